"""Faces of quadratic hexahedra as quads: how finely they have to be cut, and how far they have moved."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal.generate import box
from hexconformal.mesh import boundary_quads
from hexconformal.regularization.quadratic.curved_surface import CurvedSurface, largest_bend, needed_parts


def vault(along_x, along_y, cells=(1, 1, 1)):
    """A box whose lid is a parabola in each direction, so much higher in the middle, and its boundary."""
    mesh = hc.elevated(box(cells), 27)
    x, y, z = mesh.points.T
    up = z * (along_x * (1 - (2 * x - 1) ** 2) + along_y * (1 - (2 * y - 1) ** 2))
    return mesh.replaced(np.column_stack([x, y, z + up])), boundary_quads(mesh.table)[0]


@pytest.mark.parametrize("sizes", [(0.2, 0.0), (0.0, 0.2), (0.2, 0.1)])
def test_a_parabola_is_as_far_from_its_chord_as_its_height(sizes):
    mesh, quads = vault(*sizes)
    lid = quads[(vault(0.0, 0.0)[0].points[quads][:, :, 2] > 0.9).all(axis=1)]
    assert largest_bend(mesh, lid) == pytest.approx(sum(sizes), rel=1e-12)


def test_parts_follow_by_the_square_of_their_number_as_far_as_memory_allows():
    mesh, _ = vault(0.1, 0.0)
    assert [needed_parts(mesh, 1.0, tolerance) for tolerance in (1.0, 1 / 4, 1 / 16, 1 / 17)] == [2, 2, 4, 8]
    assert needed_parts(mesh, 1.0, 0.0) == 32
    assert needed_parts(mesh, 1.0, 0.0, 2, 8) == 8
    many = hc.elevated(box((10, 10, 10)), 20)
    parts = needed_parts(many, 1.0, 0.0)
    assert parts**3 * 1000 <= 1_000_000 < (2 * parts) ** 3 * 1000


def test_a_surface_that_is_flattened_has_moved_by_its_height_at_most():
    mesh, quads = vault(0.02, 0.0)
    flat = vault(0.0, 0.0)[0].points
    lid = quads[(flat[quads][:, :, 2] > 0.9).all(axis=1)]
    surface = CurvedSurface.of(mesh, lid, 1e-5)
    assert surface.hausdorff(flat, mesh.points, 1e-5) == pytest.approx(0.02, rel=2e-3)
    # Below a parabola is two thirds of the rectangle around it.
    assert surface.mean_distance(mesh.points, flat) == pytest.approx(0.02 * 2 / 3, rel=0.02)
    assert surface.mean_distance(mesh.points, mesh.points) == surface.hausdorff(flat, flat, 1e-5) == 0.0


def test_cells_of_two_types_of_which_few_are_at_the_faces():
    curved, cells = vault(0.1, 0.0, (2, 2, 4))[0], box((2, 2, 4))[1]
    straight = box((2, 2, 4))[0]
    points = np.vstack([straight + [2.0, 0.0, 0.0], curved.points])
    both = {"hexahedron20": curved.blocks[0].cells[:, :20] + len(straight), "hexahedron": cells}
    mesh = hc.MixedMesh.of_types(points, both)
    quads = boundary_quads(mesh.table)[0]
    for first, shape in ((0, "straight"), (len(straight), "curved")):
        own = quads[(quads >= first).all(axis=1) & (quads < first + len(straight)).all(axis=1)]
        top = own[(points[own][:, :, 2] > 0.95).all(axis=1)]
        assert len(top) == 4, shape
        surface = CurvedSurface.of(mesh, top, 1e-3)
        places = surface.matrix @ points
        assert places[:, 2].min() > 0.95
        x, y = (places[:, :2] - [0.0 if first else 2.0, 0.0]).T
        assert [x.min(), x.max(), y.min(), y.max()] == pytest.approx([0, 1, 0, 1], abs=1e-12)
        assert np.ptp(places[:, 2]) == pytest.approx(0.1 if first else 0.0, rel=1e-12, abs=1e-12)
        assert surface.hausdorff(points, points + [0.0, 0.0, 0.3], 1e-3) == pytest.approx(0.3, rel=1e-6)


def test_each_sheet_is_compared_with_itself():
    mesh = hc.elevated(hc.generate.box((1, 2, 3), (1.0, 2.0, 3.0)), 20)
    cells, moved = mesh.blocks[0].cells, mesh.points.copy()
    # Two planes change places: all of them together are where they were.
    inside = np.isin(mesh.points[:, 2], [1.0, 2.0])
    moved[inside, 2] = 3.0 - moved[inside, 2]
    faces = np.concatenate([cells[:2, 4:8], cells[2:4, 4:8]])
    for sheets, apart in ((None, 0.0), (np.array([0, 0, 1, 1]), 1.0)):
        surface = CurvedSurface.of(mesh, faces, 1e-3, sheets)
        assert surface.hausdorff(mesh.points, moved, 1e-3) == pytest.approx(apart, abs=1e-9)
