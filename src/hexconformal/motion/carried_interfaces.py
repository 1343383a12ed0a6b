"""Faces between regions of a mesh that moves: they go where the displacement of the boundary carries them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import NormalizedMesh
from ..solver import AdmissibleDirections
from .extension import Harmonic

__all__ = ["CarriedInterfaces"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


class CarriedInterfaces:
    """The nodes of interfaces, and their places for a displacement of the boundary: those of its harmonic extension.

    The extension is that of the initial mesh, so that a displacement alone tells where they are, not the way there.

    Parameters
    ----------
    normalized
        The mesh.
    admissible
        Directions nodes may go in; those whose displacement is given are held.
    moving
        Nodes whose displacement is given.
    interfaces
        See :class:`hexconformal.MeshMotion`.
    linear
        Whether all nodes are moved by an extension, those of interfaces among them: then none are left to be carried.
    tolerance
        Of the linear solver.

    Attributes
    ----------
    nodes
        (c,) ids of the nodes that are carried.
    notes
        What is kept, in words.
    """

    def __init__(
        self,
        normalized: NormalizedMesh,
        admissible: AdmissibleDirections,
        moving: Ints,
        interfaces: Any,
        linear: bool,
        tolerance: float,
    ) -> None:
        space, regions = normalized.space, normalized.regions(interfaces)
        quads = np.empty((0, 4), np.int64) if regions is None else normalized.interfaces_of(regions).quads
        on = np.zeros(len(normalized.points), dtype=bool)
        on[quads] = True
        on = space.joined(on)
        follow = on.copy()
        follow[moving] = False
        self.notes: tuple[str, ...] = ()
        faces = int(space.total(len(quads)))
        if faces:
            nodes, following = (int(space.total(space.own(one).sum())) for one in (on, follow))
            what = f"{regions}, {faces} faces between them move as the displacement is extended"
            self.notes = (f"interfaces: {what}: {nodes - following} of their nodes are given, {following} follow",)
        self.nodes: Ints = np.flatnonzero(follow & (not linear))
        self._start, self._moving = normalized.points, moving
        self._are_there = space.anywhere(len(self.nodes) > 0)
        if self._are_there:
            self._extension = Harmonic(normalized, admissible, tolerance)

    def places(self, prescribed: Field) -> Field:
        """(c, 3) places of the nodes, for displacements (k, 3) of the moving nodes from the initial mesh."""
        if not self._are_there:
            return np.empty((0, 3))
        field = np.zeros_like(self._start)
        field[self._moving] = prescribed
        return np.asarray((self._start + self._extension(field, self._start))[self.nodes])
