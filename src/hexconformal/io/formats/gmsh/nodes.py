"""The $Nodes of a file of Gmsh: read, and written with other coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError, first_ids
from .sections import Encoding, Numbers

__all__ = ["NodeBlock", "NodeTags", "encode_nodes", "read_nodes"]


@dataclass(frozen=True)
class NodeBlock:
    """Nodes of one entity of the geometry (of all, in version 2): its dimension and tag, tags and places of nodes.

    `parameters` (k, 0 to 3) are the places of nodes on curves and surfaces in the coordinates of these.
    """

    dimension: int
    entity: int
    tags: NDArray[np.int64]
    points: NDArray[np.float64]
    parameters: NDArray[np.float64]


class NodeTags:
    """The indices of nodes, in the order of the file, by their tags.

    >>> NodeTags(np.array([107, 20, 3])).indices(np.array([3, 107]))
    array([2, 0])
    """

    def __init__(self, tags: NDArray[np.int64]) -> None:
        self.tags = tags
        self._order = np.argsort(tags, kind="stable")
        self._sorted = tags[self._order]
        twice = self._sorted[1:][self._sorted[1:] == self._sorted[:-1]]
        if len(twice):
            raise ReadError(f"nodes numbered twice: {first_ids(np.unique(twice))}")

    def indices(self, tags: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices of tags, of any shape, that all must be there."""
        places = np.minimum(np.searchsorted(self._sorted, tags), max(len(self._sorted) - 1, 0))
        missing = np.unique(tags[self._sorted[places] != tags]) if len(self._sorted) else np.unique(tags)
        if len(missing):
            raise ReadError(f"nodes that are referred to, but not there: {first_ids(missing)}")
        return np.asarray(self._order[places])


def read_nodes(body: bytes, encoding: Encoding) -> list[NodeBlock]:
    """The nodes of the body of $Nodes."""
    numbers = Numbers(body, encoding, "Nodes")
    return _blocks_4(numbers) if encoding.version.startswith("4") else [_block_2(numbers, encoding)]


def _block_2(numbers: Numbers, encoding: Encoding) -> NodeBlock:
    count = numbers.text_count()
    if encoding.ascii:
        table = numbers.take("double", 4 * count).reshape(count, 4)
        tags, points = table[:, 0].astype(np.int64), table[:, 1:].copy()
    else:
        rows = numbers.records(_record_2(encoding), count)
        tags, points = rows["tag"].astype(np.int64), rows["point"].astype(np.float64)
    return NodeBlock(-1, 0, tags, points, np.empty((count, 0)))


def _record_2(encoding: Encoding) -> np.dtype[Any]:
    return np.dtype([("tag", encoding.dtype("int")), ("point", encoding.dtype("double"), 3)])


def _blocks_4(numbers: Numbers) -> list[NodeBlock]:
    block_count, node_count, _, _ = numbers.take("size", 4).tolist()
    blocks = []
    for _ in range(block_count):
        dimension, entity, parametric = numbers.take("int", 3).tolist()
        count = numbers.one("size")
        tags = numbers.take("size", count)
        width = 3 + (dimension if parametric else 0)
        table = numbers.take("double", width * count).reshape(count, width)
        blocks.append(NodeBlock(dimension, entity, tags, table[:, :3].copy(), table[:, 3:].copy()))
    if sum(len(block.tags) for block in blocks) != node_count:
        raise ReadError(f"$Nodes announces {node_count} nodes, its blocks hold another number")
    return blocks


def encode_nodes(blocks: list[NodeBlock], encoding: Encoding) -> bytes:
    """The body of $Nodes."""
    ending = b"" if encoding.ascii else b"\n"
    tags = np.concatenate([block.tags for block in blocks])
    if not encoding.version.startswith("4"):
        points = np.concatenate([block.points for block in blocks])
        count = f"{len(tags)}\n".encode()
        if not encoding.ascii:
            rows = np.empty(len(tags), _record_2(encoding))
            rows["tag"], rows["point"] = tags, points
            return count + rows.tobytes() + ending
        lines = encoding.encoded("double", points).splitlines(keepends=True)
        return count + b"".join(b"%d %s" % pair for pair in zip(tags.tolist(), lines, strict=True))
    parts = [encoding.encoded("size", [len(blocks), len(tags), *((tags.min(), tags.max()) if len(tags) else (0, 0))])]
    for block in blocks:
        head = [block.dimension, block.entity, int(block.parameters.shape[1] > 0)]
        if encoding.ascii:
            parts.append(" ".join(map(str, [*head, len(block.tags)])).encode() + b"\n")
        else:
            parts += [encoding.encoded("int", head), encoding.encoded("size", [len(block.tags)])]
        parts.append(encoding.encoded("size", block.tags[:, None]))
        parts.append(encoding.encoded("double", np.hstack([block.points, block.parameters])))
    return b"".join(parts) + ending
