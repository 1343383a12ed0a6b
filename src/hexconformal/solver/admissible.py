"""The directions in which nodes may move: a linear space of displacements at every node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import MeshError, OptionError, as_mask, first_ids
from ..energy import Patch
from ..mesh import HexMesh
from .coupled_nodes import UNCOUPLED, CoupledNodes

__all__ = [
    "AdmissibleDirections",
    "boundary_directions",
    "count_free_directions",
    "fixed_components",
    "line_normal_sums",
    "planar_normal_sums",
]

Field = NDArray[np.float64]

# Directions whose normals agree to this angle (radians) count as one plane.
_FLAT = 1e-6


@dataclass(frozen=True)
class AdmissibleDirections:
    """Admissible displacements P d of constrained nodes; all others are free.

    Attributes
    ----------
    nodes
        (k,) ids of the constrained nodes, ascending.
    projectors
        (k, 3, 3) orthogonal projectors P onto the admissible displacements: 0 holds a node, rank 1 lets it
        slide along a line, rank 2 in a plane. They are the same for nodes that are coupled, in their frames, so that
        projections at nodes and the mean over groups commute.
    coupled
        Nodes that move together.
    """

    nodes: NDArray[np.int64]
    projectors: Field
    coupled: CoupledNodes = UNCOUPLED

    @classmethod
    def from_normal_sums(
        cls, sums: Field, fixed: NDArray[np.bool_] | None = None, coupled: CoupledNodes = UNCOUPLED
    ) -> AdmissibleDirections:
        """Directions orthogonal to forbidden unit vectors n, of which the sums (n, 3, 3) of n n^T are given.

        Parameters
        ----------
        sums
            Zero where a node is free.
        fixed
            (n, 3) components that are held besides.
        coupled
            Nodes that move together: what one of a group may not do, none may.
        """
        if fixed is not None:
            sums = sums.copy()
            sums[:, [0, 1, 2], [0, 1, 2]] += fixed
        sums = coupled.common_normals(sums)
        nodes = np.flatnonzero(sums.any(axis=(1, 2)))
        admissible, vectors = _admissible(sums[nodes])
        projectors = np.einsum("kia,ka,kja->kij", vectors, admissible.astype(float), vectors)
        if len(coupled.nodes):
            everywhere = np.tile(np.eye(3), (len(sums), 1, 1))
            everywhere[nodes] = projectors
            projectors = coupled.common_projectors(everywhere)[nodes]
        # Exact zeros and ones on the axes: a cube's faces stay flat to the last bit.
        projectors[np.abs(projectors) < 1e-9] = 0.0
        projectors[np.abs(projectors - 1.0) < 1e-9] = 1.0
        return cls(nodes, projectors, coupled)

    def project(self, field: Field) -> Field:
        """Admissible part of an (n, 3) field of displacements or forces."""
        out = field.copy()
        out[self.nodes] = np.einsum("kij,kj->ki", self.projectors, field[self.nodes])
        return self.coupled.averaged(out)

    def all_projectors(self, count: int) -> Field:
        """(count, 3, 3) projectors of all nodes, the identity where a node is free."""
        projectors = np.tile(np.eye(3), (count, 1, 1))
        projectors[self.nodes] = self.projectors
        return projectors

    def free(self, count: int) -> NDArray[np.bool_]:
        """(count,) nodes that can move at all."""
        free = np.ones(count, dtype=bool)
        free[self.nodes] = self.projectors.any(axis=(1, 2))
        return free

    def with_held(self, nodes: NDArray[Any]) -> AdmissibleDirections:
        """The same with further nodes (ids) held, and those that are coupled to them."""
        held = np.unique(nodes)
        partners = np.isin(self.coupled.roots, self.coupled.roots[np.isin(self.coupled.nodes, held)])
        held = np.union1d(held, self.coupled.nodes[partners])
        ids = np.union1d(self.nodes, held)
        projectors = np.zeros((len(ids), 3, 3))
        projectors[np.searchsorted(ids, self.nodes)] = self.projectors
        projectors[np.searchsorted(ids, held)] = 0.0
        return AdmissibleDirections(ids, projectors, self.coupled)

    def restricted(self, patch: Patch) -> AdmissibleDirections:
        """The same for the nodes of a patch; those that stay are held, and groups that would only move in part."""
        inside = patch.local[self.nodes] >= 0
        moving = self.coupled.whole(patch.moving & (patch.local >= 0))
        coupled = self.coupled.restricted(moving, patch.local)
        own = AdmissibleDirections(patch.local[self.nodes[inside]], self.projectors[inside], coupled)
        return own.with_held(np.flatnonzero(~moving[patch.nodes]))

    def held_components(self, count: int) -> NDArray[np.bool_]:
        """(count, 3) components to leave out where a field is treated component by component.

        As many at a node as directions are forbidden, those closest to them; the others then still span
        the admissible displacements, and a definite map of them stays definite.
        """
        share = np.einsum("kii->ki", self.projectors)
        forbidden = 3 - np.rint(share.sum(axis=1)).astype(np.int64)
        rank = np.argsort(np.argsort(share, axis=1, kind="stable"), axis=1)
        held = np.zeros((count, 3), dtype=bool)
        held[self.nodes] = rank < forbidden[:, None]
        return held


def fixed_components(mesh: HexMesh, fixed: Any) -> NDArray[np.bool_]:
    """Components (n, 3) held by the user, or by cells that are carried along.

    Parameters
    ----------
    mesh
        The mesh; other cells' nodes are held.
    fixed
        None, the name of a point array (nonzero holds) or of a set or group of the file, an (n,) or (n, 3) mask, or
        node ids.

    Raises
    ------
    OptionError
        If the name is unknown, or the mask has another length.
    """
    held = mesh.held[:, None] | np.zeros((1, 3), dtype=bool)
    mask = as_mask(fixed, len(mesh.points), "fixed", mesh.named_nodes() if isinstance(fixed, str) else None)
    return held | (mask if mask.ndim == 2 else mask[:, None])


def boundary_directions(
    points: Field,
    quads: NDArray[np.int64],
    boundary: str = "slide",
    fixed: NDArray[np.bool_] | None = None,
    ids: NDArray[Any] | None = None,
    edges: NDArray[np.int64] | None = None,
    others: Field | None = None,
    coupled: CoupledNodes = UNCOUPLED,
) -> AdmissibleDirections:
    """The admissible directions of a boundary mode, with further components held by a mask.

    Parameters
    ----------
    points
        (n, 3) coordinates.
    quads
        (k, 4) boundary quads.
    boundary
        "fixed" holds every boundary node. "slide" lets a node move in all the planes of the boundary quads
        around it: in a flat face, along a straight edge, not at a corner; on a curved boundary that means
        not at all. "free" leaves the boundary alone.
    fixed
        (n, 3) components that are held besides.
    ids
        (n,) ids by which messages name the nodes; default their places.
    edges
        (k, 2) edges in flat faces along which the nodes of "slide" move, too.
    others
        (n, 3, 3) sums of n n^T over other planes in which nodes move, those of interfaces.
    coupled
        Nodes that move together.

    Raises
    ------
    OptionError
        If the mode is unknown.
    MeshError
        If boundary quads have no area, so that there is no face to slide in.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.mesh.topology import boundary_quads
    >>> points, cells = box((2, 2, 2))
    >>> admissible = boundary_directions(points, boundary_quads(cells)[0])
    >>> admissible.project(np.ones_like(points))[[0, 1, 4]]  # a corner, an edge, a face
    array([[0., 0., 0.],
           [1., 0., 0.],
           [1., 1., 0.]])
    """
    if boundary not in ("fixed", "slide", "free"):
        raise OptionError(f"boundary must be 'fixed', 'slide' or 'free', not {boundary!r}")
    sums = np.zeros((len(points), 3, 3))
    if boundary == "fixed":
        sums[np.unique(quads)] = np.eye(3)
    elif boundary == "slide":
        sums = planar_normal_sums(points, quads, ids)
        if edges is not None:
            sums += line_normal_sums(points, edges)
    if others is not None:
        sums = sums + others
    return AdmissibleDirections.from_normal_sums(sums, fixed, coupled)


def count_free_directions(sums: Field) -> NDArray[np.int64]:
    """(n,) number of directions that sums (n, 3, 3) of n n^T leave free: 2 in a plane, 1 on an edge, 0 at a corner."""
    free = np.full(len(sums), 3)
    nodes = np.flatnonzero(sums.any(axis=(1, 2)))
    free[nodes] = _admissible(sums[nodes])[0].sum(axis=1)
    return free


def _admissible(sums: Field) -> tuple[NDArray[np.bool_], Field]:
    """Mask (k, 3) of the eigenvectors of the sums that are admissible, and these vectors (k, 3, 3)."""
    values, vectors = np.linalg.eigh(sums)
    return values < _FLAT**2 * np.maximum(np.trace(sums, axis1=1, axis2=2), 1.0)[:, None], vectors


def planar_normal_sums(points: Field, quads: NDArray[np.int64], ids: NDArray[Any] | None = None) -> Field:
    """Sums (n, 3, 3) of n n^T over the corner triangles of the boundary quads around every node."""
    sums, triangles = np.zeros((len(points), 3, 3)), quads[:, 2] == quads[:, 3]
    for faces in (quads[triangles, :3], quads[~triangles]):
        _add_normals(points, faces, ids, sums)
    return sums


def _add_normals(points: Field, faces: NDArray[np.int64], ids: NDArray[Any] | None, sums: Field) -> None:
    x, size = points[faces] - points[faces[:, :1]], faces.shape[1]
    for corner in range(size):
        # A quad that is not flat has four different corner normals, which leave its nodes no way to go.
        a, b = x[:, (corner + 1) % size] - x[:, corner], x[:, corner - 1] - x[:, corner]
        normal = np.cross(a, b)
        length = np.linalg.norm(normal, axis=1)
        area = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
        if not area.all():
            bad = faces[area == 0, corner]
            bad = np.unique(bad if ids is None else ids[bad])
            raise MeshError(
                f"boundary quads with an edge of no length at nodes {first_ids(bad)}: move these apart, or give the "
                "cells there, which are collapsed, by the type that they are, such as wedges"
            )
        # Three corners on a line (or nearly) say nothing about the plane; the other corners do.
        says = length > 1e-3 * area
        unit = normal[says] / length[says, None]
        outer = np.einsum("ki,kj->kij", unit, unit)
        for node in range(size):
            np.add.at(sums, faces[says, node], outer)


def line_normal_sums(points: Field, edges: NDArray[np.int64]) -> Field:
    """Sums (n, 3, 3) of 1 - t t^T over the edges (k, 2) around every node, t being their directions."""
    along = points[edges[:, 1]] - points[edges[:, 0]]
    length = np.linalg.norm(along, axis=1)
    along /= np.where(length > 0.0, length, 1.0)[:, None]
    normal = np.eye(3) - np.einsum("ki,kj->kij", along, along)
    sums = np.zeros((len(points), 3, 3))
    for end in (0, 1):
        np.add.at(sums, edges[:, end], normal)
    return sums
