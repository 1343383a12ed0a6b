"""Meshes of wedges, pyramids and tetrahedra move as those of hexahedra do, alone or mixed with these."""

import numpy as np
import pytest
from meshes.hexahedra import cube_in_cube, turned
from meshes.mixed import cut_up, jittered_inside, mixed_block, shuffled_grid, smallest_determinants

import hexconformal as hc
from hexconformal import MeshError
from hexconformal.generate import bent_bar, box
from hexconformal.mesh import MixedMesh, boundary_quads, collapsed_mesh


def minima(mesh):
    return {name: one.scaled_jacobian.min for name, one in hc.quality(mesh).summary().types.items()}


def around_a_cube(kind):
    """A cube in a cube, cut up, and its inner and outer nodes."""
    points, cells, inner, outer = cube_in_cube(9)
    x, _, _ = centres = points[cells].mean(axis=1).T
    reach = np.abs(centres).max(axis=0)
    kinds = {
        "wedges beside hexahedra": np.where(x > 0.0, "wedge", "hexahedron"),
        "tetrahedra": np.full(len(cells), "tetra"),
        "hexahedra inside tetrahedra": np.where(reach < 1.0, "hexahedron", "tetra"),
        "tetrahedra inside hexahedra": np.where(reach < 1.0, "tetra", "hexahedron"),
    }
    return cut_up(points, cells, kinds[kind]), inner, outer


# Shares of the smallest scaled Jacobian that are left at 30 degrees; hexahedra alone keep .39.
CUBES = {
    "wedges beside hexahedra": {"wedge": 0.25, "hexahedron": 0.33},
    "tetrahedra": {"tetra": 0.17},
    "hexahedra inside tetrahedra": {"hexahedron": 0.3, "pyramid": 0.65, "tetra": 0.55},
    "tetrahedra inside hexahedra": {"tetra": 0.2, "pyramid": 0.5, "hexahedron": 0.75},
}


@pytest.mark.parametrize("kind", CUBES)
def test_a_cube_turns_in_a_cube_and_back(kind):
    mesh, inner, outer = around_a_cube(kind)
    motion, start = hc.MeshMotion(mesh, inner, outer), minima(mesh)
    for degrees in (15, 30, 45):
        step = motion.step(turned(mesh.points[inner], [0, 0, 1], degrees))
        assert not step.report.refused
        moved = mesh.replaced(step.points)
        assert (smallest_determinants(moved, 5) > 0).all()
        assert hc.quality(moved).valid.all()
        assert step.report.types == pytest.approx(minima(moved))
        goal = mesh.points[inner] + turned(mesh.points[inner], [0, 0, 1], degrees)
        np.testing.assert_allclose(step.points[inner], goal, atol=1e-14)
        np.testing.assert_array_equal(step.points[outer], mesh.points[outer])
        if degrees == 30:
            shares = {name: least / start[name] for name, least in step.report.types.items()}
            assert all(shares[name] > least for name, least in CUBES[kind].items()), shares
    for degrees in (20, 0):
        step = motion.step(turned(mesh.points[inner], [0, 0, 1], degrees))
    np.testing.assert_array_equal(step.points, mesh.points)


def bent(points, degrees):
    """The places of points of a bar along x when it is bent as `bent_bar` is."""
    length = np.ptp(points[:, 0])
    angle = np.radians(degrees) * points[:, 0] / length
    radius, middle = length / np.radians(degrees), points[:, 1].mean()
    distance = radius - (points[:, 1] - middle)
    return np.column_stack([distance * np.sin(angle), radius + middle - distance * np.cos(angle), points[:, 2]])


