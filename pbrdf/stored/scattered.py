"""Interpolation of a list or a sample of points, by radial basis functions."""

from functools import cache, cached_property
from typing import Any

import numpy as np

from pbrdf.stored.contents import Contents, Parameter
from pbrdf.stored.interpolation import Interpolation
from pbrdf.stored.left_out import Measured, grouped
from pbrdf.stored.parameters import Cloud
from pbrdf.stored.schemes import Scheme, combined

__all__ = ["ScatteredInterpolation"]

# Points left out to choose how to interpolate, and about a place to judge the error there
_TRIED, _JUDGED = 12, 8


class ScatteredInterpolation(Interpolation):
    """Interpolation between points that form no grid.

    Values are linear combinations of those of the nearest points, in ln M00 and elements
    over M00 or in the elements themselves, by the radial functions that miss points which
    are left out the least.
    """

    def __init__(self, contents: Contents) -> None:
        super().__init__(contents)
        assert contents.cloud is not None
        self._cloud: Cloud = contents.cloud

    @property
    def _axes(self) -> dict[str, Parameter]:
        names = self._cloud.names
        return {n: p for n, p in self._contents.parameters.items() if n not in names}

    def _middle(self) -> dict[str, np.ndarray]:
        centre = self._cloud.points.mean(0)
        middle = self._cloud.index[self._cloud.nearest(centre, 1)]
        return super()._middle() | {"point": middle}

    def _stencil(
        self, place: dict[str, Any], keep: dict[str, np.ndarray]
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        stencil, weights = super()._stencil(place, keep)
        cloud = self._chosen[0]
        near, weight, _ = cloud.weights(self._at(place))
        counts = np.abs(weight) > 1e-12
        stencil["point"], weights["point"] = cloud.index[near[counts]], weight[counts]
        return stencil, weights

    def _scheme(self, name: str) -> Scheme:
        return self._chosen[1] if name == "point" else super()._scheme(name)

    def _at(self, place: dict[str, Any]) -> np.ndarray:
        return np.array([place[name] for name in self._cloud.names], dtype=float)

    @cached_property
    def measured(self) -> dict[str, Measured]:
        """How each axis and the points are interpolated, and the error of it."""
        found = super().measured
        cloud, scheme = self._chosen
        numbers = cloud.nearest(cloud.points.mean(0), _TRIED)
        each = np.array([self._missed(int(k)) for k in numbers])
        centre = self._between_cloud(cloud.points.mean(0))
        return found | {", ".join(cloud.names): Measured(scheme, each.max(0), centre)}

    def _between_points(self, place: dict[str, Any]) -> np.ndarray:
        along = super()._between_points(place)
        return np.asarray(np.hypot(along, self._between_cloud(self._at(place))))

    def _between_cloud(self, place: np.ndarray) -> np.ndarray:
        """Error between points, by class: what those nearest are missed by, scaled."""
        cloud = self._chosen[0]
        _, _, reach = cloud.weights(place)
        near = cloud.nearest(place, _JUDGED)
        reaches = [cloud.weights(cloud.points[k], int(k))[2] for k in near]
        each = [
            self._missed(int(k)) * reach / max(own, 1e-12)
            for k, own in zip(near, reaches, strict=True)
        ]
        return np.asarray(np.sqrt(np.mean(np.square(each), axis=0)))

    @cached_property
    def _missed(self) -> Any:
        cloud, scheme = self._chosen

        @cache
        def found(left: int) -> np.ndarray:
            predicted, computed, noise = self._trial(cloud, scheme.log, left)
            return grouped(predicted - computed, computed, noise)

        return found

    def _trial(
        self, cloud: Cloud, log: bool, left: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a point as the others have it, as computed, and the error of both."""
        near, weight, _ = cloud.weights(cloud.points[left], left)
        value, stderr = self._all
        found, spread = combined(
            weight, np.moveaxis(value[near], 0, -3), np.moveaxis(stderr[near], 0, -3),
            log=log, apart=True,
        )  # fmt: skip
        return found, value[left], np.hypot(spread, stderr[left])

    @cached_property
    def _all(self) -> tuple[np.ndarray, np.ndarray]:
        """All finished points, at the middle of the other axes and of the incidences."""
        place = super()._middle() | {"point": self._cloud.index}
        value, stderr = self._contents.read(place, [len(self._theta_i) // 2])
        shape = (len(self._cloud.index), *value.shape[len(place) :])
        return value.reshape(shape), stderr.reshape(shape)

    @cached_property
    def _chosen(self) -> tuple[Cloud, Scheme]:
        """Choose radial functions, coordinates and values that miss points the least."""
        cloud = self._cloud
        numbers = cloud.nearest(cloud.points.mean(0), _TRIED)
        tried = []
        for one in cloud.choices():
            for log in (False, True):
                missed = []
                for k in numbers:
                    predicted, computed, _ = self._trial(one, log, int(k))
                    missed.append(grouped(predicted - computed, computed)[:2, 0, 0].max())
                tried.append((float(np.mean(missed)), one, log))
        _, best, log = min(tried, key=lambda row: row[0])
        pairs = zip(best.names, best.logarithm, strict=True)
        by = [f"ln {name}" if logarithm else name for name, logarithm in pairs]
        words = f"{best.kernel} in {', '.join(by)}" + (" of ln M00" if log else "")
        return best, Scheme(name=words, log=log, basis=(), next=np.zeros_like)
