"""The conformal distortion of a surface: value, gradient and positive semidefinite second derivative.

Everything is a sum over *frames*: a point of a cell where the two derivatives f1, f2 of the immersion are taken,
f_i = sum_a x_a B_ai. The plane kernel of :mod:`hexconformal.kernel.distortion` does the rest.

Two energies share it. The *quaternionic* one is that of Gruber & Aulisa, int |*df - N df|^2; with N frozen it is a
quadratic form that majorizes it. The *barrier* form divides the same density by the area |f1 x f2|, that is
2 (s1 - s2)^2 / (s1 s2): every cell counts the same whatever its size, and none can collapse or turn over.
Equation (15) and equation (16) of docs/mathematics.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from hexconformal.geometry import Faces, corner_triangles
from hexconformal.kernel import (
    Vector,
    cross,
    dot,
    loop,
    parallel_ranges,
    plane_density,
    plane_gradient,
    plane_normal,
)
from hexconformal.mesh import binary_search, corner_incidences, node_pattern

from ..mesh import Floats, Ints

__all__ = ["ENERGIES", "Frames", "Quaternionic", "SurfaceEnergy", "corner_frames", "gauss_frames"]

_TINY = 1e-300
_GAUSS = 0.5 + np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) / np.sqrt(12.0)


@dataclass(frozen=True, eq=False)
class Frames:
    """Points of cells at which derivatives are taken, with their nodes, weights and cells.

    Attributes
    ----------
    nodes
        (f, k) nodes they depend on.
    gradients
        (f, k, 2) derivatives of the shape functions, for an orthonormal frame of the reference domain.
    weights
        (f,) share in the reference measure; those of one cell sum to 1.
    owners
        (f,) cell of each: triangles first, then quadrilaterals.
    """

    nodes: Ints
    gradients: Floats
    weights: Floats
    owners: Ints

    def derivatives(self, points: Floats) -> tuple[Vector, Vector]:
        """f1 and f2 of every frame, as tuples of components."""
        x = points[self.nodes]
        f = [np.einsum("fkx,fk->xf", x, self.gradients[:, :, i]) for i in (0, 1)]
        return (f[0][0], f[0][1], f[0][2]), (f[1][0], f[1][1], f[1][2])


def _triangle_gradients(shapes: Floats) -> Floats:
    """(f, 3, 2) derivatives of the linear functions on triangles (f, 3, 2) of the plane."""
    edges = np.stack([shapes[:, 1] - shapes[:, 0], shapes[:, 2] - shapes[:, 0]], axis=1)
    inverse = np.linalg.inv(edges)
    # f1, f2 solve f . edge_k = x_k - x_0.
    return np.stack([-inverse.sum(axis=2), inverse[:, :, 0], inverse[:, :, 1]], axis=1)


def corner_frames(cells: Faces, shapes: tuple[Floats, Floats]) -> Frames:
    """One frame for each triangle, one at each corner of a quadrilateral: all have three nodes."""
    t, q = len(cells.triangles), len(cells.quads)
    quads = shapes[1]
    corners = np.stack([quads, np.roll(quads, -1, axis=1), np.roll(quads, 1, axis=1)], axis=2).reshape(-1, 3, 2)
    return Frames(
        np.concatenate([cells.triangles, corner_triangles(cells.quads)]),
        _triangle_gradients(np.concatenate([shapes[0], corners])),
        np.concatenate([np.ones(t), np.full(4 * q, 0.25)]),
        np.concatenate([np.arange(t), t + np.repeat(np.arange(q), 4)]),
    )


def gauss_frames(cells: Faces, shapes: tuple[Floats, Floats]) -> Frames:
    """One frame for each triangle, the 2 x 2 Gauss points of each quadrilateral: exact for the frozen energy.

    Where there are quadrilaterals every frame has four nodes, the last of a triangle with no weight.
    """
    t, q = len(cells.triangles), len(cells.quads)
    gradients = _triangle_gradients(shapes[0])
    if q == 0:
        return Frames(cells.triangles, gradients, np.ones(t), np.arange(t))
    u, v = _GAUSS[:, 0], _GAUSS[:, 1]
    local = np.stack(
        [np.stack([v - 1, 1 - v, v, -v], axis=1), np.stack([u - 1, -u, u, 1 - u], axis=1)], axis=2
    )  # (gauss, corner, direction)
    jacobian = np.einsum("mkx,gki->mgxi", shapes[1], local)
    quads = np.einsum("gki,mgix->mgkx", local, np.linalg.inv(jacobian)).reshape(-1, 4, 2)
    area = np.linalg.det(jacobian)
    return Frames(
        np.concatenate([cells.triangles[:, [0, 1, 2, 0]], np.repeat(cells.quads, 4, axis=0)]),
        np.concatenate([np.pad(gradients, ((0, 0), (0, 1), (0, 0))), quads]),
        np.concatenate([np.ones(t), (area / area.sum(axis=1, keepdims=True)).ravel()]),
        np.concatenate([np.arange(t), t + np.repeat(np.arange(q), 4)]),
    )


@loop
def _blocks(first, last, nodes, gradients, second, offsets, incidences, indptr, indices, data):  # type: ignore[no-untyped-def]
    """Rows of the Hessian, a 3 x 3 block per pair of nodes, from (f, 6, 6) second derivatives in (f1, f2)."""
    width = nodes.shape[1]
    for node in range(first, last):
        for k in range(indptr[node], indptr[node + 1]):
            data[k] = 0.0
        for k in range(offsets[node], offsets[node + 1]):
            frame, a = incidences[k] // width, incidences[k] % width
            for b in range(width):
                place = binary_search(indices, indptr[node], indptr[node + 1], nodes[frame, b])
                for i in range(2):
                    for j in range(2):
                        weight = gradients[frame, a, i] * gradients[frame, b, j]
                        for x in range(3):
                            for y in range(3):
                                data[place, x, y] += weight * second[frame, 3 * i + x, 3 * j + y]


@loop
def _forces(first, last, width, gradients, slopes, offsets, incidences, result):  # type: ignore[no-untyped-def]
    """The gradient (n, 3) at nodes, from derivatives (f, 6) with respect to (f1, f2)."""
    for node in range(first, last):
        for x in range(3):
            result[node, x] = 0.0
        for k in range(offsets[node], offsets[node + 1]):
            frame, a = incidences[k] // width, incidences[k] % width
            for x in range(3):
                result[node, x] += (
                    gradients[frame, a, 0] * slopes[frame, x] + gradients[frame, a, 1] * slopes[frame, 3 + x]
                )


class SurfaceEnergy:
    """A conformal energy of a surface; :class:`Quaternionic` or :class:`surface.energy.barrier.Barrier`.

    Parameters
    ----------
    frames
        Points at which the energy is measured, with their nodes and perfect shapes.
    count
        Number of nodes n.
    """

    frames: Frames

    def __init__(self, frames: Frames, count: int) -> None:
        self.frames = frames
        self._count = count
        self._incidences = corner_incidences(frames.nodes, count)
        self._pattern = node_pattern(frames.nodes, *self._incidences)

    def densities(self, points: Floats) -> Floats:
        """(f,) weighted densities, whose sum is the energy."""
        raise NotImplementedError

    def density_gradients(self, points: Floats) -> Floats:
        """(f, 6) derivatives of the weighted densities with respect to f1 and f2."""
        raise NotImplementedError

    def density_hessians(self, points: Floats) -> Floats:
        """(f, 6, 6) positive semidefinite second derivatives of the weighted densities in (f1, f2)."""
        raise NotImplementedError

    def value(self, points: Floats) -> float:
        """The energy; infinite where the barrier is."""
        return float(self.densities(points).sum())

    def gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy."""
        result, frames = np.empty((self._count, 3)), self.frames
        parallel_ranges(
            _forces, self._count, frames.nodes.shape[1], frames.gradients, self.density_gradients(points),
            *self._incidences, result,
        )  # fmt: skip
        return result

    def hessian(self, points: Floats) -> scipy.sparse.bsr_matrix:
        """(3 n, 3 n) positive semidefinite second derivative, in 3 x 3 blocks."""
        indptr, indices = self._pattern
        data = np.empty((len(indices), 3, 3))
        frames = self.frames
        parallel_ranges(
            _blocks, self._count, frames.nodes, frames.gradients, self.density_hessians(points), *self._incidences,
            indptr, indices, data,
        )  # fmt: skip
        return scipy.sparse.bsr_matrix((data, indices, indptr), shape=(3 * self._count, 3 * self._count))


