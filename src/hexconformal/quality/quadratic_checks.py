"""Checks of quadratic hexahedra among the cells of a mesh: what they share besides corners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import EDGE_NODES, FACES, HEXAHEDRON, QUADRATIC_TYPES
from ..mesh import CellBlock, HexMesh, MixedMesh, blocks_of, counts_by_type
from .finding import Finding, error, warning

__all__ = ["check_quadratic", "require_linear"]

Ints = NDArray[np.int64]

_FACE_CENTRES = np.arange(20, 26)


def check_quadratic(mesh: MixedMesh) -> list[Finding]:
    """Quadratic cells, and edges and faces that do not have the same node in their middle in all cells around.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20
    >>> one = MixedMesh.of_types(HEXAHEDRON20.ideal, {"hexahedron20": [range(20)]})
    >>> [finding.kind for finding in check_quadratic(one)]
    ['higher order']
    """
    curved = [block for block in mesh.blocks if block.cell_type.name in QUADRATIC_TYPES]
    if not curved:
        return []
    ids = np.sort(np.concatenate([block.places for block in curved]))
    names = ", ".join(f"{len(block.cells)} {block.cell_type.name}" for block in curved)
    text, linear = f"cells of higher order: {names}", "by their corners, linearize=True (--linearize)"
    others = [block for block in mesh.blocks if block not in curved and block.cell_type is not HEXAHEDRON]
    if others:
        beside = f"beside {counts_by_type(others)} they are worked on {linear} only"
        found = [error("higher order", ids, f"{text}; {beside}")]
    else:
        found = [warning("higher order", ids, f"{text}; they are worked on as they are, or {linear}")]
    for what, corners, middles in (("edges", EDGE_NODES[:, :2], EDGE_NODES[:, 2]), ("faces", FACES, _FACE_CENTRES)):
        torn = _torn(mesh.blocks, corners, middles)
        if len(torn):
            text = f"cells with {what} that have another node in their middle, or none, in a cell beside"
            found.append(warning(f"torn {what}", torn, f"{text}: {first_ids(torn, mesh.cell_labels)}"))
    return found


def require_linear(mesh: HexMesh | MixedMesh) -> None:
    """Refuse cells of higher order where they would be worked on by their corners without a word.

    Raises
    ------
    MeshError
        If there are any.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20
    >>> mesh = MixedMesh.of_types(HEXAHEDRON20.ideal, {"hexahedron20": [range(20)]})
    >>> require_linear(mesh)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    hexconformal.MeshError: cells of higher order: 1 hexahedron of 20 nodes; hexconformal.regularize works on them ...
    """
    curved = [block for block in blocks_of(mesh) if block.cell_type.name in QUADRATIC_TYPES]
    if curved:
        raise MeshError(
            f"cells of higher order: {counts_by_type(curved)}; hexconformal.regularize works on them as they are, this "
            "by their corners, as_volume_mesh(mesh, linearize=True)"
        )


def _torn(blocks: Sequence[CellBlock], corners: Ints, middles: Ints) -> Ints:
    """Hexahedra one of whose edges, or faces, with these corners has not the same middle in all of them."""
    ends, nodes, owners = [], [], []
    for block in blocks:
        if block.cells.shape[1] >= 8:
            has = middles < block.cells.shape[1]
            nodes.append(np.where(has, block.cells[:, np.where(has, middles, 0)], -1).ravel())
            ends.append(np.sort(block.cells[:, corners].reshape(-1, corners.shape[1]), axis=1))
            owners.append(np.repeat(block.places, len(middles)))
    _, first, inverse = np.unique(np.concatenate(ends), axis=0, return_index=True, return_inverse=True)
    which, found = inverse.ravel(), np.concatenate(nodes)
    torn = np.zeros(len(first), dtype=bool)
    torn[which[found != found[first][which]]] = True
    return np.unique(np.concatenate(owners)[torn[which]])