@pytest.mark.parametrize("operator", ["conformal", "harmonic", "elastic"])
def test_a_bar_of_all_types_whose_surface_is_bent(operator):
    mesh = mixed_block(3)
    on = np.unique(boundary_quads(collapsed_mesh(mesh).cells)[0])
    motion = hc.MeshMotion(mesh, on, operator=operator)
    for degrees in (30, 60, 90):
        goal = bent(mesh.points, degrees)
        step = motion.step((goal - mesh.points)[on])
        assert not step.report.refused
        assert (smallest_determinants(mesh.replaced(step.points), 5) > 0).all()
        # The map of the whole bar is what a perfect extension would be.
        best = minima(mesh.replaced(goal))
        least = 0.9 if operator == "conformal" else 0.5
        assert all(step.report.types[name] > least * best[name] for name in best), (step.report.types, best)
        if operator == "conformal":
            assert np.linalg.norm(step.points - goal, axis=1).max() < 0.07


def test_the_test_bends_as_the_generator_does():
    straight, _ = box((6, 2, 2), (4.0, 1.0, 1.0), (0.0, -0.5, -0.5))
    np.testing.assert_allclose(bent(straight, 70.0), bent_bar((6, 2, 2), 70.0)[0], atol=1e-12)


def test_a_similarity_of_the_boundary_is_that_of_all_cells():
    mesh = jittered_inside(mixed_block(2), 0.12, seed=4)
    on = np.unique(boundary_quads(collapsed_mesh(mesh).cells)[0])
    goal = 1.3 * (mesh.points + turned(mesh.points.copy(), [1, 2, 3], 40)) + [1, 2, 3]
    motion = hc.MeshMotion(mesh, on, energy_tolerance=1e-12)
    np.testing.assert_allclose(motion.step((goal - mesh.points)[on]).points, goal, atol=1e-5)


@pytest.mark.parametrize("kinds", [["hexahedron", "wedge"], ["tetra", "tetra"]], ids=str)
def test_an_elastic_extension_of_a_linear_field_is_that_field(kinds):
    # Cells of the same volume, and so of the same stiffness: cubes that are cut into wedges are twice as long.
    points, cubes = box((4, 3, 3), (4.0, 3.0, 3.0))
    points[:, 0] += (points[:, 0] - 2.0).clip(0.0) * (kinds == ["hexahedron", "wedge"])
    mesh = cut_up(points, cubes, np.array(kinds)[(points[cubes].mean(axis=1)[:, 0] > 2.0).astype(int)])
    assert np.ptp(hc.quality(mesh).volume) < 1e-12
    mesh = mesh.replaced(mesh.points @ np.array([[1.0, 0.2, 0.0], [0.1, 0.9, 0.1], [0.0, 0.3, 1.2]]))
    on = np.unique(boundary_quads(collapsed_mesh(mesh).cells)[0])
    field = mesh.points @ np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.3], [0.05, 0.0, 0.1]])
    motion = hc.MeshMotion(mesh, on, operator="elastic")
    np.testing.assert_allclose(motion.step(field[on]).points, mesh.points + field, atol=1e-7)


def test_the_order_of_cells_and_of_wedges_changes_nothing_and_ids_are_those_of_the_mesh():
    mesh, inner, outer = around_a_cube("wedges beside hexahedra")
    grid = shuffled_grid(mesh, seed=3)
    blocks = {block.cell_type.name: block.cells for block in mesh.blocks}
    turned_over = MixedMesh.of_types(
        mesh.points, {"wedge": blocks["wedge"][:, [3, 4, 5, 0, 1, 2]], "hexahedron": blocks["hexahedron"]}
    )
    steps = []
    for one in (mesh, grid, turned_over):
        motion = hc.MeshMotion(one, inner, outer, operator="harmonic")
        steps.append(motion.step(turned(mesh.points[inner], [0, 0, 1], 90)))
    for step in steps:
        np.testing.assert_allclose(step.points, steps[0].points, atol=1e-9)
        assert step.report.refused
    solid = np.flatnonzero(grid.celltypes != 9)
    quads, tables = [], (mesh.table, hc.as_volume_mesh(grid).table, turned_over.table)
    for step, table in zip(steps, tables, strict=True):
        quads.append({frozenset(cell) for cell in table[step.report.blocked].tolist()})
        assert 0 < len(step.report.blocked) < 50
    assert quads[0] == quads[1] == quads[2]
    # The message has the ids of the grid, which has two quadrilaterals among its cells.
    first = str(solid[steps[1].report.blocked][0])
    assert f"(ids {first}" in steps[1].report.reason


