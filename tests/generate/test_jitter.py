"""Jittered meshes."""

import numpy as np
import pytest

from hexconformal import OptionError, as_volume_mesh, generate, quality
from hexconformal.elements import all_valid, is_valid
from hexconformal.mesh.topology import boundary_quads


def test_jitter_is_reproducible_and_harmless_to_its_input():
    points, cells = generate.box((6, 6, 6))
    points.flags.writeable = cells.flags.writeable = False
    one, _ = generate.jittered(points, cells, amount=0.9, seed=3)
    np.testing.assert_array_equal(one, generate.jittered(points, cells, amount=0.9, seed=3)[0])
    assert (one != generate.jittered(points, cells, amount=0.9, seed=4)[0]).any()
    outside = np.unique(boundary_quads(cells)[0])
    np.testing.assert_array_equal(one[outside], points[outside])
    assert np.abs(one - points).max() > 0.3 / 6
    assert all_valid(one, cells)
    loose, _ = generate.jittered(points, cells, amount=0.2, keep_boundary=False)
    assert (loose[outside] != points[outside]).any()
    tangled, _ = generate.jittered(points, cells, amount=0.9, seed=3, valid=False)
    assert not all_valid(tangled, cells)


def test_jitter_leaves_bad_cells_to_themselves():
    points, cells = generate.box((5, 5, 5))
    cells = cells.copy()
    cells[62] = cells[62][[4, 5, 6, 7, 0, 1, 2, 3]]
    moved, _ = generate.jittered(points, cells, amount=0.9)
    assert np.flatnonzero(~is_valid(moved, cells)).tolist() == [62]
    inside = np.setdiff1d(cells[62], boundary_quads(cells)[0])
    assert (np.linalg.norm(moved - points, axis=1)[inside] > 0.01).all()


def test_meshes_of_all_linear_types_are_shaken():
    points, cells = generate.swept_cylinder(3, 2, 4)
    outside = np.isclose(np.hypot(points[:, 0], points[:, 1]), 1.0) | np.isin(points[:, 2], [0.0, 2.0])
    for valid, amount in ((True, 0.4), (False, 0.9)):
        moved, same = generate.jittered(points, cells, amount, valid=valid)
        assert same is cells
        np.testing.assert_array_equal(moved[outside], points[outside])
        assert (np.abs(moved - points)[~outside].max(axis=1) > 0.0).all()
        # The axis has six wedges of edges that are .2 long, and heights of .5.
        axis = (points[:, :2] == 0.0).all(axis=1) & ~outside
        assert 0.5 * amount * 0.2 < np.abs(moved - points)[axis].max() <= amount * 0.2 + 1e-12
        assert quality(as_volume_mesh((moved, cells))).valid.all() == valid
    with pytest.raises(OptionError, match="must be linear, hexahedron, wedge, pyramid, tetra, not hexahedron27"):
        generate.jittered(*generate.curved_ball(1, 1))
