"""Interfaces between regions are kept by regularization."""

import numpy as np
import pytest

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh import interface_quads


def two_materials(seed=1):
    """A box of two materials that meet in a plane, not where regular cells would; inner nodes jittered."""
    points, cells = generate.box((8, 5, 5))
    x = points[:, 0].copy()
    material = np.where(points[cells].mean(axis=1)[:, 0] < 0.5, 1, 2)
    plane, inside = x == 0.5, ((points > 0) & (points < points.max(axis=0))).all(axis=1)
    shift = 0.05 * np.random.default_rng(seed).uniform(-1, 1, points.shape) * inside[:, None]
    shift[plane, 0] = 0.0
    shift[:, 0] += 0.13 * np.sin(np.pi * x)
    return points + shift, cells, material, plane


def fibre():
    """A round fibre along the axis of a cylinder."""
    points, cells = generate.cylinder(4, 3, 4)
    radius = np.hypot(*points[:, :2].T)
    of_cells = np.hypot(*points[cells].mean(axis=1)[:, :2].T)
    levels = np.unique(radius.round(9))
    material = np.where(of_cells < levels[np.abs(levels - 0.8).argmin()], 1, 2)
    return generate.jittered(points, cells, 0.2, seed=4), material


def meshed(points, cells, material):
    return hc.HexMesh(points, cells, cell_data={"material": material})


@pytest.mark.parametrize("options", [{}, {"boundary": "fixed"}, {"hausdorff": 0.0}, {"boundary": "free"}])
def test_a_flat_interface_stays_in_its_plane_where_nodes_slide(options):
    points, cells, material, plane = two_materials()
    result = hc.regularize(meshed(points, cells, material), **options)
    assert np.ptp(result.points[plane, 0]) < 1e-15
    assert np.abs(result.points[plane, 0] - points[plane, 0]).max() < 1e-15
    assert np.abs(result.points[plane] - points[plane]).max() > 0.01
    assert any("2 regions (array 'material': 1, 2)" in note for note in result.report.notes)
    assert result.report.after.scaled_jacobian.mean > result.report.before.scaled_jacobian.mean
    # Without a word it would have moved.
    ignored = hc.regularize(meshed(points, cells, material), interfaces="ignore", **options)
    assert np.abs(ignored.points[plane, 0] - points[plane, 0]).max() > 0.01
    assert not any("interfaces" in note for note in ignored.report.notes)


def test_volumes_of_both_sides_of_a_flat_interface_stay():
    points, cells, material, _ = two_materials()
    result = hc.regularize(meshed(points, cells, material))
    before, after = (hc.quality((x, cells)).volume for x in (points, result.points))
    for number in (1, 2):
        assert after[material == number].sum() == pytest.approx(before[material == number].sum(), rel=1e-12)


def test_a_curved_interface_stays():
    (points, cells), material = fibre()
    nodes = np.unique(interface_quads(cells, material))
    result = hc.regularize(meshed(points, cells, material))
    assert 0 < len(nodes) < len(points)
    radii = [np.hypot(*x[nodes, :2].T) for x in (points, result.points)]
    np.testing.assert_allclose(radii[1], radii[0], atol=1e-12)
    assert result.report.after.invalid == 0
    assert result.report.largest_displacement > 0.01


def test_a_tangled_mesh_is_unfolded_with_its_interface_kept():
    points, cells, material, plane = two_materials()
    inner = ((points > 0) & (points < points.max(axis=0))).all(axis=1) & ~plane
    points = points + 0.2 * np.random.default_rng(5).uniform(-1, 1, points.shape) * inner[:, None]
    assert (hc.quality((points, cells)).scaled_jacobian <= 0).sum() > 5
    result = hc.regularize(meshed(points, cells, material))
    assert result.report.after.invalid == 0
    assert np.abs(result.points[plane, 0] - points[plane, 0]).max() < 1e-15


def test_an_interface_with_coincident_nodes_is_no_obstacle():
    points, cells, material, plane = two_materials()
    inside = np.flatnonzero(plane & (np.abs(points[:, 1:] - points[:, 1:].mean(axis=0)).max(axis=1) < 0.35))
    points = points.copy()
    points[inside[0]] = points[inside[1]]
    result = hc.regularize(meshed(points, cells, material))
    assert result.report.before.inverted > 0
    assert result.report.after.invalid == 0
    assert np.abs(result.points[plane, 0] - points[plane, 0]).max() < 1e-15


def test_the_command_line_keeps_those_of_an_array(tmp_path, capsys):
    from hexconformal.app.cli import main

    points, cells, material, plane = two_materials()
    path, better = tmp_path / "part.vtu", tmp_path / "better.vtu"
    hc.write(path, hc.HexMesh(points, cells, cell_data={"layer": material}))
    assert main(["regularize", str(path), str(better), "--interfaces", "layer"]) == 0
    assert "2 regions (array 'layer': 1, 2)" in capsys.readouterr().out
    assert np.abs(hc.read(better).points[plane, 0] - points[plane, 0]).max() < 1e-15
