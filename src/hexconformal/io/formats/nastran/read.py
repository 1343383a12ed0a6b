"""Decks into a meshio.Mesh, and the positions of their nodes."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError, first_ids
from ...format_tools.meshio_files import checked_contents, parsing, permuted_nodes
from ...format_tools.meshio_internals import cell_block
from ...source_file import FileContents, SourceFile
from .cards import Card, bulk_cards
from .elements import COUPLING_CARDS, ELEMENTS, NODE_ORDERS, UNSUPPORTED_SOLIDS
from .reals import parse_real
from .systems import CoordinateSystems

__all__ = ["Nodes", "read"]

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

_SOLIDS = ("CHEXA", "CPENTA", "CPYRAM", "CPYRA", "CTETRA")


def read(path: Path) -> FileContents:
    """Read a deck. BEGIN BULK may be missing, as in what Gmsh writes, and in files to include."""
    with parsing("nastran") as output:
        text = path.read_bytes().decode("utf-8", "surrogateescape")
        cards = list(bulk_cards(text))
        if not cards:
            raise ReadError("there is no bulk data in it")
        nodes = Nodes(cards)
        mesh, labels, notes = _mesh(cards, nodes)
    others = Counter(card.name for card in cards if card.name not in ELEMENTS and card.name != "GRID")
    model = tuple(f"{count} {name}" for name, count in others.items())
    file = SourceFile(path, "nastran", text=text, node_labels=nodes.labels, cell_labels=labels, model=model)
    return FileContents(checked_contents(mesh, file, output).data, file, tuple(notes), _held(cards, nodes.labels))


@dataclass(frozen=True)
class _Element:
    kind: str
    label: int
    reference: int
    nodes: list[int]


class Nodes:
    """The nodes of a deck.

    Attributes
    ----------
    cards
        Their GRID cards.
    labels
        (n,) their numbers.
    local
        (n, 3) coordinates as they are written.
    systems, of_system
        The systems of coordinates, and (n,) the one of each node.
    """

    def __init__(self, cards: list[Card]) -> None:
        defaults = [card.integer(1, 0) for card in cards if card.name == "GRDSET"]
        self.cards = [card for card in cards if card.name == "GRID"]
        default = defaults[0] if defaults else 0
        self.labels = np.array([card.integer(0) for card in self.cards], dtype=np.int64)
        self.of_system = np.array([card.integer(1, default) for card in self.cards], dtype=np.int64)
        rows = [[parse_real(text) for text in card.fields[2:5]] for card in self.cards]
        self.local = np.array([row + [0.0] * (3 - len(row)) for row in rows], dtype=np.float64).reshape(-1, 3)
        self.systems = CoordinateSystems(cards)
        values, counts = np.unique(self.labels, return_counts=True)
        if (counts > 1).any():
            raise ReadError(f"nodes numbered twice: {first_ids(values[counts > 1])}")

    def points(self, local: Floats) -> Floats:
        """(n, 3) positions of the nodes with these coordinates."""
        result = local.copy()
        for number in np.unique(self.of_system).tolist():
            if number:
                mine = self.of_system == number
                result[mine] = self.systems[number].to_basic(local[mine])
        return result

    def coordinates(self, points: Floats) -> Floats:
        """(n, 3) coordinates, as they are written, of nodes in these positions."""
        result = points.copy()
        for number in np.unique(self.of_system).tolist():
            if number:
                mine = self.of_system == number
                result[mine] = self.systems[number].from_basic(points[mine], self.local[mine])
        return result


def _mesh(cards: list[Card], nodes: Nodes) -> tuple[Any, Ints, list[str]]:
    """The mesh, the numbers of its elements, and remarks."""
    import meshio

    unsupported = Counter(card.name for card in cards if card.name.startswith(UNSUPPORTED_SOLIDS))
    if unsupported:
        raise ReadError(f"solid elements that are not supported: {_counts(unsupported)}")
    elements: list[_Element] = []
    aside: Counter[str] = Counter()
    by_corners: Counter[str] = Counter()
    for card in cards:
        if card.name in ELEMENTS:
            element = _element(card, by_corners)
            if element is None:
                aside[card.name] += 1
            else:
                elements.append(element)
        elif card.name.startswith(COUPLING_CARDS):
            aside[card.name] += 1
    if not elements or not len(nodes.labels):
        raise ReadError("the deck holds no nodes, or no elements of a known type")
    notes = (
        [f"elements taken by their corners: {_counts(by_corners)}; a deck with the same cells keeps them"]
        if by_corners
        else []
    )
    if aside:
        notes.append(f"set aside, their nodes held: {_counts(aside)}; a deck with the same cells keeps them")
    defined = Counter(card.name for card in cards if card.name.startswith("CORD1"))
    if defined:
        notes.append(f"nodes that define coordinate systems are held: {_counts(defined)}")
    starts = [k for k, one in enumerate(elements) if k == 0 or one.kind != elements[k - 1].kind]
    runs = [elements[start:end] for start, end in zip(starts, [*starts[1:], len(elements)], strict=True)]
    blocks = [(run[0].kind, _places(nodes.labels, np.array([one.nodes for one in run], np.int64))) for run in runs]
    references = [np.array([one.reference for one in run], dtype=np.int64) for run in runs]
    cells = permuted_nodes([cell_block(*block) for block in blocks], NODE_ORDERS)
    mesh = meshio.Mesh(nodes.points(nodes.local), cells, cell_data={"nastran:ref": references})
    return mesh, np.array([one.label for one in elements], dtype=np.int64), notes


def _element(card: Card, by_corners: Counter[str]) -> _Element | None:
    """The element of a card; None if it is at a single node."""
    shape = ELEMENTS[card.name]
    most, corners = max(shape.types), min(shape.types)
    numbers = [card.integer(place, 0) for place in range(shape.first, shape.first + most)]
    given = [number for number in numbers if number]
    if card.name in _SOLIDS:  # with more than any type has, as Gmsh writes those of 27, it is none of these
        given += [0 for text in card.fields[shape.first + most :] if text.strip()]
    if 0 in numbers[:corners]:
        if corners == 2:
            return None
        raise ReadError(f"line {card.lines[0][0] + 1}: {card.name} {card.fields[0]} has too few nodes")
    kind = shape.types.get(len(given))
    if kind is None and card.name in _SOLIDS:
        counts = " or ".join(map(str, shape.types))
        raise ReadError(f"{card.name} {card.fields[0]} has {len(given)} nodes; only those with {counts} are supported")
    if kind is None:
        if len(given) > corners:
            by_corners[card.name] += 1
        kind, given = shape.types[corners], numbers[:corners]
    reference = card.integer(1, 0) if shape.first == 2 else 0
    return _Element(kind, card.integer(0), reference, given)


def _held(cards: list[Card], labels: Ints) -> NDArray[np.bool_]:
    """(n,) nodes of cards that are set aside, and those that define coordinate systems."""
    found = [
        int(text)
        for card in cards
        if card.name.startswith((*COUPLING_CARDS, "CORD1")) or (card.name in ELEMENTS and not all(card.fields[2:4]))
        for text in card.fields[1:]
        if text.isdigit()
    ]
    return np.isin(labels, np.array(found, dtype=np.int64))


def _places(labels: Ints, nodes: Ints) -> Ints:
    order = np.argsort(labels, kind="stable")
    places = np.minimum(np.searchsorted(labels, nodes, sorter=order), len(labels) - 1)
    missing = np.unique(nodes[labels[order[places]] != nodes])
    if len(missing):
        raise ReadError(f"nodes that are referred to, but not there: {first_ids(missing)}")
    return np.asarray(order[places])


def _counts(counter: Counter[str]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counter.items())
