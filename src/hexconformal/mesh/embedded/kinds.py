"""Faces or edges of hexahedra that cells and sets of a file stand for, and which of them belong together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..carried_cells import CarriedCells, telling_tags
from .row_matching import parts_within, same_rows

__all__ = ["Classified", "classify"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Classified:
    """Faces or edges, and which of them belong together.

    Attributes
    ----------
    inner
        (k, j) those found that are not among the known ones.
    known_kinds, inner_kinds
        (q,) and (k,) kinds: those of the same kind have the same tag and are in the same sets; 0 is in none.
    tags, known_tags
        Name of the array that tells known ones apart, "" if none does, and its values (q,), -1 where it has none.
    carried_places
        For each carried cell its place among the known ones and then the inner ones, -1 if it is none of them.
    set_places
        The same for each set.
    """

    inner: Ints
    known_kinds: Ints
    inner_kinds: Ints
    tags: str
    known_tags: Ints
    carried_places: Ints
    set_places: Mapping[str, Ints]


def classify(
    cells: Ints, parts: Ints, known: Ints, count: int, carried: CarriedCells, sets: Mapping[str, Ints]
) -> Classified:
    """Find the faces or edges that carried cells and sets are, and refine these until each is in one kind.

    Parameters
    ----------
    cells
        (m, 8) hexahedra.
    parts
        (p, j) corners of a cell that make up each of its faces, or edges.
    known
        (q, j) those that come first: the boundary quads.
    count
        Number of nodes.
    carried
        Cells with j corners.
    sets
        Rows of j nodes by name.

    Examples
    --------
    >>> from hexconformal.elements import EDGES
    >>> lines = CarriedCells(np.array([[1, 0], [0, 2]]))
    >>> rim, none = np.array([[0, 1], [0, 4]]), np.empty((0, 2), int)
    >>> found = classify(np.arange(8)[None], EDGES, none, 8, lines, {"rim": rim})
    >>> found.inner.tolist(), found.inner_kinds, found.carried_places
    ([[0, 1], [0, 4]], array([2, 1]), array([ 0, -1]))
    """
    lengths = [len(carried.nodes), *map(len, sets.values())]
    rows = np.concatenate([carried.nodes, *sets.values()])
    places, inner = _located(cells, parts, known, count, rows)
    own, *others = np.split(places, np.cumsum(lengths)[:-1])
    kinds = _Refinement(len(known) + len(inner))
    first, last = len(known), len(known) + len(inner)
    tags, known_tags = "", np.full(first, -1, dtype=np.int64)
    for start, stop in ((0, first), (first, last)):
        mine = np.flatnonzero((own >= start) & (own < stop))
        found = telling_tags(carried, mine)
        kinds.split(own[mine])
        if found is not None:
            if stop == first:
                tags, known_tags[own[mine]] = found
            kinds.split_by(own[mine], found[1])
    for mask in carried.sets.values():
        kinds.split(own[mask])
    for other in others:
        kinds.split(other)
    of_sets = dict(zip(sets, others, strict=True))
    return Classified(inner, kinds.within(0, first), kinds.within(first, last), tags, known_tags, own, of_sets)


class _Refinement:
    """Elements split by the sets that they are in."""

    def __init__(self, count: int) -> None:
        self._labels = np.zeros(count, dtype=np.int64)
        self._next = 1

    def split(self, places: Ints) -> None:
        """Tell apart those in a set; -1 is none."""
        places = np.unique(places[places >= 0])
        old, labels = np.unique(self._labels[places], return_inverse=True)
        self._labels[places] = self._next + labels.ravel()
        self._next += len(old)

    def split_by(self, places: Ints, values: Ints) -> None:
        """Tell apart those of every value."""
        order = np.argsort(values, kind="stable")
        for part in np.split(places[order], np.flatnonzero(np.diff(values[order])) + 1):
            self.split(part)

    def within(self, start: int, stop: int) -> Ints:
        """The kinds in a range, numbered from 1 on; 0 stays what is in no set."""
        labels = np.append(self._labels[start:stop], 0)
        return np.asarray(np.unique(labels, return_inverse=True)[1].ravel()[:-1], dtype=np.int64)


def _located(cells: Ints, parts: Ints, known: Ints, count: int, rows: Ints) -> tuple[Ints, Ints]:
    """Places of rows of nodes among the known ones and those (k, j) found in the cells, and the latter."""
    places = np.full(len(rows), -1, dtype=np.int64)
    asked = np.flatnonzero(((rows >= 0) & (rows < count)).all(axis=1))
    if len(asked) == 0:
        return places, np.empty((0, parts.shape[1]), dtype=np.int64)
    first = same_rows(np.concatenate([known, rows[asked]]))[len(known) :]
    is_known = first < len(known)
    places[asked[is_known]] = first[is_known]
    asked = asked[~is_known]
    inside = np.zeros(count, dtype=bool)
    inside[rows[asked]] = True
    found = parts_within(cells, parts, inside) if len(asked) else np.empty((0, parts.shape[1]), dtype=np.int64)
    first = same_rows(np.concatenate([found, rows[asked]]))[len(found) :]
    is_found = first < len(found)
    inner = np.unique(first[is_found])
    places[asked[is_found]] = len(known) + np.searchsorted(inner, first[is_found])
    return places, found[inner]
