"""Print how contact angles survive what disturbs photographs; see README.md."""

import argparse

import numpy as np
from scipy.ndimage import gaussian_filter

from examples.drop_picture import fill, meridian
from fitting import contact_angle

KINDS = (
    "plain", "grey substrate", "mirror image", "needle", "bright drop", "no drop",
    "perfect mirror", "curved substrate", "hidden foot", "given baseline",
)  # fmt: skip
# The baseline of these is given, as well as it can be named
GIVEN = ("hidden foot", "given baseline")
ROWS, COLUMNS = 360, 560


def photograph(
    kind: str, angle: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture, 8 bits, and row and column of two points of its baseline.

    All but its kind and its angle is drawn from the generator.
    """
    bond = rng.uniform(0, 1.5)
    # The substrate falls or rises from the line between the contacts
    bend = np.deg2rad(rng.uniform(-5, 5)) if kind == "curved substrate" else 0.0
    half = meridian(np.clip(angle + bend, 0.2, 2.95), bond)
    bend = np.clip(angle + bend, 0.2, 2.95) - angle
    half = half * min(rng.uniform(60, 100) / half[:, 0].max(), 190 / half[-1, 1])
    outline = np.concatenate([(half * [-1, 1])[::-1], half[1:]])
    # x to the right and z up, from the middle of the base
    drop = np.stack([outline[:, 0], half[-1, 1] - outline[:, 1]], axis=1)
    lean = np.deg2rad(rng.uniform(-2, 2))
    cos, sin = np.cos(lean), np.sin(lean)
    row, column = 230 + rng.uniform(-8, 8), COLUMNS / 2 + rng.uniform(-20, 20)

    def layer(points: np.ndarray) -> np.ndarray:
        x, z = points.T
        return fill(row - x * sin - z * cos, column + x * cos - z * sin, ROWS, COLUMNS)

    ground = np.full((ROWS, COLUMNS), 0.85)
    far = 2000.0
    x = np.linspace(-far, far, 2001)
    top = 0 * x
    if kind == "curved substrate":
        radius = half[-1, 0] / np.sin(abs(bend))
        inside = np.minimum(np.abs(x), 0.9 * radius)
        top = np.sqrt(radius**2 - inside**2) - np.sqrt(radius**2 - half[-1, 0] ** 2)
        top = np.sign(bend) * top
    elif kind == "hidden foot":
        top = top + rng.uniform(0.02, 0.1) * half[-1, 1]
    base = layer(np.concatenate([np.stack([x, top], 1), [[far, -far], [-far, -far]]]))
    tone = {"grey substrate": rng.uniform(0.2, 0.5), "mirror image": rng.uniform(0.6, 0.7)}
    if kind == "perfect mirror":
        tone[kind] = ground[0, 0]
    level = ground + (tone.get(kind, 0.06) - ground) * base
    if kind in tone:
        image = layer(drop * [1, -1])
        dark = 0.06 if kind == "perfect mirror" else rng.uniform(0.06, 0.8 * tone[kind])
        level = level + (dark - level) * image * base
    if kind == "no drop":
        drop = no_drop(rng)
    level = level + (0.06 - level) * layer(drop)
    if kind == "needle":
        w, end = rng.uniform(6, 14), 0.8 * half[-1, 1]
        needle = layer(np.array([[-w, end], [-w, far], [w, far], [w, end]]))
        level = level + (0.06 - level) * needle
    level = gaussian_filter(level, rng.uniform(0.8, 2.5), mode="nearest")
    if kind == "bright drop":
        level = 0.95 - level
    level = level * (1 - rng.uniform(0, 0.15) * np.linspace(0, 1, COLUMNS))
    level = level + rng.uniform(0.005, 0.03) * rng.standard_normal(level.shape)
    ends = np.array([[row + t * sin, column - t * cos] for t in (200.0, -200.0)])
    return np.clip(np.rint(255 * level), 0, 255).astype(np.uint8), ends


def no_drop(rng: np.random.Generator) -> np.ndarray:
    """Return the outline of something else, x to the right and z up from the substrate."""
    w, h, slant = rng.uniform(40, 90), rng.uniform(40, 120), rng.uniform(0, 40)
    x = np.linspace(-2 * w, 2 * w, 400)
    turn = np.linspace(0, 2 * np.pi, 200)
    shapes = {
        "block with a slanting side": [[-w, 0], [-w, h], [w - slant, h], [w, 0]],
        "triangle": [[-w, 0], [slant - 20, h], [w, 0]],
        "nothing": [[-1, -8], [1, -8], [0, -8]],
        "hill": np.stack([x, h * np.exp(-((2 * x / w) ** 2))], axis=1),
        "waves": np.stack([x * 4, 12 + h / 6 * (1 + np.sin(x / 20))], axis=1),
        "block in the air": [[-w, 60], [-w, 60 + h], [w, 60 + h], [w, 60]],
        "disc in the air": np.stack([w * np.cos(turn), w * np.sin(turn) + w + 15], axis=1),
        "needle": [[-6 - slant / 4, h], [-6 - slant / 4, 999], [6, 999], [6, h]],
        "stairs": [[-w, 0], [-w, h / 2], [0, h / 2], [0, h], [w, h], [w, 0]],
        "star": np.stack(
            [
                w * (1 + 0.3 * np.cos(5 * turn)) * np.cos(turn),
                w * (1 + 0.3 * np.cos(5 * turn)) * np.sin(turn) + w / 2,
            ],
            axis=1,
        ),
    }
    outline = np.asarray(shapes[list(shapes)[rng.integers(len(shapes))]], dtype=float)
    # What stands on the substrate reaches into it
    if outline[:, 1].min() < 14:
        foot = outline[[-1, 0]] * [1, 0] - [0, 9]
        outline = np.concatenate([outline, foot])
    return outline


def main() -> None:
    """Print a row for each kind of disturbance."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=int, default=400, help="of all kinds together")
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument(
        "--baseline", choices=("usual", "always", "never"), default="usual",
        help="whether the right baseline is given; usually to the last two kinds",
    )  # fmt: skip
    parser.add_argument("--kinds", default="", help="only these, by semicolons")
    arguments = parser.parse_args()
    print("kind            pictures refused |   bias    rms  stderr  worst  inside")
    everywhere: list[bool] = []
    outside = 0
    kinds = arguments.kinds.split(";") if arguments.kinds else KINDS
    for kind in kinds:
        number = KINDS.index(kind)
        errors, stderrs, inside, refused = [], [], [], 0
        count = -(-arguments.pictures // len(kinds))
        for seed in range(arguments.first_seed, arguments.first_seed + count):
            rng = np.random.default_rng([seed, number])
            degrees = rng.uniform(10, 170)
            try:
                picture, line = photograph(kind, np.deg2rad(degrees), rng)
                line = line + rng.uniform(-0.5, 0.5, line.shape)
                usual = kind in GIVEN and arguments.baseline == "usual"
                given = line if usual or arguments.baseline == "always" else None
                found = contact_angle(picture, baseline=given)
            except ValueError as error:
                refused += 1
                if kind != "no drop":
                    print(f"  seed {seed}, {degrees:.0f} degrees: {str(error)[:120]}")
                continue
            if kind == "no drop":
                print(f"  seed {seed}: took it for {found.mean:.0f} degrees")
            for side in (found.left, found.right):
                outside += not 0 <= side.low <= side.value <= side.high <= 180
                errors.append(side.value - degrees)
                stderrs.append(side.stderr)
                inside.append(side.low <= degrees <= side.high)
        everywhere += inside if kind != "no drop" else []
        line = f"{kind:16}{count:8d} {refused:7d} | "
        if errors and kind != "no drop":
            worst = max(errors, key=abs)
            line += (
                f"{np.mean(errors):+6.2f} {np.sqrt(np.mean(np.square(errors))):6.2f} "
                f"{np.mean(stderrs):7.2f} {worst:+6.2f} {np.mean(inside):7.1%}"
            )
        print(line, flush=True)
    print(f"{outside} sides outside [0, 180]")
    if everywhere:
        share = np.mean(everywhere)
        print(f"95 % intervals hold {share:.1%} of {len(everywhere)} sides")


if __name__ == "__main__":
    main()
