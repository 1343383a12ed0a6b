"""Runs on quadratic cells of all types, alone and beside others, whose inner nodes are off."""

import numpy as np
import pytest
from meshes.mixed import cut_into_pyramids, cut_into_tetrahedra, mixed_block
from meshes.quadratic_cells import raised, rounded

import hexconformal as hc
from hexconformal.elements import SECOND_ORDER

MOST = {"hexahedron": 27, "wedge": 18, "pyramid": 14, "tetra": 10}
FEWEST = {"hexahedron": 20, "wedge": 15, "pyramid": 13, "tetra": 10}
each_number = pytest.mark.parametrize("nodes", [FEWEST, MOST], ids=["fewest", "all"])
# Linear meshes of each type, with a round boundary, and the axes in which it is round.
ROUND = {
    "tetra": (lambda: cut_into_tetrahedra(*hc.generate.ball(2, 2)), [0, 1, 2]),
    "pyramid": (lambda: cut_into_pyramids(*hc.generate.ball(2, 1)), [0, 1, 2]),
    "wedge": (lambda: hc.as_volume_mesh(hc.generate.swept_cylinder(2, 1, 3)), [0, 1]),
}


def perturbed(mesh, outside, amount, seed=0):
    """The mesh with inner nodes off by up to `amount` edges along each axis."""
    block = mesh.blocks[0]
    ends = mesh.points[block.cells[:, block.cell_type.edges]]
    edge = np.median(np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2))
    moves = np.random.default_rng(seed).uniform(-amount * edge, amount * edge, mesh.points.shape)
    return mesh.replaced(mesh.points + ~outside[:, None] * moves)


def round_body(name, nodes):
    """A body with curved cells, and which of its nodes are on the boundary."""
    make, axes = ROUND[name]
    mesh, outside, numbers = raised(make(), nodes)
    return rounded(mesh, outside, numbers, axes), outside


@each_number
@pytest.mark.parametrize("name", list(ROUND))
def test_tangled_round_bodies_are_unfolded_within_a_boundary_that_stays(name, nodes):
    first, outside = round_body(name, nodes)
    assert hc.quality(first).valid.all()
    tangled = perturbed(first, outside, 0.2)
    assert (~hc.quality(tangled).valid).mean() > 0.3
    result = hc.regularize(tangled, boundary="fixed")
    assert result.report.after.invalid == 0
    assert result.report.after.scaled_jacobian.min > 0.8 * hc.quality(first).scaled_jacobian.min()
    np.testing.assert_array_equal(result.points[outside], first.points[outside])


@pytest.mark.long
@each_number
@pytest.mark.parametrize("name", list(ROUND))
def test_on_a_round_boundary_nodes_slide(name, nodes):
    (first, outside), axes = round_body(name, nodes), ROUND[name][1]
    result = hc.regularize(perturbed(first, outside, 0.2), hausdorff=0.02)
    assert result.report.after.invalid == 0
    assert result.report.boundary_moved > 0.3 * outside.sum()
    assert 0 < result.report.hausdorff <= 0.02
    on_round = outside & np.isclose(np.linalg.norm(first.points[:, axes], axis=1), 1.0)
    # Quadratic faces are this far away from the round surface, between nodes that lie on it.
    away = np.abs(np.linalg.norm(result.points[on_round][:, axes], axis=1) - 1.0)
    assert away.max() < 0.03
    held = hc.regularize(perturbed(first, outside, 0.2), boundary="fixed")
    assert result.report.after.scaled_jacobian.min > held.report.after.scaled_jacobian.min - 0.02


@each_number
@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_all_types_beside_each_other(nodes, boundary):
    mesh, outside, _ = raised(mixed_block(2), nodes)
    assert len(mesh.blocks) == 4
    tangled = perturbed(mesh, outside, 0.2)
    assert (~hc.quality(tangled).valid).mean() > 0.2
    result = hc.regularize(tangled, boundary=boundary)
    assert result.report.after.invalid == 0
    assert set(result.report.after.types) == {one.cell_type.name for one in mesh.blocks}
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    np.testing.assert_allclose(result.points.min(axis=0), low, atol=1e-12)
    np.testing.assert_allclose(result.points.max(axis=0), high, atol=1e-12)
    for axis in range(3):
        for end in (low, high):
            on = outside & (mesh.points[:, axis] == end[axis])
            np.testing.assert_allclose(result.points[on, axis], end[axis], atol=1e-12)
    if boundary == "fixed":
        np.testing.assert_array_equal(result.points[outside], tangled.points[outside])


