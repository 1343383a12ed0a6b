"""Meshes and options that programs on ranks, and the tests that compare with one process, share."""

from dataclasses import replace

import numpy as np

from hexconformal import Options, generate
from hexconformal.formulation import Schedules

TIGHT = {"gradient_tolerance": 1e-12, "emphasis": "mean"}
# Where the surface is kept by a barrier the energy stalls long before the gradient vanishes: directions are those of
# one process if the equation is solved. The last digit, which depends on ranks, must decide nothing: what was done on
# one rank leaves nodes that have hardly moved as close to several faces, and slender cells are at the brink of costing.
SOLVED = Schedules(
    thin=replace(Schedules().thin, thin=0.0),
    minimization=replace(Schedules().minimization, slender=40.0),
    newton=replace(Schedules().newton, tolerance=1e-11, iterations=2000),
    volume=replace(Schedules().volume, tolerance=1e-11, iterations=2000),
)

# What is done with the whole of a small mesh, and with parts of a large one.
PATCHES = Schedules(
    unfolding=replace(Schedules().unfolding, whole=0), worst_cells=replace(Schedules().worst_cells, many_cells=0)
)


def clustered():
    """Nodes crowded inside an eighth of a cube, a block of them free: on four ranks one has none on the boundary."""
    line = np.concatenate([[0.0], np.linspace(0.26, 0.49, 8), [1.0]])
    points, cells = generate.box((9, 9, 9))
    places = np.rint(9.0 * points).astype(int)
    points, inner = line[places], ((places > 1) & (places < 8)).all(axis=1)
    points[inner] += np.random.default_rng(5).uniform(-0.008, 0.008, (inner.sum(), 3))
    return points, cells, {"held": ~inner}


def block_far_apart():
    """A small block, far away from one cell: the curve has no room to cut the block, so some ranks have nothing."""
    return far_apart(*generate.jittered(*generate.box((3, 3, 3)), 0.2, seed=2))


def cylinder_far_apart():
    return far_apart(*cylinder())


def far_apart(points, cells):
    """A mesh and one cell far away from it."""
    far, single = generate.box((1, 1, 1))
    far = far * [1.0, 1.0, 1.1] + [4000.0, 5000.0, 6000.0]
    return np.concatenate([points, far]), np.concatenate([cells, single + len(points)])


def folding():
    """A block sheared so far that steps fold cells at one end alone."""
    points, cells = generate.jittered(*generate.box((8, 3, 3), (8.0, 3.0, 3.0)), 0.05, seed=4)
    inner = ((points > 0.01) & (points < [7.99, 2.99, 2.99])).all(axis=1)
    points[inner & (points[:, 0] < 2.5)] += [0.55, 0.5, 0.5]
    return points, cells


def block():
    return generate.jittered(*generate.box((5, 4, 6), (1.0, 1.0, 1.5)), 0.25, seed=1)


# All is lowered a little only, and again for cells that are opened though they are not next to flat.
REOPENED = Schedules(
    minimization=replace(Schedules().minimization, stall=0.9),
    worst_cells=replace(
        Schedules().worst_cells, angle_steps=0, stiff_steps=0, patch_rounds=0, reopened=1.0, opened=0.85
    ),
)


def twisted():
    return generate.jittered(*generate.twisted_cube(5), 0.1, seed=3)


def ball():
    return generate.jittered(*generate.ball(4, 3), 0.2, seed=1)


def bent(make):
    """What another makes, bent so that no face of its boundary is flat."""

    def made():
        points, cells, *arrays = make()
        size = np.ptp(points, axis=0)
        return points + 0.1 * size * np.sin(np.roll(points, 1, axis=1) / size * 3.0 + 0.3), cells, *arrays

    return made


def cylinder():
    return generate.jittered(*generate.cylinder(3, 2, 4), 0.2, seed=2)


