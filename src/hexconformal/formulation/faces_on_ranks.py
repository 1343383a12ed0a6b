"""The kept faces of a rank, and what it has of a surface that is made up of such faces of all ranks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..geometry import BilinearSurface, SurfaceLocator
from ..mesh import face_keys
from ..ranks import FacesBeside, GatheredCells, RankSpace, Routes

__all__ = ["FacesOnRanks", "SurfaceShare"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SurfaceShare:
    """What a rank has of a surface, and of others' faces around that.

    Attributes
    ----------
    numbers
        (f,) numbers that faces have in the surface: of own ones, ascending, then of others'.
    faces
        (f, 4) their nodes, in the order of the surface, in places of nodes here.
    ranks
        (f - own,) ranks that the others belong to.
    owners
        Rank that each face of the surface belongs to, on rank 0; empty elsewhere.
    """

    numbers: Ints
    faces: Ints
    ranks: Ints
    owners: Ints

    @property
    def own(self) -> int:
        """Number of own faces."""
        return len(self.numbers) - len(self.ranks)

    def places(self, numbers: Ints) -> Ints:
        """Where own faces with some numbers are among these."""
        return np.searchsorted(self.numbers[: self.own], numbers)

    def sheets(self, original: SurfaceLocator | BilinearSurface) -> Ints | None:
        """(f,) the sheets of faces of the surface; None where there is one."""
        return None if original.sheets is None else original.sheets[self.numbers]

    def surface(self, points: Field, original: SurfaceLocator | BilinearSurface) -> Any:
        """The faces as a surface with points (n, 3), cut as the original is; None where there are none."""
        if self.own == 0:
            return None
        if isinstance(original, SurfaceLocator):
            return SurfaceLocator(points, self.faces, self.sheets(original))
        return BilinearSurface(points, self.faces, original.parts[self.numbers], self.sheets(original))


@dataclass(frozen=True, eq=False)
class FacesOnRanks:
    """The kept faces of a rank, and where they are among those of all, which rank 0 has.

    Attributes
    ----------
    space
        Where fields live.
    quads
        (k, 4) own faces, in places of nodes here.
    beside
        Faces of others around them.
    layer
        The cells at kept faces of all ranks, which are on rank 0, with their nodes.
    """

    space: RankSpace
    quads: Ints
    beside: FacesBeside
    layer: GatheredCells

    def of_all(self) -> tuple[Ints, Ints]:
        """The faces of all ranks by the nodes of the layer, on rank 0, those of lower ranks first; all must call it.

        Besides, on all ranks, (p + 1,) the number among these of the first face of each rank.
        """
        counts = self.space.halo.comm.allgather(len(self.quads))
        return self.layer.places(self.quads), np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)

    def share(self, surface: Ints) -> SurfaceShare:
        """What each rank has of a surface (f, 4) of faces of all, which is on rank 0; all must call it.

        Parameters
        ----------
        surface
            By the nodes of the layer; none on other ranks.
        """
        comm, halo, own = self.space.halo.comm, self.space.halo, len(self.quads)
        every, firsts = self.of_all()
        # Faces are the same that have the same nodes, whichever comes first.
        keys = np.unique(face_keys(np.concatenate([every, surface])), axis=0, return_inverse=True)[1].ravel()
        place = np.empty(len(every) + len(surface), dtype=np.int64)
        place[keys[: len(every)]] = np.arange(len(every))
        place = place[keys[len(every) :]]
        numbers = np.full(len(every), -1)
        numbers[place] = np.arange(len(surface))
        nodes = np.full((len(every), 4), -1)
        nodes[place] = self.layer.numbers[surface]
        # Every rank asks for its faces, and for those around them.
        asked = np.concatenate([firsts[comm.rank] + np.arange(own), firsts[self.beside.ranks] + self.beside.places])
        routes = Routes(comm, np.zeros_like(asked))
        at = routes.forward(asked)
        found = routes.backward(np.column_stack([numbers[at], nodes[at]]))
        known = found[:, 0] >= 0
        order = np.argsort(found[:own, 0][known[:own]], kind="stable")
        found, ranks = found[known], self.beside.ranks[known[own:]]
        found[: len(order)] = found[order]
        owners = np.searchsorted(firsts, place, side="right") - 1
        return SurfaceShare(found[:, 0], halo.local(found[:, 1:]), ranks, owners)
