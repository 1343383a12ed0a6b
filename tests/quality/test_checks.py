"""What is wrong with a mesh is found, named, and told apart from what can be mended."""

import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal.common.errors import MeshError
from hexconformal.generate import box, jittered
from hexconformal.mesh.hex_mesh import HexMesh
from hexconformal.quality.checks import check, require_sound


def kinds(points, cells):
    return {finding.kind: finding for finding in check(HexMesh(points, cells))}


def test_a_sound_mesh_has_no_findings():
    for scale, shift in ((1, 0), (1e-9, 0), (1e9, 0), (1, 1e6), (5e-7, 1e6)):
        points, cells = block(3)
        assert check(HexMesh(points * scale + shift, cells)) == ()
    points, cells = block(3)
    assert check(HexMesh(points * [1, 1, 1e4], cells)) == ()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_points_that_are_not_finite(bad):
    points, cells = block(2)
    points[[3, 7], 1] = bad
    found = kinds(points, cells)
    assert list(found) == ["not finite"]
    assert found["not finite"].ids.tolist() == [3, 7]
    with pytest.raises(MeshError, match=r"NaN or infinite coordinates: 2 \(ids 3, 7\)"):
        require_sound(HexMesh(points, cells))


def test_ids_that_point_nowhere():
    points, cells = block(2)
    for bad in (-1, 27, 10**12):
        broken = cells.copy()
        broken[2, 5] = bad
        found = kinds(points, broken)
        assert list(found) == ["bad index"]
        assert found["bad index"].ids.tolist() == [2]
    assert "subtract 1" in kinds(points, cells + 1)["bad index"].message


def test_repeated_nodes_and_duplicates():
    points, cells = block(2)
    broken = cells.copy()
    broken[4, 2] = broken[4, 3]
    found = kinds(points, broken)
    assert found["repeated nodes"].severity == "error"
    assert found["repeated nodes"].ids.tolist() == [4]
    twice = np.vstack([cells, cells[[5]][:, [4, 5, 6, 7, 0, 1, 2, 3]], cells[[5]]])
    found = kinds(points, twice)
    assert found["duplicate cells"].ids.tolist() == [8, 9]
    assert "crowded faces" in found


def test_different_cells_with_equal_sums_are_no_duplicates():
    # Sums of ids and of their squares agree: 1+5+9+17+18 = 2+3+11+15+19 and likewise squared.
    rest = [100, 101, 102]
    one, other = [1, 5, 9, 17, 18], [2, 3, 11, 15, 19]
    assert sum(one) == sum(other)
    assert sum(i * i for i in one) == sum(i * i for i in other)
    points = np.random.default_rng(0).random((103, 3))
    assert "duplicate cells" not in kinds(points, [one + rest, other + rest])


def periodic(axes, count):
    """A cube of cells whose opposite sides share their nodes along some axes."""
    points, cells = block(count)
    places = points.astype(int)
    for axis in axes:
        places[:, axis] %= count
    _, first, number = np.unique(places, axis=0, return_index=True, return_inverse=True)
    return points[first], number.ravel()[cells]


@pytest.mark.parametrize("count", [3, 4, 6])
def test_a_mesh_without_boundary_is_refused(count):
    points, cells = periodic((0, 1, 2), count)
    found = kinds(points, cells)
    assert found["no boundary"].severity == "error"
    assert "periodic" in found["no boundary"].message
    assert not {"mirrored", "foreign order"} & found.keys()
    for refuses in (hc.regularize, hc.orient):
        with pytest.raises(MeshError, match="there is no boundary"):
            refuses((points, cells))


@pytest.mark.parametrize("axes", [(0,), (2,), (0, 1)])
def test_cells_that_close_a_periodic_mesh_are_named(axes):
    points, cells = periodic(axes, 4)
    found = kinds(points, cells)["wrapped cells"]
    assert found.severity == "warning"
    assert "periodic" in found.message
    ends = np.ptp(points[cells], axis=1)[found.ids]
    assert (ends == 3).any(axis=1).all()
    assert len(found.ids) == (16 if len(axes) == 1 else 24)


