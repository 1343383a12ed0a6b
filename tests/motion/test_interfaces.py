"""Interfaces between regions in a mesh that moves."""

import numpy as np
import pytest
from meshes.hexahedra import cube_in_cube, turned

import hexconformal as hc
from hexconformal.generate import box, jittered

POINTS, CELLS = jittered(*box((8, 5, 5), (2.0, 1.0, 1.0)), 0.15, seed=3)
POINTS[np.abs(POINTS[:, 0] - 1.0) < 0.1, 0] = 1.0
MATERIAL = np.where(POINTS[CELLS].mean(axis=1)[:, 0] < 1.0, 4, 9)
WALL, PLANE = (np.flatnonzero(POINTS[:, 0] == x) for x in (0.0, 1.0))
EVEN = np.tile([0.5, 0.0, 0.0], (len(WALL), 1))
Y, Z = POINTS[WALL, 1:].T
BUMP = np.stack([0.4 * np.sin(np.pi * Y) ** 2 * np.sin(np.pi * Z) ** 2, 0 * Y, 0 * Y], axis=1)


def motion(moving=WALL, data=MATERIAL, **options):
    mesh = hc.HexMesh(POINTS, CELLS, cell_data={} if data is None else {"material": data})
    return hc.MeshMotion(mesh, moving, **options)


def volumes(points):
    volume = hc.quality((points, CELLS)).volume
    return np.array([volume[number == MATERIAL].sum() for number in (4, 9)])


def test_a_flat_interface_stays_flat_where_a_wall_comes_as_a_whole():
    # The linear extension of 0.5 at x = 0 and 0 at x = 2 is 0.25 at x = 1.
    points = motion().step(EVEN).points
    np.testing.assert_allclose(points[PLANE], POINTS[PLANE] + [0.25, 0, 0], atol=1e-7)
    assert volumes(points) == pytest.approx([0.75, 0.75], abs=1e-7)
    ignored = motion(interfaces="ignore").step(EVEN).points
    assert np.abs(ignored[PLANE] - points[PLANE]).max() > 1e-3


def interface_quads():
    """Quads of the plane, from the cells on one side of it."""
    near = CELLS[MATERIAL == 4]
    on = np.isin(near, PLANE)
    touching = near[on.sum(axis=1) == 4]
    return touching[:, [1, 2, 6, 5]]


def test_an_interface_before_a_wall_that_bulges_is_smooth_and_has_the_volumes_of_an_extension():
    points = motion().step(BUMP).points
    # In a harmonic field between insulated walls the mean over sections is linear in x: half of the wall's at x = 1.
    pressed = 2.0 - volumes(points).sum()
    assert pressed > 0.05
    assert volumes(points) == pytest.approx([1 - pressed / 2, 1 - pressed / 2], rel=2e-3)

    def unevenness(x):
        a, b, c, d = np.moveaxis(x[interface_quads(), 0], 1, 0)
        return np.abs(a - b + c - d).max()

    ignored = motion(interfaces="ignore").step(BUMP).points
    assert unevenness(points) < 0.5 * unevenness(ignored)


def test_its_place_depends_on_the_displacement_alone():
    one, two = motion(), motion()
    direct = one.step(BUMP).points
    for share in (0.3, 0.8, 1.2, 1.0):
        stepped = two.step(share * BUMP).points
    np.testing.assert_allclose(stepped[PLANE], direct[PLANE], atol=1e-12)
    np.testing.assert_array_equal(two.step(0 * BUMP).points, POINTS)


def test_nodes_of_an_interface_that_are_given_go_there_and_the_others_follow():
    given = PLANE[(np.abs(POINTS[PLANE, 1:] - 0.5) < 0.35).all(axis=1)]
    displacement = np.tile([0.1, 0.0, 0.02], (len(given), 1))
    moved = motion(given)
    points = moved.step(displacement).points
    np.testing.assert_allclose(points[given], POINTS[given] + displacement, atol=1e-14)
    np.testing.assert_array_equal(moved.carried, np.setdiff1d(PLANE, given))
    assert 0.01 < (points[moved.carried, 0] - 1.0).min() < 0.1
    assert moved.notes == (
        "interfaces: 2 regions (array 'material': 4, 9), 25 faces between them move as the displacement is extended: "
        f"{len(given)} of their nodes are given, {len(moved.carried)} follow",
    )
    whole = motion(PLANE)
    everywhere = np.tile([0.1, 0.0, 0.0], (len(PLANE), 1))
    np.testing.assert_array_equal(
        whole.step(everywhere).points, motion(PLANE, interfaces="ignore").step(everywhere).points
    )


@pytest.mark.parametrize("operator", ["conformal", "harmonic", "elastic"])
def test_without_regions_or_where_they_are_ignored_nothing_is_carried(operator):
    plain, ignored = motion(data=None, operator=operator), motion(interfaces="ignore", operator=operator)
    assert plain.notes == ignored.notes == ()
    expected = plain.step(BUMP).points
    np.testing.assert_array_equal(ignored.step(BUMP).points, expected)
    if operator != "conformal":
        # A linear operator extends the displacement itself.
        np.testing.assert_array_equal(motion(operator=operator).step(BUMP).points, expected)


def test_the_harmonic_operator_and_what_is_carried_agree():
    carried, linear = motion().step(BUMP).points, motion(operator="harmonic").step(BUMP).points
    np.testing.assert_allclose(carried[PLANE], linear[PLANE], atol=1e-7)
    assert np.abs(carried - linear).max() > 1e-3


def test_arrays_are_named_or_given_and_refused():
    np.testing.assert_array_equal(motion(data=None, interfaces=MATERIAL).carried, PLANE)
    np.testing.assert_array_equal(motion(interfaces="material").carried, PLANE)
    with pytest.raises(hc.OptionError, match="interfaces must be 'auto', 'ignore' or an array on cells"):
        motion(interfaces="phase")


@pytest.mark.long
def test_a_shell_around_a_cube_turns_with_it():
    points, cells, inner, outer = cube_in_cube()
    reach = np.abs(points - points.mean(axis=0)).max(axis=1)
    material = np.where(reach[cells].mean(axis=1) < 1.0, 1, 2)
    mesh = hc.HexMesh(points, cells, cell_data={"material": material})
    shell = hc.MeshMotion(mesh, inner, outer)
    np.testing.assert_array_equal(shell.carried, np.flatnonzero(np.abs(reach - 1.0) < 1e-9))
    for degrees in range(10, 121, 10):
        step = shell.step(turned(points[inner], [0, 0, 1], degrees))
        assert not step.report.refused


def test_a_restart_goes_on_with_the_same_interface():
    first = motion()
    first.step(0.5 * BUMP)
    second = motion()
    second.resume(first.state())
    np.testing.assert_array_equal(second.step(BUMP).points, first.step(BUMP).points)
