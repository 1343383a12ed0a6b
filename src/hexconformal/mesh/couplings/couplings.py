"""Couplings: pairs of nodes that move together, and the rigid maps that take them to each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, array_of_numbers
from ..hex_mesh import HexMesh, NodePairs
from ..topology import boundary_quads, components, connected_components
from .rigid_maps import RigidMaps, affine_map, one_map, several_maps

__all__ = ["Couplings", "find_couplings"]

Field = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

_MISFIT = 1e-6  # diagonals that a pair may be off its map
_SAME_PLACE = 1e-9  # diagonals up to which nodes of different parts are at the same place
_COINCIDENT = "at the same place in different parts"


@dataclass(frozen=True, eq=False)
class Couplings:
    """Pairs of nodes that move together: the displacement of the first is that of the second, turned.

    Attributes
    ----------
    pairs
        (k, 2) indices of nodes.
    rotations
        (k, 3, 3) orthogonal matrices; the identity where a translation takes the second node to the first.
    counts
        Number of pairs by their source, such as "$Periodic".
    misfit
        Largest distance between a node and the image of its partner, in diagonals of the bounding box.
    notes
        What is kept, and what is not, in words.
    """

    pairs: Ints
    rotations: Field
    counts: dict[str, int]
    misfit: float = 0.0
    notes: tuple[str, ...] = ()


def find_couplings(mesh: HexMesh, couplings: Any = "auto", among: Mask | None = None) -> Couplings:
    """The couplings of a mesh.

    Parameters
    ----------
    mesh
        The mesh; nodes that belong to no hexahedron are coupled to none.
    couplings
        "auto": the pairs that the file couples (Gmsh's $Periodic, *EQUATION and *MPC of decks), and nodes of parts that
        share no node, where they are at the same place; "ignore": none; or (k, 2) ids of nodes, the second of which one
        rigid map takes to the first, or a translation for each pair of faces.
    among
        (n,) nodes that may be coupled; default those of hexahedra.

    Raises
    ------
    OptionError
        If ids that are given make no sense, or no rigid map fits their nodes to a millionth of the diagonal.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> mesh = HexMesh(*box((2, 1, 1)))
    >>> found = find_couplings(mesh, [[2, 0], [5, 3], [8, 6], [11, 9]])
    >>> found.counts, found.notes
    ({'given': 4}, ('couplings: 4 pairs of nodes move together (given)',))
    """
    if isinstance(couplings, str):
        if couplings not in ("auto", "ignore"):
            raise OptionError(f"couplings must be 'auto', 'ignore' or (k, 2) ids of nodes, not {couplings!r}")
        return _Finder(mesh, among).from_mesh() if couplings == "auto" else _Finder(mesh, among).found()
    return _Finder(mesh, among).given(couplings)


class _Finder:
    """Collects couplings."""

    def __init__(self, mesh: HexMesh, among: Mask | None) -> None:
        self._mesh, self._points = mesh, mesh.points
        self._among = np.zeros(len(mesh.points), dtype=bool) if among is None else among
        if among is None:
            self._among[mesh.cells] = True
        self._diagonal = float(np.linalg.norm(np.ptp(mesh.points[self._among], axis=0)))
        self._pairs, self._rotations = [np.empty((0, 2), np.int64)], [np.empty((0, 3, 3))]
        self._seen = np.empty(0, np.int64)
        self._counts: dict[str, int] = {}
        self._misfit, self._notes = 0.0, list[str]()

    def found(self) -> Couplings:
        told = [f"{count} pairs of nodes move together ({source})" for source, count in self._counts.items()]
        notes = tuple(f"couplings: {text}" for text in [*told, *self._notes])
        pairs, rotations = np.concatenate(self._pairs), np.concatenate(self._rotations)
        return Couplings(pairs, rotations, self._counts, self._misfit, notes)

    def given(self, couplings: Any) -> Couplings:
        pairs = _checked_pairs(couplings, len(self._points))
        pairs = pairs[self._among[pairs].all(axis=1)]
        if len(pairs):
            maps = several_maps(*self._ends(pairs), self._tolerance)
            if maps.misfits.max() > self._tolerance:
                raise OptionError(
                    f"couplings must be pairs that a rigid map takes to each other: {self._worst(pairs, maps)}"
                )
            self._add(pairs, maps, "given")
        return self.found()

    def from_mesh(self) -> Couplings:
        for link in self._mesh.coupled_pairs:
            pairs = self._new(link.nodes)
            maps = self._maps(pairs, link)
            if maps is not None:
                self._add(pairs, maps, link.source)
            if link.left_out:
                self._notes.append(f"not understood, and not kept: {link.left_out}")
        pairs = self._new(_coincident_pairs(self._mesh, _SAME_PLACE * self._diagonal))
        apart = np.linalg.norm(np.subtract(*self._ends(pairs)), axis=1)
        self._add(pairs, RigidMaps(np.tile(np.eye(3), (len(pairs), 1, 1)), apart), _COINCIDENT)
        return self.found()

    def _maps(self, pairs: Ints, link: NodePairs) -> RigidMaps | None:
        """The maps of pairs that the file couples; None where none fits, which is told."""
        if len(pairs) == 0:
            return None
        ends = self._ends(pairs)
        maps = None if link.affine is None else affine_map(*ends, link.affine, self._tolerance)
        if maps is None:
            maps = (several_maps if link.several else one_map)(*ends, self._tolerance)
        if maps.misfits.max() <= self._tolerance:
            return maps
        self._notes.append(
            f"{len(pairs)} pairs of nodes of {link.source} are not kept: no rigid map takes them to each other, "
            f"{self._worst(pairs, maps)}"
        )
        return None

    @property
    def _tolerance(self) -> float:
        return _MISFIT * self._diagonal

    def _ends(self, pairs: Ints) -> tuple[Field, Field]:
        return self._points[pairs[:, 0]], self._points[pairs[:, 1]]

    def _worst(self, pairs: Ints, maps: RigidMaps) -> str:
        worst = int(maps.misfits.argmax())
        labels = self._mesh.node_labels
        ids = pairs[worst] if labels is None else labels[pairs[worst]]
        return f"nodes {ids[0]} and {ids[1]} are off by {maps.misfits[worst] / self._diagonal:.3g} diagonals"

    def _new(self, pairs: Ints) -> Ints:
        """The pairs of nodes of cells that are not there yet, in whatever order, each once."""
        pairs = pairs[self._among[pairs].all(axis=1)]
        keys = np.sort(pairs, axis=1) @ np.array([len(self._points), 1])
        first = np.sort(np.unique(keys, return_index=True)[1])
        first = first[~np.isin(keys[first], self._seen)]
        self._seen = np.concatenate([self._seen, keys[first]])
        return pairs[first]

    def _add(self, pairs: Ints, maps: RigidMaps, source: str) -> None:
        # A node that is its own partner says something only where it is on an axis.
        saying = (pairs[:, 0] != pairs[:, 1]) | (maps.rotations != np.eye(3)).any(axis=(1, 2))
        if saying.any():
            self._pairs.append(pairs[saying])
            self._rotations.append(maps.rotations[saying])
            self._counts[source] = self._counts.get(source, 0) + int(saying.sum())
            self._misfit = max(self._misfit, float(maps.misfits[saying].max()) / self._diagonal)


def _checked_pairs(couplings: Any, count: int) -> Ints:
    numbers = array_of_numbers("couplings", couplings, "'auto', 'ignore' or pairs of ids of nodes")
    if numbers.size == 0:
        return np.empty((0, 2), np.int64)
    if numbers.ndim != 2 or numbers.shape[1] != 2 or not np.array_equal(numbers, np.rint(numbers)):
        raise OptionError(f"couplings must be (k, 2) ids of nodes, not of shape {numbers.shape}")
    if numbers.min() < 0 or numbers.max() >= count:
        raise OptionError(
            f"couplings must be ids of nodes from 0 to {count - 1}, not {numbers.min():g} to {numbers.max():g}"
        )
    return numbers.astype(np.int64)


def _coincident_pairs(mesh: HexMesh, tolerance: float) -> Ints:
    """(k, 2) nodes of the surfaces of different parts at the same place, each with the first one there."""
    count, part_of_cells = components(mesh.cells)
    if count == 1:
        return np.empty((0, 2), np.int64)
    parts = np.full(len(mesh.points), -1)
    parts[mesh.cells] = part_of_cells[:, None]
    nodes = np.unique(boundary_quads(mesh.cells)[0])
    # Nodes at exactly one place are one to the tree: many of them would be the more pairs.
    places, inverse = np.unique(mesh.points[nodes] + 0.0, axis=0, return_inverse=True)
    from scipy.spatial import cKDTree

    near = cKDTree(places).query_pairs(tolerance, output_type="ndarray").astype(np.int64)
    groups = connected_components(near, len(places))[inverse.ravel()]
    order = np.argsort(groups, kind="stable")
    starts = np.flatnonzero(np.diff(groups[order], prepend=-1))
    sizes = np.diff(np.append(starts, len(order)))
    lowest, highest = (f.reduceat(parts[nodes[order]], starts) for f in (np.minimum, np.maximum))
    pairs = np.column_stack([nodes[order], np.repeat(nodes[order[starts]], sizes)])
    return pairs[np.repeat(lowest != highest, sizes) & (pairs[:, 0] != pairs[:, 1])]
