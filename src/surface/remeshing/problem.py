"""A surface at work: what is lowered, what holds its nodes, and the volume, area and shape that it keeps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexconformal.mesh import connected_components

from ..constraint import CORNER, SMOOTH, Features, InputSurface, SmoothProjection
from ..energy import Barrier, Distortion
from ..mesh import Cells, Floats, Ints, area_gradient, cell_areas, edge_table, nodal_area_vectors, unit_vectors

__all__ = ["RemeshingProblem"]

_GROWTH = 2.0  # of a cell's density in one step
_AREA = 0.008  # relative change of the area
_USUAL = 10.0  # times the median
_KNOWN = 0.3  # length of a sum of normals that says something
_SHARPEST = 2.0  # curvature that counts, per mean edge length
_LOOSE, _TIGHT = 0.03, 1e-8  # of the linear systems: with nodes put back onto the surface, and without


@dataclass(eq=False)
class RemeshingProblem:
    """What the loop works on.

    Attributes
    ----------
    start, cells, features
        The input.
    energy
        What is lowered.
    eps
        Relaxation of the constraint, in squares of the mean edge length.
    normal
        Where its normal is taken.
    bound
        Largest distance from the input; None lets the surface go (no projection, no bound).
    """

    start: Floats
    cells: Cells
    features: Features
    energy: Distortion
    eps: float
    normal: str
    bound: float | None

    def __post_init__(self) -> None:
        count = len(self.start)
        self.edges = self.cells.edges()
        self.moving = self.features.kind != CORNER
        self._smooth = self.features.kind == SMOOTH
        self._pieces = _closed_pieces(self.cells, count)
        self._volumes = self._piece_volumes(self.start, nodal_area_vectors(self.start, self.cells))
        self.area = float(cell_areas(self.start, self.cells).sum())
        self.shape = InputSurface(self.start, self.cells)
        self.precision = _TIGHT if self.bound is None else _LOOSE
        self.target = None if self.bound is None else SmoothProjection(self.start, self.cells, self.features)

    def retracted(
        self, x: Floats, base: Floats, step: Floats, frozen: NDArray[np.bool_]
    ) -> tuple[Floats, Floats, Ints | None]:
        """A step from points on the input, back onto it; then the surface with its old volume and area.

        Who does not step moves a little with the rest, which gives volume and area back; who is `frozen` stays at x.

        Returns
        -------
        (n, 3) points, a little off the input, those on it, and where they are there.
        """
        if self.target is None:
            return base + step, base + step, None
        still = ~step.any(axis=1)
        moved, places, _ = self.target.project(base + step)
        # Where the input is rough a projection may not stay where it is: no step has to mean no change.
        moved += base - self.target.foot_points(base)[0]
        moved[still], places[still] = base[still], self.target.node_facets[still]
        result = moved
        for _ in range(2):
            result = self.with_volume(self._with_area(result, self._smooth), self._smooth)
        if frozen.any():
            result[frozen], rest = x[frozen], self._smooth & ~frozen
            result = self.with_volume(self._with_area(result, rest), rest)
        return result, moved, places

    def with_volume(self, points: Floats, free: NDArray[np.bool_] | None = None) -> Floats:
        """Every closed piece shifted along its normals, where nodes are free to, until it encloses its old volume."""
        free = self._smooth if free is None else free
        vectors = nodal_area_vectors(points, self.cells)
        areas = np.linalg.norm(vectors, axis=1) * free
        inside = self._pieces >= 0
        total = np.bincount(self._pieces[inside], areas[inside], len(self._volumes))
        missing = self._volumes - self._piece_volumes(points, vectors)
        offset = np.where(total > 0, missing / np.where(total > 0, total, 1.0), 0.0)
        shift = np.zeros(len(points))
        shift[inside] = offset[self._pieces[inside]]
        return np.asarray(points + (shift * free)[:, None] * unit_vectors(vectors))

    def _with_area(self, points: Floats, free: NDArray[np.bool_]) -> Floats:
        """What is cut off where the surface is curved, given back there: shifted in proportion to the curvature."""
        excess = self.area_excess(points)
        if excess == 0.0:
            return points
        bend, pull, upward = self._bending(points, free)
        rate = float((bend * pull).sum())
        if not rate > 0:
            return points
        return np.asarray(points - (excess * self.area / rate) * bend[:, None] * upward)

    def _bending(self, points: Floats, free: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
        """Curvature at the nodes less its mean, the derivative of the area along the normals, and these."""
        vectors = nodal_area_vectors(points, self.cells)
        upward, areas = unit_vectors(vectors), np.linalg.norm(vectors, axis=1) * free
        pull = (area_gradient(points, self.cells) * upward).sum(axis=1) * free
        bend = np.clip(pull / np.maximum(areas, 1e-3), -_SHARPEST, _SHARPEST) * free
        mean = float((bend * areas).sum()) / max(float(areas.sum()), 1e-300)
        return (bend - mean) * free, pull, upward

    def _piece_volumes(self, points: Floats, vectors: Floats) -> Floats:
        inside = self._pieces >= 0
        moments = (points * vectors).sum(axis=1) / 3
        count = int(self._pieces.max(initial=-1)) + 1
        return np.bincount(self._pieces[inside], moments[inside], count).astype(np.float64)

    def slope(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy of the surface that has got its volume and area back."""
        gradient = self.energy.gradient(points)
        size = np.linalg.norm(gradient, axis=1)
        # A few bad cells must not move all others through volume and area.
        usual = gradient * np.minimum(1.0, _USUAL * np.median(size) / np.maximum(size, 1e-300))[:, None]
        change = float(cell_areas(points, self.cells).sum()) / self.area - 1
        if abs(change) > 0.98 * _AREA:
            bend, pull, upward = self._bending(points, self._smooth)
            force = float((bend[:, None] * upward * usual).sum()) / max(float((bend * pull).sum()), 1e-300)
            # Only a multiplier of the right sign: the energy would have the area leave its range.
            if force * change < 0:
                by_area = force * area_gradient(points, self.cells)
                gradient, usual = gradient - by_area, usual - by_area
        vectors = nodal_area_vectors(points, self.cells)
        upward, areas = unit_vectors(vectors), np.linalg.norm(vectors, axis=1)
        whole = self._pieces >= 0
        inside = whole & self._smooth
        piece, count = self._pieces[inside], len(self._volumes)
        total = np.maximum(np.bincount(piece, areas[inside], count), 1e-300)
        pressure = np.bincount(piece, (upward * usual).sum(axis=1)[inside], count) / total
        gradient[whole] -= pressure[self._pieces[whole], None] * vectors[whole]
        return gradient

    def area_excess(self, points: Floats) -> float:
        """How far the area is out of its range, relatively; negative where it is too small, 0 within."""
        if self.bound is None:
            return 0.0
        change = float(cell_areas(points, self.cells).sum()) / self.area - 1
        return change - float(np.clip(change, -_AREA, _AREA))

    def in_trouble(self, y: Floats, before: Floats, after: Floats, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) nodes of cells that a step to y spoils, turns over, or takes away from the input.

        Energies of the cells are given, and the nodes that are held.
        """
        still = np.concatenate([held[table].all(axis=1) for table in (self.cells.triangles, self.cells.quads)])
        mask = self.nodes_of(~(after <= _GROWTH * before + before.mean()))
        if self.bound is None or mask.any():
            return mask
        bad = self.shape.cells_out_of_bounds(y, self.bound, still)
        t = len(self.cells.triangles)
        mask[self.cells.triangles[bad[:t]]] = True
        mask[self.cells.quads[bad[t:]]] = True
        return mask

    def nodes_of(self, frames: NDArray[np.bool_] | Ints) -> NDArray[np.bool_]:
        """(n,) nodes of some frames."""
        mask = np.zeros(len(self.start), dtype=bool)
        mask[self.energy.frames.nodes[frames]] = True
        return mask

    def frame_normals(self, points: Floats, normals: Floats | None) -> Floats:
        """(f, 3) unit normal each frame is measured against: the mean of the surface's at its smooth nodes."""
        frames = self.energy.frames
        f1, f2 = (np.stack(f, axis=1) for f in frames.derivatives(points))
        own = unit_vectors(np.cross(f1, f2))
        if normals is None:
            return own
        mean = (unit_vectors(normals) * self._smooth[:, None])[frames.nodes].sum(axis=1)
        known = np.linalg.norm(mean, axis=1) > _KNOWN
        return np.where(known[:, None], unit_vectors(mean), own)

    def damp(self, damping: Floats) -> None:
        """Damp the frames by the largest (n,) damping of their nodes."""
        if isinstance(self.energy, Barrier):
            self.energy.damping = damping[self.energy.frames.nodes].max(axis=1)

    def around(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) the nodes and all that share an edge with one of them."""
        result = nodes.copy()
        result[self.edges[nodes[self.edges].any(axis=1)]] = True
        return result


def _closed_pieces(cells: Cells, count: int) -> NDArray[np.int64]:
    """(n,) number of the closed connected piece each node lies in, -1 in open ones."""
    table = edge_table(cells)
    labels = connected_components(table.nodes, count)
    open_pieces = np.unique(labels[table.nodes[table.uses != 2]])
    used = np.zeros(count, dtype=bool)
    used[table.nodes] = True
    closed = used & ~np.isin(labels, open_pieces)
    result = np.full(count, -1)
    result[closed] = np.unique(labels[closed], return_inverse=True)[1].ravel()
    return result
