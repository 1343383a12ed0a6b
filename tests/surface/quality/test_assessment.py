"""Measures of surface cells against formulas, against each other, and against Verdict."""

import json

import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import icosphere, mixed_sphere, no_cells, quad_sphere, shaken

import surface
from hexconformal.common.errors import MeshError
from hexconformal.geometry import Faces
from surface.quality.assessment import MEASURES, quality

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])


def verdict(points, cells, *names):
    """Verdict's measures, triangles first."""
    flat = [np.insert(table, 0, table.shape[1], axis=1).ravel() for table in cells.tables]
    measured = pv.PolyData(points, np.concatenate(flat)).cell_quality(list(names))
    return [np.asarray(measured[name]) for name in names]


@pytest.mark.parametrize("shape", [icosphere(2), quad_sphere(5), mixed_sphere(5)])
def test_angles_and_areas_are_those_of_verdict(shape):
    points, cells = shaken(shape, 0.05)
    points = points * [1, 2, 0.5]
    measured = quality(surface.SurfaceMesh(points, cells))
    least, largest, area = verdict(points, cells, "min_angle", "max_angle", "area")
    np.testing.assert_allclose(measured.min_angle, least, atol=1e-10)
    np.testing.assert_allclose(measured.max_angle, largest, atol=1e-10)
    # Verdict's area of a bent quadrilateral is an approximation of its own.
    t = len(cells.triangles)
    np.testing.assert_allclose(measured.area[:t], area[:t], rtol=1e-12)
    np.testing.assert_allclose(measured.area[t:], area[t:], rtol=0.03)


def test_triangles_against_verdict():
    points, cells = shaken(icosphere(3), 0.05)
    measured = quality((points, cells.triangles))
    radius, frobenius = verdict(points, cells, "radius_ratio", "aspect_frobenius")
    np.testing.assert_allclose(1 / measured.radius_ratio, radius, rtol=1e-8)
    # Verdict's is (K + 1 / K) / 2.
    np.testing.assert_allclose(1 + measured.conformal_distortion / 4, frobenius, rtol=1e-10)
    assert np.isnan(measured.scaled_jacobian).all()


def test_quadrilaterals_against_verdict():
    rng = np.random.default_rng(0)
    points = SQUARE + rng.uniform(-0.45, 0.45, (500, 4, 3)) * [1, 1, 0]
    cells = Faces(no_cells(3), np.arange(2000).reshape(-1, 4))
    measured = quality(surface.SurfaceMesh(points.reshape(-1, 3), cells))
    jacobian, frobenius, area = verdict(points.reshape(-1, 3), cells, "scaled_jacobian", "max_aspect_frobenius", "area")
    np.testing.assert_allclose(measured.scaled_jacobian, jacobian, atol=1e-10)
    sound = jacobian > 1e-3
    assert 20 < (~sound).sum() < 480
    np.testing.assert_allclose(1 + measured.conformal_distortion[sound] / 4, frobenius[sound], rtol=1e-8)
    np.testing.assert_allclose(measured.area[sound], area[sound], rtol=0.2)
    np.testing.assert_array_equal(measured.conformality <= 0, jacobian <= 0)


def singular_values(corners):
    """Of the linear map from the unit equilateral triangle."""
    reference = np.array([[1, 0.5], [0, 3**0.5 / 2]])
    edges = np.stack([corners[1] - corners[0], corners[2] - corners[0]], axis=1)
    return np.linalg.svd(edges @ np.linalg.inv(reference), compute_uv=False)


def test_dilatation_is_the_quotient_of_the_singular_values():
    corners = np.random.default_rng(1).normal(size=(40, 3, 3))
    measured = quality((corners.reshape(-1, 3), np.arange(120).reshape(-1, 3)))
    s = np.array([singular_values(x) for x in corners])
    np.testing.assert_allclose(measured.dilatation, s[:, 0] / s[:, 1], rtol=1e-9)
    np.testing.assert_allclose(measured.conformality, s[:, 1] / s[:, 0], rtol=1e-9)
    expected = 2 * (s[:, 0] - s[:, 1]) ** 2 / (s[:, 0] * s[:, 1])
    np.testing.assert_allclose(measured.conformal_distortion, expected, rtol=1e-9)


