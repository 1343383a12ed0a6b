"""The mesh of a deck: instances in their places, cells by type, sets by name."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from ....mesh import NodePairs
from ...format_tools.meshio_internals import cell_block
from .deck import Deck
from .members import Cells, Member, members_of
from .named_sets import NamedSets
from .statements import (
    Coupling,
    Find,
    LabelIndex,
    WorkLimit,
    pairs_of,
)

__all__ = ["DeckMesh", "mesh_of"]

Ints = NDArray[np.int64]

_REPEATS, _FREE = 50, 20_000_000  # members of sets, per character of the deck; and those that are no matter


@dataclass(frozen=True, eq=False)
class DeckMesh:
    """The mesh of a deck.

    Attributes
    ----------
    mesh
        A meshio.Mesh.
    node_labels, cell_labels
        What the deck calls its nodes and cells.
    type_names
        (m,) what it calls the types of these.
    sections
        Names of the sets to which sections give a material.
    held
        (k,) nodes of elements that are set aside.
    face_sets
        (k, 4) the faces of surfaces, by name.
    coupled_pairs
        Pairs of nodes that move together.
    """

    mesh: Any
    node_labels: NDArray[Any]
    cell_labels: NDArray[Any]
    type_names: NDArray[np.str_]
    sections: tuple[str, ...]
    held: Ints
    face_sets: dict[str, Ints]
    coupled_pairs: tuple[NodePairs, ...] = ()


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
    cells = Cells(members, node_indices)
    if starts[-1] == 0 or not cells.types:
        raise ReadError("the deck holds no nodes, or no elements of a known type")
    limit = WorkLimit(_REPEATS * length + _FREE, "the members of all sets together")
    sets = NamedSets(members, node_indices, cells, limit)
    mesh = meshio.Mesh(
        np.concatenate([member.points for member in members]),
        [cell_block(name, nodes) for name, nodes in cells.nodes.items()],
        point_sets=sets.named("NSET"),
        cell_sets={name: cells.by_type(rows) for name, rows in sets.named("ELSET").items()},
    )
    node_labels = _labels(members, [member.labels for member in members])
    cell_labels = _labels([members[number] for number in cells.owners], cells.labels)
    in_cells = np.zeros(starts[-1], dtype=bool)
    for nodes in cells.nodes.values():
        in_cells[nodes] = True
    pairs = pairs_of(_couplings(members, node_indices, sets), in_cells)
    sections, held = sets.of_sections(), _held(members, node_indices)
    return DeckMesh(mesh, node_labels, cell_labels, cells.names, sections, held, sets.faces(), pairs)


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


def _couplings(members: list[Member], indices: list[LabelIndex], sets: NamedSets) -> Iterator[tuple[Coupling, Find]]:
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
