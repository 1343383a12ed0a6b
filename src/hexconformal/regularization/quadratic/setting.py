"""A mesh of quadratic cells in units of its edges, and what of it moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from ...elements import collapsed_cells, determinant_bounds
from ...energy import CornerWeights, Objective, QuadraticTerm, Term, stretched_boxes
from ...mesh import SERIAL, CellBlock, HexMesh, MixedMesh, Regions, collapsed_mesh, find_regions
from ...solver import AdmissibleDirections, LaplacePreconditioner, Preconditioner, Problem
from ..options import Options
from .curved_boundary import CurvedBoundary
from .schedule import QuadraticSchedule

__all__ = ["QuadraticSetting"]

Field = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class QuadraticSetting:
    """What stays the same during a run.

    Attributes
    ----------
    mesh
        The user's mesh, of quadratic cells, and linear ones beside them.
    options
        The options.
    schedule
        Numbers of the run.
    boundary
        What keeps the boundary.
    left_out
        (m,) cells that count for nothing, as they stay folded, or lie outside a part that is worked on.
    """

    mesh: MixedMesh
    options: Options
    schedule: QuadraticSchedule
    boundary: CurvedBoundary
    left_out: Mask

    @classmethod
    def of(cls, mesh: MixedMesh, options: Options, schedule: QuadraticSchedule) -> QuadraticSetting:
        """The setting of all cells of a mesh; raises what :meth:`CurvedBoundary.of` does."""
        count = sum(len(block.cells) for block in mesh.blocks)
        return cls(mesh, options, schedule, CurvedBoundary.of(mesh, options, schedule), np.zeros(count, dtype=bool))

    def without(self, cells: Mask) -> QuadraticSetting:
        """The same where some cells (m,) stay folded."""
        return replace(self, boundary=self.boundary.with_held(self.nodes_of(cells)), left_out=self.left_out | cells)

    def within(self, moving: Mask) -> QuadraticSetting:
        """The same where no nodes but some (n,) move, and the cells at these alone count."""
        if moving.all():
            return self
        outside = np.empty_like(self.left_out)
        for block in self.blocks:
            outside[block.places] = ~moving[block.cells].any(axis=1)
        return replace(self, boundary=self.boundary.with_held(~moving), left_out=self.left_out | outside)

    def with_boundary_held(self) -> QuadraticSetting:
        """The same with a boundary that stays."""
        return replace(self, boundary=self.boundary.with_held(self.boundary.on_it))

    def nodes_of(self, cells: Mask) -> Mask:
        """(n,) nodes of some cells (m,)."""
        nodes = np.zeros(len(self.mesh.points), dtype=bool)
        for block in self.blocks:
            nodes[block.cells[cells[block.places]]] = True
        return nodes

    def around(self, nodes: Mask, rings: int) -> Mask:
        """(n,) nodes of the cells at some nodes (n,), and of so many rings of cells around these; coupled ones too."""
        for _ in range(rings + 1):
            cells = np.empty(len(self.left_out), dtype=bool)
            for block in self.blocks:
                cells[block.places] = nodes[block.cells].any(axis=1)
            nodes = self.boundary.admissible.coupled.closed(self.nodes_of(cells))
        return nodes

    @property
    def blocks(self) -> Sequence[CellBlock]:
        """The cells by their type."""
        return self.mesh.blocks

    @cached_property
    def corners(self) -> HexMesh:
        """The mesh by its corners."""
        return collapsed_mesh(self.mesh)

    @cached_property
    def regions(self) -> Regions | None:
        """The regions of the mesh, if it has any that count."""
        return find_regions(self.corners, self.options.interfaces)

    @property
    def start(self) -> Field:
        """(n, 3) the points in units of edges."""
        return self.boundary.start

    @cached_property
    def unit(self) -> float:
        """Length of an edge on average, in the user's unit."""
        return self.boundary.parts * self.boundary.normalized.unit

    @cached_property
    def free(self) -> Mask:
        """(n,) nodes that move."""
        return self._referenced & self.boundary.admissible.free(len(self.start))

    @cached_property
    def _referenced(self) -> Mask:
        """(n,) nodes that belong to a cell that counts."""
        return self.nodes_of(~self.left_out)

    def inner(self, points: Field) -> Mask:
        """(n,) nodes off the boundary that may go from points (n, 3) in all directions, each by itself."""
        admissible, inner = self.admissible(points), self._referenced & ~self.boundary.on_it
        inner[admissible.nodes] = False
        inner[admissible.coupled.nodes] = False
        return inner

    def to_user(self, points: Field) -> Field:
        """The points in the user's unit; what has not moved is what it was, bit by bit."""
        return np.asarray(self.mesh.points + self.unit * (points - self.start))

    def on_surface(self, points: Field) -> Field:
        """The points (n, 3), in edges, with those that slide where they belong."""
        sliding = self.boundary.sliding
        return points if sliding is None else sliding.seen_from(points).update(points)

    # ----------------------------------------------------------------------------------------- objectives
    @cached_property
    def boxes(self) -> tuple[Field | None, ...]:
        """Of each type, the boxes of cells that are stretched on purpose."""
        tables = (collapsed_cells(block.cells, block.cell_type) for block in self.blocks)
        return tuple(stretched_boxes(self.start, table) for table in tables)

    def terms(self, weights: CornerWeights | None = None) -> tuple[QuadraticTerm, ...]:
        """Equation (10a) for each type, with angles as of equation (12) where they have a weight."""
        weights = CornerWeights() if weights is None else weights
        evenness = self.schedule.evenness if weights.angle == 0.0 else self.schedule.raised_evenness
        return self._terms(~self.left_out, weights, evenness)

    def _terms(self, cells: Mask, weights: CornerWeights, evenness: float) -> tuple[QuadraticTerm, ...]:
        """A term for the cells (m,) of each type that count."""
        terms = []
        for block, boxes in zip(self.blocks, self.boxes, strict=True):
            own = cells[block.places]
            some = boxes if boxes is None or own.all() else boxes[own]
            table = block.cells if own.all() else block.cells[own]
            terms.append(QuadraticTerm(table, block.cell_type, len(self.start), some, weights, evenness))
        return tuple(terms)

    @cached_property
    def _every_term(self) -> tuple[QuadraticTerm, ...]:
        """The distortion of all cells, folded ones too."""
        return self._terms(np.ones(len(self.left_out), dtype=bool), CornerWeights(), self.schedule.evenness)

    def problem(self, weights: CornerWeights, points: Field, kept: Mask | None = None) -> Problem:
        """The minimization with some weights, the barrier as it is seen from points (n, 3); cells (m,) stay valid."""
        terms: tuple[Term, ...] = self.terms(weights)
        barrier = self.boundary.term
        if barrier is not None:
            terms += (replace(barrier, term=barrier.term.renewed(barrier.places(points))),)
        sliding = self.boundary.sliding
        space = SERIAL if sliding is None else sliding.seen_from(points)
        problem = Problem(Objective(terms), self.admissible(points).project, space=space)
        if kept is None:
            return problem

        def acceptable(points: Field) -> bool:
            return not (kept & ~self.valid(points)).any()

        def spoiled(points: Field) -> Mask:
            return self.boundary.admissible.coupled.closed(self.nodes_of(kept & ~self.valid(points)))

        return replace(problem, acceptable=acceptable, spoiled=spoiled)

    def admissible(self, points: Field) -> AdmissibleDirections:
        """The directions in which nodes may go from points (n, 3)."""
        return self.boundary.admissible if self.boundary.sliding is None else self.boundary.sliding.admissible(points)

    def preconditioner(self, points: Field) -> Preconditioner:
        """An approximate inverse of the Hessian for what begins at points (n, 3): multigrid for their Laplacian."""
        if self.boundary.sliding is None:
            return self._preconditioner
        return LaplacePreconditioner(self._laplacian, self.admissible(points), self._referenced)

    @cached_property
    def _preconditioner(self) -> LaplacePreconditioner:
        return LaplacePreconditioner(self._laplacian, self.boundary.admissible, self._referenced)

    @cached_property
    def _laplacian(self) -> scipy.sparse.csr_matrix:
        return self.laplacian(self.start)

    def laplacian(self, points: Field) -> scipy.sparse.csr_matrix:
        """(n, n) Laplacian of the cells that count, in coordinates of their own, the stiffer the smaller they are."""
        first, *others = (term.laplacian(points) for term in self.terms())
        return sum(others, first)

    # ------------------------------------------------------------------------------------------- measures
    def energy(self, points: Field) -> float:
        """Equation (10a) of all cells; not a number where one is folded."""
        energy = sum(term.value(points) for term in self._every_term)
        return energy if np.isfinite(energy) else float("nan")

    def smallest_determinant(self, points: Field) -> float:
        """Of all points of all cells that count."""
        return min(float(term.determinants(points).min(initial=np.inf)) for term in self.terms())

    def count_folded(self, points: Field) -> int:
        """Number of points that are folded, of all cells that count."""
        return sum(int((term.determinants(points) <= 0.0).sum()) for term in self.terms())

    def folds(self, points: Field) -> tuple[Mask, Field]:
        """(m,) cells that are folded at a point, or were valid at first and are not, and how deep folds (m,) are."""
        depths = np.empty(len(self.left_out))
        for block, term in zip(self.blocks, self._every_term, strict=True):
            depths[block.places] = np.maximum(-term.determinants(points), 0.0).sum(axis=1)
        return self.folded_cells(points) | (self._valid_at_first & ~self.valid(points)), depths

    @cached_property
    def _valid_at_first(self) -> Mask:
        return self.valid(self.start)

    def folded_cells(self, points: Field) -> Mask:
        """(m,) cells with a point that is folded."""
        out = np.empty(len(self.left_out), dtype=bool)
        for block, term in zip(self.blocks, self._every_term, strict=True):
            out[block.places] = (term.determinants(points) <= 0.0).any(axis=1)
        return out

    def worst_angles(self, points: Field) -> dict[str, float]:
        """Largest e(u) at all points of the cells of each type that count, u the unit columns; infinite if folded."""
        return {term.cell_type.name: float(term.largest_angles(points).max(initial=0.0)) for term in self.terms()}

    def worst_by_type(self, scaled_jacobians: Field) -> Field:
        """Smallest scaled Jacobian of each type of cells, of those (m,) of all."""
        return np.array([scaled_jacobians[block.places].min() for block in self.blocks])

    def scaled_jacobians(self, points: Field) -> Field:
        """(m,) smallest scaled Jacobian at the points of each cell."""
        out = np.empty(len(self.left_out))
        for block, term in zip(self.blocks, self._every_term, strict=True):
            out[block.places] = term.scaled_jacobians(points)
        return out

    def valid(self, points: Field) -> Mask:
        """(m,) cells that are proved to be valid, where the user's mesh has them."""
        out, points = np.empty(len(self.left_out), dtype=bool), self.to_user(points)
        for block in self.blocks:
            out[block.places] = determinant_bounds(points, block.cells, block.cell_type)[0] > 0
        return out
