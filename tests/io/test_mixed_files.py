"""Meshes of several types from and to files and libraries: cells keep their places, numbers, arrays and order."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.mixed import four_types, shuffled_grid

import hexconformal as hc
from hexconformal import io
from hexconformal.elements import CELL_TYPES


def rows(mesh):
    """All cells with their number in the file, as (type, nodes)."""
    return {
        int(mesh.cell_labels[place]): (one.cell_type.name, tuple(nodes))
        for one in mesh.blocks
        for place, nodes in zip(one.places.tolist(), one.cells.tolist(), strict=True)
    }


def test_a_grid_comes_back_with_arrays_on_all_cells_measured():
    grid = shuffled_grid(four_types(0.1))
    mesh = hc.as_volume_mesh(grid)
    for row, (name, nodes) in rows(mesh).items():
        assert CELL_TYPES[name].vtk == grid.celltypes[row]
        assert nodes == tuple(grid.get_cell(row).point_ids)
    back = mesh.replaced(cell_data={"number": np.arange(13.0)}).to_source_type()
    np.testing.assert_array_equal(back.celltypes, grid.celltypes)
    np.testing.assert_array_equal(back.cell_connectivity, grid.cell_connectivity)
    solid = grid.celltypes != 9
    assert back["number"][solid].tolist() == list(range(13))
    assert np.isnan(back["number"][~solid]).all()
    assert "number" not in grid.cell_data


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".msh", ".mesh", ".bdf", ".xdmf", ".med", ".exo"])
def test_files_hold_all_types_and_measures_agree(tmp_path, extension):
    if extension in (".xdmf", ".med", ".exo"):
        pytest.importorskip("h5py" if extension != ".exo" else "netCDF4")
    mesh = four_types(0.1)
    path = tmp_path / f"mixed{extension}"
    lost = hc.write(path, mesh.replaced(cell_data={"number": np.arange(13)}))
    back = hc.as_volume_mesh(path)
    assert isinstance(back, hc.MixedMesh)
    assert {one.cell_type.name: len(one.cells) for one in back.blocks} == {
        one.cell_type.name: len(one.cells) for one in mesh.blocks
    }
    for name, one in hc.quality(mesh).by_type().items():
        np.testing.assert_allclose(hc.quality(back).by_type()[name].shape, one.shape, rtol=1e-6)
    if "cell array 'number'" not in lost:
        name = "number" if "number" in back.cell_data else "medit:ref"
        assert sorted(back.cell_data[name].tolist()) == list(range(13))
    # The same file again, with arrays on all of its cells.
    again = tmp_path / f"again{extension}"
    hc.write(again, back.replaced(cell_data=hc.quality(back).arrays()))
    np.testing.assert_allclose(hc.quality(again).scaled_jacobian, hc.quality(back).scaled_jacobian, rtol=1e-6)


@pytest.mark.parametrize("library", ["meshio", "pyvista"])
def test_cells_that_are_turned_round_are_so_in_what_they_came_from(library):
    mesh = four_types()
    cells = {one.cell_type.name: one.cells.copy() for one in mesh.blocks}
    cells["wedge"] = cells["wedge"][:, [3, 4, 5, 0, 1, 2]]
    if library == "meshio":
        source = meshio.Mesh(mesh.points, [("quad", [[0, 1, 3, 2]]), *cells.items()])
    else:
        source = shuffled_grid(hc.MixedMesh.of_types(mesh.points, cells))
    turned, report = hc.orient(source)
    assert len(report.mirrored) == 2
    back = turned.to_source_type()
    assert type(back) is type(source)
    assert hc.check(back) == ()
    if library == "meshio":
        assert [one.type for one in back.cells] == ["quad", *cells]
        np.testing.assert_array_equal(back.cells[3].data, mesh.blocks[2].cells)
    else:
        np.testing.assert_array_equal(back.celltypes, source.celltypes)


def test_several_blocks_of_a_type_are_one():
    mesh = four_types()
    tetrahedra = mesh.blocks[0].cells
    source = meshio.Mesh(
        mesh.points,
        [
            ("tetra", tetrahedra[:3]),
            ("triangle", [[0, 1, 2]]),
            ("pyramid", mesh.blocks[3].cells),
            ("tetra", tetrahedra[3:]),
        ],
        cell_data={"tag": [np.arange(3), np.array([9]), np.arange(3, 5), np.arange(5, 10)]},
    )
    taken = hc.as_volume_mesh(source)
    assert [one.cell_type.name for one in taken.blocks] == ["pyramid", "tetra"]
    assert taken.cell_labels.tolist() == [0, 1, 2, 4, 5, 6, 7, 8, 9, 10]
    assert taken.cell_data["tag"].tolist() == list(range(10))
    tetra = taken.blocks[1]
    np.testing.assert_array_equal(tetra.cells, tetrahedra)
    assert tetra.places.tolist() == [0, 1, 2, 5, 6, 7, 8, 9]


def test_numbers_are_those_of_the_deck(tmp_path):
    mesh = four_types()
    text = "*NODE\n" + "".join(f"{n + 101}, {x!r}, {y!r}, {z!r}\n" for n, (x, y, z) in enumerate(mesh.points.tolist()))
    number, names = 1000, {"tetra": "C3D4", "hexahedron": "C3D8", "wedge": "C3D6", "pyramid": "C3D5"}
    for one in mesh.blocks:
        text += f"*ELEMENT, TYPE={names[one.cell_type.name]}\n"
        for nodes in one.cells.tolist():
            number += 1
            text += f"{number}, {', '.join(str(node + 101) for node in nodes)}\n"
    path = tmp_path / "deck.inp"
    path.write_text(text)
    measured = hc.quality(path)
    assert measured.labels.tolist() == list(range(1001, 1014))
    assert measured.by_type()["hexahedron"].labels.tolist() == [1009]


def test_linear_cells_and_quadratic_ones_are_measured_beside_each_other():
    grid = shuffled_grid(four_types()) + pv.examples.cells.QuadraticTetrahedron().translate((9, 9, 9))
    assert hc.quality(grid).by_type()["tetra10"].valid.all()
    assert len(hc.quality(grid).valid) == 14
    curved = pv.examples.cells.QuadraticHexahedron() + pv.examples.cells.Tetrahedron().translate((9, 9, 9))
    assert hc.regularize(curved, boundary="fixed").report.after.invalid == 0
    assert list(hc.quality(curved).by_type()) == ["tetra", "hexahedron20"]
    assert hc.quality(hc.as_volume_mesh(curved, linearize=True)).by_type()["hexahedron"].valid.all()
    with pytest.raises(
        hc.MeshError, match="no hexahedra, wedges, pyramids, tetrahedra, only: 1 triangle; for surfaces"
    ):
        hc.quality(pv.examples.cells.Triangle())


def test_voxels_among_other_cells_are_hexahedra():
    image = pv.RectilinearGrid(np.array([0.0, 1, 3, 6]), [0.0, 1], [0.0, 1]).cast_to_unstructured_grid()
    assert set(image.celltypes) == {11}
    table, types = image.cell_connectivity.reshape(3, 8).copy(), [11, 12, 11, 10]
    table[1] = table[1, [0, 1, 3, 2, 4, 5, 7, 6]]
    cells = [[8, *table[0]], [8, *table[1]], [8, *table[2]], [4, *table[2][[0, 1, 2, 4]]]]
    grid = pv.UnstructuredGrid(np.concatenate(cells), types, np.asarray(image.points, float))
    mesh = hc.as_volume_mesh(grid)
    np.testing.assert_allclose(hc.quality(mesh).volume, [1, 2, 3, 0.5])
    np.testing.assert_allclose(hc.quality(mesh).scaled_jacobian[:3], 1)
    back = mesh.to_source_type()
    assert back.celltypes.tolist() == [12, 12, 12, 10]
    np.testing.assert_allclose(hc.quality(back).volume, [1, 2, 3, 0.5])


def test_hexahedra_are_still_asked_for_by_who_works_on_them():
    grid = shuffled_grid(four_types())
    with pytest.raises(hc.MeshError, match="besides hexahedra there are other three-dimensional cells"):
        hc.as_hex_mesh(grid)
    assert len(hc.as_hex_mesh(grid, other_cells="keep").cells) == 1
    assert type(hc.as_volume_mesh(pv.ImageData(dimensions=(3, 3, 3)))) is hc.HexMesh
    with pytest.raises(hc.OptionError, match="other_cells must be"):
        io.as_volume_mesh(grid, other_cells="drop")