def test_interfaces_of_triangles_and_quadrilaterals_are_carried():
    mesh = mixed_block(2)
    x = mesh.points[collapsed_mesh(mesh).cells].mean(axis=1)[:, 0]
    material = np.digitize(x, [3.0, 6.0])
    mesh = MixedMesh(mesh.points, mesh.blocks, {}, {"material": material})
    wall = np.flatnonzero(mesh.points[:, 0] == 0.0)
    far = mesh.points[:, 0] == 8.0
    motion = hc.MeshMotion(mesh, wall, far)
    plane = np.flatnonzero(np.isin(mesh.points[:, 0], [3.0, 6.0]))
    np.testing.assert_array_equal(motion.carried, plane)
    assert "3 regions (array 'material': 0, 1, 2), 12 faces between them" in motion.notes[-1]
    push = np.tile([2.0, 0.0, 0.0], (len(wall), 1))
    direct = motion.step(push).points
    # In a row of cells that follow each other the extension falls from 2 to 0.
    assert ((direct[plane, 0] - mesh.points[plane, 0]) > 0.2).all()
    assert ((direct[plane, 0] - mesh.points[plane, 0]) < 1.8).all()
    for share in (0.5, 1.2, 1.0):
        stepped = motion.step(share * push).points
    np.testing.assert_allclose(stepped[plane], direct[plane], atol=1e-12)
    ignored = hc.MeshMotion(mesh, wall, far, interfaces="ignore").step(push).points
    assert np.abs(ignored[plane] - direct[plane]).max() > 1e-3


@pytest.mark.parametrize("target", ["input", "current"])
def test_a_restart_goes_on_as_if_nothing_had_been(target):
    mesh, inner, outer = around_a_cube("hexahedra inside tetrahedra")
    whole, other = (hc.MeshMotion(mesh, inner, outer, target=target) for _ in range(2))
    whole.step(turned(mesh.points[inner], [0, 0, 1], 10))
    other.resume(whole.state())
    goal = turned(mesh.points[inner], [0, 0, 1], 20)
    np.testing.assert_array_equal(whole.step(goal).points, other.step(goal).points)


def test_walls_slide_on_triangles_and_quadrilaterals():
    mesh = mixed_block(2)
    piston = np.flatnonzero(mesh.points[:, 0] == 0.0)
    step = hc.MeshMotion(mesh, piston).step(np.tile([2.0, 0.0, 0.0], (len(piston), 1)))
    assert not step.report.refused
    for axis in (1, 2):
        for side in (0.0, 2.0):
            on = mesh.points[:, axis] == side
            np.testing.assert_array_equal(step.points[on, axis], side)
    walls = (mesh.points[:, 1] == 0.0) & (mesh.points[:, 0] > 0.0) & (mesh.points[:, 0] < 8.0)
    assert (step.points[walls, 0] - mesh.points[walls, 0] > 0.05).all()


def test_quadratic_cells_are_refused_by_name():
    curved = hc.elevated(box((2, 2, 2)), 20)
    for mesh in (curved, curved.to_source_type()):
        with pytest.raises(
            MeshError, match=r"8 hexahedra of 20 nodes; .* as they are, this by their corners, as_volume_mesh"
        ):
            hc.MeshMotion(mesh, [0])


def test_cells_that_are_invalid_are_named_by_the_ids_of_the_mesh():
    mesh = mixed_block(1)
    points = mesh.points.copy()
    points[len(points) - 1] = [3.5, 0.5, 1.5]  # the centre of the last cube, out through its top
    grid = shuffled_grid(mesh.replaced(points), seed=1)
    bad = np.flatnonzero(~hc.quality(grid).valid)
    rows = np.flatnonzero(grid.celltypes != 9)[bad]
    with pytest.raises(MeshError, match=rf"must be valid at the start: {len(rows)} \(ids {rows[0]}"):
        hc.MeshMotion(grid, [0])
