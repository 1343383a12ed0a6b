"""The boundary of a mesh of quadratic cells: that of the linear ones it is cut into, as a function of its nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from ...energy import ComposedTerm
from ...formulation import Schedules
from ...geometry import DistanceBarrier, sharp_length
from ...mesh import MixedMesh, NormalizedMesh, Regions, boundary_quads, collapsed_mesh, face_edges, unique_edges
from ...solver import AdmissibleDirections, coupled_nodes, fixed_components
from ..acceptance import boundary_distance
from ..boundary import Boundary, KeptGeometry, Said, boundary_of, kept_geometry
from ..options import Options
from ..region_rows import InterfaceRow, interface_rows
from .curved_surface import CurvedSurface, largest_bend, needed_parts
from .cut_mesh import CutMesh
from .schedule import QuadraticSchedule
from .sliding import Sliding, sliding_nodes

__all__ = ["CurvedBoundary"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_EXACT = 0.02  # bounds to which distances are measured


@dataclass(frozen=True, eq=False)
class CurvedBoundary:
    """What keeps the boundary of quadratic cells.

    Attributes
    ----------
    cut
        The mesh cut into linear cells.
    normalized
        These, normalized.
    boundary
        Their boundary: of a part of an edge as much as of a whole one.
    admissible
        Directions that the nodes of the mesh itself may go in, all of those that slide on a curved surface.
    sliding
        Brings these back to it; None where there are none.
    bound
        How far the surface may move, in diagonals.
    sheets
        (k, 4) corners of the faces inside that are kept.
    """

    cut: CutMesh
    normalized: NormalizedMesh
    boundary: Boundary
    admissible: AdmissibleDirections
    sliding: Sliding | None
    bound: float
    sheets: Ints

    @classmethod
    def of(cls, mesh: MixedMesh, options: Options, schedule: QuadraticSchedule) -> CurvedBoundary:
        """The boundary of a mesh as the options ask for it.

        Raises
        ------
        MeshError
            If most cells have negative volume, or faces do not fit.
        OptionError
            If options make no sense.
        """
        corners = NormalizedMesh(collapsed_mesh(mesh))
        parts, bound, notes = 2, options.hausdorff, list[str]()
        if options.boundary == "slide" and bound > 0.0:
            diagonal = corners.diagonal * corners.unit
            bend = largest_bend(mesh, boundary_quads(mesh.table)[0]) / diagonal
            parts = needed_parts(mesh, bend, schedule.nearness * bound, *schedule.parts)
            # Samples are compared with parts, which are that much nearer or farther than the surface itself.
            near = bound - bend / parts**2
            if near < (1.0 - schedule.nearness) * bound:
                least = bend / parts**2 / schedule.nearness
                notes = [f"curved parts stay: faces bend too far for a hausdorff below {least:.2g} to be followed"]
                parts, near = 2, 0.0
            bound = near
        cut = CutMesh(mesh, parts)
        normalized, count = NormalizedMesh(cut.linear()), len(mesh.points)
        fixed, among = np.zeros((cut.count, 3), dtype=bool), np.zeros(cut.count, dtype=bool)
        fixed[:count] = fixed_components(corners.mesh, options.fixed)
        among[mesh.cells] = True
        kept = kept_geometry(corners, options)
        said = Said(
            fixed, _of_parts(kept, corners, cut, normalized), *coupled_nodes(normalized, options.couplings, among)
        )
        boundary = boundary_of(normalized, replace(options, hausdorff=bound), Schedules(), said=said)
        boundary = replace(boundary, notes=(*boundary.notes, *notes))
        every, own = boundary.admissible, boundary.admissible.nodes < count
        admissible = AdmissibleDirections(every.nodes[own], every.projectors[own], every.coupled)
        if boundary.barrier is None:
            return cls(cut, normalized, boundary, admissible, None, options.hausdorff, kept.quads)
        quads = np.concatenate([corners.quads, kept.quads])
        around = unique_edges(face_edges(quads)).nodes
        # Triangles have their last node twice.
        edges = np.concatenate([around[around[:, 0] != around[:, 1]], kept.edges])
        kinds = sliding_nodes(cut, boundary.barrier, cut.faces(quads), cut.edges(edges), admissible)
        held = boundary.barrier.curves.corners
        start = normalized.points[:count] / parts
        sliding = Sliding(kinds, held[held < count], admissible, start, parts)
        barrier = _between_nodes(boundary.barrier, count)
        boundary = replace(boundary, barrier=barrier)
        return cls(cut, normalized, boundary, admissible, sliding, options.hausdorff, kept.quads)

    def with_held(self, nodes: Mask) -> CurvedBoundary:
        """The same with further nodes (n,) of the mesh held."""
        admissible = self.admissible.with_held(np.flatnonzero(nodes))
        sliding = None if self.sliding is None else self.sliding.with_held(np.flatnonzero(nodes))
        return replace(self, admissible=admissible, sliding=sliding)

    @property
    def parts(self) -> int:
        """Into which edges are cut; lengths here are in edges, those of `normalized` in parts of them."""
        return self.cut.parts

    @cached_property
    def start(self) -> Field:
        """(n, 3) the nodes of the mesh at first, in edges."""
        return np.asarray(self.normalized.points[: len(self.cut.mesh.points)] / self.parts)

    @cached_property
    def on_it(self) -> Mask:
        """(n,) nodes of the mesh that lie on the boundary, those on its edges and faces too."""
        found = np.zeros(self.cut.count, dtype=bool)
        found[self.normalized.quads] = True
        return found[: len(self.cut.mesh.points)]

    @cached_property
    def term(self) -> ComposedTerm | None:
        """The barrier as a function of the nodes of the mesh, in edges; None where there is none."""
        barrier = self.boundary.barrier
        return None if barrier is None else ComposedTerm(barrier, self._matrix)

    def places(self, points: Field) -> Field:
        """(count, 3) nodes of the parts, as far as they lie on the boundary or a sheet inside, with nodes (n, 3) there.

        Where nothing has moved they are what they were, to the last bit.
        """
        return np.asarray(self.normalized.points + self._matrix @ (points - self.start))

    # ---------------------------------------------------------------------------------------- measures
    @property
    def diagonal(self) -> float:
        """Diagonal of the bounding box, in the user's unit."""
        return self.normalized.diagonal * self.normalized.unit

    def distance(self, points: Field) -> float:
        """Hausdorff distance of the boundary, and of sheets inside, from where it was, in diagonals.

        Points (n, 3) of the mesh are in the user's unit, here and in what follows.
        """
        if self.boundary.barrier is None:
            return boundary_distance(self._normalized_places(points), self.normalized, self.boundary, "slide")
        surfaces = (self._surface, self._inside) if len(self.sheets) else (self._surface,)
        return max(one.hausdorff(self.cut.mesh.points, points, self._tolerance) for one in surfaces) / self.diagonal

    def mean_distance(self, points: Field) -> float:
        """Mean distance of the boundary from where it was, in diagonals."""
        return self._surface.mean_distance(self.cut.mesh.points, points) / self.diagonal

    @property
    def _tolerance(self) -> float:
        """To which distances are measured, in the user's unit."""
        return _EXACT * (self.bound or 1e-3) * self.diagonal

    @cached_property
    def _surface(self) -> CurvedSurface:
        return CurvedSurface.of(self.cut.mesh, boundary_quads(self.cut.mesh.table)[0], self._tolerance)

    @cached_property
    def _inside(self) -> CurvedSurface:
        inner = self.boundary.inner
        sheets = None if inner is None else inner.sheets[:: self.parts**2]
        return CurvedSurface.of(self.cut.mesh, self.sheets, self._tolerance, sheets)

    def sharp_length(self, points: Field) -> float:
        """Length of the sharp edges of the boundary."""
        return sharp_length(self.normalized.to_user(self._normalized_places(points)), self.normalized.quads)

    def interface_rows(self, regions: Regions, points: Field) -> tuple[tuple[InterfaceRow, ...], list[str]]:
        """A row for each pair of regions that meet, and notes."""
        parts = replace(regions, labels=regions.labels[self.cut.owners])
        places = self.normalized.to_user(self._normalized_places(points))
        rows, notes = interface_rows(parts, self.normalized.mesh, places, self.diagonal, len(self.start))
        return tuple(replace(row, quads=row.quads // self.parts**2) for row in rows), notes

    def _normalized_places(self, points: Field) -> Field:
        shift = (points - self.cut.mesh.points) / (self.parts * self.normalized.unit)
        return self.places(self.start + shift) if shift.any() else self.normalized.points

    @cached_property
    def _matrix(self) -> scipy.sparse.csr_array:
        """(count, n) takes nodes of the mesh, in edges, to nodes of the parts on what is kept, in parts of edges."""
        sheets = [] if self.boundary.inner is None else [self.boundary.inner.quads.ravel()]
        nodes = np.unique(np.concatenate([self.normalized.quads.ravel(), *sheets]))
        shares = scipy.sparse.csr_array(self.parts * self.cut.matrix(nodes))
        lengths = np.zeros(self.cut.count, dtype=np.int64)
        lengths[nodes] = np.diff(shares.indptr)
        pointers = np.concatenate([[0], np.cumsum(lengths)])
        return scipy.sparse.csr_array((shares.data, shares.indices, pointers), shape=(self.cut.count, len(self.start)))


def _between_nodes(barrier: DistanceBarrier, count: int) -> DistanceBarrier:
    """The barrier at nodes of parts that are none of the mesh, the first of so many, alone, and without attraction.

    Nodes of the mesh lie on the surface itself: nothing has to draw them there.
    """
    samples = barrier.forward
    nodes = np.take_along_axis(barrier.original.faces[samples.faces], samples.weights.argmax(axis=1)[:, None], axis=1)
    between = (samples.weights.max(axis=1) == 1.0) & (nodes[:, 0] >= count)
    forward = replace(samples, attraction=np.zeros(len(samples))).chosen(between)
    return replace(barrier, forward=forward, backward=barrier.backward.chosen(np.zeros(len(barrier.backward), bool)))


def _of_parts(kept: KeptGeometry, corners: NormalizedMesh, cut: CutMesh, normalized: NormalizedMesh) -> KeptGeometry:
    """The geometry to keep, of the parts of its faces and edges."""
    held = np.zeros(cut.count, dtype=bool)
    held[: len(kept.held)] = kept.held
    skin = cut.faces(corners.quads)
    # Which face of a cell each part of the skin is of.
    row = skin.matching(normalized.quads) // skin.each
    quads, edges = cut.faces(kept.quads), cut.edges(kept.edges)
    kinds, edge_kinds = np.repeat(kept.kinds, quads.each), np.repeat(kept.edge_kinds, edges.each)
    kinds_of_skin, tags = (None if told is None else told[row] for told in (kept.kinds_of_skin, kept.tags))
    return KeptGeometry(held, kinds_of_skin, tags, quads.nodes, kinds, edges.nodes, edge_kinds, kept.notes)
