"""The corner energy of a mesh, or of a patch of it, and its projected Newton method.

For meshes where the note's energy is not enough: tangled cells, cells that are barely valid, and the worst
cells of an otherwise good mesh. Everything is measured at the corners, where the scaled Jacobian is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .block_matrix import BlockMatrix, cell_places
from .corner_kernels import corner_densities, corner_sums
from .elements import CORNERS
from .grain import PATCH, rounded
from .size_kernel import size_sums
from .threads import parallel_ranges
from .topology import boundary_quads
from .validity import is_valid

__all__ = ["SIZE", "Emphasis", "Measures", "Shaping", "SurfacePenalty", "newton_step", "next_shift", "projected_newton"]
__all__ += ["rings"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

SIZE = 6.0  # weight of the sizes of cells beside their angles, or their whole distortion
_ARMIJO = 1e-4
_HALVINGS = 25
_SOLVE, _SOLVE_ITERATIONS = 0.1, 50  # tolerance and limit of the truncated solves
_CURVATURE = (1e-5, 1e-1)  # bounds of the shift that stands in for the curvature the convex Hessian leaves out


def _corner_table() -> Ints:
    """(8, 6): at each corner the neighbours along e1, e2, e3, and the signs that turn edges into derivatives."""
    neighbours = [[int(np.flatnonzero((CORNERS ^ CORNERS[q] == axis).all(axis=1))[0]) for axis in np.eye(3, dtype=int)]
                  for q in range(8)]  # fmt: skip
    return np.ascontiguousarray(np.hstack([neighbours, 1 - 2 * CORNERS]), dtype=np.int64)


_TABLE = _corner_table()
_NOTHING = np.empty((0, 3)), np.empty((0, 3, 3)), np.empty((0, 36), np.int64)


@dataclass(frozen=True)
class Emphasis:
    """What counts: sum of shape * e(f) + angle * phi(e(u)) over the corners (see corner_kernels), and of sizes.

    Attributes
    ----------
    shape
        Weight of the whole distortion, edge lengths and angles against the target.
    angle
        Weight of the angles alone: the distortion of the unit columns, edge lengths free.
    stiffness
        phi(e) = e / (1 - stiffness e): no corner gets worse than 1 / stiffness.
    eps
        Of the barrier chi_eps; 0 once nothing is folded.
    size
        Weight of what cells pay for losing or gaining volume (see size_kernel).
    """

    shape: float = 1.0
    angle: float = 0.0
    stiffness: float = 0.0
    eps: float = 0.0
    size: float = 0.0


@dataclass(frozen=True)
class Measures:
    """Per cell: smallest corner determinant, largest densities e(f) and e(u); infinite where folded."""

    determinant: Field
    shape: Field
    angle: Field


class SurfacePenalty(Protocol):
    """What keeps nodes of the boundary near the surface: a penalty, and a limit that is never crossed."""

    def value(self, points: Field) -> float: ...
    def excess(self, points: Field) -> float: ...
    def add(self, points: Field, forces: Field, matrix: BlockMatrix) -> float: ...
    def restricted(self, nodes: Ints, moving: Mask, points: Field) -> SurfacePenalty: ...


@dataclass
class Shaping:
    """The corner energy of cells whose nodes move in admissible directions.

    Attributes
    ----------
    cells
        (m, 8) nodes.
    inverses
        Inverse target frames as in :class:`hexconformal.assembly.Distortion`, empty for cubes.
    projectors
        (n, 3, 3) orthogonal projections onto the admissible displacements; 0 holds a node.
    surface
        What keeps boundary nodes near the surface, or None.
    sizes
        (m,) volumes that cells should have, 0 for those without; empty for none at all.
    firmness
        Factor of the weight of sizes.
    grain
        Of the directions that are taken, see :mod:`hexconformal.grain`; 0 for none. Patches have a finer one.
    """

    cells: Ints
    inverses: Field
    projectors: Field
    surface: SurfacePenalty | None = None
    sizes: Field = field(default_factory=lambda: np.empty(0))
    firmness: float = 1.0
    grain: float = 0.0

    @cached_property
    def _matrix(self) -> BlockMatrix:
        return BlockMatrix.of_cells(self.cells, self.free)

    @cached_property
    def _places(self) -> Ints:
        return cell_places(self.cells, self.free, self._matrix)

    def value(self, points: Field, emphasis: Emphasis) -> float:
        """Energy at the points; infinite where a corner is folded, too bad, or too far from the surface."""
        total = self._sums(points, emphasis, None)
        if self.surface is not None and np.isfinite(total):
            total += self.surface.value(points)
        return total

    def excess(self, points: Field) -> float:
        """Largest distance of the boundary from the surface, in units of its bound."""
        return 0.0 if self.surface is None else self.surface.excess(points)

    def value_gradient_hessian(self, points: Field, emphasis: Emphasis) -> tuple[float, Field, BlockMatrix]:
        """Energy, gradient (n, 3), and the convex part of the Hessian; the matrix is reused by the next call."""
        gradient, matrix = np.zeros_like(points), self._matrix
        matrix.data[:] = 0.0
        total = self._sums(points, emphasis, gradient)
        if self.surface is not None:
            total += self.surface.add(points, gradient, matrix)
        return total, gradient, matrix

    def _sums(self, points: Field, emphasis: Emphasis, gradient: Field | None) -> float:
        derivatives = gradient is not None
        where = (derivatives, *((gradient, self._matrix.data, self._places) if derivatives else _NOTHING))
        weights = emphasis.eps, emphasis.shape, emphasis.angle, emphasis.stiffness
        total = float(corner_sums(points, self.cells, _TABLE, self.inverses, *weights, *where))
        if emphasis.size > 0.0 and len(self.sizes):
            total += float(size_sums(points, self.cells, self.sizes, emphasis.size * self.firmness, *where))
        return total

    def surface_force(self, points: Field) -> tuple[float, Field]:
        """What keeps the boundary near the surface alone: its energy and gradient (n, 3)."""
        gradient = np.zeros_like(points)
        return 0.0 if self.surface is None else self.surface.add(points, gradient, self._matrix), gradient

    def measures(self, points: Field) -> Measures:
        """Figures of every cell, as the energy sees it."""
        columns = np.empty((3, len(self.cells)))
        parallel_ranges(corner_densities, len(self.cells), points, self.cells, _TABLE, self.inverses, *columns)
        return Measures(*columns)

    @cached_property
    def free(self) -> Mask:
        """(n,) nodes that can move at all."""
        return np.asarray(self.projectors.any(axis=(1, 2)))

    @cached_property
    def inner(self) -> Mask:
        """(n,) nodes inside the mesh that can move in all directions."""
        inner = (self.projectors == np.eye(3)).all(axis=(1, 2))
        inner[boundary_quads(self.cells)[0]] = False
        return np.asarray(inner)

    def restricted(self, moving: Mask, points: Field) -> tuple[Shaping, Ints]:
        """The same energy with only some nodes moving: the patch's own problem, and its nodes' ids here."""
        moving = moving & self.free
        around = np.flatnonzero(moving[self.cells].any(axis=1))
        nodes = np.unique(self.cells[around])
        local = np.full(len(moving), -1)
        local[nodes] = np.arange(len(nodes))
        patch = Shaping(
            local[self.cells[around]],
            self.inverses[around] if len(self.inverses) > 1 else self.inverses,
            np.where(moving[nodes, None, None], self.projectors[nodes], 0.0),
            None if self.surface is None else self.surface.restricted(nodes, moving, points),
            self.sizes[around] if len(self.sizes) else self.sizes,
            self.firmness,
            min(self.grain, PATCH),
        )
        return patch, nodes


def rings(cells: Ints, count: int, cores: Mask, width: int) -> Mask:
    """(count,) nodes of the cells in a mask (m,), grown by rings of cells."""
    nodes = np.zeros(count, dtype=bool)
    nodes[cells[cores]] = True
    for _ in range(width):
        nodes[cells[nodes[cells].any(axis=1)]] = True
    return nodes


def newton_step(
    problem: Shaping, points: Field, emphasis: Emphasis, shift: float, accept: Callable[[Field], bool]
) -> tuple[Field, float, float, float] | None:
    """One truncated Newton step with the convex Hessian: new points, energy before and after, length.

    None where no step lowers the energy acceptably.
    """
    energy, gradient, matrix = problem.value_gradient_hessian(points, emphasis)
    direction, _ = matrix.solve(-gradient, problem.projectors, _SOLVE, _SOLVE_ITERATIONS, shift)
    if problem.grain > 0.0:
        grains = rounded(direction, points, problem.cells, problem.grain)
        direction = np.einsum("nij,nj->ni", problem.projectors, grains)
    slope = float(np.einsum("ij,ij->", gradient, direction))
    step = 1.0
    for _ in range(_HALVINGS):
        trial = points + step * direction
        value = problem.value(trial, emphasis)
        if value <= energy + _ARMIJO * step * slope and accept(trial):
            return trial, energy, value, step
        step *= 0.5
    return None


def next_shift(shift: float, step: float) -> float:
    """More of the diagonal after short steps, less after long ones."""
    low, high = _CURVATURE
    return min(high, 4 * shift) if step < 0.3 else max(low, shift / 4)


def projected_newton(
    problem: Shaping, points: Field, emphasis: Emphasis, decrease: float = 1e-3
) -> Iterator[tuple[Field, float]]:
    """Newton's method with the convex Hessian and truncated solves; yields points and energy of every step.

    Ends where two steps in a row lower the energy by less than the given fraction, or no step lowers it. A cell
    that is valid everywhere (Bernstein) stays so.
    """
    valid = is_valid(points, problem.cells)
    shift, slow = _CURVATURE[0], 0

    def keeps_valid(trial: Field) -> bool:
        return bool(is_valid(trial, problem.cells)[valid].all())

    while slow < 2:
        step = newton_step(problem, points, emphasis, shift, keeps_valid)
        if step is None:
            return
        points, before, after, length = step
        if not valid.all():
            valid |= is_valid(points, problem.cells)
        yield points, after
        shift = next_shift(shift, length)
        slow = slow + 1 if before - after <= decrease * abs(before) else 0
