"""The conformally invariant distortion of a surface, a barrier against cells that collapse or turn over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hexconformal.common import Schedule, tuned
from hexconformal.geometry import Faces
from hexconformal.kernel import Vector, add, cross, dot, plane_density, plane_gradient, plane_normal, scale, subtract

from ..mesh import Floats
from .distortion_energy import SurfaceEnergy, corner_frames

__all__ = ["Barrier", "TurnedCellsSchedule"]

_TINY = 1e-300


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
        f1, f2 = self.frames.derivatives(points)
        area = np.asarray(dot(self._normals_at(f1, f2), cross(f1, f2)))
        size = 0.5 * (dot(f1, f1) + dot(f2, f2))
        schedule, least = self._schedule, self._schedule.smallest_area * size
        self.regularization = np.where(area > least, 0.0, np.hypot(schedule.regularization * area, least))
        self._weights = self.frames.weights
        relative = self.densities(points) / self._weights
        if self.emphasize_worst:
            self._weights = self._weights * (1 + np.minimum(relative / schedule.doubled, schedule.largest_factor))
        else:
            self._weights = self._weights / (1 + relative / self.cap)

    def densities(self, points: Floats) -> Floats:
        f1, f2 = self.frames.derivatives(points)
        n = self._normals_at(f1, f2)
        area, _ = self._regularized(np.asarray(dot(n, cross(f1, f2))))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            phi = self._phi(plane_density(f1, f2, n) / area)[0]
        return np.asarray(self._weights * np.where(area > 0, phi, np.inf))

    def density_gradients(self, points: Floats) -> tuple[Vector, Vector]:
        f1, f2 = self.frames.derivatives(points)
        n = self._normals_at(f1, f2)
        area, change = self._regularized(np.asarray(dot(n, cross(f1, f2))))
        g1, g2 = plane_gradient(f1, f2, n)
        ratio = plane_density(f1, f2, n) / area
        s = self._weights * self._phi(ratio)[1] / area
        ratio = ratio * change
        return (
            scale(s, subtract(g1, scale(ratio, cross(f2, n)))),
            scale(s, subtract(g2, scale(ratio, cross(n, f1)))),
        )

    def _normals_at(self, f1: Vector, f2: Vector) -> Vector:
        if self.normals is None:
            return plane_normal(f1, f2)
        return (self.normals[:, 0], self.normals[:, 1], self.normals[:, 2])

    def _phi(self, e: Floats) -> tuple[Floats, Floats, Floats]:
        """Density phi of cells of distortion e, equation (16), with its first and second derivative."""
        m, c = self.continuation * self._m, self._c
        root = np.sqrt(1 + 2 * e / m)
        return 2 * e / (1 + root) + c * e**3 / 3, 1 / root + c * e**2, 2 * c * e - 1 / (m * root**3)

    def _regularized(self, area: Floats) -> tuple[Floats, Floats]:
        """The regularized area and its derivative."""
        root = np.sqrt(area**2 + self.regularization**2)
        return 0.5 * (area + root), 0.5 * (1 + area / np.maximum(root, _TINY))

    def density_hessians(self, points: Floats) -> Floats:
        """The part of positive curvature of the second derivative, in closed form.

        With a = (f1 - N x f2) / 2 and b = (f1 + N x f2) / 2 in the plane of N, the conformal and anticonformal
        parts, the density is 8 |b|^2 / (|a|^2 - |b|^2). It depends on the lengths of a and b alone, so its Hessian
        splits into a 2 x 2 block (of negative determinant) and two turning directions, of which that of b has
        positive curvature.
        """
        f1, f2 = self.frames.derivatives(points)
        n = self._normals_at(f1, f2)
        area, change = self._regularized(np.asarray(dot(n, cross(f1, f2))))
        _, slope, bend = self._phi(plane_density(f1, f2, n) / area)
        w = self._weights * slope
        f1, f2 = (subtract(f, scale(dot(f, n), n)) for f in (f1, f2))
        turned = cross(n, f2)
        a, b = scale(0.5, subtract(f1, turned)), scale(0.5, add(f1, turned))
        alpha = np.sqrt(dot(a, a)) + _TINY
        beta = np.sqrt(dot(b, b))
        # Where b vanishes every direction will do.
        still = beta <= 1e-14 * alpha
        a = scale(1 / alpha, a)
        b0, b1, b2 = (np.where(still, p, q / np.where(still, 1.0, beta)) for p, q in zip(a, b, strict=True))
        b = (b0, b1, b2)
        # Block 16 / area^3 [[beta^2 p, -2 alpha beta (alpha^2 + beta^2)], [., alpha^2 q]] in (|a|, |b|).
        p, q = 3 * alpha**2 + beta**2, alpha**2 + 3 * beta**2
        x, y, z = beta**2 * p, -2 * alpha * beta * (alpha**2 + beta**2), alpha**2 * q
        largest = 0.5 * (x + z + np.hypot(x - z, 2 * y))
        u = np.stack([y, largest - x], axis=0)
        u /= np.maximum(np.hypot(*u), _TINY)
        radial = np.concatenate(
            [np.stack(a) * u[0] + np.stack(b) * u[1], np.stack(cross(n, a)) * u[0] - np.stack(cross(n, b)) * u[1]]
        )
        turning = np.concatenate([np.stack(cross(n, b)), np.stack(b)])
        # Directions d|a| = <(a, n x a), df> / 2 and the like: hence the quarters.
        result = np.einsum("f,if,jf->fij", w * 4 * largest / area**3, radial, radial)
        result += np.einsum("f,if,jf->fij", w * 4 * alpha**2 / area**2, turning, turning)
        # What bends upwards adds the square of the gradient 16 alpha beta / area^2 (alpha d beta - beta d alpha).
        gradient = np.concatenate(
            [
                np.stack(b) * alpha - np.stack(a) * beta,
                -np.stack(cross(n, b)) * alpha - np.stack(cross(n, a)) * beta,
            ]
        )
        square = self._weights * np.maximum(bend, 0.0) * (8 * alpha * beta / area**2) ** 2
        result += np.einsum("f,if,jf->fij", square, gradient, gradient)
        # Of a regularized frame the frozen density's, and the curvature of 1 / area.
        folded = np.flatnonzero(self.regularization > 0)
        if len(folded):
            along = np.concatenate([np.stack(cross(f2, n)), np.stack(cross(n, f1))])[:, folded]
            dip = w * 8 * beta**2 * 2 * change**2 / area**3
            result[folded] = np.einsum("f,if,jf->fij", dip[folded], along, along)
            result[folded] += (w * 4 / area)[folded, None, None] * np.eye(6)
        # Out of the plane a frozen normal gives 4 / area, but it turns with a cell that travels round a bend.
        normal = np.einsum("f,if,jf->fij", w * self._schedule.tilt_stiffness * 4 / area, np.stack(n), np.stack(n))
        result[:, :3, :3] += normal
        result[:, 3:, 3:] += normal
        result[:, range(6), range(6)] += (self.damping * 4 * w / area)[:, None]
        return result