@each_number
def test_interfaces_of_quadrilaterals_and_of_triangles_stay(nodes):
    mesh, outside, _ = raised(mixed_block(2), nodes)
    places = np.empty(sum(len(one.cells) for one in mesh.blocks))
    for one in mesh.blocks:
        places[one.places] = mesh.points[one.cells].mean(axis=1)[:, 0]
    # Wedges and hexahedra, pyramids with tetrahedra, and tetrahedra.
    region = np.digitize(places, [4.0, 6.0])
    between = np.isin(mesh.points[:, 0], [4.0, 6.0])
    tangled = perturbed(mesh, outside | between, 0.15).replaced(cell_data={"region": region})
    assert not hc.quality(tangled).valid.all()
    result = hc.regularize(tangled, interfaces="region")
    assert result.report.after.invalid == 0
    assert [(row.regions, row.quads) for row in result.report.interfaces] == [(("0", "1"), 4), (("1", "2"), 8)]
    assert all(row.distance < 1e-9 for row in result.report.interfaces)
    np.testing.assert_allclose(result.points[between, 0], mesh.points[between, 0], atol=1e-9)
    assert np.ptp(result.points[between] - tangled.points[between], axis=0)[1:].min() > 1e-3


@pytest.mark.parametrize("linear", ["tetra", "wedge", "pyramid"])
def test_linear_cells_beside_quadratic_ones(linear):
    curved, outside, _ = raised(hc.as_volume_mesh(hc.generate.box((2, 2, 2))), FEWEST)
    curved = perturbed(curved, outside, 0.2)
    other = {
        "tetra": lambda: cut_into_tetrahedra(*hc.generate.box((2, 2, 2))),
        "pyramid": lambda: cut_into_pyramids(*hc.generate.box((2, 2, 2))),
        "wedge": lambda: hc.as_volume_mesh(hc.generate.swept_cylinder(2, 1, 2)),
    }[linear]()
    count = len(curved.points)
    cells = {"hexahedron20": curved.blocks[0].cells}
    cells |= {one.cell_type.name: one.cells + count for one in other.blocks}
    both = hc.MixedMesh.of_types(np.vstack([curved.points, other.points + [5.0, 0.0, 0.0]]), cells)
    report = hc.regularize(both, boundary="fixed").report
    assert report.after.invalid == 0
    assert linear in report.after.types


@pytest.mark.parametrize("name", ["tetra", "wedge"])
def test_where_the_order_differs_the_result_is_the_same_but_for_that(name):
    mesh, outside = round_body(name, FEWEST)
    mesh = perturbed(mesh, outside, 0.1)
    order = np.random.default_rng(1).permutation(len(mesh.points))
    cells = {one.cell_type.name: np.argsort(order)[one.cells] for one in mesh.blocks}
    shuffled = hc.MixedMesh.of_types(mesh.points[order], cells)
    one, other = (hc.regularize(each, boundary="fixed").report.after for each in (mesh, shuffled))
    assert one.scaled_jacobian.min == pytest.approx(other.scaled_jacobian.min, abs=0.02)
    assert one.scaled_jacobian.mean == pytest.approx(other.scaled_jacobian.mean, abs=0.005)


def test_a_flat_cell_alone_is_told_and_ends_no_run():
    """Of one flat cell two corners of which are in one place there is no energy whose fall could be measured."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.0]])
    points = np.concatenate([corners, [corners[list(ends)].mean(axis=0) for ends in SECOND_ORDER["tetra10"][1]]])
    report = hc.regularize((points, {"tetra10": [range(10)]})).report
    assert report.after.invalid == 1
    assert not report.converged
