"""How often a surface winds around a point, and surfaces that no valid mesh can have."""

import numpy as np
import pytest

from hexconformal import generate, regularize
from hexconformal.elements.hexahedron import FACES
from hexconformal.mesh.hex_mesh import HexMesh
from hexconformal.mesh.topology import boundary_quads
from hexconformal.quality.winding_number import inside_out, winding_number


def test_a_ball_is_wound_around_once_and_what_is_outside_not_at_all():
    points, cells = generate.ball(4, 2)
    quads = points[boundary_quads(cells)[0]]
    radius = np.linalg.norm(points, axis=1).max()
    for direction in np.random.default_rng(0).normal(size=(5, 3)):
        direction /= np.linalg.norm(direction)
        assert winding_number(0.9 * radius * direction, quads) == pytest.approx(1.0, abs=1e-12)
        assert winding_number(1.01 * radius * direction, quads) == pytest.approx(0.0, abs=1e-12)


def test_winding_numbers_of_tangled_cells_add_up_to_that_of_the_boundary():
    # Faces inside cancel only if the solid angle of a twisted quad does not depend on how it is cut.
    points, cells = generate.jittered(*generate.box((3, 3, 3)), 4.0, seed=2, valid=False)
    boundary = points[boundary_quads(cells)[0]]
    rng, seen = np.random.default_rng(1), set()
    for point in rng.uniform(0, 1, (60, 3)):
        single = [winding_number(point, points[cell[FACES]]) for cell in cells]
        assert np.abs(np.round(single) - single).max() < 1e-12
        assert sum(single) == pytest.approx(winding_number(point, boundary), abs=1e-9)
        seen |= set(np.round(single).astype(int).tolist())
    assert -1 in seen


def folded_box():
    """A box of 4^3 cells whose corner has been pulled through the whole box and out on the other side."""
    points, cells = generate.box((4, 4, 4))
    points = points.copy()
    points[np.argmin(points.sum(axis=1))] = 1.6
    return points, cells


def test_a_corner_pulled_through_the_box_turns_the_surface_inside_out():
    points, cells = folded_box()
    quads = boundary_quads(cells)[0]
    found = inside_out(points, quads, np.arange(len(quads)))
    # The tip is outside, and so is what it passes on its way out.
    tip, far = np.argsort(points.sum(axis=1))[[-1, -2]]
    for node in tip, far:
        assert set(np.flatnonzero((quads == node).any(axis=1))) <= set(found)
    assert np.isin(quads[found], [tip, far]).any(axis=1).all()


@pytest.mark.parametrize("mesh", [generate.twisted_cube(4), generate.ball(3, 2)], ids=["twisted", "ball"])
def test_surfaces_of_valid_meshes_are_never_inside_out(mesh):
    points, cells = generate.jittered(*mesh, 0.6, seed=4)
    quads = boundary_quads(cells)[0]
    assert len(inside_out(points, quads, np.arange(len(quads)))) == 0


def test_the_report_says_that_no_valid_mesh_has_this_surface():
    result = regularize(HexMesh(*folded_box()), boundary="fixed")
    assert result.report.after.inverted > 0
    assert any("inside out" in note and "no valid mesh has it" in note for note in result.report.notes)