@pytest.mark.parametrize("k", [1.0, 1.5, 4.0, 1000.0])
def test_cells_of_known_dilatation(k):
    triangle = np.array([[0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0]])
    points = np.concatenate([triangle, SQUARE]) * [k, 1, 1]
    measured = quality(surface.SurfaceMesh(points, Faces(np.array([[0, 1, 2]]), np.array([[3, 4, 5, 6]]))))
    np.testing.assert_allclose(measured.dilatation, k, rtol=1e-7)
    np.testing.assert_allclose(measured.area, k * np.array([3**0.5 / 4, 1]))
    assert measured.scaled_jacobian[1] == pytest.approx(1)


def test_no_unit_no_place_no_turn_changes_the_measures():
    points, cells = shaken(mixed_sphere(4), 0.05)
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    here = quality(surface.SurfaceMesh(points, cells)).arrays()
    there = quality(surface.SurfaceMesh(1e4 * points @ turn.T + 1e4, cells)).arrays()
    for name in MEASURES:
        scale = 1e8 if name == "area" else 1
        np.testing.assert_allclose(there[name], scale * here[name], rtol=1e-8, atol=1e-8)


def test_folded_and_flat_cells():
    points = np.array([[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0], [2, 0, 0], [0.0, 0, 0]])
    measured = quality(surface.SurfaceMesh(points, Faces(np.array([[0, 1, 4], [0, 5, 1]]), np.array([[0, 1, 2, 3]]))))
    assert (measured.dilatation[:2] == np.inf).all()
    assert (measured.conformality[:2] == 0).all()
    assert (measured.radius_ratio[:2] == 0).all()
    assert measured.conformality[2] < 0
    assert measured.scaled_jacobian[2] == pytest.approx(-15 / 17)
    summary = measured.summary(worst=1)
    assert summary.inverted == 3
    assert summary.worst[0].id == 2
    assert summary.area_ratio == np.inf
    assert json.loads(json.dumps(summary.to_dict(), allow_nan=False))["area_ratio"] is None


def test_summary_says_what_the_arrays_say():
    points, cells = shaken(mixed_sphere(4), 0.05)
    measured = quality(surface.SurfaceMesh(points, cells))
    summary = measured.summary(worst=3)
    assert summary.count == len(cells)
    assert summary.min_angle == measured.min_angle.min()
    assert summary.mean_angle == pytest.approx(measured.min_angle.mean())
    assert summary.max_angle == measured.max_angle.max()
    assert summary.radius_ratio == np.nanmin(measured.radius_ratio)
    assert summary.scaled_jacobian == np.nanmin(measured.scaled_jacobian)
    assert summary.area_ratio == measured.area.max() / measured.area.min()
    assert [cell.conformality for cell in summary.worst] == sorted(measured.conformality)[:3]
    place = int(measured.conformality.argmin())
    corners = cells.triangles[place] if place < len(cells.triangles) else cells.quads[place - len(cells.triangles)]
    np.testing.assert_allclose(summary.worst[0].centre, points[corners].mean(axis=0))
    lines = str(summary).splitlines()
    assert lines[0].startswith(f"{len(cells)} cells, 0 inverted, area ")
    assert len(lines) == 2 + len(MEASURES)
    only = quality((points, cells.triangles)).summary()
    assert "scaled_jacobian" not in only.distributions
    assert np.isnan(only.scaled_jacobian)


def test_worst_cells_are_numbered_as_handed_in():
    points, cells = quad_sphere(3)
    bent = points.copy()
    bent[cells.quads[7, 0]] *= 1.4
    faces = np.insert(cells.quads, 0, 4, axis=1).ravel()
    mesh = pv.PolyData(bent, faces, lines=[2, 0, 1, 2, 1, 2])
    measured = quality(mesh)
    worst = measured.summary(worst=1).worst[0].id
    assert worst == int(measured.conformality.argmin()) + 2


def test_what_cannot_be_measured_is_refused():
    with pytest.raises(MeshError, match="NaN"):
        quality((SQUARE * np.nan, [[0, 1, 2]]))
    with pytest.raises(MeshError, match="outside"):
        quality((SQUARE, [[0, 1, 7]]))
