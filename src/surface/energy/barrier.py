"""The conformally invariant distortion of a surface, a barrier against cells that collapse or turn over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hexconformal.common import Schedule, tuned
from hexconformal.geometry import Faces
from hexconformal.kernel import parallel_ranges

from ..mesh import Floats
from . import barrier_kernels
from .distortion_energy import SurfaceEnergy, corner_frames

__all__ = ["Barrier", "TurnedCellsSchedule"]


@dataclass(frozen=True)
class TurnedCellsSchedule(Schedule):
    """Cells that are turned over, or nearly so, or the worst.

    Attributes
    ----------
    regularization
        Over the negative area: less is too stiff to turn a cell round.
    smallest_area
        Relative to the size of a frame; below it the area is regularized.
    tilt_stiffness
        Out of the plane, of that against a normal that stays.
    doubled, largest_factor
        Density that counts twice with `emphasize_worst`, and the most any may count.
    """

    regularization: float = tuned(4.0)
    smallest_area: float = tuned(0.02, 0.0, 1.0)
    tilt_stiffness: float = tuned(0.1, 0.0, 1.0)
    doubled: float = tuned(2.0)
    largest_factor: float = tuned(100.0)


class Barrier(SurfaceEnergy):
    """The conformally invariant distortion, mean of 2 (s1 - s2)^2 / (s1 s2) over the cells.

    With normals N given it is F(f1, f2; N) / <N, f1 x f2>, F the frozen density of the plane kernel: that lies above
    it, is equal where N is the cell's own normal, and forbids a cell to tilt against N by a right angle.

    Parameters
    ----------
    cells, shapes, count
        See :class:`SurfaceEnergy`.
    m, c
        Of the density phi(e) = m (sqrt(1 + 2 e / m) - 1) + c e^3 / 3 of a cell of distortion e, equation (16). Beyond m
        it grows as the angles that are lost, so that a cell between others of other shapes does not spoil them all; the
        cube keeps the worst cells from paying for that. By default the distortion itself.
    schedule
        What is done about cells that are turned over.

    Attributes
    ----------
    normals
        (f, 3) unit normals of the frames, or None: each cell's own.
    regularization
        (f,) r, by how much the area a = <N, f1 x f2> of a frame is regularized, (a + sqrt(a^2 + r^2)) / 2, so that a
        frame upside down has a finite density; 0 is the barrier.
    emphasize_worst
        Whether the worst frames count more, not less, than their density; see :meth:`adapt`.
    continuation
        Factor of m: large at first, since with a small m the energy hardly sees how to unfold a cell.
    cap
        Density from which on a frame counts less; see :meth:`adapt`.
    damping
        (f,) or one number, added to the second derivative, relative to that of the frozen density.
    """

    def __init__(
        self,
        cells: Faces,
        shapes: tuple[Floats, Floats],
        count: int,
        m: float = np.inf,
        c: float = 0.0,
        schedule: TurnedCellsSchedule | None = None,
    ) -> None:
        self._schedule = TurnedCellsSchedule() if schedule is None else schedule
        super().__init__(corner_frames(cells, shapes), count)
        self._m, self._c = m, c
        self.damping: float | Floats = 0.0
        self.emphasize_worst = False
        self.continuation, self.cap = 1.0, np.inf
        self.normals: Floats | None = None
        self.regularization = np.zeros(len(self.frames.nodes))
        self._weights = self.frames.weights

    def update_normals(self, points: Floats, normals: Floats, largest_rise: float) -> None:
        """Take new normals, those that lower the energy first, as far as it rises by `largest_rise` at most."""
        kept, self.normals = self.normals, normals
        if kept is None or largest_rise == np.inf:
            return
        rise = self.densities(points)
        self.normals = kept
        rise -= self.densities(points)
        order = np.argsort(rise)
        taken = order[np.cumsum(rise[order]) <= largest_rise]
        self.normals = kept.copy()
        self.normals[taken] = normals[taken]

    def value_at_own_normals(self, points: Floats) -> float:
        """The energy against the cells' own normals, where what is beyond the cap counts by its logarithm only."""
        kept, self.normals = self.normals, None
        relative = self.densities(points) / self._weights
        self.normals = kept
        return float((self.frames.weights * self.cap * np.log1p(relative / self.cap)).sum())

    def adapt(self, points: Floats) -> None:
        """Adapt the energy to these points: its regularization and the weights of the frames.

        Frames upside down, or nearly so, are regularized. The worst are kept from outweighing the rest; or, where
        they are emphasized, they count in proportion to how bad they are, which makes the energy of higher order.
        """
        frames, schedule, regularization = self.frames, self._schedule, np.empty(len(self.frames.nodes))
        parallel_ranges(
            barrier_kernels.regularizations, len(regularization), np.asarray(points), frames.nodes, frames.gradients,
            self._given_normals, schedule.regularization, schedule.smallest_area, regularization,
        )  # fmt: skip
        self.regularization = regularization
        self._weights = self.frames.weights
        relative = self.densities(points) / self._weights
        if self.emphasize_worst:
            self._weights = self._weights * (1 + np.minimum(relative / schedule.doubled, schedule.largest_factor))
        else:
            self._weights = self._weights / (1 + relative / self.cap)

    def densities(self, points: Floats) -> Floats:
        return self._evaluated(barrier_kernels.densities, points)

    def density_gradients(self, points: Floats) -> Floats:
        return self._evaluated(barrier_kernels.gradients, points, shape=(6,))

    def density_hessians(self, points: Floats) -> Floats:
        damping = np.array(np.broadcast_to(self.damping, self._weights.shape), dtype=np.float64)
        stiffness = self._schedule.tilt_stiffness
        return self._evaluated(barrier_kernels.hessians, points, damping, stiffness, shape=(6, 6))

    @property
    def _given_normals(self) -> Floats:
        """Those of the frames, or none: compiled loops know no None."""
        return np.empty((0, 3)) if self.normals is None else self.normals

    def _evaluated(
        self, function: Callable[..., None], points: Floats, *more: Any, shape: tuple[int, ...] = ()
    ) -> Floats:
        """What a compiled loop finds for every frame, of a shape."""
        frames, result = self.frames, np.empty((len(self._weights), *shape))
        parallel_ranges(
            function, len(result), np.asarray(points), frames.nodes, frames.gradients, self._weights,
            self._given_normals, self.regularization, float(self.continuation * self._m), float(self._c), *more, result,
        )  # fmt: skip
        return result
