"""Cells of second order that are no hexahedra: as they are, or by their corners on request, in all formats."""

import h5py
import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.mixed import mixed_block
from meshes.quadratic_cells import raised

import hexconformal as hc
from hexconformal import io
from hexconformal.elements import CELL_TYPES, SECOND_ORDER
from hexconformal.io.cell_types import VTK_TYPES

OTHERS = [name for name in SECOND_ORDER if not name.startswith("hexahedron")]
FORMATS = {
    ".vtu": ["tetra10", "wedge15", "wedge18", "pyramid13"],
    ".vtk": ["tetra10", "wedge15", "wedge18", "pyramid13"],
    ".msh": OTHERS,
    ".inp": ["tetra10", "wedge15"],
    ".bdf": ["tetra10", "wedge15", "pyramid13"],
    ".e": ["tetra10", "wedge15", "pyramid13"],
    ".med": ["tetra10", "wedge15", "wedge18", "pyramid13"],
}
# Pairs of corners that nodes are between, as the manuals of the formats list them.
MANUALS = {
    "gmsh": {
        "tetra10": [(0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3)],
        "wedge18": [(0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)],
        "pyramid14": [(0, 1), (0, 3), (0, 4), (1, 2), (1, 4), (2, 3), (2, 4), (3, 4)],
    },
    "nastran": {
        "tetra10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
        "wedge15": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)],
        "pyramid13": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
    },
    "med": {
        "wedge15": [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
        "pyramid13": [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
        "hexahedron27": [
            *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
            *((0, 1, 2, 3), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7), tuple(range(8))),
        ],
    },
}


def straight(name):
    """The ideal cell, by its corners, with its other nodes between these."""
    plain, between = SECOND_ORDER[name]
    corners = CELL_TYPES[plain].ideal
    return np.vstack([corners, *(corners[list(among)].mean(axis=0) for among in between)])


def bent(name, seed=0):
    """The cell with all but its corners moved."""
    points = straight(name)
    corners = len(CELL_TYPES[SECOND_ORDER[name][0]].nodes)
    points[corners:] += np.random.default_rng(seed).uniform(-0.05, 0.05, points[corners:].shape)
    return points


def grid_of(name, points):
    """A grid with the cell; VTK has no pyramid of 14 nodes, meshio has."""
    if name not in VTK_TYPES:
        return meshio.Mesh(points, [(name, [range(len(points))])])
    nodes = np.arange(len(points))
    return pv.UnstructuredGrid(np.array([len(nodes), *nodes]), np.array([VTK_TYPES[name]], np.uint8), points)


@pytest.mark.parametrize("name", OTHERS)
def test_it_is_taken_as_it_is_or_by_its_corners(name):
    grid, corners = grid_of(name, bent(name)), len(CELL_TYPES[SECOND_ORDER[name][0]].nodes)
    (block,) = hc.as_volume_mesh(grid).blocks
    assert (block.cell_type.name, block.cells.tolist()) == (name, [list(range(len(grid.points)))])
    assert hc.quality(grid).valid.all()
    assert hc.quality(grid).scaled_jacobian[0] < 0.999
    mesh = hc.as_volume_mesh(grid, linearize=True)
    assert f"cells taken as linear, their edges straightened: 1 {name}" in mesh.notes
    assert mesh.blocks[0].cell_type.name == SECOND_ORDER[name][0]
    np.testing.assert_array_equal(mesh.straightened, np.arange(len(grid.points)) >= corners)
    assert hc.quality(mesh).scaled_jacobian[0] == pytest.approx(1.0)
    moved = mesh.replaced(2.0 * mesh.points + 1.0).to_source_type()
    np.testing.assert_allclose(moved.points, 2.0 * straight(name) + 1.0, atol=1e-14)


