"""Meshes and options that programs on ranks, and the tests that compare with one process, share."""

import numpy as np

from hexconformal import Options, generate

TIGHT = {"gradient_tolerance": 1e-12, "emphasis": "mean"}


def clustered():
    """Nodes crowded inside an eighth of a cube, a block of them free: on four ranks one has none on the boundary."""
    line = np.concatenate([[0.0], np.linspace(0.26, 0.49, 8), [1.0]])
    points, cells = generate.box((9, 9, 9))
    places = np.rint(9.0 * points).astype(int)
    points, inner = line[places], ((places > 1) & (places < 8)).all(axis=1)
    points[inner] += np.random.default_rng(5).uniform(-0.008, 0.008, (inner.sum(), 3))
    return points, cells, {"held": ~inner}


def far_apart():
    """A small block, far away from one cell: the curve has no room to cut the block, so some ranks have nothing."""
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 0.2, seed=2)
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


def twisted():
    return generate.jittered(*generate.twisted_cube(5), 0.1, seed=3)


def ball():
    return generate.jittered(*generate.ball(4, 3), 0.2, seed=1)


# Final points to a tight tolerance.
CASES = {
    "fixed": (twisted, Options(boundary="fixed", **TIGHT)),
    "fixed, quaternionic": (twisted, Options(boundary="fixed", energy="quaternionic", **TIGHT)),
    "flat faces slide": (block, Options(**TIGHT)),
    "flat faces slide, quaternionic": (block, Options(energy="quaternionic", weight="volume", **TIGHT)),
    "curved faces stay": (twisted, Options(hausdorff=0.0, method="newton", target="1:1:2", **TIGHT)),
    "fixed, convex": (twisted, Options(boundary="fixed", method="majorize", **TIGHT)),
    "no boundary on a rank": (
        clustered,
        Options(boundary="fixed", fixed="held", target="cube", **TIGHT),
    ),
    "nothing on a rank": (far_apart, Options(boundary="fixed", **TIGHT)),
    "bad cells on a rank": (folding, Options(boundary="fixed", energy="quaternionic", target="cube", **TIGHT)),
}
# Patches of ranks are not those of one process: what counts is how good cells are.
GOOD = {"worst cells are raised": (ball, Options(boundary="fixed"))}
