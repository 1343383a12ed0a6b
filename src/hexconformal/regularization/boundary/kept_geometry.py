"""What a mesh says of its geometry: tags of its skin, faces between regions and others inside, curves, held nodes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...mesh import NormalizedMesh, face_keys, find_embedded
from ..options import Options

__all__ = ["KeptGeometry", "kept_geometry"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


def _none(*shape: int) -> Ints:
    return np.empty(shape, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class KeptGeometry:
    """Geometry that is kept beside the skin, in the node ids of a normalized mesh.

    Attributes
    ----------
    held
        (n,) nodes that stay.
    kinds_of_skin, tags
        (q,) what boundary quads are, and the tags of some of them, as in the file; None where nothing tells them apart.
    quads, kinds
        (k, 4) faces inside, and what kind each is.
    edges, edge_kinds
        (e, 2) edges of curves, and what kind each is.
    notes
        What was found, in words.
    """

    held: Mask
    kinds_of_skin: Ints | None = None
    tags: Ints | None = None
    quads: Ints = field(default_factory=lambda: _none(0, 4))
    kinds: Ints = field(default_factory=lambda: _none(0))
    edges: Ints = field(default_factory=lambda: _none(0, 2))
    edge_kinds: Ints = field(default_factory=lambda: _none(0))
    notes: tuple[str, ...] = ()


def kept_geometry(normalized: NormalizedMesh, options: Options) -> KeptGeometry:
    """The geometry that a mesh carries, and the faces between its regions; with interfaces="ignore" tags alone.

    Raises
    ------
    OptionError
        If `interfaces` makes no sense.
    """
    mesh, count = normalized.mesh, len(normalized.points)
    ignored = isinstance(options.interfaces, str) and options.interfaces == "ignore"
    carried = find_embedded(mesh, normalized.node_ids[normalized.quads], with_sets=not ignored)
    told, tags = (x if (x != x[:1]).any() else None for x in (carried.skin_kinds, carried.skin_tags))
    held = np.zeros(count, dtype=bool)
    if ignored:
        return KeptGeometry(held, told, tags)
    place = np.empty(count, dtype=np.int64)
    place[normalized.node_ids] = np.arange(count)
    held[place[carried.held]] = True
    regions, notes = normalized.regions(options.interfaces), carried.notes
    quads, owners = _none(0, 4), _none(0)
    if regions is not None:
        between = normalized.interfaces_of(regions)
        quads, owners = between.quads, between.owners
        if len(quads):
            notes = (f"interfaces: {regions}, {len(quads)} faces between them are kept", *notes)
    faces = _refined(quads, owners, place[carried.quads], carried.kinds)
    return KeptGeometry(held, told, tags, *faces, place[carried.edges], carried.edge_kinds, notes)


def _refined(quads: Ints, kinds: Ints, others: Ints, other_kinds: Ints) -> tuple[Ints, Ints]:
    """Faces of two kinds of kinds, each face once, in one order, and the kinds that both together tell apart."""
    both = np.concatenate([quads, others])
    _, first, which = np.unique(face_keys(both), axis=0, return_index=True, return_inverse=True)
    told = np.zeros((len(first), 2), dtype=np.int64)
    told[which.ravel()[: len(quads)], 0] = kinds + 1
    told[which.ravel()[len(quads) :], 1] = other_kinds + 1
    return both[first], np.unique(told, axis=0, return_inverse=True)[1].ravel()