@pytest.mark.parametrize(("extension", "name"), [(key, name) for key, names in FORMATS.items() for name in names])
def test_files_keep_all_nodes_as_they_are(extension, name, tmp_path):
    path, other = tmp_path / f"a{extension}", tmp_path / f"b{extension}"
    cells = {name: [range(len(bent(name)))]}
    for mesh in (hc.as_volume_mesh(grid_of(name, bent(name))), hc.as_volume_mesh((bent(name), cells))):
        expected = hc.quality(mesh)
        io.write(path, mesh)
        again = hc.as_volume_mesh(path)
        (block,) = again.blocks
        assert block.cell_type.name == name
        # MED's cells are told from the other side: turned round there, and back.
        np.testing.assert_allclose(again.points[block.cells[0]], bent(name), atol=1e-7)
        assert hc.quality(again).minimum_jacobian[0] == pytest.approx(expected.minimum_jacobian[0], abs=1e-5)
        io.write(other, again.replaced(3.0 * again.points[:, [1, 2, 0]]))
        last = hc.as_volume_mesh(other)
        np.testing.assert_allclose(last.points[last.blocks[0].cells[0]], 3.0 * bent(name)[:, [1, 2, 0]], atol=1e-6)


@pytest.mark.parametrize("extension", list(FORMATS))
def test_files_hold_all_types_beside_each_other(extension, tmp_path):
    kept = {SECOND_ORDER[name][0] for name in FORMATS[extension]} | {"hexahedron"}
    every, _, _ = raised(mixed_block(1), {"hexahedron": 20, "wedge": 15, "pyramid": 13, "tetra": 10})
    blocks = {one.cell_type.name: one.cells for one in every.blocks if one.cell_type.linear.name in kept}
    points = every.points + np.random.default_rng(0).uniform(-0.02, 0.02, every.points.shape)
    mesh = hc.MixedMesh.of_types(points, blocks)
    path = tmp_path / f"a{extension}"
    io.write(path, mesh)
    back = hc.as_volume_mesh(path)
    assert {one.cell_type.name: len(one.cells) for one in back.blocks} == {n: len(rows) for n, rows in blocks.items()}
    before, after = hc.quality(mesh).by_type(), hc.quality(back).by_type()
    for name, one in before.items():
        np.testing.assert_allclose(after[name].minimum_jacobian, one.minimum_jacobian, atol=1e-4)
        np.testing.assert_allclose(after[name].volume, one.volume, rtol=1e-5)
    result = hc.regularize(path, boundary="fixed", max_iterations=3)
    io.write(tmp_path / f"b{extension}", result.mesh)
    assert hc.quality(tmp_path / f"b{extension}").valid.all()


@pytest.mark.parametrize("name", ["wedge15", "wedge18"])
def test_wedges_the_other_way_up_are_worked_on_and_stay_so(name):
    cell_type = hc.elements.SOLID_TYPES[name]
    mesh = hc.MixedMesh.of_types(bent(name), {name: [cell_type.mirrored]})
    upright = hc.MixedMesh.of_types(bent(name), {name: [cell_type.nodes]})
    assert hc.quality(mesh).minimum_jacobian[0] == hc.quality(upright).minimum_jacobian[0] > 0
    result = hc.regularize(mesh, boundary="fixed")
    assert result.mesh.blocks[0].cells.tolist() == [list(cell_type.mirrored)]
    assert result.report.after.invalid == 0


def test_vtk_has_no_pyramid_of_14_nodes(tmp_path):
    mesh = hc.MixedMesh.of_types(straight("pyramid14"), {"pyramid14": [range(14)]})
    with pytest.raises(hc.MeshError, match="VTK has no pyramids of 14 nodes: Gmsh's files"):
        io.write(tmp_path / "a.vtu", mesh)


