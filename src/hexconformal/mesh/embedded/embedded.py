"""What a mesh carries beside its hexahedra that is geometry: faces inside, curves, sets on its boundary, held nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...common import first_names
from ...elements import EDGES, FACES, are_collapsed
from ..carried_cells import CarriedCells
from ..hex_mesh import HexMesh
from .kinds import Classified, classify
from .node_sets import NodeSetParts, NodeSets, most_single_nodes

__all__ = ["Embedded", "find_embedded"]

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_TOO_MANY = "too many to be held, unless `fixed` says so"


@dataclass(frozen=True, eq=False)
class Embedded:
    """Geometry that a mesh carries, in its own node ids.

    Attributes
    ----------
    quads
        (k, 4) faces of hexahedra inside the mesh that are patches: shells, membranes, baffles, sides of sets.
    kinds
        (k,) which of them belong together: those with the same tag, in the same sets.
    skin_kinds
        (q,) the same of the boundary quads, 0 where nothing is said of them; where it changes is a curve.
    skin_tags
        (q,) the tags of boundary quads that come from one array, -1 where it has none.
    edges
        (e, 2) edges of hexahedra that are pieces of curves, the lower id first.
    edge_kinds
        (e,) which of them belong together.
    held
        (n,) ids of nodes that stay where they are, ascending.
    notes
        What was found, in words.
    """

    quads: Ints
    kinds: Ints
    skin_kinds: Ints
    skin_tags: Ints
    edges: Ints
    edge_kinds: Ints
    held: Ints
    notes: tuple[str, ...] = ()


def find_embedded(mesh: HexMesh, skin: Ints, with_sets: bool = True) -> Embedded:
    """Find the geometry that a mesh carries beside its hexahedra.

    These are its cells of lower dimension and its sets. Quadrilaterals inside are patches, lines are curves, vertices
    hold their nodes. On the boundary tags of quadrilaterals, sets of faces and sets of nodes tell quads apart. Sets
    that overlap are refined until every face is in one kind. Cells that are no face and no edge of a hexahedron hold
    their nodes. For sets of nodes see :meth:`hexconformal.mesh.embedded.node_sets.NodeSets.parts`.

    Parameters
    ----------
    mesh
        The mesh.
    skin
        (q, 4) its boundary quads.
    with_sets
        False to leave sets alone.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh import boundary_quads
    >>> points, cells = box((2, 2, 2))
    >>> mesh = HexMesh(points, cells, {"load": (points == 0.5).all(axis=1), "floor": points[:, 2] == 0})
    >>> found = find_embedded(mesh, boundary_quads(cells)[0])
    >>> found.held, np.bincount(found.skin_kinds)
    (array([13]), array([20,  4]))
    >>> found.notes
    ("outlines on the boundary are kept of: node set 'floor' (4 quads)", "held: node set 'load' (1 nodes)")
    """
    quads, lines, triangles, vertices = (mesh.carried_cells(corners) for corners in (4, 2, 3, 1))
    node_sets, face_sets = (mesh.node_sets(), mesh.face_sets()) if with_sets else ({}, {})
    if not (node_sets or face_sets or any(len(some.nodes) for some in (quads, lines, triangles, vertices))):
        none = np.empty(0, dtype=np.int64)
        nothing = np.zeros(len(skin), np.int64)
        return Embedded(none.reshape(0, 4), none, nothing, nothing - 1, none.reshape(0, 2), none, none)
    count = len(mesh.points)
    what = "quadrilaterals that are no faces of hexahedra"
    if are_collapsed(mesh.cells).any():
        what = "triangles and quadrilaterals that are no faces of cells"
        quads, triangles = quads.behind(triangles), CarriedCells(np.empty((0, 3), dtype=np.int64))
    of_nodes = _parts_of_node_sets(mesh, skin, node_sets)
    sides = {f"side set {name!r}": nodes for name, nodes in face_sets.items()}
    sides |= {name: parts.faces for name, parts in of_nodes.items()}
    faces = classify(mesh.cells, FACES, skin, count, quads, sides)
    chains = {name: parts.edges for name, parts in of_nodes.items()}
    edges = classify(mesh.cells, EDGES, np.empty((0, 2), dtype=np.int64), count, lines, chains)
    told = _Told()
    _tell_of_faces(told, faces, quads, len(skin))
    for name, places in {"lines": edges.carried_places, **edges.set_places}.items():
        told.add("kept as curves", name, len(np.unique(places[places >= 0])), "edges")
    held = _Held(mesh, told)
    held.add(what, quads.nodes[faces.carried_places < 0])
    held.add("lines that are no edges of hexahedra", lines.nodes[edges.carried_places < 0])
    held.add("triangles", triangles.nodes)
    held.add("vertices", vertices.nodes)
    for name, parts in of_nodes.items():
        held.add(name, parts.held)
        told.add(_TOO_MANY, name, parts.scattered, "nodes")
    return Embedded(
        faces.inner,
        faces.inner_kinds,
        faces.known_kinds,
        faces.known_tags,
        np.sort(edges.inner, axis=1),
        edges.inner_kinds,
        np.flatnonzero(held.mask),
        told.notes(),
    )


class _Told:
    """What is said of what was found, by what becomes of it."""

    def __init__(self) -> None:
        self._found: dict[str, list[str]] = {}

    def add(self, fate: str, name: str, count: int, what: str) -> None:
        """Say what becomes of something, if there is any of it."""
        if count:
            self._found.setdefault(fate, []).append(f"{name} ({count} {what})")

    def notes(self) -> tuple[str, ...]:
        return tuple(f"{fate}: {first_names(names)}" for fate, names in self._found.items())


class _Held:
    """Nodes of hexahedra that stay where they are."""

    def __init__(self, mesh: HexMesh, told: _Told) -> None:
        self._used = np.zeros(len(mesh.points), dtype=bool)
        self._used[mesh.cells] = True
        self._most = most_single_nodes(int(np.count_nonzero(self._used)))
        self._told = told
        self.mask = np.zeros(len(mesh.points), dtype=bool)

    def add(self, name: str, nodes: Ints) -> None:
        """Hold some nodes, as far as hexahedra have them; those of all cells, or of a whole layer, are not meant."""
        ids = np.unique(nodes)
        ids = ids[(ids >= 0) & (ids < len(self.mask))]
        ids = ids[self._used[ids]]
        if len(ids) > self._most:
            self._told.add(_TOO_MANY, name, len(ids), "nodes")
        else:
            self.mask[ids] = True
            self._told.add("held", name, len(ids), "nodes")


def _parts_of_node_sets(mesh: HexMesh, skin: Ints, node_sets: Mapping[str, Mask]) -> dict[str, NodeSetParts]:
    if not node_sets:
        return {}
    reader = NodeSets(mesh.cells, skin, len(mesh.points))
    return {f"node set {name!r}": reader.parts(members) for name, members in node_sets.items()}


def _tell_of_faces(told: _Told, faces: Classified, quads: CarriedCells, count: int) -> None:
    """Say which faces are patches, and which outlines on the boundary, of so many quads, are kept."""
    outlines = "outlines on the boundary are kept of"
    if faces.tags:
        told.add(outlines, f"tags {faces.tags!r}", len(np.unique(faces.known_kinds)), "kinds")
    sets = {f"set {name!r}": faces.carried_places[mask] for name, mask in quads.sets.items()} | dict(faces.set_places)
    for name, places in {"quadrilaterals": faces.carried_places, **sets}.items():
        found = np.unique(places[places >= 0])
        on_skin = int(np.searchsorted(found, count))
        if on_skin < count and not (name == "quadrilaterals" and faces.tags):
            told.add(outlines, name, on_skin, "quads")
        told.add("kept as patches", name, len(found) - on_skin, "quads")
