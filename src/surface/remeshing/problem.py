"""The optimization problem of a remeshing: energy, retraction, and the volume, area and distance that are kept."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hexconformal.geometry import (
    CORNER,
    SMOOTH,
    Faces,
    Features,
    area_gradient,
    edge_table,
    face_areas,
    nodal_area_vectors,
    unit_vectors,
)
from hexconformal.mesh import connected_components

from ..constraint import InputSurface, Interfaces, SmoothProjection
from ..energy import Barrier, SurfaceEnergy
from ..mesh import Floats, Ints
from .schedules import ProblemSchedule

__all__ = ["RemeshingProblem"]


@dataclass(eq=False)
class RemeshingProblem:
    """A surface whose energy is lowered within bounds on its volume, area and distance from the input.

    Attributes
    ----------
    start, cells, features
        The input.
    energy
        The energy to lower.
    eps
        Relaxation of the constraint, in squares of the mean edge length.
    normal
        Place at which its normal is taken: "middle", "simpson" or "linear".
    bound
        Largest distance from the input; with None there is neither projection nor bound.
    interfaces
        Lines between regions, which are among the features.
    schedule
        Tolerances and limits.
    """

    start: Floats
    cells: Faces
    features: Features
    energy: SurfaceEnergy
    eps: float
    normal: str
    bound: float | None
    interfaces: Interfaces = field(default_factory=Interfaces)
    schedule: ProblemSchedule = field(default_factory=ProblemSchedule)

    def __post_init__(self) -> None:
        count = len(self.start)
        self.edges = edge_table(self.cells).nodes
        self.moving = self.features.kind != CORNER
        self._smooth = self.features.kind == SMOOTH
        self._pieces = _closed_pieces(self.cells, count)
        self._volumes = self._piece_volumes(self.start, nodal_area_vectors(self.start, self.cells))
        self.area = float(face_areas(self.start, self.cells).sum())
        self.input_surface = InputSurface(self.start, self.cells, self.interfaces)
        free, projected = self.schedule.free_tolerance, self.schedule.projected_tolerance
        self.solver_tolerance = free if self.bound is None else projected
        self.projection = None if self.bound is None else SmoothProjection(self.start, self.cells, self.features)

    @property
    def node_facets(self) -> Ints | None:
        """(n,) facets of the input on which the nodes lie; None without projection."""
        return None if self.projection is None else self.projection.node_facets

    @node_facets.setter
    def node_facets(self, facets: Ints | None) -> None:
        if self.projection is not None and facets is not None:
            self.projection.node_facets = facets

    def retract(
        self, x: Floats, base: Floats, step: Floats, frozen: NDArray[np.bool_]
    ) -> tuple[Floats, Floats, Ints | None]:
        """Take a step from points on the input, project them onto it, and restore volume and area.

        Nodes that do not step move a little as volume and area are restored; those that are `frozen` stay at x.

        Returns
        -------
        (n, 3) points, a little off the input, those on it, and the facets of the input on which these lie.
        """
        if self.projection is None:
            return base + step, base + step, None
        still = ~step.any(axis=1)
        projected, facets, _ = self.projection.project(base + step)
        # Where the input is rough a projected point, projected again, may move: but no step has to mean no change.
        projected += base - self.projection.foot_points(base)[0]
        projected[still], facets[still] = base[still], self.projection.node_facets[still]
        result = self.restored(projected, self._smooth)
        if frozen.any():
            result[frozen], rest = x[frozen], self._smooth & ~frozen
            result = self.restore_volume(self._restore_area(result, rest), rest)
        return result, projected, facets

    def restored(self, points: Floats, free: NDArray[np.bool_]) -> Floats:
        """Give closed pieces their volume back, and the whole an area within its range, by shifts of some nodes."""
        for _ in range(2):
            points = self.restore_volume(self._restore_area(points, free), free)
        return points

    def restore_volume(self, points: Floats, free: NDArray[np.bool_] | None = None) -> Floats:
        """Shift every closed piece along its normals, at nodes that are free, until it encloses the input's volume."""
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

    def _restore_area(self, points: Floats, free: NDArray[np.bool_]) -> Floats:
        """Bring the area back into its range by a shift along the normals in proportion to the curvature."""
        excess = self.area_excess(points)
        if excess == 0.0:
            return points
        curvature, area_rate, normals = self._curvature_deviation(points, free)
        rate = float((curvature * area_rate).sum())
        if not rate > 0:
            return points
        return np.asarray(points - (excess * self.area / rate) * curvature[:, None] * normals)

    def _curvature_deviation(self, points: Floats, free: NDArray[np.bool_]) -> tuple[Floats, Floats, Floats]:
        """Mean curvature at the nodes less its mean, the derivative of the area along the normals, and the normals."""
        vectors = nodal_area_vectors(points, self.cells)
        normals, areas = unit_vectors(vectors), np.linalg.norm(vectors, axis=1) * free
        area_rate = (area_gradient(points, self.cells) * normals).sum(axis=1) * free
        largest = self.schedule.max_curvature
        curvature = np.clip(area_rate / np.maximum(areas, 1e-3), -largest, largest) * free
        mean = float((curvature * areas).sum()) / max(float(areas.sum()), 1e-300)
        return (curvature - mean) * free, area_rate, normals

    def _piece_volumes(self, points: Floats, vectors: Floats) -> Floats:
        inside = self._pieces >= 0
        volumes = (points * vectors).sum(axis=1) / 3
        count = int(self._pieces.max(initial=-1)) + 1
        return np.bincount(self._pieces[inside], volumes[inside], count).astype(np.float64)

    def constrained_gradient(self, points: Floats) -> Floats:
        """(n, 3) derivative of the energy of the surface with its volume and area restored."""
        gradient = self.energy.gradient(points)
        size = np.linalg.norm(gradient, axis=1)
        # A few bad cells must not move all others through volume and area.
        largest = self.schedule.max_force * np.median(size)
        clipped = gradient * np.minimum(1.0, largest / np.maximum(size, 1e-300))[:, None]
        change = float(face_areas(points, self.cells).sum()) / self.area - 1
        if abs(change) > self.schedule.area_reached * self.schedule.area_tolerance:
            curvature, area_rate, normals = self._curvature_deviation(points, self._smooth)
            multiplier = float((curvature[:, None] * normals * clipped).sum()) / max(
                float((curvature * area_rate).sum()), 1e-300
            )
            # Only a multiplier of the right sign: the energy would have the area leave its range.
            if multiplier * change < 0:
                area_force = multiplier * area_gradient(points, self.cells)
                gradient, clipped = gradient - area_force, clipped - area_force
        vectors = nodal_area_vectors(points, self.cells)
        normals, areas = unit_vectors(vectors), np.linalg.norm(vectors, axis=1)
        whole = self._pieces >= 0
        inside = whole & self._smooth
        piece, count = self._pieces[inside], len(self._volumes)
        total = np.maximum(np.bincount(piece, areas[inside], count), 1e-300)
        pressure = np.bincount(piece, (normals * clipped).sum(axis=1)[inside], count) / total
        gradient[whole] -= pressure[self._pieces[whole], None] * vectors[whole]
        return gradient

    def area_excess(self, points: Floats) -> float:
        """Relative area beyond its range; negative where it is too small, 0 within."""
        if self.bound is None:
            return 0.0
        change = float(face_areas(points, self.cells).sum()) / self.area - 1
        largest = self.schedule.area_tolerance
        return change - float(np.clip(change, -largest, largest))

    def violating_nodes(self, y: Floats, before: Floats, after: Floats, held: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) nodes of cells that a step to y spoils, turns over, or takes too far from the input.

        The energies of the frames before and after it are given, and the nodes that are held.
        """
        still = ~self.cells.any_of(~held)
        mask = self.nodes_of_frames(~(after <= self.schedule.max_growth * before + before.mean()))
        if self.bound is None or mask.any():
            return mask
        mask[self.cells.corners_of(self.input_surface.cells_out_of_bounds(y, self.bound, still))] = True
        return mask

    def nodes_of_frames(self, frames: NDArray[np.bool_] | Ints) -> NDArray[np.bool_]:
        """(n,) nodes of some frames of the energy."""
        mask = np.zeros(len(self.start), dtype=bool)
        mask[self.energy.frames.nodes[frames]] = True
        return mask

    def frame_normals(self, points: Floats, normals: Floats | None) -> Floats:
        """(f, 3) unit normal that each frame is measured against: the mean of the input's at its smooth nodes."""
        frames = self.energy.frames
        f1, f2 = (np.stack(f, axis=1) for f in frames.derivatives(points))
        own = unit_vectors(np.cross(f1, f2))
        if normals is None:
            return own
        mean = (unit_vectors(normals) * self._smooth[:, None])[frames.nodes].sum(axis=1)
        defined = np.linalg.norm(mean, axis=1) > 0.0
        return np.where(defined[:, None], unit_vectors(mean), own)

    def set_damping(self, damping: Floats) -> None:
        """Damp each frame by the largest of the (n,) dampings of its nodes."""
        if isinstance(self.energy, Barrier):
            self.energy.damping = damping[self.energy.frames.nodes].max(axis=1)

    def with_neighbours(self, nodes: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(n,) the nodes and their neighbours along edges."""
        result = nodes.copy()
        result[self.edges[nodes[self.edges].any(axis=1)]] = True
        return result


def _closed_pieces(cells: Faces, count: int) -> NDArray[np.int64]:
    """(n,) number of the closed connected piece each node lies in, -1 in open ones."""
    table = edge_table(cells)
    labels = connected_components(table.nodes, count)
    open_pieces = np.unique(labels[table.nodes[table.nonmanifold]])
    used = np.zeros(count, dtype=bool)
    used[table.nodes] = True
    closed = used & ~np.isin(labels, open_pieces)
    result = np.full(count, -1)
    result[closed] = np.unique(labels[closed], return_inverse=True)[1].ravel()
    return result