@pytest.mark.parametrize(("extension", "name"), [(key, name) for key, names in FORMATS.items() for name in names])
def test_files_keep_all_nodes_and_what_is_written_of_corners_is_straight(extension, name, tmp_path):
    path, other = tmp_path / f"a{extension}", tmp_path / f"b{extension}"
    grid = grid_of(name, bent(name))
    io.write(path, hc.as_volume_mesh(grid, linearize=True))  # straight
    assert hc.quality(path).scaled_jacobian[0] == pytest.approx(1.0, abs=1e-5)
    mesh = hc.as_volume_mesh(path, linearize=True)
    block = mesh.origin.selection.higher_order[0]
    np.testing.assert_allclose(mesh.points[block.nodes[0]], straight(name), atol=1e-7)
    io.write(other, mesh.replaced(3.0 * mesh.points[:, [1, 2, 0]]))
    again = hc.as_volume_mesh(other, linearize=True)
    block = again.origin.selection.higher_order[0]
    np.testing.assert_allclose(again.points[block.nodes[0]], 3.0 * straight(name)[:, [1, 2, 0]], atol=1e-6)


@pytest.mark.parametrize("name", MANUALS["gmsh"])
def test_gmsh_has_the_order_of_its_manual(name, tmp_path):
    corners = CELL_TYPES[SECOND_ORDER[name][0]].ideal
    points = [*corners, *(corners[list(pair)].mean(axis=0) for pair in MANUALS["gmsh"][name])]
    faces = {"wedge18": [(0, 1, 4, 3), (0, 2, 5, 3), (1, 2, 5, 4)], "pyramid14": [(0, 1, 2, 3)]}.get(name, [])
    points += [corners[list(face)].mean(axis=0) for face in faces]
    number = {"tetra10": 11, "wedge18": 13, "pyramid14": 14}[name]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(points))]
    lines += [f"{k} {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(np.array(points).tolist(), 1)]
    lines += ["$EndNodes", "$Elements", "1", f"1 {number} 2 0 1 {' '.join(map(str, range(1, len(points) + 1)))}"]
    (tmp_path / "a.msh").write_text("\n".join([*lines, "$EndElements", ""]))
    mesh = hc.as_volume_mesh(tmp_path / "a.msh", linearize=True)
    np.testing.assert_allclose(mesh.points[mesh.origin.selection.higher_order[0].nodes[0]], straight(name), atol=1e-12)
    io.write(tmp_path / "b.vtu" if name in VTK_TYPES else tmp_path / "b.msh", mesh)
    other = next(tmp_path.glob("b.*"))
    again = hc.as_volume_mesh(other, linearize=True)
    np.testing.assert_allclose(again.points[again.origin.selection.higher_order[0].nodes[0]], straight(name), atol=1e-6)


@pytest.mark.parametrize("name", MANUALS["nastran"])
def test_nastran_has_the_order_of_its_manual(name, tmp_path):
    io.write(tmp_path / "a.bdf", hc.as_volume_mesh(grid_of(name, straight(name)), linearize=True))
    text = (tmp_path / "a.bdf").read_text()
    card = next(line for line in text.splitlines() if line.startswith(("CTETRA", "CPENTA", "CPYRAM")))
    fields = text[text.index(card) :].replace("\n", " ").replace("+", " ").split("ENDDATA")[0].split()[3:]
    nodes = np.array([int(field) for field in fields]) - 1
    corners = len(CELL_TYPES[SECOND_ORDER[name][0]].nodes)
    x = straight(name)
    for place, pair in enumerate(MANUALS["nastran"][name], corners):
        np.testing.assert_allclose(x[nodes[place]], x[nodes[list(pair)]].mean(axis=0), atol=1e-12)


@pytest.mark.parametrize("name", MANUALS["med"])
def test_med_has_the_order_of_its_manual(name, tmp_path):
    io.write(tmp_path / "a.med", hc.as_volume_mesh(grid_of(name, straight(name)), linearize=True))
    with h5py.File(tmp_path / "a.med") as data:
        (mesh,) = data["ENS_MAA"].values()
        step = mesh if "NOE" in mesh else next(iter(mesh.values()))
        x = step["NOE"]["COO"][()].reshape(3, -1).T
        nodes = next(iter(step["MAI"].values()))["NOD"][()] - 1
    corners = len(CELL_TYPES[SECOND_ORDER[name][0]].nodes)
    for place, among in enumerate(MANUALS["med"][name], corners):
        np.testing.assert_allclose(x[nodes[place]], x[nodes[list(among)]].mean(axis=0), atol=1e-12)
    edges = {"wedge15": [1, 2, 3], "pyramid13": [1, 3, 4], "hexahedron27": [1, 3, 4]}[name]
    assert np.linalg.det(x[nodes[edges]] - x[nodes[0]]) < 0.0  # mirrored, seen from VTK


@pytest.mark.parametrize("name", [*MANUALS["med"], "tetra10"])
def test_arrays_on_cells_of_second_order_come_back_from_med(name, tmp_path):
    grid = grid_of(name, straight(name))
    mesh = hc.as_volume_mesh(grid, linearize=True).replaced(cell_data={"heat": [7.5]}, point_data={"x": grid.points})
    io.write(tmp_path / "a.med", mesh)
    again = hc.as_volume_mesh(tmp_path / "a.med", linearize=True)
    assert again.cell_data["heat"].tolist() == [7.5]
    # Into the file that it is from, with an array more.
    io.write(tmp_path / "b.med", again.replaced(2.0 * again.points, cell_data={"cold": [2.5]}))
    last = hc.as_volume_mesh(tmp_path / "b.med", linearize=True)
    assert (last.cell_data["heat"].tolist(), last.cell_data["cold"].tolist()) == ([7.5], [2.5])
    np.testing.assert_allclose(last.point_data["x"], grid.points, atol=1e-12)
    np.testing.assert_allclose(last.points, 2.0 * grid.points, atol=1e-12)


@pytest.mark.parametrize("name", ["tetra", "wedge", "pyramid"])
def test_arrays_on_linear_cells_without_hexahedra_come_back_from_med(name, tmp_path):
    corners = CELL_TYPES[name].ideal
    io.write(tmp_path / "a.med", hc.as_volume_mesh((corners, {name: [range(len(corners))]})))
    mesh = hc.as_volume_mesh(tmp_path / "a.med")
    io.write(tmp_path / "b.med", mesh.replaced(cell_data={"cold": [2.5]}))
    assert hc.as_volume_mesh(tmp_path / "b.med").cell_data["cold"].tolist() == [2.5]


def test_solids_of_nastran_with_more_nodes_than_any_type_are_refused(tmp_path):
    grids = "".join(f"GRID,{k},,{k}.,{k % 3}.,{k % 5}.\n" for k in range(1, 28))
    cards = [f"CHEXA,7,1,{','.join(map(str, range(1, 7)))},+"]
    cards += [f"+,{','.join(map(str, range(k, min(k + 8, 28))))},+" for k in range(7, 28, 8)]
    (tmp_path / "a.bdf").write_text(f"BEGIN BULK\n{grids}" + "\n".join(cards).rstrip(",+") + "\nENDDATA\n")
    with pytest.raises(hc.ReadError, match="CHEXA 7 has 27 nodes; only those with 8 or 20"):
        hc.as_volume_mesh(tmp_path / "a.bdf")


def test_beside_hexahedra_it_is_one_of_the_cells():
    cube = pv.UnstructuredGrid(*[np.array([8, *range(8)]), np.array([12], np.uint8)], straight("hexahedron20")[:8])
    both = cube + grid_of("tetra10", bent("tetra10") + [9.0, 0.0, 0.0])
    assert {one.cell_type.name for one in hc.as_volume_mesh(both).blocks} == {"hexahedron", "tetra10"}
    assert {one.cell_type.name for one in hc.as_volume_mesh(both, linearize=True).blocks} == {"hexahedron", "tetra"}
    assert hc.as_hex_mesh(both, other_cells="keep").held.sum() == 10


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("linearize", [False, True])
def test_where_hexahedra_are_needed_they_are_called_what_they_are(name, linearize):
    with pytest.raises(hc.MeshError, match=f"cells of higher order: 1 {name}; there are no hexahedra"):
        hc.as_hex_mesh(grid_of(name, straight(name)), linearize=linearize)
