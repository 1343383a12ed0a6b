"""What each file format keeps, and what it says it cannot."""

import os

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.files import as_grid, awkward_mesh, mixed_grid, mixed_meshio
from meshes.hexahedra import block

from hexconformal import HexMesh, as_hex_mesh
from hexconformal.common.errors import MeshError, OptionError, ReadError, WriteError
from hexconformal.io import read_write as io
from hexconformal.io.formats import WRITE_EXTENSIONS

# What each format keeps of arrays: all of them, one with integers, or none.
KEEPS = {
    ".vtu": ("all", "all"),
    ".vtk": ("all", "all"),
    ".msh": ("all", "all"),
    ".inp": ("none", "none"),
    ".mesh": ("one", "one"),
    ".meshb": ("one", "one"),
    ".mfem": ("none", "one"),
    ".e": ("all", "all"),
    ".exo": ("all", "all"),
    ".ex2": ("all", "all"),
    ".med": ("all", "all"),
    ".xdmf": ("all", "all"),
    ".xmf": ("all", "all"),
    ".bdf": ("none", "none"),
    ".nas": ("none", "none"),
    ".fem": ("none", "none"),
}


def test_every_format_is_tested():
    assert set(KEEPS) == set(WRITE_EXTENSIONS)


@pytest.mark.parametrize("extension", KEEPS)
def test_round_trip(extension, tmp_path):
    mesh = awkward_mesh()
    path = tmp_path / f"mesh{extension}"
    lost = io.write(path, mesh)
    again = io.read(path)
    if extension in (".bdf", ".nas", ".fem"):
        np.testing.assert_allclose(again.points, mesh.points, rtol=1e-9)
        assert any("digits" in text for text in lost)
    else:
        np.testing.assert_array_equal(again.points, mesh.points)
    np.testing.assert_array_equal(again.cells, mesh.cells)
    grid = pv.wrap(as_grid(again))
    assert (grid.celltypes == 9).sum() == 4
    assert (grid.celltypes == 3).sum() == 2
    for keeps, kind, ours, theirs in zip(
        KEEPS[extension],
        ("point", "cell"),
        (mesh.point_data, mesh.cell_data),
        (again.point_data, again.cell_data),
        strict=True,
    ):
        for name, array in ours.items():
            if keeps == "all":
                np.testing.assert_array_equal(theirs[name], array)
                assert f"{kind} array {name!r}" not in lost
            elif keeps == "one" and name == "i":
                np.testing.assert_array_equal(theirs["attribute" if extension == ".mfem" else "medit:ref"], array)
            else:
                assert f"{kind} array {name!r}" in lost
    if extension == ".msh":
        assert any("integer type of" in text for text in lost)
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".")]


def test_whatever_holds_a_mesh_can_be_written(tmp_path):
    points, cells = block(1)
    with_tetra = meshio.Mesh(points, [("hexahedron", cells), ("tetra", cells[:, :4])])
    for number, mesh in enumerate([(points, cells), mixed_grid(), with_tetra]):
        io.write(tmp_path / f"{number}.vtu", mesh)
        back = io.read(tmp_path / f"{number}.vtu", other_cells="keep")
        np.testing.assert_array_equal(back.points, as_hex_mesh(mesh, other_cells="keep").points)
    with pytest.raises(OptionError, match="cannot make a mesh of int"):
        io.write(tmp_path / "a.vtu", 3)


def test_who_has_a_surface_or_tetrahedra_is_told(tmp_path):
    points, cells = block(1)
    pv.Sphere().save(tmp_path / "a.stl")
    with pytest.raises(ReadError, match=r"surface\.remesh, and the command remesh"):
        io.read(tmp_path / "a.stl")
    with pytest.raises(WriteError, match=r"surface\.remesh, and the command remesh"):
        io.write(tmp_path / "a.ply", (points, cells))
    with pytest.raises(MeshError, match=r"no hexahedra, only: 1 quad; .* surface\.remesh"):
        as_hex_mesh(meshio.Mesh(points, [("quad", cells[:, :4])]))
    with pytest.raises(MeshError, match=r"no hexahedra, only: 1 tetra$"):
        as_hex_mesh(meshio.Mesh(points, [("tetra", cells[:, :4])]))
    (tmp_path / "a.msh").write_text("hello")
    with pytest.raises(ReadError, match="not a sound gmsh or ansys file"):
        io.read(tmp_path / "a.msh")