class Quaternionic(SurfaceEnergy):
    """The conformal distortion int |*df - N df|^2 of Gruber & Aulisa over the reference domain.

    Parameters
    ----------
    cells, shapes, count
        See :class:`SurfaceEnergy`.
    metric
        Weigh every point by tr(g^-1) sqrt(det g) / 2 of the metric g of these points (n, 3), as Gruber & Aulisa do;
        None: by the reference measure. It is frozen: the weights belong to the energy.
    """

    def __init__(self, cells: Faces, shapes: tuple[Floats, Floats], count: int, metric: Floats | None = None) -> None:
        super().__init__(gauss_frames(cells, shapes), count)
        self._weights = self.frames.weights
        if metric is not None:
            f1, f2 = self.frames.derivatives(metric)
            c = cross(f1, f2)
            self._weights = self._weights * (dot(f1, f1) + dot(f2, f2)) / (2 * np.sqrt(dot(c, c)) + _TINY)

    def densities(self, points: Floats) -> Floats:
        f1, f2 = self.frames.derivatives(points)
        return np.asarray(self._weights * plane_density(f1, f2, plane_normal(f1, f2)))

    def density_gradients(self, points: Floats) -> Floats:
        f1, f2 = self.frames.derivatives(points)
        g1, g2 = plane_gradient(f1, f2, plane_normal(f1, f2))
        return np.asarray(self._weights[:, None] * np.stack([*g1, *g2], axis=1))

    def normals(self, points: Floats) -> Vector:
        """Unit normal of every frame."""
        f1, f2 = self.frames.derivatives(points)
        return plane_normal(f1, f2)

    def density_hessians(self, points: Floats) -> Floats:
        """Second derivative with the normals frozen: its quadratic model lies above the energy everywhere."""
        n = self.normals(points)
        result = np.empty((len(self._weights), 6, 6))
        zero = np.zeros(len(self._weights))
        for column in range(6):
            d = [zero] * 6
            d[column] = zero + 1.0
            h1, h2 = plane_gradient((d[0], d[1], d[2]), (d[3], d[4], d[5]), n)
            for row, h in enumerate((*h1, *h2)):
                result[:, row, column] = self._weights * h
        return result


ENERGIES = ("barrier", "quaternionic")