def folded(points, cells):
    """A mesh with a node drawn through the cell that it belongs to: of all ranks one has folded cells."""
    bad, points = cells[len(cells) // 2], points.copy()
    points[bad[0]] += 1.5 * (points[bad[6]] - points[bad[0]])
    return points, cells


def folded_cube():
    return folded(*generate.jittered(*generate.twisted_cube(5), 0.1, seed=1))


def folded_far_apart():
    return far_apart(*folded(*generate.jittered(*generate.box((4, 4, 4)), 0.2, seed=2)))


# Final points to a tight tolerance.
CASES = {
    "fixed": (twisted, Options(boundary="fixed", **TIGHT)),
    "fixed, quaternionic": (twisted, Options(boundary="fixed", energy="quaternionic", **TIGHT)),
    "flat faces slide": (block, Options(**TIGHT)),
    "flat faces slide, quaternionic": (block, Options(energy="quaternionic", weight="volume", **TIGHT)),
    "curved faces stay": (twisted, Options(hausdorff=0.0, method="newton", target="1:1:2", **TIGHT)),
    "fixed, convex": (twisted, Options(boundary="fixed", method="majorize", **TIGHT), SOLVED),
    "no boundary on a rank": (
        clustered,
        Options(boundary="fixed", fixed="held", target="cube", **TIGHT),
    ),
    "nothing on a rank": (block_far_apart, Options(boundary="fixed", **TIGHT)),
    "curved faces slide": (cylinder, Options(**TIGHT), SOLVED),
    "curved faces slide, volume kept": (cylinder, Options(conserve_volume=True, **TIGHT), SOLVED),
    "curved faces slide, no boundary on a rank": (
        bent(clustered),
        Options(target="cube", max_iterations=2, **TIGHT),
        SOLVED,
    ),
    "curved faces slide, nothing on a rank": (
        cylinder_far_apart,
        Options(hausdorff=1e-6, max_iterations=4, **TIGHT),
        SOLVED,
    ),
    "bad cells on a rank": (folding, Options(boundary="fixed", energy="quaternionic", target="cube", **TIGHT)),
}
# Patches of ranks are not those of one process: what counts is how good cells are.
GOOD = {
    "worst cells are raised": (ball, Options(boundary="fixed")),
    "curved faces slide as they do by themselves": (ball, Options()),
    "folded cells are unfolded": (folded_cube, Options()),
    "folded cells are unfolded, by patches": (folded_cube, Options(boundary="fixed"), PATCHES),
    "folded cells are unfolded, nothing on a rank": (folded_far_apart, Options(), PATCHES),
}

OPENED = {"worst cells are opened once more": (ball, Options(boundary="fixed"), REOPENED)}


def two_materials():
    """A box of two materials that meet in a plane."""
    points, cells = generate.box((6, 4, 4), (1.5, 1.0, 1.0))
    plane = points[:, 0] == 0.75
    material = np.where(points[cells].mean(axis=1)[:, 0] < 0.75, 7, 3)
    points = generate.jittered(points, cells, 0.25, seed=1)[0]
    points[plane, 0] = 0.75
    return points, cells, {}, {"material": material}


def numbered():
    """The same with an array that numbers cells, and tells no regions apart."""
    points, cells, *_ = two_materials()
    return points, cells, {}, {"material": np.arange(len(cells))}


def core():
    """A cylinder with a round core of two materials, on whose surface nodes are crowded: three surfaces that meet."""
    points, cells = generate.cylinder(3, 3, 4)
    centres = points[cells].mean(axis=1)
    inner = np.linalg.norm(centres[:, :2], axis=1) < 0.65
    part = np.where(inner, np.where(centres[:, 2] < 1.0, 1, 2), 0)
    on = np.intersect1d(cells[inner], cells[~inner])
    flat = points[:, 2] == 1.0
    moved = generate.jittered(points, cells, 0.15, seed=2)[0]
    moved[flat, 2] = 1.0
    x, y, z = points[on].T
    angle = 0.12 * np.sin(2.0 * np.arctan2(y, x) + z)
    moved[on] = np.column_stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z])
    return moved, cells, {}, {"part": part}


def core_far_apart():
    """The same, and one cell far away: of four ranks one has nothing, or a single region."""
    points, cells, _, data = core()
    return *far_apart(points, cells), {}, {"part": np.append(data["part"], 0)}


def folded_core():
    """The same with a node inside drawn through a cell, and through a face between materials."""
    points, cells, _, data = core()
    plane = np.isclose(points[:, 2], 1.0).nonzero()[0]
    below = cells[(np.isin(cells[:, 4:], plane).all(axis=1)) & (data["part"] == 1)]
    node = below[np.linalg.norm(points[below[:, 0]][:, :2], axis=1).argmin(), 0]
    points[node, 2] = 1.2
    return points, cells, {}, data


# Faces between regions are kept; final points to a tight tolerance.
REGIONS = {
    "flat": (two_materials, Options(**TIGHT)),
    "flat, boundary fixed": (two_materials, Options(boundary="fixed", **TIGHT)),
    "flat, by name, no bound": (two_materials, Options(hausdorff=0.0, interfaces="material", **TIGHT)),
    "flat, given": (two_materials, Options(interfaces=two_materials()[3]["material"], **TIGHT)),
    "numbered": (numbered, Options(**TIGHT)),
    "ignored": (two_materials, Options(interfaces="ignore", **TIGHT)),
    "curved": (core, Options(max_iterations=5, **TIGHT), SOLVED),
    "curved, boundary fixed": (core, Options(boundary="fixed", **TIGHT)),
    "curved, volumes kept": (core, Options(conserve_volume=True, max_iterations=2, **TIGHT), SOLVED),
    "curved, nothing on a rank": (core_far_apart, Options(hausdorff=1e-6, max_iterations=4, **TIGHT), SOLVED),
}
# As good as in one process.
GOOD_REGIONS = {
    "raised": (core, Options()),
    "raised, by patches": (core, Options(), PATCHES),
    "unfolded": (folded_core, Options(), PATCHES),
}
# Where faces inside cannot be kept within their bound.
HELD = {"held": (two_materials, Options(**TIGHT))}