def test_wedges_keep_their_shape_between_libraries(tmp_path):
    points, cells = block(1)
    points = np.vstack([points, [[2, 0, 0], [2, 0, 1]]])
    wedge = [[4, 8, 6, 5, 9, 7]]
    source = as_hex_mesh(meshio.Mesh(points, [("hexahedron", cells), ("wedge", wedge)]), other_cells="keep")
    io.write(tmp_path / "a.vtu", source)
    volumes = pv.read(tmp_path / "a.vtu").compute_cell_sizes()["Volume"]
    io.write(tmp_path / "b.msh", io.read(tmp_path / "a.vtu", other_cells="keep"))
    back = io.read(tmp_path / "b.msh", other_cells="keep").origin.source
    np.testing.assert_array_equal(back.cells_dict["wedge"], wedge)
    np.testing.assert_allclose(volumes, [1, 0.5])


def test_arrays_of_odd_types_are_kept_or_named(tmp_path):
    mesh = HexMesh(*block(1))
    mesh = mesh.replaced(
        point_data={"tensor": np.arange(72.0).reshape(8, 3, 3), "flag": np.arange(8) > 3},
        cell_data={"name": np.array(["abc"]), "pair": np.ones((1, 2))},
    )
    assert io.write(tmp_path / "a.vtu", mesh) == []
    np.testing.assert_array_equal(io.read(tmp_path / "a.vtu").point_data["tensor"], np.arange(72.0).reshape(8, 9))
    assert io.read(tmp_path / "a.vtu").cell_data["name"].tolist() == ["abc"]
    lost = io.write(tmp_path / "a.msh", mesh)
    assert {"cell array 'name'", "cell array 'pair'"} <= set(lost)
    np.testing.assert_array_equal(io.read(tmp_path / "a.msh").point_data["flag"], np.arange(8) > 3)


def test_writing_changes_nothing_in_memory(tmp_path):
    source = mixed_meshio()
    before = repr((source.points, source.cells, source.point_data, source.cell_data, source.field_data))
    mesh = as_hex_mesh(source)
    for extension in KEEPS:
        lost = io.write(tmp_path / f"mesh_{extension[1:]}{extension}", mesh)
        # The vertex has no counterpart in some formats.
        assert ("1 vertex cells" in lost) == (extension in (".inp", ".mesh", ".meshb", ".bdf", ".nas", ".fem"))
    assert repr((source.points, source.cells, source.point_data, source.cell_data, source.field_data)) == before


@pytest.mark.parametrize("extension", sorted(set(KEEPS) - {".vtu", ".vtk"}))
@pytest.mark.parametrize(
    ("code", "name"), [(16, "hexagonal_prism"), (31, "quadratic_linear_wedge"), (42, "polyhedron")]
)
def test_solid_cells_that_meshio_does_not_know_are_named(extension, code, name, tmp_path):
    points, cells = block(3)
    other = [4, *(3, 1, 2, 3), *(3, 1, 2, 5), *(3, 2, 3, 5), *(3, 1, 3, 5)] if code == 42 else 12
    nodes = other if code == 42 else list(range(other))
    grid = pv.UnstructuredGrid(np.array([8, *cells[0], len(nodes), *nodes]), np.array([12, code], np.uint8), points)
    mesh = as_hex_mesh(grid, other_cells="keep")
    with pytest.raises(WriteError, match=rf"\.vtu, \.vtk\) hold: 1 of type {name}"):
        io.write(tmp_path / f"a{extension}", mesh)


def test_shared_meshes_survive(shared, tmp_path):
    path = shared / "meshes" / "hex" / "xu_t3_fandisk_input.vtu"
    mesh = io.read(path)
    assert len(mesh.cells) == 357
    for extension in (".vtu", ".vtk", ".msh", ".mesh"):
        io.write(tmp_path / f"a{extension}", mesh)
        again = io.read(tmp_path / f"a{extension}")
        np.testing.assert_array_equal(again.points, mesh.points)
        np.testing.assert_array_equal(again.cells, mesh.cells)
