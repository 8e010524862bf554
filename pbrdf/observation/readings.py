"""Readings of a goniometer from samples of a surface: means, standard errors, dataset."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from pbrdf.conventions import BOUNCES, RESULT_VARIABLES, STOKES
from pbrdf.kernels.cones import facets as observe_facets
from pbrdf.kernels.paths import shading
from pbrdf.observation.expected import Expected
from pbrdf.observation.look import Look, Sight
from pbrdf.validity import variables

__all__ = ["Readings", "as_scan", "to_dataset"]


# Glints caught by luck whose spread counts as much as what near misses foretell
FEW = 10.0


class Running:
    """Mean and sum of squared deviations over samples, added one by one (Welford)."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.count = 0
        self.mean = np.zeros(shape)
        self._scatter = np.zeros(shape)

    def add(self, values: np.ndarray) -> None:
        """Add one sample."""
        self.count += 1
        step = values - self.mean
        self.mean += step / self.count
        step *= values - self.mean
        self._scatter += step

    def variance(self) -> np.ndarray:
        """Return the variance of the mean."""
        return self._scatter / (self.count - 1) / self.count


class Readings:
    """Mean and standard error of the readings over samples, added in a fixed order."""

    def __init__(self, look: Look, expected: Expected | None = None) -> None:
        self.look, self.expected = look, expected
        self.tried = np.zeros(look.size, dtype=np.int64)
        self.samples = 0
        # All bounces together stand behind the classes of bounces
        shape = (look.size, len(BOUNCES) + 1, *look.shape[2:])
        self._all, self._steady = Running(shape), Running(shape)
        self._foretold = np.zeros(shape)
        self._glints = np.zeros(shape[:2])
        self.caught = np.zeros(look.shape[:2], dtype=np.int64)
        self._one = np.zeros(look.shape[:2])
        self.energy = np.zeros((look.shape[2], shading.N_ENERGIES))
        self.counts = np.zeros(shading.N_COUNTS, dtype=np.int64)
        self.facet_counts = np.zeros(observe_facets.N_FACET_COUNTS, dtype=np.int64)
        self.bundles = 0
        # In the order in which they came, each once
        self.notes: dict[str, None] = {}

    def add(self, sight: Sight) -> None:
        """Add one sample."""
        self.samples += 1
        self._all.add(_and_total(sight.brdf))
        # What comes by luck, and seldom, has moments of its own
        self._steady.add(_and_total(sight.brdf - sight.glints))
        self._foretold += _and_total(sight.foretold)
        self._glints += _and_total(sight.glints_caught)
        self.caught += sight.caught
        self.tried += sight.tried
        self._one = np.maximum(self._one, sight.one)
        self.energy += (sight.energy - self.energy) / self.samples
        self.counts += sight.counts
        self.facet_counts += sight.facet_counts
        self.bundles += sight.bundles
        self.notes |= dict.fromkeys(sight.notes)

    @property
    def mean(self) -> np.ndarray:
        """Mean matrices (geometries, bounces and total, wavelengths, stokes, stokes)."""
        return self._all.mean

    def stderr(self) -> np.ndarray:
        """Return standard errors of the mean, in its shape.

        The spread over samples says little of glints that came by luck where few did, and
        nothing where none did: there the paths that passed near foretell their variance.
        With none of these the error is one path, as strong as those found elsewhere in the
        run, or of matrix 1 if none was.
        """
        if self.samples < 2:
            return np.full_like(self.mean, np.nan)
        few = (FEW / (FEW + self._glints))[:, :, None, None, None]
        foretold = self._steady.variance() + self._foretold / self.samples**2
        variance = few * foretold + (1.0 - few) * self._all.variance()
        if self.expected is not None:
            variance[:, [0, -1]] += self._one_more_hidden()[:, None]
        dark = (self.mean[..., :1, :1] == 0.0) & (variance[..., :1, :1] == 0.0)
        return np.where(dark, self._one_path()[..., None, None], np.sqrt(variance))

    def _one_more_hidden(self) -> np.ndarray:
        """Squares that stand for one facet more that is hidden than was found.

        Of N points tried with a probability h of being hidden it is 1 / (N (N + 1/h)) of
        the single bounce; (geometries, wavelengths, stokes, stokes).
        """
        assert self.expected is not None
        seen, tried = self.expected.seen, np.maximum(self.tried, 1)
        hidden = np.where(seen > 0.0, 1.0 - seen, 0.0)
        more = 1.0 / (tried + 1.0 / np.maximum(hidden, 1e-300)) / tried
        more /= np.maximum(seen, 1e-3) ** 2
        squares: np.ndarray = self.mean[:, 0] ** 2 * more[:, None, None, None]
        return squares

    def _one_path(self) -> np.ndarray:
        """One path in each reading (geometries, bounces and total, wavelengths)."""
        per_path = self._one / self.samples
        found = self.mean[:, :-1, :, 0, 0].sum(axis=0)
        weight = (self.caught * per_path).sum(axis=0)[:, None]
        known = (found > 0.0) & (weight > 0.0)
        strength = np.divide(found, weight, out=np.ones_like(found), where=known)
        one = per_path[:, :, None] * np.minimum(strength, 1.0)
        return np.concatenate([one, np.sqrt((one**2).sum(axis=1, keepdims=True))], axis=1)

    def rel_error(self) -> float:
        """Largest standard error over M00 of geometries above a tenth of the brightest.

        Infinite where nothing was seen but might have been.
        """
        m00, stderr = self.mean[:, -1, :, 0, 0], self.stderr()[:, -1, :, 0, 0]
        bright = m00 > 0.1 * m00.max()
        if not bright.any():
            return np.inf if stderr.any() else 0.0
        return float(np.max(stderr[bright] / m00[bright]))


