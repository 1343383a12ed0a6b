"""A piece of a mesh that several ranks have together."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, OptionError, first_ids
from ..io import CELL_IDS, NODE_IDS
from ..mesh import HexMesh, MixedMesh, blocks_of

__all__ = ["MeshPiece", "cell_ids_of", "node_ids_of"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class MeshPiece(HexMesh):
    """What one rank has of a mesh: some of its cells, each of which one rank has, and their nodes.

    It is a :class:`hexconformal.HexMesh` with ids; cells count the points here from 0. Nodes may be on several ranks,
    with the same coordinates and the same id. A rank may have nothing at all.

    Attributes
    ----------
    node_ids, cell_ids
        (n,), (m,) what nodes and cells are called on all ranks: numbers from 0 on, not necessarily all of them.

    Raises
    ------
    MeshError
        If shapes or types make no sense, or ids are no whole numbers, negative, or there twice.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> MeshPiece(CORNERS, [range(8)], node_ids=range(40, 48), cell_ids=[6])
    MeshPiece(8 points, 1 hexahedra)
    """

    node_ids: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    cell_ids: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    _may_be_empty: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, count in (("node_ids", len(self.points)), ("cell_ids", len(self.cells))):
            object.__setattr__(self, name, _checked_ids(getattr(self, name), count, name))
        if len(self.cells) and not (self.cells.min() >= 0 and self.cells.max() < len(self.points)):
            raise MeshError(f"cells must count the {len(self.points)} points of their piece from 0")

    def __repr__(self) -> str:
        return f"MeshPiece({len(self.points)} points, {len(self.cells)} hexahedra)"

    @classmethod
    def of(cls, mesh: Any) -> MeshPiece:
        """The piece itself.

        Raises
        ------
        OptionError
            If something else is given.
        """
        if isinstance(mesh, cls):
            return mesh
        raise OptionError(
            f"with comm every rank must hand in a hexconformal.ranks.MeshPiece, with ids, not {type(mesh).__name__}; "
            "hexconformal.ranks.read_piece reads one from a file"
        )

    @classmethod
    def nothing(cls) -> MeshPiece:
        """The piece of a rank that has none."""
        return cls(np.empty((0, 3)), np.empty((0, 8), dtype=np.int64))

    @property
    def node_labels(self) -> Ints:
        """(n,) what messages call the nodes."""
        return self.node_ids

    @property
    def cell_labels(self) -> Ints:
        """(m,) what messages call the cells."""
        return self.cell_ids


def node_ids_of(mesh: HexMesh | MixedMesh) -> Ints:
    """(n,) what nodes are called on ranks: the ids that a file in pieces gives them, else their places."""
    return mesh.node_ids if isinstance(mesh, MeshPiece) else _ids(mesh.point_data.get(NODE_IDS), len(mesh.points))


def cell_ids_of(mesh: HexMesh | MixedMesh) -> Ints:
    """(m,) what cells are called on ranks."""
    return (
        mesh.cell_ids
        if isinstance(mesh, MeshPiece)
        else _ids(mesh.cell_data.get(CELL_IDS), sum(len(block.cells) for block in blocks_of(mesh)))
    )


def _checked_ids(ids: Any, count: int, name: str) -> Ints:
    given = np.asarray(ids)
    if given.size and given.dtype.kind not in "iu":
        raise MeshError(f"{name} must be whole numbers, not {given.dtype}")
    found = np.array(given, dtype=np.int64).reshape(-1)
    if len(found) != count:
        raise MeshError(f"{name} must be {count} numbers, one for each, not {len(found)}")
    if len(found) and found.min() < 0:
        raise MeshError(f"{name} must be 0 or more; negative: {first_ids(found[found < 0])}")
    names, counts = np.unique(found, return_counts=True)
    if len(names) < count:
        raise MeshError(f"{name} must be different; there several times: {first_ids(names[counts > 1])}")
    found.setflags(write=False)
    return found


def _ids(given: Any, count: int) -> Ints:
    if given is None or given.dtype.kind not in "iu" or given.shape != (count,) or len(np.unique(given)) < count:
        return np.arange(count)
    return np.asarray(given, dtype=np.int64)
