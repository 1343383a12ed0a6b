"""The parts of a deck whose nodes have labels of their own, and their cells by type."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .deck import Deck, ElementBlock, Instance, NodeBlock, Scope
from .statements import (
    LabelIndex,
    Placement,
)

__all__ = ["Cells", "Member", "members_of"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Member:
    """A part of the mesh whose nodes have labels of their own: an instance, the assembly, or the deck itself."""

    name: str
    scopes: tuple[Scope, ...]
    place: Placement
    instance: Instance | None = None

    @property
    def nodes(self) -> Iterator[NodeBlock]:
        """Blocks of nodes, in order."""
        return (block for scope in self.scopes for block in scope.nodes)

    @property
    def elements(self) -> Iterator[ElementBlock]:
        """Blocks of elements, in order."""
        return (block for scope in self.scopes for block in scope.elements)

    @cached_property
    def labels(self) -> Ints:
        """Of all its nodes."""
        return np.concatenate([np.empty(0, dtype=np.int64), *(block.labels for block in self.nodes)])

    @property
    def points(self) -> NDArray[np.float64]:
        """(n, 3) all its nodes, in their place."""
        parts = [self.place.apply(block.system.to_points(block.coordinates)) for block in self.nodes]
        return np.concatenate([np.empty((0, 3)), *parts])


def members_of(deck: Deck) -> list[Member]:
    """The members of a deck in the order of the mesh's points: the deck itself, instances, the assembly.

    Parts without an assembly stand for themselves.
    """
    members = [Member("", (deck.root,), Placement())]
    if deck.instances:
        members += [Member(i.own.name, (i.part, i.own), i.place, i) for i in deck.instances]
    else:
        members += [Member(part.name, (part,), Placement()) for part in deck.parts.values()]
    return [*members, Member("", (deck.assembly,), Placement())]


class Cells:
    """Cells grouped by type, in the order in which types come first.

    Attributes
    ----------
    nodes
        Rows (k, w) of the nodes of all cells of a type.
    labels, owners
        Labels of cells, and the number of the member that these belong to, piece by piece in the order of the mesh.
    names
        (m,) what the deck calls the types of all cells, in the order of the mesh.
    indices
        For each member its cells by their labels.
    """

    def __init__(self, members: list[Member], node_indices: list[LabelIndex]) -> None:
        pieces = [
            (block.cell_type, number, block.labels, node_indices[number].of_all(block.nodes), block.name)
            for number, member in enumerate(members)
            for block in member.elements
            if len(block.labels)
        ]
        self.types = list(dict.fromkeys(piece[0] for piece in pieces))
        place = {cell_type: rank for rank, cell_type in enumerate(self.types)}
        pieces.sort(key=lambda piece: place[piece[0]])
        by_type: dict[str, list[Ints]] = {cell_type: [] for cell_type in self.types}
        for cell_type, _, _, nodes, _ in pieces:
            by_type[cell_type].append(nodes)
        self.nodes = {cell_type: np.concatenate(parts) for cell_type, parts in by_type.items()}
        self.owners = [piece[1] for piece in pieces]
        self.labels = [piece[2] for piece in pieces]
        self.names = np.repeat([piece[4] for piece in pieces], [len(piece[2]) for piece in pieces])
        ends = np.cumsum([0, *(len(labels) for labels in self.labels)])
        found: list[list[tuple[Ints, Ints]]] = [[] for _ in members]
        for owner, labels, start in zip(self.owners, self.labels, ends[:-1].tolist(), strict=True):
            found[owner].append((labels, start + np.arange(len(labels))))
        self.indices = [_index(parts, "elements") for parts in found]
        self._ends = np.cumsum([len(nodes) for nodes in self.nodes.values()])

    def by_type(self, rows: Ints) -> list[Ints]:
        """Sorted rows among all cells, as rows among those of each type."""
        parts = np.split(rows, np.searchsorted(rows, self._ends[:-1]))
        return [part - start for part, start in zip(parts, [0, *self._ends[:-1].tolist()], strict=True)]

    def nodes_of(self, rows: Ints) -> Ints:
        """Nodes of sorted rows among all cells."""
        parts = zip(self.nodes.values(), self.by_type(rows), strict=True)
        return np.concatenate([np.empty(0, dtype=np.int64), *(nodes[part].ravel() for nodes, part in parts)])


def _index(parts: list[tuple[Ints, Ints]], what: str) -> LabelIndex:
    none = np.empty(0, dtype=np.int64)
    labels, rows = ([none, *(part[column] for part in parts)] for column in (0, 1))
    return LabelIndex(np.concatenate(labels), np.concatenate(rows), what)
