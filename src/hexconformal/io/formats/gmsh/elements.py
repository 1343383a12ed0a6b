"""The $Elements of a file of Gmsh, by the blocks of one type that follow each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from ...format_tools.meshio_internals import gmsh_cell_types
from .entities import Entities, Entity
from .sections import Encoding, Numbers

__all__ = ["NODE_ORDERS", "ElementBlock", "read_elements"]

# Where the format has the nodes that VTK names in turn, of types that meshio leaves in its order.
NODE_ORDERS = {
    "wedge18": [0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16],
    "pyramid14": [0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12, 13],
}


@dataclass(frozen=True)
class ElementBlock:
    """Elements of one type: their dimension, tags (k,), and tags of their nodes (k, j) in Gmsh's order.

    `geometrical`, `physical` and `partition` (k,) are numbers, 0 for none; `groups` are all physical groups of the
    entity that the elements are on, `bounding` the entities that bound it (both of version 4).
    """

    type: str
    tags: NDArray[np.int64]
    nodes: NDArray[np.int64]
    geometrical: NDArray[np.int64]
    physical: NDArray[np.int64]
    partition: NDArray[np.int64]
    groups: tuple[int, ...] = ()
    bounding: object = None


def read_elements(body: bytes, encoding: Encoding, entities: Entities) -> list[ElementBlock]:
    """The elements of the body of $Elements."""
    numbers = Numbers(body, encoding, "Elements")
    if encoding.version.startswith("4"):
        return _blocks_4(numbers, entities)
    return _blocks_2_text(numbers) if encoding.ascii else _blocks_2_binary(numbers)


def _blocks_4(numbers: Numbers, entities: Entities) -> list[ElementBlock]:
    blocks = []
    block_count, *_ = numbers.take("size", 4).tolist()
    for _ in range(block_count):
        dimension, tag, code = numbers.take("int", 3).tolist()
        count = numbers.one("size")
        name, width = _cell_type(code)
        rows = numbers.take("size", (1 + width) * count).reshape(count, 1 + width)
        entity = entities.get((dimension, tag), Entity((), None))
        # Part of a partitioned surface is part of the surface; what parts two partitions is on no surface.
        whole = tag
        if entity.parent is not None:
            whole = entity.parent[1] if entity.parent[0] == dimension else 0
        blocks.append(
            ElementBlock(
                name,
                rows[:, 0],
                rows[:, 1:],
                np.full(count, whole),
                np.full(count, (*entity.physical, 0)[0]),
                np.full(count, entity.partition),
                entity.physical,
                entity.bounding,
            )
        )
    return blocks


def _blocks_2_text(numbers: Numbers) -> list[ElementBlock]:
    count = numbers.text_count()
    words = numbers.rest()
    widths = {code: width for code, (_, width) in gmsh_cell_types().items()}
    starts, codes, place = [], [], 0
    flat = words.tolist()
    for _ in range(count):
        if place + 3 > len(flat):
            raise ReadError("$Elements is truncated: it announces more elements than it holds")
        code = flat[place + 1]
        starts.append(place)
        codes.append(code)
        place += 3 + flat[place + 2] + (widths.get(code) or _cell_type(code)[1])
    if place > len(flat):
        raise ReadError("$Elements is truncated: its last element has too few nodes")
    first, kinds = np.array(starts, dtype=np.int64), np.array(codes, dtype=np.int64)
    tag_counts = words[first + 2] if count else first
    blocks = []
    for rows in np.split(np.arange(count), np.flatnonzero(np.diff(kinds)) + 1) if count else []:
        name, width = _cell_type(int(kinds[rows[0]]))
        start, tags = first[rows], tag_counts[rows]
        nodes = words[(start + 3 + tags)[:, None] + np.arange(width)]
        columns = [np.where(tags > k, words[np.minimum(start + 3 + k, len(words) - 1)], 0) for k in (0, 1, 3)]
        blocks.append(ElementBlock(name, words[start], nodes, columns[1], columns[0], columns[2]))
    return blocks


def _blocks_2_binary(numbers: Numbers) -> list[ElementBlock]:
    total, found = numbers.text_count(), 0
    runs: list[list[tuple[str, NDArray[np.int64]]]] = []
    while found < total:
        code, count, tag_count = numbers.take("int", 3).tolist()
        name, width = _cell_type(code)
        if count < 1 or tag_count < 0:
            raise ReadError("$Elements holds a count that makes no sense")
        rows = numbers.take("int", count * (1 + tag_count + width)).reshape(count, -1)
        fields = np.zeros((count, 4 + width), dtype=np.int64)  # tag, physical, geometrical, partition, nodes
        fields[:, 0], fields[:, 4:] = rows[:, 0], rows[:, 1 + tag_count :]
        for place, k in enumerate((0, 1, 3)):
            if tag_count > k:
                fields[:, 1 + place] = rows[:, 1 + k]
        if not runs or runs[-1][0][0] != name:
            runs.append([])
        runs[-1].append((name, fields))
        found += count
    blocks = []
    for run in runs:
        fields = np.concatenate([part for _, part in run])
        blocks.append(ElementBlock(run[0][0], fields[:, 0], fields[:, 4:], fields[:, 2], fields[:, 1], fields[:, 3]))
    return blocks


def _cell_type(code: int) -> tuple[str, int]:
    """The meshio name of a type of elements, and the number of nodes."""
    known = gmsh_cell_types().get(code)
    if known is None:
        raise ReadError(f"elements of Gmsh's type {code} are not supported")
    return known
