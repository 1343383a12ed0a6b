"""Quadratic hexahedra with a curved boundary, for benchmarks: middles of edges lie on it, inner nodes are off."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

import hexconformal as hc
from hexconformal.elements import BETWEEN, LATTICE
from hexconformal.mesh import MixedMesh, boundary_quads

__all__ = ["CURVED", "ball", "boundary_nodes", "cylinder", "perturbed", "twisted_box"]

Field = NDArray[np.float64]


def boundary_nodes(mesh: MixedMesh) -> NDArray[np.bool_]:
    """(n,) nodes of all kinds on faces that belong to one cell."""
    (block,) = mesh.blocks
    corners, owners = boundary_quads(block.cells[:, :8])
    found = np.zeros(len(mesh.points), dtype=bool)
    around = block.cells[owners]
    local = (corners[:, :, None] == around[:, None, :8]).argmax(axis=2)
    lattice = LATTICE[: around.shape[1]]
    for places in np.unique(local, axis=0):
        axis = int(np.flatnonzero(np.ptp(LATTICE[places], axis=0) == 0)[0])
        on_face = lattice[:, axis] == LATTICE[places[0], axis]
        found[around[(local == places).all(axis=1)][:, on_face]] = True
    return found


def perturbed(mesh: MixedMesh, amount: float, corners: bool = True, seed: int = 0) -> MixedMesh:
    """The mesh with inner nodes, or those of them that are no corners, off by up to `amount` edges along each axis."""
    (block,) = mesh.blocks
    edge = np.median(np.linalg.norm(mesh.points[block.cells[:, 1]] - mesh.points[block.cells[:, 0]], axis=1))
    moved = ~boundary_nodes(mesh)
    if not corners:
        moved[block.cells[:, :8]] = False
    moves = np.random.default_rng(seed).uniform(-amount * edge, amount * edge, mesh.points.shape)
    return mesh.replaced(mesh.points + moved[:, None] * moves)


def _on_round_boundary(mesh: MixedMesh, axes: list[int]) -> MixedMesh:
    """The mesh whose nodes between corners at distance 1 from the origin in these coordinates are there, too."""
    points, cells = mesh.points.copy(), mesh.blocks[0].cells
    outside = boundary_nodes(mesh) & np.isclose(np.linalg.norm(points[:, axes], axis=1), 1.0)
    for place, among in enumerate(BETWEEN[: cells.shape[1] - 8], start=8):
        middles = np.unique(cells[outside[cells[:, among]].all(axis=1), place])
        points[np.ix_(middles, axes)] /= np.linalg.norm(points[np.ix_(middles, axes)], axis=1, keepdims=True)
    return mesh.replaced(points)


def ball(nodes: int, core: int = 3, layers: int = 3) -> MixedMesh:
    """An O-grid of second order in a ball of radius 1."""
    return _on_round_boundary(hc.elevated(hc.generate.ball(core, layers), nodes), [0, 1, 2])


def cylinder(nodes: int, core: int = 2, layers: int = 3, axial: int = 4) -> MixedMesh:
    """An O-grid of second order in a cylinder of radius 1."""
    return _on_round_boundary(hc.elevated(hc.generate.cylinder(core, layers, axial), nodes), [0, 1])


def twisted_box(nodes: int, n: int = 4, angle: float = 60.0) -> MixedMesh:
    """A box of cells twisted about z, with faces as curved as that makes them."""
    mesh = hc.elevated(hc.generate.box((n, n, 2 * n), (1.0, 1.0, 2.0), (-0.5, -0.5, 0.0)), nodes)
    turn = np.radians(angle) * mesh.points[:, 2] / 2.0
    x, y, z = mesh.points.T
    return mesh.replaced(np.stack([np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y, z], 1))


def _made(make: Callable[[int], MixedMesh], nodes: int, amount: float, corners: bool) -> MixedMesh:
    return perturbed(make(nodes), amount, corners)


# Names, and what makes the meshes: of what is off by .35 of an edge nearly all cells are invalid.
CURVED: list[tuple[str, Callable[[], MixedMesh]]] = [
    ("ball, middles off by .35 h", partial(_made, ball, 27, 0.35, False)),
    ("ball, middles off by .35 h", partial(_made, ball, 20, 0.35, False)),
    ("ball, all nodes off by .15 h", partial(_made, ball, 27, 0.15, True)),
    ("cylinder, all nodes off by .25 h", partial(_made, cylinder, 27, 0.25, True)),
    ("twisted box, all nodes off by .2 h", partial(_made, twisted_box, 20, 0.2, True)),
]