def test_tangled_cells_are_not_taken_for_a_periodic_mesh():
    for seed in range(5):
        points, cells = jittered(*box((4, 4, 4)), 1.0, seed=seed, valid=False)
        assert "wrapped cells" not in kinds(points, cells)
    mirrored = box((1, 2, 2))[0], box((1, 2, 2))[1][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    assert "wrapped cells" not in kinds(*mirrored)


def test_anything_that_is_a_mesh_is_checked_and_oriented(tmp_path):
    points, cells = block(2)
    mirrored = cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    hc.write(tmp_path / "a.vtu", HexMesh(points, mirrored))
    for source in ((points, mirrored), tmp_path / "a.vtu", str(tmp_path / "a.vtu"), pv.read(tmp_path / "a.vtu")):
        assert [finding.kind for finding in check(source)] == ["mirrored"]
        np.testing.assert_array_equal(hc.orient(source)[0].cells, cells)


def test_flat_cells_are_a_warning():
    points, cells = block(2)
    points[points[:, 2] == 2, 2] = 1
    found = kinds(points, cells)
    assert found["flat cells"].severity == "warning"
    assert found["flat cells"].ids.tolist() == np.flatnonzero(points[cells][:, :, 2].min(axis=1) == 1).tolist()
    assert found["coincident points"].severity == "warning"
    assert len(found["coincident points"].ids) == 18
    # The ends of an edge without length lie in its middle, and do not hang there.
    assert set(found) == {"flat cells", "coincident points"}


def test_a_face_of_three_cells():
    points, cells = block(1)
    points = np.vstack([points, np.add(points, [0, 0, 1]), np.add(points, [0.3, 0, 1])])
    top = cells[0, 4:]
    cells = np.array([cells[0], [*top, 12, 13, 14, 15], [*top, 20, 21, 22, 23]])
    cells[1, 4:], cells[2, 4:] = 8 + block(1)[1][0, 4:], 16 + block(1)[1][0, 4:]
    found = kinds(points, cells)
    assert found["crowded faces"].severity == "error"
    assert "more than two cells: 1 (nodes" in found["crowded faces"].message
    assert "unreferenced points" in found


def test_hanging_nodes():
    # One cell beside two of half its height: the middle nodes hang on its edges.
    points, cells = block(1)
    low, high = points.copy(), points.copy()
    low[:, 2] /= 2
    high[:, 2] = high[:, 2] / 2 + 0.5
    all_points = np.vstack([points, np.add(low, [1, 0, 0]), np.add(high, [1, 0, 0])])
    names, inverse = np.unique(all_points, axis=0, return_inverse=True)
    merged = inverse.ravel()[np.vstack([cells, cells + 8, cells + 16])]
    found = kinds(names, merged)
    assert found["hanging nodes"].severity == "warning"
    np.testing.assert_array_equal(names[found["hanging nodes"].ids], [[1, 0, 0.5], [1, 1, 0.5]])
    assert list(found) == ["hanging nodes"]


def test_pieces_and_unreferenced_points():
    points, cells = block(2)
    apart = np.vstack([points, points + 5, [[0.5, 0.5, 7]]])
    found = kinds(apart, np.vstack([cells, cells + 27]))
    assert found["pieces"].ids.tolist() == [0, 8]
    assert found["unreferenced points"].ids.tolist() == [54]
    assert {finding.severity for finding in found.values()} == {"warning"}
    assert len(require_sound(HexMesh(apart, np.vstack([cells, cells + 27])))) == 2


def test_what_is_tangled_inside_does_not_count_for_the_side_that_cells_are_on():
    """Most of the cells are negative, but what all enclose is not: that is for the outer faces to say."""
    points, cells = hc.generate.box((8, 8, 8))
    inside = ((points > 0.0) & (points < 1.0)).all(axis=1)
    points[inside] = 1.0 - points[inside]
    assert hc.quality((points, cells)).summary().inverted > 256
    assert "mirrored" not in kinds(points, cells)
    assert not hc.orient((points, cells))[1].changed
    mirrored = cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    assert "mirrored" in kinds(points, mirrored)
    assert hc.orient((points, mirrored))[1].mirrored.tolist() == list(range(512))
    assert hc.regularize((points, cells)).report.after.scaled_jacobian.min > 0.99


def test_mirrored_and_foreign_cells_point_to_orient():
    points, cells = block(3)
    mirror = [4, 5, 6, 7, 0, 1, 2, 3]
    assert "orient()" in kinds(points, cells[:, mirror])["mirrored"].message
    some = cells.copy()
    some[13] = some[13, mirror]
    found = kinds(points, some)
    assert found["mirrored"].severity == "error"
    assert 13 in found["mirrored"].ids
    found = kinds(points, cells[:, [0, 1, 3, 2, 4, 5, 7, 6]])
    assert "lexicographic" in found["foreign order"].message
    with pytest.raises(MeshError, match="lexicographic"):
        require_sound(HexMesh(points, cells[:, [0, 1, 3, 2, 4, 5, 7, 6]]))


def test_tangled_meshes_are_sound_input(shared):
    for name in ("xu_t1_hanger", "xu_t3_fandisk", "xu_t3_kitty", "msq_pave3"):
        from hexconformal.io.read_write import read

        assert check(read(shared / "meshes" / "hex" / f"{name}_input.vtu")) == (), name
