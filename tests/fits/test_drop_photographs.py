"""Pictures of drops as people take them: measured within their interval, or refused."""

from pathlib import Path

import numpy as np
import pytest
from skimage import io

from fitting import contact_angle
from pbrdf.errors import DataFileError

CASES = Path(__file__).parents[1] / "cases" / "surface"


def grey(name: str) -> np.ndarray:
    image = io.imread(CASES / name)
    return image if image.ndim == 2 else image[..., 0]


@pytest.mark.parametrize(
    "name",
    [
        "drop_plain20.png",
        "drop_inverted_70.png",
        "drop_needle_in_110.png",
        "drop_mirror_90.png",
        "drop_mirrorbase_45.png",
        "drop_mirrorsharp_120.png",
        "drop_reflect_120.png",
    ],
)
def test_angle_lies_in_its_interval(name):
    degrees = float(name[:-4].rpartition("_")[2].removeprefix("plain"))
    result = contact_angle(CASES / name)
    for side in (result.left, result.right):
        assert abs(side.value - degrees) < 1
        assert 0 <= side.low < degrees < side.high <= 180
        assert side.high - side.low < 6


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("not_a_drop.png", "smooth outline of a drop"),
        ("drop_edge_110.png", "cut by the left side"),
        ("drop_pendant_70.png", "substrate above it .a pendant drop"),
    ],
)
def test_refusals_name_the_reason(name, reason):
    with pytest.raises(DataFileError, match=reason):
        contact_angle(CASES / name)


def test_turned_and_mirrored_pictures_are_refused_by_side():
    image = grey("drop_plain20.png")
    with pytest.raises(DataFileError, match="substrate on its left"):
        contact_angle(np.rot90(image, 3))
    with pytest.raises(DataFileError, match="cut by the right side"):
        contact_angle(grey("drop_edge_110.png")[:, ::-1])


def test_of_several_drops_one_is_named():
    one, other = grey("drop_inverted_70.png"), grey("drop_plain20.png")
    image = np.concatenate([255 - other, one], axis=1)
    widest = contact_angle(image)
    assert widest.left.value == pytest.approx(70, abs=0.5)
    assert any("number 2 from the left" in remark for remark in widest.warnings)
    assert contact_angle(image, which=1).right.value == pytest.approx(20, abs=1.5)
    with pytest.raises(ValueError, match="which must be 1 to 2, got 3"):
        contact_angle(image, which=3)


@pytest.mark.parametrize("name", ["drop_mirror_90.png", "drop_mirrorsharp_120.png"])
def test_given_baseline_of_a_mirror_image(name):
    """Also where the substrate has the ground's tone: then nothing else shows it."""
    image = grey(name).copy()
    degrees = float(name[:-4].rpartition("_")[2])
    result = contact_angle(image, baseline=[[300, 60], [300, 520]])
    assert result.left.value == pytest.approx(degrees, abs=0.5)
    image[image > 120] = image[:250].max()
    result = contact_angle(image, baseline=[[300, 60], [300, 520]])
    for side in (result.left, result.right):
        assert side.value == pytest.approx(degrees, abs=1)
        assert side.low < degrees < side.high


def test_a_baseline_off_the_substrate_is_named():
    image = grey("drop_inverted_70.png")
    result = contact_angle(image, baseline=[[294, 60], [294, 520]])
    assert any("6.0 pixels below the given" in remark for remark in result.warnings)
    # The angle moves by what was announced
    shift = contact_angle(image).left.value - result.left.value
    assert shift == pytest.approx(6 * result.per_pixel[0], rel=0.1)
