"""Tags of boundary quads that a mesh carries along from its geometry."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import HexMesh

__all__ = ["surface_tags", "tags_of_faces"]

Ints = NDArray[np.int64]


_TAGS = (
    *("gmsh:geometrical", "CellEntityIds", "gmsh:physical", "medit:ref", "nastran:ref", "cell_tags"),
    *("tags", "tag", "surface"),
)


def surface_tags(mesh: HexMesh, quads: Ints) -> Ints | None:
    """Tags of boundary quads, from the quadrilaterals that the mesh carries along beside its hexahedra.

    Looked for are integer arrays on cells that tell surfaces apart, those of the geometry first:
    ``gmsh:geometrical``, ``CellEntityIds``, ``gmsh:physical``, ``medit:ref``, ``cell_tags`` and the like.

    Parameters
    ----------
    mesh
        As it was taken in.
    quads
        (q, 4) boundary quads.

    Returns
    -------
    (q,) integers, -1 on quads that the mesh does not carry; None if there are no tags, or all are the same.
    """
    for name in _TAGS:
        carried = _carried(mesh, name)
        if carried is None or len(carried[0]) == 0:
            continue
        tags = _matched(quads, *carried)
        if (tags != tags[:1]).any():
            return tags
    return None


def tags_of_faces(surface: Any) -> Ints | None:
    """Tags (f,) of the faces of a pyvista surface, by arrays with the same names; None if there are none."""
    for name in _TAGS:
        tags = np.asarray(surface.cell_data[name]) if name in surface.cell_data else np.empty(0)
        if tags.ndim == 1 and tags.dtype.kind in "iu" and (tags != tags[:1]).any():
            return tags.astype(np.int64)
    return None


def _carried(mesh: HexMesh, name: str) -> tuple[Ints, Ints] | None:
    """Quadrilaterals (k, 4) among the other cells of what the mesh was made from, and their tags (k,)."""
    found = None if mesh.origin is None else mesh.origin.quads(name)
    if found is None:
        return None
    nodes, tags = found
    return (nodes.astype(np.int64), tags.astype(np.int64)) if tags.ndim == 1 and np.all(tags == np.rint(tags)) else None


def _matched(quads: Ints, carried: Ints, tags: Ints) -> Ints:
    """The tag of each quad, -1 where no carried one has the same nodes."""
    both = np.sort(np.concatenate([carried, quads]), axis=1)
    same = np.unique(both, axis=0, return_inverse=True)[1].ravel()
    known = np.full(len(both), -1, dtype=np.int64)
    known[same[: len(carried)]] = tags
    return known[same[len(carried) :]]
