"""Surface files and objects: what goes in comes out, in its order; what a format cannot hold is said."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import icosphere, mixed_sphere, quad_sphere

import surface
from hexconformal.common.errors import MeshError, ReadError, WriteError
from hexconformal.io import FORMATS
from surface.io.convert import as_pyvista
from surface.io.read_write import EXTENSIONS

TEXTS = {
    ".ply": "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
    "property float z\nproperty uchar red\nelement face 2\nproperty list uchar int vertex_index\nproperty int tag\n"
    "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    "0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n3 0 1 2 7\n3 0 2 3 8\n0 1\n",
    ".obj": "# by hand\nmtllib a.mtl\nv 0 0 0 0.5 0.5 0.5\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nvt 0 0\ng one\nf 1//1 2/1/1 \\\n"
    " 3/1\nv 0 1 0\ns off\nf -4 -2 -1\n",
    ".off": "OFF # by hand\n4 2 0\n\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 255 0 0\n3 0 2 3\n",
    ".stl": "solid by hand\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 1 1 0\n endloop\n"
    "endfacet\nfacet normal 0 0 1\n outer loop\n  vertex -0.0 0 0\n  vertex 1 1 0\n  vertex 0 1 0\n endloop\nendfacet\n"
    "endsolid by hand\n",
}
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
KEEP_ARRAYS = (".msh", ".ply", ".vtk", ".vtp", ".vtu")


def interleaved():
    """A sphere of triangles and quadrilaterals in random order, with arrays of several types."""
    points, cells = mixed_sphere(3)
    rng = np.random.default_rng(0)
    faces = [*cells.triangles.tolist(), *cells.quads.tolist()]
    faces = [faces[i] for i in rng.permutation(len(faces))]
    flat = [node for face in faces for node in (len(face), *face)]
    grid = pv.UnstructuredGrid(flat, [{3: 5, 4: 9}[len(face)] for face in faces], points)
    grid.point_data["height"] = points[:, 2]
    grid.point_data["id"] = np.arange(len(points), dtype=np.int32)
    grid.cell_data["tag"] = 10 * np.arange(len(faces), dtype=np.int32)
    grid.cell_data["size"] = rng.random(len(faces))
    return grid


@pytest.mark.parametrize("extension", [e for e in EXTENSIONS if e != ".stl"])
def test_cells_stay_in_their_order_with_their_arrays(extension, tmp_path):
    grid = interleaved()
    path = tmp_path / f"mixed{extension}"
    lost = surface.write(path, grid)
    again = surface.read(path)
    same = as_pyvista(again)
    np.testing.assert_array_equal(same.points, grid.points)
    np.testing.assert_array_equal(same.celltypes, grid.celltypes)
    np.testing.assert_array_equal(same.cell_connectivity, grid.cell_connectivity)
    if extension in KEEP_ARRAYS:
        for name in ("height", "id"):
            np.testing.assert_array_equal(again.point_data[name], grid.point_data[name])
        for name in ("tag", "size"):
            np.testing.assert_array_equal(same.cell_data[name], grid.cell_data[name])
    else:
        assert lost == ["point array 'height'", "point array 'id'", "cell array 'tag'", "cell array 'size'"]
    # And once more through what was read, with points that moved.
    moved = tmp_path / f"moved{extension}"
    surface.write(moved, again.replaced(2 * again.points, cell_data={"new": again.rows.astype(float)}))
    second = as_pyvista(surface.read(moved))
    np.testing.assert_array_equal(second.points, 2 * grid.points)
    np.testing.assert_array_equal(second.cell_connectivity, grid.cell_connectivity)
    if extension in KEEP_ARRAYS:
        np.testing.assert_array_equal(second.cell_data["tag"], grid.cell_data["tag"])
        np.testing.assert_array_equal(second.cell_data["new"], np.arange(grid.n_cells))


@pytest.mark.parametrize("source", KEEP_ARRAYS)
@pytest.mark.parametrize("target", KEEP_ARRAYS)
def test_from_one_format_to_another(source, target, tmp_path):
    grid = interleaved()
    first, second = tmp_path / f"a{source}", tmp_path / f"b{target}"
    surface.write(first, grid)
    surface.write(second, surface.read(first))
    again = as_pyvista(surface.read(second))
    np.testing.assert_array_equal(again.points, grid.points)
    np.testing.assert_array_equal(again.cell_connectivity, grid.cell_connectivity)
    np.testing.assert_array_equal(again.cell_data["tag"], grid.cell_data["tag"])
    np.testing.assert_array_equal(again.point_data["height"], grid.point_data["height"])


def test_physical_groups_of_gmsh_and_lines_survive(tmp_path):
    points, cells = quad_sphere(3)
    tags = [np.full(2, 4, np.int32), np.arange(len(cells.quads), dtype=np.int32)]
    lines = np.array([[0, 1], [1, 2]])
    mesh = meshio.Mesh(
        points,
        [("line", lines), ("quad", cells.quads)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"skin": np.array([1, 2])},
    )
    path = tmp_path / "a.msh"
    surface.write(path, mesh)
    result = surface.remesh(path, max_iterations=1)
    surface.write(path, result.mesh)
    again = meshio.read(path)
    assert [block.type for block in again.cells] == ["line", "quad"]
    np.testing.assert_array_equal(again.cells[0].data, lines)
    for before, after in zip(tags, again.cell_data["gmsh:physical"], strict=True):
        np.testing.assert_array_equal(after, before)
    np.testing.assert_array_equal(again.field_data["skin"], [1, 2])
    np.testing.assert_array_equal(again.points, result.points)
    assert np.isnan(again.cell_data["min_angle"][0]).all()


def test_lines_and_vertices_come_first_in_polydata(tmp_path):
    points, cells = quad_sphere(2)
    flat = np.insert(cells.quads, 0, 4, axis=1).ravel()
    grid = pv.UnstructuredGrid([*flat, 2, 0, 1, 1, 5], [9] * len(cells) + [3, 1], points)
    grid.cell_data["tag"] = np.arange(grid.n_cells)
    grid.field_data["note"] = [3.0]
    surface.write(tmp_path / "a.vtp", grid)
    again = pv.read(tmp_path / "a.vtp")
    assert again.cell_data["tag"].tolist() == [len(cells) + 1, len(cells), *range(len(cells))]
    assert (again.n_verts, again.n_lines) == (1, 1)
    assert again.field_data["note"] == [3.0]
    lost = surface.write(tmp_path / "a.ply", grid)
    assert lost == ["field data 'note'", "2 vertices and lines"]


def test_what_is_handed_in_comes_back_in_its_type_and_order():
    grid = interleaved()
    copy = grid.copy()
    out = surface.remesh(grid, max_iterations=2).mesh
    assert isinstance(out, pv.UnstructuredGrid)
    np.testing.assert_array_equal(out.cell_connectivity, grid.cell_connectivity)
    np.testing.assert_array_equal(out.cell_data["tag"], grid.cell_data["tag"])
    assert out.points.dtype == np.float64
    assert grid == copy
    # Each cell has its own angle.
    angles = pv.UnstructuredGrid(out).cell_quality("min_angle")["min_angle"]
    np.testing.assert_allclose(out.cell_data["min_angle"], angles, atol=1e-8)
    again = surface.remesh(out, max_iterations=2).mesh
    np.testing.assert_allclose(again.cell_data["min_angle"], again.cell_quality("min_angle")["min_angle"], atol=1e-8)
    assert isinstance(surface.remesh(pv.Sphere(), max_iterations=1).mesh, pv.PolyData)
    structured = pv.Plane(i_resolution=4, j_resolution=4).points.reshape(5, 5, 3)
    structured = pv.StructuredGrid(*(structured[None, ..., k] for k in range(3)))
    assert isinstance(surface.remesh(structured, max_iterations=1).mesh, pv.StructuredGrid)


def test_a_mesh_from_a_file_can_be_written_in_another_format(tmp_path):
    points, cells = icosphere(1)
    surface.write(tmp_path / "a.ply", (points, cells.triangles))
    mesh = surface.remesh(tmp_path / "a.ply", max_iterations=1).mesh
    assert isinstance(mesh, surface.SurfaceMesh)
    assert surface.write(tmp_path / "b.vtp", mesh) == []
    assert {"min_angle", "min_angle_change"} <= set(pv.read(tmp_path / "b.vtp").cell_data)


@pytest.mark.parametrize("extension", TEXTS)
def test_files_written_by_hand(extension, tmp_path):
    path = tmp_path / f"hand{extension}"
    path.write_text(TEXTS[extension])
    mesh = surface.read(path)
    np.testing.assert_array_equal(mesh.points, SQUARE)
    np.testing.assert_array_equal(mesh.cells.triangles, [[0, 1, 2], [0, 2, 3]])
    if extension == ".ply":
        np.testing.assert_array_equal(mesh.cell_data["tag"], [7, 8])
        np.testing.assert_array_equal(mesh.point_data["red"], [1, 2, 3, 4])
        assert mesh.origin.file.model == ("1 edge",)
    if extension == ".obj":
        assert mesh.origin.file.model == ("1 normals", "1 texture coordinates", "1 groups")


@pytest.mark.parametrize("extension", [".ply", ".stl", ".obj", ".vtp"])
def test_files_of_vtk_are_read(extension, tmp_path):
    path = tmp_path / f"sphere{extension}"
    sphere = pv.Sphere(theta_resolution=9, phi_resolution=7)
    sphere.save(path)
    mesh = surface.read(path)
    assert mesh.cells.triangles.shape == (sphere.n_cells, 3)
    np.testing.assert_allclose(mesh.points[mesh.cells.triangles], sphere.points[sphere.regular_faces], atol=1e-6)


@pytest.mark.parametrize("extension", [".ply", ".stl", ".obj", ".vtp"])
def test_files_are_read_by_vtk(extension, tmp_path):
    path = tmp_path / f"sphere{extension}"
    points, cells = icosphere(2)
    surface.write(path, (points, cells.triangles))
    sphere = pv.read(path)
    np.testing.assert_allclose(sphere.points[sphere.regular_faces], points[cells.triangles], atol=1e-6)


@pytest.mark.parametrize("extension", [".ply", ".off", ".obj", ".stl", ".msh"])
def test_files_are_read_by_meshio(extension, tmp_path):
    path = tmp_path / f"sphere{extension}"
    points, cells = icosphere(2)
    surface.write(path, (points, cells.triangles))
    sphere = meshio.read(path, file_format="gmsh" if extension == ".msh" else None)
    np.testing.assert_allclose(sphere.points[sphere.cells[0].data], points[cells.triangles], atol=1e-6)


@pytest.mark.parametrize("order", ["little", "big"])
def test_binary_ply_with_every_type(order, tmp_path):
    mark = {"little": "<", "big": ">"}[order]
    types = ["char", "uchar", "short", "ushort", "int", "uint", "float", "double"]
    codes = [mark + code for code in ("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")]
    head = f"ply\nformat binary_{order}_endian 1.0\nelement vertex 4\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += "element face 2\nproperty list uint short vertex_indices\n"
    head += "".join(f"property {name} of_{name}\n" for name in types) + "property list uchar float uv\nend_header\n"
    body = SQUARE.astype(mark + "f8").tobytes()
    values = np.array([[1, 2, 3, 4, 5, 6, 0.5, 0.25], [11, 12, 13, 14, 15, 16, 7.5, 7.25]])
    for face, row in zip(([0, 1, 2], [0, 2, 3]), values, strict=True):
        body += np.array(3, mark + "u4").tobytes() + np.array(face, mark + "i2").tobytes()
        body += b"".join(np.array(x, code).tobytes() for x, code in zip(row, codes, strict=True))
        body += b"\x02" + np.array([1, 2], mark + "f4").tobytes()
    (tmp_path / "a.ply").write_bytes(head.encode() + body)
    mesh = surface.read(tmp_path / "a.ply")
    np.testing.assert_array_equal(mesh.points, SQUARE)
    np.testing.assert_array_equal(mesh.cells.triangles, [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(np.stack([mesh.cell_data[f"of_{name}"] for name in types], axis=1), values)
    assert mesh.origin.file.model == ("2 'uv' of faces",)


def test_arrays_in_ply_that_need_another_type(tmp_path):
    data = {
        "truth": np.array([True, False, True]),
        "small": np.arange(3),
        "large": np.array([1, 2**40, 3]),
        "vector of flow": np.arange(9.0).reshape(3, 3),
        "text": np.array(["a", "b", "c"]),
    }
    mesh = surface.SurfaceMesh(np.eye(3), surface.as_surface_mesh((np.eye(3), [[0, 1, 2]])).cells, point_data=data)
    lost = surface.write(tmp_path / "a.ply", mesh)
    assert lost == [
        "the shape of the point array 'vector of flow' (kept as vector_of_flow_0, vector_of_flow_1, ...)",
        "point array 'text'",
    ]
    again = surface.read(tmp_path / "a.ply").point_data
    for name in ("truth", "small", "large"):
        np.testing.assert_array_equal(again[name], data[name])
    np.testing.assert_array_equal(again["vector_of_flow_1"], [1, 4, 7])


def test_stl_joins_equal_points_and_keeps_the_order(tmp_path):
    points, cells = icosphere(2)
    points = points.astype(np.float32).astype(float)
    assert surface.write(tmp_path / "a.stl", (points, cells.triangles)) == ["digits beyond single precision"]
    again = surface.read(tmp_path / "a.stl")
    assert len(again.points) == len(points)
    np.testing.assert_array_equal(again.points[again.cells.triangles], points[cells.triangles])


def test_stl_holds_no_quadrilaterals(tmp_path):
    with pytest.raises(WriteError, match=r"an .stl file holds triangles only.*quadrilaterals: 24 \(first ids 0"):
        surface.write(tmp_path / "a.stl", (*quad_sphere(2)[:1], quad_sphere(2)[1].quads))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("extension", EXTENSIONS)
@pytest.mark.parametrize("part", [0.0, 0.02, 0.5, 0.97])
def test_truncated_files_are_read_errors(extension, part, tmp_path):
    points, cells = icosphere(2)
    path = tmp_path / f"a{extension}"
    surface.write(path, (points, cells.triangles))
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(MeshError) as caught:
        surface.read(path)
    # Lines that are missing at the end of an .obj file cannot be noticed.
    assert isinstance(caught.value, ReadError) or extension == ".obj"
    assert str(path) in str(caught.value)
    if extension == ".ply" and part >= 0.5:
        assert "it is truncated" in str(caught.value)


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_nonsense_is_a_read_error(extension, tmp_path):
    path = tmp_path / f"a{extension}"
    path.write_bytes(bytes(np.random.default_rng(1).integers(0, 256, 4000, dtype=np.uint8)))
    with pytest.raises(MeshError, match="a\\."):
        surface.read(path)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        (
            "a.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 2 1 0\nf 1 2 3 4 5\n",
            "cells of other types: 1 .ids 0., namely 1 polygon",
        ),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "three corners or more; fewer have: 1 .ids 0"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n", r"node ids outside 0\.\.1"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2 x\n", "not a sound .obj file"),
        ("a.obj", "v 0 0 0\nv 1 0 0\n", "no faces"),
        ("a.off", "OFF\n2 1 0\n0 0 0\n1 0 0\n3 0 1\n", "shorter than it says"),
        ("a.off", "NO\n", "does not begin with OFF"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\nend_header\n0\n", "'property half x'"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n0\n", "no vertices"),
        ("a.xyz", "1 2 3\n", "unknown extension .xyz; known are .msh .obj"),
    ],
)
def test_what_is_wrong_with_a_file_is_told(name, text, said, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(MeshError, match=said):
        surface.read(tmp_path / name)


def test_an_off_file_with_a_number_on_each_line(tmp_path):
    (tmp_path / "a.off").write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3\n0\n1\n2\n3 0\n2 3\n")
    assert surface.read(tmp_path / "a.off").cells.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(ReadError, match="does not exist"):
        surface.read(tmp_path / "a.ply")
    with pytest.raises(ReadError, match="is a folder"):
        surface.read(tmp_path)
    with pytest.raises(WriteError, match=r"the folder .* does not exist"):
        surface.write(tmp_path / "no" / "a.ply", (SQUARE, [[0, 1, 2]]))


def test_a_write_that_fails_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.ply"
    surface.write(path, (SQUARE, [[0, 1, 2]]))
    before = path.read_bytes()

    def full(target, mesh):
        target.write_bytes(b"ply")
        raise OSError("no space left on device")

    monkeypatch.setattr("hexconformal.io.formats.ply.PLY", replace(FORMATS[".ply"], write=full))
    with pytest.raises(WriteError, match="no space left"):
        surface.write(path, (2 * SQUARE, [[0, 1, 2]]))
    assert path.read_bytes() == before
    assert [child.name for child in tmp_path.iterdir()] == ["a.ply"]
