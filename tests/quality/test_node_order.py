"""Node orders: foreign and mirrored cells are put right, tangled ones left alone."""

import numpy as np
import pytest
from meshes.files import mixed_grid, mixed_meshio
from meshes.hexahedra import block

from hexconformal import HexMesh, as_hex_mesh
from hexconformal.common.errors import MeshError
from hexconformal.elements.hexahedron import CORNER_NEIGHBOURS
from hexconformal.mesh.topology import boundary_quads
from hexconformal.quality.checks import check
from hexconformal.quality.node_order import orient

MIRROR = [4, 5, 6, 7, 0, 1, 2, 3]

# VTK's corners listed in the order of the format, written out from its definition.
FORMATS = {
    "lexicographic": [0, 1, 3, 2, 4, 5, 7, 6],
    "bottom and top alternating": [0, 4, 1, 5, 2, 6, 3, 7],
    "top face listed backwards": [0, 1, 2, 3, 7, 6, 5, 4],
}


def corner_determinants(mesh):
    x = mesh.points[mesh.cells]
    return np.linalg.det(x[:, CORNER_NEIGHBOURS] - x[:, :, None])


def wavy(k):
    points, cells = block(k)
    return points + 0.15 * np.sin(points @ [[1, 2, 3], [2, 3, 1], [3, 1, 2]]), cells


def test_nothing_to_do_returns_the_same_mesh():
    mesh = HexMesh(*wavy(3))
    result, report = orient(mesh)
    assert result is mesh
    assert not report.changed


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("mirror", [False, True])
def test_foreign_orders(name, mirror):
    points, cells = wavy(3)
    foreign = (cells[:, MIRROR] if mirror else cells)[:, FORMATS[name]]
    result, report = orient(HexMesh(points, foreign))
    assert report.order == name
    assert corner_determinants(result).min() > 0
    np.testing.assert_array_equal(np.sort(result.cells), np.sort(cells))
    assert check(result) == ()
    assert len(boundary_quads(result.cells)[0]) == 54


def test_axes_listed_the_other_way_round():
    # z fastest is x fastest of the mirrored cell.
    points, cells = wavy(2)
    c_order = cells[:, FORMATS["lexicographic"]].reshape(-1, 2, 2, 2).transpose(0, 3, 2, 1).reshape(-1, 8)
    result, report = orient(HexMesh(points, c_order))
    assert report.order == "lexicographic"
    assert len(report.mirrored) == 8
    assert corner_determinants(result).min() > 0


def test_some_mirrored_cells():
    points, cells = wavy(4)
    flipped = np.random.default_rng(0).choice(64, 40, replace=False)
    mixed = cells.copy()
    mixed[flipped] = mixed[flipped][:, MIRROR]
    result, report = orient(HexMesh(points, mixed))
    np.testing.assert_array_equal(report.mirrored, np.sort(flipped))
    np.testing.assert_array_equal(result.cells, cells)


def test_a_cell_turned_inside_out_by_its_points_stays_inverted():
    points, cells = block(3)
    inner = cells[13]
    points[inner[:4]], points[inner[4:]] = points[inner[4:]].copy(), points[inner[:4]].copy()
    mesh = HexMesh(points, cells)
    assert corner_determinants(mesh)[13].max() < 0
    result, report = orient(mesh)
    assert result is mesh
    assert not report.changed


def test_pieces_are_oriented_each_for_itself():
    points, cells = block(2)
    two = HexMesh(np.vstack([points, points + 9]), np.vstack([cells, cells[:, MIRROR] + 27]))
    result, report = orient(two)
    np.testing.assert_array_equal(report.mirrored, np.arange(8, 16))
    assert corner_determinants(result).min() > 0


def test_a_moebius_band_of_cells_is_refused():
    # A ring of three cells whose ends are joined upside down.
    ring = [[4 * i + j for j in range(4)] for i in range(3)]
    ring.append([ring[0][j] for j in (1, 0, 3, 2)])
    cells = [[*ring[i], *ring[i + 1]] for i in range(3)]
    with pytest.raises(MeshError, match="cannot be oriented"):
        orient(HexMesh(np.random.default_rng(0).random((12, 3)), cells))


@pytest.mark.parametrize("make", [mixed_meshio, mixed_grid])
def test_the_result_is_handed_back_in_the_new_order(make):
    source = make()
    straight = as_hex_mesh(source)
    mirrored = HexMesh(
        straight.points, straight.cells[:, MIRROR], straight.point_data, straight.cell_data, straight.origin
    )
    back = as_hex_mesh(mirrored.to_source_type())
    np.testing.assert_array_equal(back.cells, mirrored.cells)
    result, report = orient(back)
    assert len(report.mirrored) == 8
    again = as_hex_mesh(result.to_source_type())
    np.testing.assert_array_equal(again.cells, straight.cells)
    for name, array in straight.cell_data.items():
        np.testing.assert_array_equal(again.cell_data[name], array)


def test_tangled_meshes_are_left_alone(shared):
    for name in ("xu_t1_hanger", "xu_t3_fandisk", "xu_t3_kitty"):
        mesh = as_hex_mesh(shared / "meshes" / "hex" / f"{name}_input.vtu")
        assert orient(mesh)[0] is mesh
