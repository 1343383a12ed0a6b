"""The stages of a run: untangle, lower the distortion, raise the worst cells; each yields iterations as it goes."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..common import first_ids
from ..elements import all_valid, corner_scaled_jacobian, is_valid
from ..energy import VOLUME_WEIGHT, CornerEnergy, Weights, inverse_targets, normalized_target, target_volumes
from ..geometry import DistanceBarrier
from ..mesh import NormalizedMesh
from ..quality import inside_out
from ..solver import MESH_ROUNDING, projected_newton
from .boundary import Boundary, boundary_of
from .improve_folded import improve_folded
from .iteration import Iteration
from .minimize import Minimization
from .options import Options
from .return_to_surface import return_to_surface
from .untangle import folded_cells, pull_back, untangle
from .untangle_interior import untangle_interior
from .worst_cells import raise_worst, raise_worst_patches

__all__ = ["Stages"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_GOOD_ENOUGH = 0.98  # smallest scaled Jacobian that need not be raised
_MANY_CELLS = 200_000  # cells up to which those of the whole mesh are raised; beyond, patches around the worst
_PATIENCE = 1  # rounds of patches without success before other features are tried
_WIDER_BOUNDS = 0.05, 0.1, 0.2  # diagonals that the boundary may move to unfold the cells that resist
_SHARES_BACK = np.linspace(0.1, 0.9, 9)  # of the way to earlier points within the bound
_RETURN_STEEPNESS = 12.5  # steepness of the barrier on the way back from there
_DISTORTION_STEPS = 2  # on the whole distortion, before the angles take over
_TARGET_SIZES_WEIGHT = 25.0  # weight of sizes that were asked for, beside those of the input
_SIZES_WEIGHT = 4.0  # weight of sizes beside the distortion, where the worst cells are not raised
_DECREASE = 1e-6  # relative decrease at which the distortion alone is minimal


class Stages:
    """The stages of a run in their order; iterate to run them.

    Attributes
    ----------
    reason
        Reason of its end, in words.
    converged
        True where that was a stopping criterion, not a limit.
    boundary
        Constraint and barrier of the boundary; decided anew where cells cannot be unfolded.
    notes
        Decisions and warnings, in words.
    corner_energy
        That of all cells that are not folded, once there is one; None before, and where none is needed.
    target_volumes
        (m,) volumes that cells should have, in the user's unit, 0 for those without; empty for none at all.
    """

    def __init__(self, normalized: NormalizedMesh, boundary: Boundary, options: Options) -> None:
        self.reason, self.converged = "interrupted", False
        self.notes: list[str] = []
        self.corner_energy: CornerEnergy | None = None
        self._normalized, self.boundary, self._options = normalized, boundary, options
        self._sufficient_hausdorff = np.inf
        self._earlier: list[Field] = []  # points to go back to where the surface cannot be brought back
        self.target_volumes = self._target_volumes()
        self._valid = np.flatnonzero(is_valid(normalized.mesh.points, normalized.mesh.cells))

    def __iter__(self) -> Iterator[Iteration]:
        kept = self._normalized.points
        yield Iteration("input", kept)
        left = most = self._options.max_iterations
        for iteration in islice(self._iterations(), most):
            left -= 1
            # The way out of a tangle may lead through cells that were valid: what is seen of it is what was before.
            if iteration.points is not kept and self.keeps_valid(iteration.points):
                kept = iteration.points
            yield iteration if iteration.points is kept else Iteration(iteration.phase, kept)
        if left == 0:
            self.reason, self.converged = f"reached max_iterations = {most}", False

    def keeps_valid(self, points: Field) -> bool:
        """True where every cell that is valid in the mesh as it came is so at these points."""
        return all_valid(self._normalized.to_user(points), self._normalized.mesh.cells, self._valid)

    def _iterations(self) -> Iterator[Iteration]:
        points = self._normalized.points
        keeps_surface = self._normalized.valid.all() and self.boundary.barrier is None
        distortion_alone = keeps_surface and not self._options.raises_worst and not self._options.changes_sizes
        if self._options.energy == "quaternionic" or distortion_alone:
            yield from self._minimize(points)
            return
        corner_energy = self._make_corner_energy()
        bad = np.zeros(len(self._normalized.cells), dtype=bool)
        if not self._normalized.valid.all():
            corner_energy, points, bad = yield from self._untangle(corner_energy)
        if bad.any():
            whole, (corner_energy, points, bad) = corner_energy, self._hold_folded(corner_energy, points, bad)
            yield Iteration("hold what stays inverted", points)
        self.corner_energy, self._earlier = corner_energy, [points]
        if bad.any() or self.boundary.barrier is not None or self._options.changes_sizes:
            if self._options.given_for_minimization:
                self.notes.append(f"without effect on this mesh: {', '.join(self._options.given_for_minimization)}")
            for points, _ in self._lower_distortion(corner_energy, points):
                yield Iteration("distortion", points)
            self.reason, self.converged = "the energy stalls", True
        else:
            for iteration in self._minimize(points):
                points = iteration.points
                yield iteration
        self._earlier.append(points)
        quality = corner_scaled_jacobian(points, corner_energy.cells)
        raised = self._options.raises_worst and corner_energy.free.any() and len(quality) > 0
        if raised and quality.min() < _GOOD_ENOUGH:
            self.reason, self.converged = "interrupted", False
            raise_cells = raise_worst if len(quality) <= _MANY_CELLS else raise_worst_patches
            for iteration in raise_cells(corner_energy, points):
                points = iteration.points
                yield iteration
            self.reason, self.converged = "the worst cell stalls", True
        for iteration in self._return_to_surface(corner_energy, points):
            points = iteration.points
            yield iteration
        unfolded = untangle_interior(corner_energy, points)
        if unfolded is not points:
            points = unfolded
            yield Iteration("untangle interior", points)
            for iteration in raise_worst_patches(corner_energy, points) if self._options.raises_worst else ():
                points = iteration.points
                yield iteration
            for iteration in self._return_to_surface(corner_energy, points):
                points = iteration.points
                yield iteration
        if bad.any():
            yield Iteration("improve what stays inverted", improve_folded(whole, points, bad))

    def _untangle(self, corner_energy: CornerEnergy) -> Generator[Iteration, None, tuple[CornerEnergy, Field, Mask]]:
        """Unfold what is folded, with other features where that helps; returns energy, points, folded cells."""
        points = self._normalized.points
        others = ("keep", "soft") if self.boundary.barrier is not None and self._options.features == "auto" else ()
        for iteration in untangle(corner_energy, points, *((_PATIENCE,) if others else ())):
            points = iteration.points
            yield iteration
        bad = folded_cells(corner_energy, points)
        barrier = self.boundary.barrier
        if barrier is not None and barrier.reference is None:
            for bound in (share * self._normalized.diagonal for share in _WIDER_BOUNDS):
                if bad.any() and barrier.bound < bound:
                    wide = replace(barrier, bound=bound)
                    found = yield from self._untangle_with_wider_bound(wide, barrier, corner_energy, points, bad)
                    corner_energy, points, bad = found
        for features in others:
            if not bad.any():
                break
            # What stands in the way may be a feature that is none, or a crease that was not taken for one.
            other = boundary_of(self._normalized, replace(self._options, features=features))
            for iteration in untangle(self._make_corner_energy(other), self._normalized.points, _PATIENCE):
                trial = iteration.points
                yield iteration
            if folded_cells(corner_energy, trial).sum() < bad.sum():
                points, bad = trial, folded_cells(corner_energy, trial)
                self.boundary, corner_energy = other, self._make_corner_energy(other)
                self.notes.append(f"features={features!r} instead, which left fewer cells folded")
        points = untangle_interior(corner_energy, points)
        yield Iteration("untangle interior", points)
        lost = self._normalized.valid & ~is_valid(points, corner_energy.cells)
        if lost.any() and not bad.any():
            points = pull_back(points, self._normalized.points, corner_energy.cells, self._within_bound)
            bad = folded_cells(corner_energy, points)
        return corner_energy, points, bad

    def _untangle_with_wider_bound(
        self, wide: DistanceBarrier, barrier: DistanceBarrier, corner_energy: CornerEnergy, points: Field, bad: Mask
    ) -> Generator[Iteration, None, tuple[CornerEnergy, Field, Mask]]:
        """Unfold with more room for the boundary, then bring it back while every cell stays unfolded."""
        wide_energy = self._make_corner_energy(replace(self.boundary, barrier=wide))
        afar = self._normalized.points
        for iteration in untangle(wide_energy, afar, _PATIENCE):
            afar = iteration.points
            yield Iteration("untangle with more room", points)
        if folded_cells(wide_energy, afar).any():
            return corner_energy, points, bad
        before, closer = self.boundary, replace(barrier, steepness=_RETURN_STEEPNESS)
        self.boundary = replace(before, barrier=closer)
        closer_energy = self._make_corner_energy()
        for closer_points in return_to_surface(closer_energy, closer, afar, keeps_worst=False):
            afar = closer_points
            yield Iteration("return to the surface", points)
        if not closer.exceeded(afar):
            return closer_energy, afar, folded_cells(closer_energy, afar)
        self.boundary = before
        self._sufficient_hausdorff = min(self._sufficient_hausdorff, closer.farthest(afar) * self._options.hausdorff)
        return corner_energy, points, bad

    def _return_to_surface(self, corner_energy: CornerEnergy, points: Field) -> Iterator[Iteration]:
        """Bring back what is out of its bound; with another surface to slide on that is told, not changed."""
        barrier = self.boundary.barrier
        if barrier is not None and barrier.reference is None:
            back = points
            for back in return_to_surface(corner_energy, barrier, points, self._options.raises_worst):
                yield Iteration("return to the surface", back)
            if barrier.exceeded(back):
                yield Iteration("return to the surface", self._towards_earlier(back))

    def _towards_earlier(self, points: Field) -> Field:
        """Points on the way back to the last ones within the bound: the first that are so, without spoiling a cell."""
        cells = self._normalized.cells
        valid = is_valid(points, cells)
        earlier = next((earlier for earlier in reversed(self._earlier) if self._within_bound(earlier)), points)
        for share in _SHARES_BACK:
            trial = points + share * (earlier - points)
            if self._within_bound(trial) and is_valid(trial, cells)[valid].all():
                return trial
        return earlier

    def brought_back(self, points: Field) -> Field:
        """The points with the boundary within its bound, as nearly as can be, where the run was left before it was."""
        barrier = copy(self.boundary.barrier)
        if barrier is None or barrier.reference is not None or self.corner_energy is None or self.converged:
            return points
        corner_energy = replace(self.corner_energy, surface_penalty=barrier)
        return [points, *return_to_surface(corner_energy, barrier, points, self._options.raises_worst)][-1]

    def energy(self, points: Field) -> float:
        """The summed distortion at some points, as the options ask for it; NaN where a corner is folded."""
        energy = self._from_input.energy(points)
        return energy if np.isfinite(energy) else float("nan")

    @cached_property
    def _from_input(self) -> Minimization:
        return Minimization(self._normalized, self.boundary.admissible, self._options, self._normalized.points)

    def _minimize(self, points: Field) -> Iterator[Iteration]:
        minimization = self._from_input
        if points is not self._normalized.points:
            minimization = Minimization(self._normalized, self.boundary.admissible, self._options, points)
        yield from minimization
        self.reason, self.converged = minimization.reason, minimization.converged

    def _lower_distortion(self, corner_energy: CornerEnergy, points: Field) -> Iterator[tuple[Field, float]]:
        """Lower the whole distortion: a few steps before the worst cells are raised, else until it is minimal."""
        if self._options.raises_worst and not self._options.changes_sizes:
            return islice(projected_newton(corner_energy, points, Weights(volume=VOLUME_WEIGHT)), _DISTORTION_STEPS)
        return projected_newton(corner_energy, points, Weights(volume=_SIZES_WEIGHT), _DECREASE)

    def _make_corner_energy(self, boundary: Boundary | None = None) -> CornerEnergy:
        normalized, boundary = self._normalized, self.boundary if boundary is None else boundary
        inverses = inverse_targets(
            normalized_target(self._options.target, normalized),
            normalized.points,
            normalized.cells,
            "corners",
            normalized.cell_labels,
        )
        return CornerEnergy(
            normalized.cells,
            np.empty((0, 1, 3, 3)) if inverses is None else inverses,
            boundary.admissible.all_projectors(len(normalized.points)),
            boundary.barrier,
            self.target_volumes / normalized.unit**3,
            _TARGET_SIZES_WEIGHT if self._options.changes_sizes else 1.0,
            MESH_ROUNDING if self._options.raises_worst and not self._options.changes_sizes else 0.0,
        )

    def _hold_folded(self, corner_energy: CornerEnergy, points: Field, bad: Mask) -> tuple[CornerEnergy, Field, Mask]:
        """The energy without the cells that cannot be unfolded: these are held, the worst no worse than it was."""
        cells = np.flatnonzero(bad)
        held = ~corner_energy.free[corner_energy.cells[cells]]
        why = "all their nodes are held" if held.all() else "no way was found to unfold them as the boundary is kept"
        mesh = self._normalized.mesh
        self.notes.append(f"cells that cannot be unfolded: {first_ids(self._ids(bad), mesh.cell_labels)}; {why}")
        quads = self._normalized.quads
        found = inside_out(points, quads, np.flatnonzero(np.isin(quads, corner_energy.cells[cells]).any(axis=1)))
        if len(found):
            nodes = np.unique(self._normalized.node_ids[quads[found]])
            ids = first_ids(nodes, mesh.node_labels)
            self.notes.append(f"the surface is turned inside out at nodes {ids}: no valid mesh has it")
        if np.isfinite(self._sufficient_hausdorff):
            away = f"up to {self._sufficient_hausdorff:.2g} diagonals away"
            self.notes.append(f"with the boundary {away} all cells were unfolded: allow more (hausdorff)")
        points = pull_back(points, self._normalized.points, corner_energy.cells, self._within_bound)
        others = folded_cells(corner_energy, points) & ~bad
        if others.any():
            ids = first_ids(self._ids(others), mesh.cell_labels)
            self.notes.append(
                f"others around them stay inverted, so that no valid cell is lost and the worst is no worse: {ids}"
            )
        bad = folded_cells(corner_energy, points)
        projectors = corner_energy.projectors.copy()
        projectors[corner_energy.cells[bad]] = 0.0
        inverses = corner_energy.inverses[~bad] if len(corner_energy.inverses) > 1 else corner_energy.inverses
        volumes = (
            corner_energy.target_volumes[~bad] if len(corner_energy.target_volumes) else corner_energy.target_volumes
        )
        cells = np.ascontiguousarray(corner_energy.cells[~bad])
        rest = replace(corner_energy, cells=cells, inverses=inverses, projectors=projectors, target_volumes=volumes)
        return rest, points, bad

    def _ids(self, cells: Mask) -> Ints:
        """Ids that cells have in the mesh."""
        return np.sort(self._normalized.cell_ids[cells])

    def _target_volumes(self) -> Field:
        valid = np.empty_like(self._normalized.valid)
        valid[self._normalized.cell_ids] = self._normalized.valid
        volumes = target_volumes(self._options.sizes, self._normalized.mesh, valid)
        return volumes[self._normalized.cell_ids] if len(volumes) else volumes

    def _within_bound(self, points: Field) -> bool:
        """True where the boundary is within its bound."""
        barrier = self.boundary.barrier
        return barrier is None or barrier.reference is not None or not barrier.exceeded(points)