def _and_total(by_bounces: np.ndarray) -> np.ndarray:
    """Put all bounces together behind the classes of bounces."""
    total = by_bounces.sum(axis=1, keepdims=True)
    return np.concatenate([by_bounces, total], axis=1)


def to_dataset(
    seen: Readings,
    judged: Mapping[str, np.ndarray],
    *,
    wavelength: np.ndarray | None,
    attrs: dict[str, Any],
) -> xr.Dataset:
    """Label the readings: one dimension `geometry`, as a measured scan has it.

    `judged` are numbers of the limits of geometric optics.
    """
    look = seen.look
    spectral = wavelength is not None and wavelength.ndim == 1
    # (geometry, bounces, wavelength, ...) to (bounces, wavelength, geometry, ...)
    mean = np.moveaxis(seen.mean, 0, 2)
    stderr = np.moveaxis(seen.stderr(), 0, 2)
    omega_i, omega_s = look.solid_angles()
    matrix = ("wavelength", "geometry", "stokes_out", "stokes_in")
    arrays: dict[str, tuple[tuple[str, ...], np.ndarray]] = {
        "brdf": (("bounces", *matrix), mean[:-1]),
        "brdf_stderr": (("bounces", *matrix), stderr[:-1]),
        "brdf_total": (matrix, mean[-1]),
        "brdf_total_stderr": (matrix, stderr[-1]),
        "truncated": (("wavelength",), seen.energy[:, shading.TRUNCATED]),
        "leaked": (("wavelength",), seen.energy[:, shading.LEAKED]),
        "transmitted": (("wavelength",), seen.energy[:, shading.TRANSMITTED]),
        "left_sideways": (("wavelength",), seen.energy[:, shading.SIDEWAYS]),
    }
    data: dict[str, Any] = {}
    for name, (dims, values) in arrays.items():
        entry = RESULT_VARIABLES[name]
        if not spectral:
            values = values.squeeze(dims.index("wavelength"))
            dims = tuple(dim for dim in dims if dim != "wavelength")
        data[name] = (dims, values, entry.about)
    for name, values, long_name in (
        ("source_solid_angle", omega_i, "projected solid angle of the source"),
        ("detector_solid_angle", omega_s, "projected solid angle of the detector"),
    ):
        data[name] = ("geometry", values, {"units": "sr", "long_name": long_name})
    data["paths"] = (
        ("bounces", "geometry"), seen.caught.T,
        {"units": "1", "long_name": "paths that joined source and detector"},
    )  # fmt: skip
    data |= variables(judged, spectral=spectral, axis="geometry")

    coords: dict[str, Any] = {
        "bounces": list(BOUNCES),
        "stokes_out": list(STOKES[: look.n_stokes]),
        "stokes_in": list(STOKES[: look.n_stokes]),
    }
    for name in ("theta_i", "theta_s", "dphi"):
        about = {"units": "rad", "long_name": RESULT_VARIABLES[name].long_name}
        coords[name] = ("geometry", getattr(look, name), about)
    if wavelength is not None:
        about = {"units": "um", "long_name": RESULT_VARIABLES["wavelength"].long_name}
        coords["wavelength"] = (
            ("wavelength", wavelength, about) if spectral else float(wavelength)
        )
    return xr.Dataset(data, coords, attrs=attrs | _counters(seen))


def _counters(seen: Readings) -> dict[str, int]:
    """Return how many rays and facets there were, by their fates."""
    return {
        "bundles": seen.bundles,
        "path_segments": int(seen.counts[shading.N_SEGMENTS]),
        "rays_escaped": int(seen.counts[shading.N_ESCAPED]),
        "rays_truncated": int(seen.counts[shading.N_TRUNCATED]),
        "rays_leaked": int(seen.counts[shading.N_LEAKED]),
        "rays_left_sideways": int(seen.counts[shading.N_SIDE]),
        "facets_joining": int(seen.facet_counts[observe_facets.N_FACETS]),
        "facet_points": int(seen.facet_counts[observe_facets.N_POINTS]),
        "facet_points_seen": int(seen.facet_counts[observe_facets.N_SEEN]),
        "facet_points_aside": int(seen.facet_counts[observe_facets.N_ASIDE]),
    }


def as_scan(result: xr.Dataset) -> xr.Dataset:
    """Make a goniometer dataset of readings: M00 to M33 of all bounces, standard errors.

    Parameters
    ----------
    result : xarray.Dataset
        As from `observe`, of one wavelength.

    Returns
    -------
    xarray.Dataset
        One dimension `geometry`, as `data_io.read_goniometer` returns and
        `data_io.write_goniometer` takes.

    Raises
    ------
    ValueError
        If the result has several wavelengths.
    """
    if "wavelength" in result.dims:
        msg = (
            f"result must have one wavelength, got {result.sizes['wavelength']}. "
            "Use result.isel(wavelength=0)."
        )
        raise ValueError(msg)
    data: dict[str, Any] = {}
    for suffix in ("", "_stderr"):
        matrices = result[f"brdf_total{suffix}"]
        for row in range(matrices.sizes["stokes_out"]):
            for column in range(matrices.sizes["stokes_in"]):
                values = matrices.isel(stokes_out=row, stokes_in=column).values
                data[f"M{row}{column}{suffix}"] = ("geometry", values, {"units": "sr-1"})
    coords = {name: result[name] for name in ("theta_i", "theta_s", "dphi")}
    if "wavelength" in result.coords:
        coords["wavelength"] = result.wavelength
    return xr.Dataset(data, coords, attrs={"source": "simulation"} | dict(result.attrs))
