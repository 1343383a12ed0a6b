"""Connections with which no mesh is valid."""

import numpy as np
import pytest

from hexconformal import HexMesh, check, generate, regularize
from hexconformal.elements import corner_scaled_jacobian
from hexconformal.mesh.topology import face_table
from hexconformal.quality.impossible_corners import impossible_corners

# Two cells with two faces in common, and two with a slit between faces that have two edges in common.
TWICE = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [0, 3, 8, 1, 4, 7, 9, 5]])
SLIT = np.array([[0, 1, 2, 3, 4, 5, 6, 7], [0, 3, 8, 1, 9, 10, 11, 12]])


def doubled(cells):
    return impossible_corners(face_table(cells), cells).tolist()


def test_cells_that_are_neighbours_twice_are_found_and_never_valid():
    assert doubled(TWICE) == [0, 4]
    rng = np.random.default_rng(0)
    best = max(corner_scaled_jacobian(rng.normal(size=(10, 3)), TWICE).min() for _ in range(20_000))
    assert best < 0.0


def test_a_slit_between_faces_with_two_edges_in_common_is_none():
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    points = np.zeros((13, 3))
    points[:4, :2], points[4:8, :2] = ring, ring
    points[4:8, 2] = 1.0
    points[2, 2], points[8] = 0.2, [1, 1, -0.2]
    points[9:, :2] = ring[[0, 3, 2, 1]]
    points[9:, 2] = -1.0
    assert corner_scaled_jacobian(points, SLIT).min() > 0.8
    assert doubled(SLIT) == []


def test_the_nodes_are_found_in_a_larger_mesh_whatever_the_order_of_its_cells():
    points, cells = generate.box((3, 3, 3))
    more = np.concatenate([cells, TWICE + len(points)])
    order = np.random.default_rng(1).permutation(len(more))
    assert doubled(more[order]) == [len(points), len(points) + 4]


@pytest.mark.parametrize("mesh", [generate.ball(3, 2), generate.cylinder(3, 2, 4), generate.box((3, 3, 3))])
def test_meshes_that_are_valid_have_none(mesh):
    assert doubled(mesh[1]) == []


@pytest.mark.long
def test_the_check_and_the_report_tell():
    points = np.random.default_rng(2).normal(size=(10, 3))
    (finding,) = [found for found in check(HexMesh(points, TWICE)) if found.kind == "doubled corners"]
    assert finding.severity == "warning"
    assert finding.ids.tolist() == [0, 4]
    assert "mesh this part anew" in finding.message
    points[:8] = generate.box((1, 1, 1))[0][[0, 1, 3, 2, 4, 5, 7, 6]]
    points[8:] = [[0.9, 0.9, 0.0], [0.9, 0.9, 1.0]]
    report = regularize((points, TWICE)).report
    assert any(finding.message == note for note in report.notes)
    assert report.after.inverted <= report.before.inverted
