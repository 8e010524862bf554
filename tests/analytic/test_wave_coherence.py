"""What the mean field leaves of the interference of s and p."""

import numpy as np

from pbrdf import Material, WaveModel
from pbrdf.wave.scattering import Scattering

LIGHT = 0.7, np.array([0.2, 0.9, 1.3]), 2.4, 1.0


def test_the_loss_of_the_mean_field_takes_coherence_and_no_power() -> None:
    """By the second order of a perfect conductor, summed here over one angle.

    A profile at normal incidence: the amplitude of s changes by -2 J_s over the Kirchhoff
    factor's 2 h², of p by -2 J_p, with J_s = Int cos W, J_p = Int W/cos (lengths in 1/k).
    """
    height, length = 0.1, 0.7
    model = WaveModel(Material.mirror(), height_rms=height, corr_length=length)
    k = 2 * np.pi
    step = (np.arange(20000) + 0.5) / 20000
    wave = np.sin(0.5 * np.pi * step)
    spectrum = (k * height) ** 2 * np.sqrt(np.pi) * k * length
    spectrum = spectrum * np.exp(-((wave * k * length) ** 2) / 4)
    # Both directions of propagating waves; dq = cos(angle) d(angle)
    each = 0.5 * np.pi / 20000 / np.pi * spectrum
    through_s, through_p = (each * (1 - wave**2)).sum(), each.sum()
    flat = (k * height) ** 2
    # Half of the change belongs to one way; a gain is none
    lost = min(flat - through_s, 0.0) + min(flat - through_p, 0.0)
    profile = Scattering(model.profile.heights, "auto", 1)
    found = profile._dressing.at(np.zeros(1), 1.0, np.inf, 0.0)[0]
    assert lost < -0.02
    assert np.isclose(found.real, lost, rtol=1e-3)


def test_coherence_is_lost_between_s_and_p_alone() -> None:
    """Powers stay, and the matrix remains realisable."""
    model = WaveModel(Material(1.2, 6.9), height_rms=0.15, corr_length=0.7)
    columns = model._columns(*LIGHT)[1]
    dressed = model.surface.matrices(columns).reshape(-1, 4, 4)
    bare = model.surface.matrices(columns, dressed=False).reshape(-1, 4, 4)
    assert np.allclose(dressed[:, :2, :2], bare[:, :2, :2], rtol=1e-13)

    def size(matrix: np.ndarray) -> np.ndarray:
        return np.linalg.norm(matrix[:, 2:, 2:], axis=(1, 2)) / matrix[:, 0, 0]

    assert (size(dressed) < size(bare) - 0.01).all()


def test_one_paint_from_visible_to_infrared_has_no_kink() -> None:
    """Where local waves reach the horizon, at 11 um, DOLP changed its slope by 0.0004."""
    waves = np.geomspace(0.35, 20.0, 61)
    paint = WaveModel(Material(1.5), height_rms=0.8, corr_length=12.0)
    rows = paint.brdf(np.deg2rad(45.0), np.deg2rad(55.0), np.pi, waves)
    dolp = rows[:, 1, 0] / rows[:, 0, 0]
    assert np.abs(np.diff(dolp)).max() > 2e-4
    assert np.abs(np.diff(dolp, 2)).max() < 1e-4
