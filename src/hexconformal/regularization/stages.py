"""The stages of a run: unfold, lower the distortion, raise the worst cells; each yields steps as it goes."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import replace
from functools import cached_property
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..common import first_ids
from ..elements import corner_scaled_jacobian
from ..energy import VOLUME_WEIGHT, CornerEnergy, Weights, inverse_targets, normalized_target, target_volumes
from ..geometry import DistanceBarrier
from ..mesh import NormalizedMesh
from ..quality import inside_out
from ..solver import MESH_ROUNDING, projected_newton
from .boundary import Boundary, boundary_of
from .improve_folded import improve_folded
from .minimize import Minimization
from .options import Options
from .step import Step
from .untangle import bring_back, folded, untangle
from .untangle_interior import unfold_inside
from .worst_cells import raise_worst, raise_worst_patches

__all__ = ["Stages"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_GOOD = 0.98  # smallest scaled Jacobian that needs no lifting
_WHOLE = 200_000  # cells up to which the whole mesh is lifted; beyond, patches around the worst cells
_PATIENCE = 1  # rounds of patches without success before other features are tried
_RETURNS, _RETURN_STEPS = 8, 8  # attempts to bring the boundary back into its band
_ROOMS = 0.05, 0.1, 0.2  # diagonals that the boundary may move to unfold what resists
_GENTLE = 12.5  # steepness of its way back
_WITHIN = 0.995  # share of the bound that leaves room for rounding
_FIRST_STEPS = 2  # on the whole distortion, before the angles take over
_FIRM = 25.0  # how much firmer sizes are that were asked for
_ALONE = 4.0  # weight of sizes beside the distortion alone
_FINE = 1e-6  # relative decrease at which the distortion alone is minimal


class Stages:
    """What a run does, in order; iterate to do it.

    Attributes
    ----------
    reason
        Why it stopped, in words.
    converged
        Whether that was a stopping criterion, not a limit.
    boundary
        How the boundary is kept; decided anew where cells cannot be unfolded.
    notes
        What the user should know about the outcome.
    problem
        The corner energy of all cells that are not folded, once there is one; None before, and where none is needed.
    wanted
        (m,) volumes that cells should have, in the user's unit, 0 for those without; empty for none at all.
    """

    def __init__(self, frame: NormalizedMesh, boundary: Boundary, options: Options) -> None:
        self.reason, self.converged = "interrupted", False
        self.notes: list[str] = []
        self.problem: CornerEnergy | None = None
        self._frame, self.boundary, self._options = frame, boundary, options
        self._hausdorff_needed = np.inf
        self.wanted = self._wanted_volumes()

    def __iter__(self) -> Iterator[Step]:
        yield Step("input", self._frame.points)
        left = most = self._options.max_iterations
        for step in islice(self._steps(), most):
            left -= 1
            yield step
        if left == 0:
            self.reason, self.converged = f"reached max_iterations = {most}", False

    def _steps(self) -> Iterator[Step]:
        points = self._frame.points
        plain = self._frame.valid.all() and self.boundary.band is None and not self._options.lifts
        plain = plain and not self._options.resizes
        if self._options.energy == "quaternionic" or plain:
            yield from self._minimize(points)
            return
        shaping, points = self._shaping(), self._frame.points
        bad = np.zeros(len(self._frame.cells), dtype=bool)
        if not self._frame.valid.all():
            shaping, points, bad = yield from self._untangle(shaping)
        if bad.any():
            whole, (shaping, points, bad) = shaping, self._without(shaping, points, bad)
            yield Step("hold what stays inverted", points)
        self.problem = shaping
        if bad.any() or self.boundary.band is not None or self._options.resizes:
            if self._options.of_minimization:
                self.notes.append(f"without effect on this mesh: {', '.join(self._options.of_minimization)}")
            for points, _ in self._shape(shaping, points):
                yield Step("shape", points)
            self.reason, self.converged = "the energy stalls", True
        else:
            for step in self._minimize(points):
                points = step.points
                yield step
        good = corner_scaled_jacobian(points, shaping.cells)
        if self._options.lifts and shaping.free.any() and len(good) and good.min() < _GOOD:
            self.reason, self.converged = "interrupted", False
            for phase, points, _ in (raise_worst if len(good) <= _WHOLE else raise_worst_patches)(shaping, points):
                yield Step(phase, points)
            self.reason, self.converged = "the worst cell stalls", True
        for step in self._return(shaping, points):
            points = step.points
            yield step
        unfolded = unfold_inside(shaping, points)
        if unfolded is not points:
            points = unfolded
            yield Step("unfold inside", points)
            for phase, points, _ in raise_worst_patches(shaping, points) if self._options.lifts else ():
                yield Step(phase, points)
            for step in self._return(shaping, points):
                points = step.points
                yield step
        if bad.any():
            yield Step("ease what stays inverted", improve_folded(whole, points, bad))

    def _untangle(self, shaping: CornerEnergy) -> Generator[Step, None, tuple[CornerEnergy, Field, Mask]]:
        """Unfold what is folded, with other features where that helps; returns the problem, points, what is left."""
        points = self._frame.points
        others = ("keep", "soft") if self.boundary.band is not None and self._options.features == "auto" else ()
        for phase, points, _ in untangle(shaping, points, *((_PATIENCE,) if others else ())):
            yield Step(phase, points)
        bad = folded(shaping, points)
        band = self.boundary.band
        for room in _ROOMS:
            if bad.any() and band is not None and band.reference is None and band.bound < room * self._frame.diagonal:
                shaping, points, bad = yield from self._from_afar(room, band, shaping, points, bad)
        for features in others:
            if not bad.any():
                break
            # What stands in the way may be a feature that is none, or a crease that was not taken for one.
            other = boundary_of(self._frame, replace(self._options, features=features))
            for phase, trial, _ in untangle(self._shaping(other), self._frame.points, _PATIENCE):
                yield Step(phase, trial)
            if folded(shaping, trial).sum() < bad.sum():
                points, bad = trial, folded(shaping, trial)
                self.boundary, shaping = other, self._shaping(other)
                self.notes.append(f"features={features!r} instead, which left fewer cells folded")
        points = unfold_inside(shaping, points)
        yield Step("unfold inside", points)
        return shaping, points, bad

    def _from_afar(
        self, room: float, band: DistanceBarrier, shaping: CornerEnergy, points: Field, bad: Mask
    ) -> Generator[Step, None, tuple[CornerEnergy, Field, Mask]]:
        """Unfold with more room for the boundary, then bring it back while every cell stays unfolded."""
        wide = self._shaping(replace(self.boundary, band=replace(band, bound=room * self._frame.diagonal)))
        afar = self._frame.points
        for step in untangle(wide, afar, _PATIENCE):
            afar = step[1]
            yield Step("untangle with more room", points)
        if folded(wide, afar).any():
            return shaping, points, bad
        before, closer = self.boundary, replace(band, steepness=_GENTLE)
        self.boundary = replace(before, band=closer)
        problem = self._shaping()
        for way_back in self._return(problem, afar):
            afar = way_back.points
            yield replace(way_back, points=points)
        needed = closer.relative_distance(afar)
        if needed <= _WITHIN:
            return problem, afar, folded(problem, afar)
        self.boundary = before
        self._hausdorff_needed = min(self._hausdorff_needed, needed * self._options.hausdorff)
        return shaping, points, bad

    def _return(self, shaping: CornerEnergy, points: Field) -> Iterator[Step]:
        """Bring samples back that a patch has let out of the band, with a steeper penalty each time."""
        band = self.boundary.band
        for _ in range(_RETURNS):
            if band is None or self._near(points):
                return
            band.steepness *= 4.0
            for points, _ in islice(projected_newton(shaping, points, Weights(volume=VOLUME_WEIGHT)), _RETURN_STEPS):
                yield Step("return to the surface", points)

    def energy(self, points: Field) -> float:
        """The summed distortion at some points, as the options ask for it; NaN where a corner is folded."""
        energy = self._from_input.energy(points)
        return energy if np.isfinite(energy) else float("nan")

    @cached_property
    def _from_input(self) -> Minimization:
        return Minimization(self._frame, self.boundary.admissible, self._options, self._frame.points)

    def _minimize(self, points: Field) -> Iterator[Step]:
        minimization = self._from_input
        if points is not self._frame.points:
            minimization = Minimization(self._frame, self.boundary.admissible, self._options, points)
        yield from minimization
        self.reason, self.converged = minimization.reason, minimization.converged

    def _shape(self, shaping: CornerEnergy, points: Field) -> Iterator[tuple[Field, float]]:
        """The whole distortion: a few steps before the lift, or until it is minimal, with other sizes too."""
        if self._options.lifts and not self._options.resizes:
            return islice(projected_newton(shaping, points, Weights(volume=VOLUME_WEIGHT)), _FIRST_STEPS)
        return projected_newton(shaping, points, Weights(volume=_ALONE), _FINE)

    def _shaping(self, boundary: Boundary | None = None) -> CornerEnergy:
        frame, boundary = self._frame, self.boundary if boundary is None else boundary
        inverses = inverse_targets(
            normalized_target(self._options.target, frame), frame.points, frame.cells, "corners", frame.cell_labels
        )
        return CornerEnergy(
            frame.cells,
            np.empty((0, 1, 3, 3)) if inverses is None else inverses,
            boundary.admissible.all_projectors(len(frame.points)),
            boundary.band,
            self.wanted / frame.unit**3,
            _FIRM if self._options.resizes else 1.0,
            MESH_ROUNDING if self._options.lifts and not self._options.resizes else 0.0,
        )

    def _without(self, shaping: CornerEnergy, points: Field, bad: Mask) -> tuple[CornerEnergy, Field, Mask]:
        """The rest of the mesh, where cells cannot be unfolded: these are held, the worst no worse than it was."""
        cells = np.flatnonzero(bad)
        held = ~shaping.free[shaping.cells[cells]]
        why = "all their nodes are held" if held.all() else "no way was found to unfold them as the boundary is kept"
        ids = first_ids(self._ids(bad), self._frame.mesh.cell_labels)
        self.notes.append(f"cells that cannot be unfolded: {ids}; {why}")
        quads = self._frame.quads
        found = inside_out(points, quads, np.flatnonzero(np.isin(quads, shaping.cells[cells]).any(axis=1)))
        if len(found):
            nodes = np.unique(self._frame.node_ids[quads[found]])
            ids = first_ids(nodes, self._frame.mesh.node_labels)
            self.notes.append(f"the surface is turned inside out at nodes {ids}: no valid mesh has it")
        if np.isfinite(self._hausdorff_needed):
            away = f"up to {self._hausdorff_needed:.2g} diagonals away"
            self.notes.append(f"with the boundary {away} all cells were unfolded: allow more (hausdorff)")
        points = bring_back(points, self._frame.points, shaping.cells, self._near)
        others = folded(shaping, points) & ~bad
        if others.any():
            ids = first_ids(self._ids(others), self._frame.mesh.cell_labels)
            self.notes.append(f"others around them stay inverted, so that the worst is no worse than it was: {ids}")
        bad = folded(shaping, points)
        projectors = shaping.projectors.copy()
        projectors[shaping.cells[bad]] = 0.0
        inverses = shaping.inverses[~bad] if len(shaping.inverses) > 1 else shaping.inverses
        volumes = shaping.target_volumes[~bad] if len(shaping.target_volumes) else shaping.target_volumes
        cells = np.ascontiguousarray(shaping.cells[~bad])
        rest = replace(shaping, cells=cells, inverses=inverses, projectors=projectors, target_volumes=volumes)
        return rest, points, bad

    def _ids(self, cells: Mask) -> Ints:
        """Their ids in the mesh."""
        return np.sort(self._frame.cell_ids[cells])

    def _wanted_volumes(self) -> Field:
        valid = np.empty_like(self._frame.valid)
        valid[self._frame.cell_ids] = self._frame.valid
        wanted = target_volumes(self._options.sizes, self._frame.mesh, valid)
        return wanted[self._frame.cell_ids] if len(wanted) else wanted

    def _near(self, points: Field) -> bool:
        """Whether the boundary is within its bound."""
        band = self.boundary.band
        return band is None or band.reference is not None or band.relative_distance(points) <= _WITHIN
