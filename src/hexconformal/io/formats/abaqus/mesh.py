"""The mesh of a deck: instances in their places, cells by type, sets by name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from ....mesh import NodePairs
from .couplings import Coupling, Find, pairs_of
from .deck import Deck, ElementBlock, Instance, NodeBlock, Scope
from .sets import LabelIndex, SetKey, SetMember, WorkLimit, resolve
from .systems import Placement

__all__ = ["DeckMesh", "Member", "members_of", "mesh_of"]

Ints = NDArray[np.int64]

_REPEATS, _FREE = 50, 20_000_000  # members of sets, per character of the deck; and those that are no matter


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


@dataclass(frozen=True, eq=False)
class DeckMesh:
    """A meshio.Mesh, what the deck calls its nodes and cells, nodes (k,) of elements set aside, and pairs coupled."""

    mesh: Any
    node_labels: NDArray[Any]
    cell_labels: NDArray[Any]
    held: Ints
    coupled_pairs: tuple[NodePairs, ...] = ()


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


def mesh_of(deck: Deck, length: int) -> DeckMesh:
    """Put the mesh of a deck together.

    Parameters
    ----------
    deck
        The deck.
    length
        How many characters it has, which limits what its sets may hold.

    Raises
    ------
    ReadError
        If there is nothing in it, labels are there twice or missing, or sets refer to none, or to themselves.
    """
    import meshio

    members = members_of(deck)
    counts = [len(member.labels) for member in members]
    starts = np.cumsum([0, *counts])
    node_indices = [
        LabelIndex(member.labels, start + np.arange(count), "nodes")
        for member, start, count in zip(members, starts[:-1].tolist(), counts, strict=True)
    ]
    cells = _Cells(members, node_indices)
    if starts[-1] == 0 or not cells.types:
        raise ReadError("the deck holds no nodes, or no elements of a known type")
    limit = WorkLimit(_REPEATS * length + _FREE, "the members of all sets together")
    sets = _Sets(members, node_indices, cells, limit)
    mesh = meshio.Mesh(
        np.concatenate([member.points for member in members]),
        list(cells.nodes.items()),
        point_sets=sets.named("NSET"),
        cell_sets={name: cells.by_type(rows) for name, rows in sets.named("ELSET").items()},
    )
    node_labels = _labels(members, [member.labels for member in members])
    cell_labels = _labels([members[number] for number in cells.owners], cells.labels)
    in_cells = np.zeros(starts[-1], dtype=bool)
    for nodes in cells.nodes.values():
        in_cells[nodes] = True
    pairs = pairs_of(_couplings(members, node_indices, sets), in_cells)
    return DeckMesh(mesh, node_labels, cell_labels, _held(members, node_indices), pairs)


class _Cells:
    """Cells grouped by type, in the order in which types come first.

    Attributes
    ----------
    nodes
        Rows (k, w) of the nodes of all cells of a type.
    labels, owners
        Labels of cells, and the number of the member that these belong to, piece by piece in the order of the mesh.
    indices
        For each member its cells by their labels.
    """

    def __init__(self, members: list[Member], node_indices: list[LabelIndex]) -> None:
        pieces = [
            (block.cell_type, number, block.labels, node_indices[number].of_all(block.nodes))
            for number, member in enumerate(members)
            for block in member.elements
            if len(block.labels)
        ]
        self.types = list(dict.fromkeys(piece[0] for piece in pieces))
        place = {cell_type: rank for rank, cell_type in enumerate(self.types)}
        pieces.sort(key=lambda piece: place[piece[0]])
        by_type: dict[str, list[Ints]] = {cell_type: [] for cell_type in self.types}
        for cell_type, _, _, nodes in pieces:
            by_type[cell_type].append(nodes)
        self.nodes = {cell_type: np.concatenate(parts) for cell_type, parts in by_type.items()}
        self.owners = [piece[1] for piece in pieces]
        self.labels = [piece[2] for piece in pieces]
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


class _Sets:
    """The sets of all members; one of an instance is called by its own name if no other has it."""

    def __init__(self, members: list[Member], nodes: list[LabelIndex], cells: _Cells, limit: WorkLimit) -> None:
        self._nodes, self._cells, self._limit = nodes, cells, limit
        self._by_name = {member.name.upper(): number for number, member in enumerate(members) if member.name}
        self._members: dict[SetKey, list[SetMember]] = {}
        self._names: dict[SetKey, str] = {}
        for number, member in enumerate(members):
            for scope in member.scopes:
                for (kind, key), listed in scope.sets.items():
                    self._members.setdefault((number, kind, key), []).extend(listed)
                    self._names[number, kind, key] = scope.set_names[kind, key]
        self._owner_names = [member.name for member in members]
        self._rows = resolve(self._members, self._references, self._combine)

    def named(self, kind: str) -> dict[str, Ints]:
        """Rows of the sets of a kind, by name."""
        keys = [key for key in self._members if key[1] == kind]
        uses: dict[str, int] = {}
        for _, _, name in keys:
            uses[name] = uses.get(name, 0) + 1
        result = {}
        for key in keys:
            number, _, name = key
            owner = self._owner_names[number]
            result[f"{owner}.{self._names[key]}" if owner and uses[name] > 1 else self._names[key]] = self._rows[key]
        return result

    def single(self, number: int, name: str) -> int | None:
        """The node of a set of it alone, by its name in a member; None if there is none."""
        instance, dot, rest = name.rpartition(".")
        place = self._by_name.get(instance.upper()) if dot else number
        rows = self._rows.get((number if place is None else place, "NSET", (rest if dot else name).upper()))
        return int(rows[0]) if rows is not None and len(rows) == 1 else None

    def _places(self, number: int, member: SetMember) -> list[int]:
        """Numbers of the members in which names are looked for."""
        if not member.instance:
            return [number]
        if member.instance.upper() not in self._by_name:
            raise ReadError(f"a set is of the instance {member.instance!r}, which is not there")
        return [self._by_name[member.instance.upper()], number]

    def _key(self, number: int, kind: str, name: str, member: SetMember) -> SetKey | None:
        """The set that a name in another set means; None if it means a label."""
        instance, dot, rest = name.partition(".")
        places = self._places(number, member)
        if dot and instance.upper() in self._by_name:
            if rest.isdecimal():
                return None
            places, name = [self._by_name[instance.upper()]], rest
        for place in places:
            if (place, kind, name.upper()) in self._members:
                return (place, kind, name.upper())
        raise ReadError(f"a set refers to {name!r}, which is not a set")

    def _references(self, key: SetKey) -> list[SetKey]:
        number, kind, _ = key
        found = []
        for member in self._members[key]:
            found += [self._key(number, kind, name, member) for name in member.names]
            if member.elements:
                found.append(self._key(number, "ELSET", member.elements, member))
        return [other for other in dict.fromkeys(found) if other is not None]

    def _combine(self, key: SetKey, others: list[Ints]) -> Ints:
        number, kind, _ = key
        indices = self._nodes if kind == "NSET" else self._cells.indices
        parts = [np.empty(0, dtype=np.int64)]
        for other, rows in zip(self._references(key), others, strict=True):
            parts.append(self._cells.nodes_of(rows) if other[1] != kind else rows)
        for member in self._members[key]:
            index = indices[self._places(number, member)[0]]
            parts += [index.of_present(member.labels), index.of_ranges(member.ranges, self._limit)]
            for name in member.names:
                if self._key(number, kind, name, member) is None:
                    instance, _, label = name.partition(".")
                    parts.append(indices[self._by_name[instance.upper()]].of_present(np.array([int(label)])))
        self._limit.spend(sum(len(part) for part in parts))
        return np.unique(np.concatenate(parts))


def _labels(owners: list[Member], parts: list[Ints]) -> NDArray[Any]:
    """Labels as they are if none is there twice, otherwise after the name of the instance."""
    labels = np.concatenate([np.empty(0, dtype=np.int64), *parts])
    if len(np.unique(labels)) == len(labels):
        return labels
    names = [
        f"{owner.name}.{label}" if owner.name else str(label)
        for owner, part in zip(owners, parts, strict=True)
        for label in part.tolist()
    ]
    return np.array(names)


def _held(members: list[Member], indices: list[LabelIndex]) -> Ints:
    """Rows of the nodes of elements that are set aside."""
    by_name = {member.name.upper(): index for member, index in zip(members, indices, strict=True) if member.name}
    parts = [np.empty(0, dtype=np.int64)]
    for member, own in zip(members, indices, strict=True):
        labels: dict[str, list[int]] = {}
        for text in (text for scope in member.scopes for text in scope.held):
            instance, dot, label = text.rpartition(".")
            if label.isdecimal() and (not dot or instance.upper() in by_name):
                labels.setdefault(instance.upper(), []).append(int(label))
        for instance, numbers in labels.items():
            index = by_name[instance] if instance else own
            parts.append(index.of_present(np.array(numbers, dtype=np.int64)))
    return np.unique(np.concatenate(parts))


def _couplings(members: list[Member], indices: list[LabelIndex], sets: _Sets) -> Iterator[tuple[Coupling, Find]]:
    """The couplings of all members, and how nodes are found by their names there."""
    by_name = {member.name.upper(): index for member, index in zip(members, indices, strict=True) if member.name}

    def finder(number: int) -> Find:
        def find(name: str) -> int | None:
            instance, dot, label = name.strip('"').rpartition(".")
            index = by_name.get(instance.upper()) if dot else indices[number]
            if not label.isdecimal() or index is None:
                return sets.single(number, name.strip('"'))
            rows = index.of_present(np.array([int(label)]))
            return int(rows[0]) if len(rows) else None

        return find

    for number, member in enumerate(members):
        for scope in member.scopes:
            for coupling in scope.couplings:
                yield coupling, finder(number)
