"""The boundary of a run: flat faces, straight edges and lines between tags stay, whatever else is tagged."""

import meshio
import numpy as np
import pytest
from independent_distance import finely_measured

import hexconformal as hc
from hexconformal import generate
from hexconformal.mesh.topology import boundary_quads


def tagged_box(tag_of):
    """A unit box with jittered nodes inside, the boundary quads of which have the tags of their centres (0: none)."""
    points, cells = generate.jittered(*generate.box((6, 6, 6)), 0.3, seed=0)
    points = points.copy()
    top = (points[:, 2] == 1.0) & (np.abs(points[:, :2] - 0.5) < 0.45).all(axis=1)
    points[top, :2] += np.random.default_rng(0).uniform(-0.04, 0.04, (top.sum(), 2))
    points[(points[:, 2] == 1.0) & np.isclose(generate.box((6, 6, 6))[0][:, 0], 0.5), 0] = 0.52
    quads, _ = boundary_quads(cells)
    tags = tag_of(points[quads].mean(axis=1))
    blocks = [("quad", quads[tags > 0]), ("hexahedron", cells)]
    return meshio.Mesh(points, blocks, cell_data={"gmsh:geometrical": [tags[tags > 0], np.ones(len(cells), int)]})


def sides(x):
    """(n, 3) distances from the closest side in each direction, ascending: from a face, from an edge, from a corner."""
    return np.sort(np.minimum(np.abs(x), np.abs(x - 1.0)), axis=1)


@pytest.mark.parametrize(
    "tag_of",
    [
        lambda x: np.where(x[:, 2] < 1e-9, 2, 0),
        lambda x: np.where(x[:, 2] < 1e-9, 2, np.where(x[:, 2] > 1 - 1e-9, 3, 4)),
    ],
    ids=["bottom alone", "walls in one group"],
)
def test_faces_and_edges_stay_flat_and_straight_whatever_is_tagged(tag_of):
    mesh = tagged_box(tag_of)
    before, result = sides(mesh.points), hc.regularize(mesh)
    after = sides(result.points)
    for kind in range(3):  # faces, edges, corners
        on = before[:, kind] == 0.0
        assert (after[on, kind] == 0.0).all()
    assert result.report.hausdorff == 0.0
    assert result.report.after.scaled_jacobian.min > 0.9


@pytest.mark.parametrize("bound", [0.0, 0.005])
def test_a_line_between_tags_in_a_flat_face_stays(bound):
    mesh = tagged_box(lambda x: np.where(x[:, 2] < 1 - 1e-9, 0, np.where(x[:, 0] < 0.52, 2, 3)))
    line = np.flatnonzero((mesh.points[:, 2] == 1.0) & (mesh.points[:, 0] == 0.52))
    assert len(line) == 7
    result = hc.regularize(mesh, hausdorff=bound)
    np.testing.assert_allclose(result.points[line][:, [0, 2]], [[0.52, 1.0]] * 7, rtol=0, atol=1e-12)
    assert np.abs(result.points[line, 1] - mesh.points[line, 1]).max() > 1e-3  # but slide along it
    untagged = hc.regularize((mesh.points, mesh.cells_dict["hexahedron"]), hausdorff=bound)
    assert np.abs(untagged.points[line, 0] - 0.52).max() > 1e-3


def test_a_hex_mesh_comes_back_as_one():
    mesh = hc.as_hex_mesh(generate.sheared_cube(3))
    better = hc.regularize(mesh).mesh
    assert isinstance(better, hc.HexMesh)
    assert {"scaled_jacobian", "scaled_jacobian_change"} <= set(better.cell_data)
    source = meshio.Mesh(mesh.points, [("hexahedron", mesh.cells)])
    assert isinstance(hc.regularize(source).mesh, meshio.Mesh)
    assert isinstance(hc.regularize(hc.as_hex_mesh(source)).mesh, hc.HexMesh)


def shaken(mesh, amount, seed):
    points, cells = mesh
    edge = np.linalg.norm(points[cells[:, 1]] - points[cells[:, 0]], axis=1).mean()
    return points + amount * edge * np.random.default_rng(seed).uniform(-1, 1, points.shape), cells


COARSE = {
    "box": shaken(generate.box((4, 4, 4)), 0.2, 2),
    "cylinder": shaken(generate.cylinder(2, 1, 4), 0.15, 0),
    "twisted": shaken(generate.twisted_cube(6, 90), 0.1, 2),
    "bar": shaken(generate.bent_bar((12, 3, 3), 150), 0.12, 2),
}


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "options"),
    [*((name, {}) for name in COARSE), *(("bar", {"max_iterations": most}) for most in (14, 16, 18))],
)
def test_coarse_warped_quads_keep_the_bound_everywhere(name, options):
    points, cells = COARSE[name]
    result = hc.regularize((points, cells), **options)
    report, quads = result.report, boundary_quads(cells)[0]
    apart = finely_measured(result.points, points, quads) / report.diagonal
    assert apart <= 0.005
    assert report.hausdorff == pytest.approx(apart, abs=0.0005)
    assert report.hausdorff <= 0.005
    assert report.after.scaled_jacobian.min > report.before.scaled_jacobian.min + 0.05


def test_the_volume_is_kept_within_the_bound_everywhere():
    points, cells = COARSE["box"]
    result = hc.regularize((points, cells), conserve_volume=True)
    assert abs(result.report.volume_change) < 1e-12
    assert finely_measured(result.points, points, boundary_quads(cells)[0]) / result.report.diagonal <= 0.005


def test_a_body_without_volume_has_no_planes_to_slide_in():
    # All faces of a cell that is pressed flat lie in one plane, in which its nodes would go anywhere.
    points, cells = generate.box((3, 1, 1))
    points = points * [1.0, 1.0, 0.0] + np.random.default_rng(3).uniform(-0.05, 0.05, points.shape) * [1.0, 1.0, 0.0]
    result = hc.regularize((points, cells), hausdorff=0.0)
    quads = boundary_quads(cells)[0]
    assert finely_measured(result.points, points, quads) / result.report.diagonal < 1e-3
