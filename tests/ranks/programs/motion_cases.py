"""Motions that programs on ranks, and the tests that compare with one process, share."""

from dataclasses import replace

import numpy as np
from cases import far_apart, two_materials

from hexconformal import HexMesh, generate
from hexconformal.motion import MotionSchedule

# The first guess, which decides about substeps, is the same to all digits then.
SOLVED = replace(MotionSchedule(), guess_tolerance=1e-12, linear_tolerance=1e-12)
MIDDLE = np.array([2.0, 2.0, 5.0]) / 7.0
TIGHT = {"energy_tolerance": 1e-15, "schedule": SOLVED}


def turned(points, degrees):
    """Displacements about an axis through the middle of a block."""
    angle = np.radians(degrees)
    matrix = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    return (points - MIDDLE) @ matrix.T + MIDDLE - points


def block_inside():
    """A cube, of which a block inside turns and all of the boundary stays: few ranks have nodes of the block."""
    points, cells = generate.jittered(*generate.box((7, 7, 7)), 0.1, seed=1)
    moves = (np.abs(points - MIDDLE) < 0.16).all(axis=1)
    outer = (np.abs(points - 0.5) > 0.499).any(axis=1)
    return HexMesh(points, cells, {"outer": outer}), moves, {"fixed": "outer"}, [turned(points, 10), turned(points, 20)]


def lid(operator="conformal"):
    """A block whose top goes, and whose walls slide: twice, and the way back."""
    points, cells = generate.jittered(*generate.box((5, 4, 6), (1.0, 1.0, 1.5)), 0.15, seed=1)
    moves = points[:, 2] == 1.5
    bump = 0.4 * np.sin(np.pi * points[:, :1]) * np.sin(np.pi * points[:, 1:2]) ** 2
    wave = np.concatenate([0.0 * bump, 0.0 * bump, bump], axis=1)
    return HexMesh(points, cells), moves, {"operator": operator}, [wave, -wave, 0.0 * wave]


def materials(operator="conformal"):
    """Two materials whose common face is carried along."""
    points, cells, _, data = two_materials()
    moves = points[:, 0] == 0.0
    push = np.where(np.abs(points[:, 1:] - 0.5).max(axis=1, keepdims=True) < 0.3, [0.2, 0.0, 0.0], 0.0)
    return HexMesh(points, cells, {}, data), moves, {"operator": operator}, [push]


def lonely():
    """A block, and a cell far away from it: some ranks have nothing, and none but one a node that moves."""
    points, cells = far_apart(*generate.jittered(*generate.box((3, 3, 3)), 0.2, seed=2))
    push = np.tile([0.1, 0.0, 0.2], (len(points), 1))
    return HexMesh(points, cells), points[:, 2] == 1.0, {"target": "current"}, [push, 2.0 * push]


def too_far():
    """A top that is pushed through the bottom: refused."""
    points, cells = generate.box((4, 3, 2), (4.0, 3.0, 2.0))
    moves, stays = points[:, 2] == 2.0, points[:, 2] == 0.0
    return HexMesh(points, cells), moves, {"fixed": stays}, [np.tile([0.0, 0.0, -2.5], (len(points), 1))]


CASES = {
    "a block inside turns": block_inside,
    "a wall goes, others slide": lid,
    "a wall goes, harmonic": lambda: lid("harmonic"),
    "a wall goes, elastic": lambda: lid("elastic"),
    "a face inside is carried": materials,
    "a face inside, elastic": lambda: materials("elastic"),
    "nothing on a rank": lonely,
    "refused": too_far,
}
