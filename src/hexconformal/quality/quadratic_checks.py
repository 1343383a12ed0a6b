"""Checks of quadratic cells among those of a mesh: what they share besides corners."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, first_ids
from ..elements import CellType, between
from ..mesh import CellBlock, HexMesh, MixedMesh, blocks_of, counts_by_type
from .finding import Finding, error, warning

__all__ = ["check_quadratic", "require_linear"]

Ints = NDArray[np.int64]


def check_quadratic(mesh: MixedMesh) -> list[Finding]:
    """Quadratic cells, and edges and faces that do not have the same node in their middle in all cells around.

    Examples
    --------
    >>> from hexconformal.elements import HEXAHEDRON20
    >>> one = MixedMesh.of_types(HEXAHEDRON20.ideal, {"hexahedron20": [range(20)]})
    >>> [finding.kind for finding in check_quadratic(one)]
    ['higher order']
    """
    curved = [block for block in mesh.blocks if block.cell_type.straight]
    if not curved:
        return []
    ids = np.sort(np.concatenate([block.places for block in curved]))
    names = ", ".join(f"{len(block.cells)} {block.cell_type.name}" for block in curved)
    text = f"cells of higher order: {names}; they are worked on as they are, or by their corners, linearize=True"
    found = [warning("higher order", ids, f"{text} (--linearize)")]
    for what, size in (("edges", 2), ("faces", 4)):
        torn = _torn(mesh.blocks, size)
        if len(torn):
            text = f"cells with {what} that have another node in their middle, or none, in a cell beside"
            advice = (
                "give all the same, in VTK's order of nodes, or work on their corners: linearize=True (--linearize)"
            )
            found.append(error(f"torn {what}", torn, f"{text}: {first_ids(torn, mesh.cell_labels)}; {advice}"))
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
    curved = [block for block in blocks_of(mesh) if block.cell_type.straight]
    if curved:
        raise MeshError(
            f"cells of higher order: {counts_by_type(curved)}; hexconformal.regularize works on them as they are, this "
            "by their corners, as_volume_mesh(mesh, linearize=True)"
        )


def _torn(blocks: Sequence[CellBlock], size: int) -> Ints:
    """Cells one of whose edges, or faces, of so many corners has not the same middle in all of them."""
    ends, nodes, owners = [], [], []
    for block in blocks:
        corners, middles = _middles(block.cell_type, size)
        nodes.append(np.where(middles < 0, -1, block.cells[:, middles]).ravel())
        ends.append(np.sort(block.cells[:, corners].reshape(-1, size), axis=1))
        owners.append(np.repeat(block.places, len(middles)))
    _, first, inverse = np.unique(np.concatenate(ends), axis=0, return_index=True, return_inverse=True)
    which, found = inverse.ravel(), np.concatenate(nodes)
    torn = np.zeros(len(first), dtype=bool)
    torn[which[found != found[first][which]]] = True
    return np.unique(np.concatenate(owners)[torn[which]])


def _middles(cell_type: CellType, size: int) -> tuple[Ints, Ints]:
    """(k, size) corners of the edges, or faces, of a type, and the nodes (k,) in their middles, -1 for none."""
    every = cell_type.edges.tolist() if size == 2 else [face for face in cell_type.faces if len(face) == size]
    among = [frozenset(one) for one in between(cell_type)]
    middles = [cell_type.corners + among.index(frozenset(one)) if frozenset(one) in among else -1 for one in every]
    return np.array(every, dtype=np.int64).reshape(-1, size), np.array(middles, dtype=np.int64)
