"""The errors of the store of drops, what opening it reads, and a picture by one call.

python studies/sweep_speed/check_drops.py drops.zarr [picture.png]
"""

import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np
import xarray as xr

import pbrdf

BRIGHT = 0.1
SHARES = (0.5, 0.9, 0.99, 1.0)


def main() -> None:
    path = Path(sys.argv[1])
    picture = Path(sys.argv[2] if len(sys.argv) > 2 else "drops.png")
    held = xr.open_zarr(path, chunks=None)
    print(f"{dict(held.sizes)}; points done: {int((held.state == 1).sum())}")
    m00 = held.brdf_total[..., 0, 0].load()
    part = held.brdf_total_stderr[..., 0, 0].load() / m00
    part = part.where(m00 > BRIGHT * m00.max(["theta_s", "dphi"]))
    light = float((part * m00).sum() / m00.where(part.notnull()).sum())
    told = ", ".join(f"{s:.0%}: {float(part.quantile(s)):.4f}" for s in SHARES)
    print(
        f"stderr / M00 of bins above {BRIGHT:g} of the peak that these shares stay below:"
    )
    print(f"    {told}; mean by light {light:.4f}")
    dims = ["theta_i", "wavelength", "theta_s", "dphi"]
    for share in SHARES[:2]:
        by_point = part.quantile(share, dims)
        at = by_point.argmax(...)
        where = {str(k): float(by_point[k][int(v)]) for k, v in at.items()}
        print(f"    worst point at {share:.0%}: {float(by_point.max()):.4f}, {where}")

    size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
    tracemalloc.start()
    start = time.process_time()
    store = pbrdf.from_store(path)
    print(
        f"from_store: {time.process_time() - start:.2f} s of CPU, at most "
        f"{tracemalloc.get_traced_memory()[1] / 1e6:.1f} MB; the store has "
        f"{size / 1e6:.0f} MB"
    )
    at = {"slope_rms": 0.12, "contact_angle": np.deg2rad(50.0), "wavelength": 0.53}
    direction = (np.deg2rad(30.0), np.deg2rad(40.0), 2.9)
    start = time.process_time()
    value = store.brdf(*direction, **at)[0, 0]
    print(
        f"between the nodes: M00 = {value:.4g} +- "
        f"{store.error(*direction, **at)[0, 0]:.2g} sr^-1, "
        f"{time.process_time() - start:.1f} s of CPU, at most "
        f"{tracemalloc.get_traced_memory()[1] / 1e6:.1f} MB"
    )
    figure = store.plot(np.deg2rad(30.0), **at)
    getattr(figure, "figure", figure).savefig(picture, dpi=120)


if __name__ == "__main__":
    main()
