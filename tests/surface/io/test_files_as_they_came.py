"""Surface files are written as they came, with other coordinates; what others cannot keep is told by name and count."""

import meshio
import numpy as np
import pytest
import pyvista as pv

import surface
from hexconformal.common.errors import ReadError
from hexconformal.io import read_surface

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
MOVED = SQUARE + [0.1, 0.2, 1 / 3]
OBJ = """# exported
mtllib a.mtl
o sheet
v 0 0 0 1 0 0
v  1 0 0
vt 0 0
vt 1 1
vn 0 0 1
g left
usemtl red
v 1 1 0
v 0 1 0   # the last
f {} {} {}
f -4/1/1 -2/2/1 \\
  -1/2/1
"""


@pytest.mark.parametrize("corners", [("1/1/1", "2/2/1", "3/2/1"), ("-4", "-3", "-2"), ("1", "2", "3")])
def test_obj(corners, tmp_path):
    path, text = tmp_path / "a.obj", OBJ.format(*corners)
    path.write_text(text)
    mesh = surface.read(path)
    np.testing.assert_array_equal(mesh.cells.triangles, [[0, 1, 2], [0, 2, 3]])
    told = ["2 texture coordinates", "1 normals", "1 groups", "1 uses of materials"]
    lost = surface.io.write(tmp_path / "a.off", mesh)
    assert lost == [f"{what} of the obj file" for what in told]
    assert surface.io.write(path, mesh.replaced(points=MOVED)) == [
        "1 normals, which are those of the file: the surface moved"
    ]
    new, old = path.read_text().splitlines(), text.splitlines()
    changed = [k for k, line in enumerate(old) if new[k] != line]
    assert [old[k].split()[0] for k in changed] == ["v"] * 4
    assert new[3].endswith(" 1 0 0")
    assert new[11].endswith("   # the last")
    np.testing.assert_array_equal(surface.read(path).points, MOVED)
    theirs = np.unique(pv.read(path).points, axis=0)  # a point of theirs for each pair of point and texture
    np.testing.assert_allclose(theirs, np.unique(MOVED, axis=0), rtol=1e-6)


STL = """solid inlet
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 1 1 0
 endloop
endfacet
endsolid inlet
solid wall two
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 1 0
  vertex 0 1 0
 endloop
endfacet
endsolid wall two
"""


def test_stl_text_keeps_its_solids(tmp_path):
    path = tmp_path / "a.stl"
    path.write_text(STL)
    mesh = surface.read(path)
    assert mesh.origin.file.model == ("solids inlet, wall two",)
    order = [SQUARE.tolist().index(point) for point in mesh.points.tolist()]
    turned = np.column_stack([MOVED[:, 0], -MOVED[:, 2], MOVED[:, 1]])
    assert surface.io.write(path, mesh.replaced(points=turned[order])) == []
    new, old = path.read_text().splitlines(), STL.splitlines()
    assert {line.split()[0] for line, other in zip(old, new, strict=True) if line != other} == {"vertex", "facet"}
    assert new[1].split()[2:] == ["0", "-1", "0"] or np.allclose([float(x) for x in new[1].split()[2:]], [0, -1, 0])
    np.testing.assert_array_equal(surface.read(path).points, turned[order])
    assert surface.io.write(tmp_path / "b.ply", surface.read(path)) == ["solids inlet, wall two of the stl file"]


def test_stl_binary_keeps_head_and_attributes(tmp_path):
    path = tmp_path / "a.stl"
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets = np.zeros(2, record)
    facets["corners"], facets["attribute"] = SQUARE[[[0, 1, 2], [0, 2, 3]]], [7, 8]
    path.write_bytes(b"COLOR=abcd".ljust(80) + (2).to_bytes(4, "little") + facets.tobytes())
    mesh = surface.read(path)
    assert surface.io.write(path, mesh.replaced(points=mesh.points + 0.5)) == ["digits beyond single precision"]
    data = path.read_bytes()
    again = np.frombuffer(data, record, 2, 84)
    assert data[:10] == b"COLOR=abcd"
    assert again["attribute"].tolist() == [7, 8]
    np.testing.assert_array_equal(again["normal"], [[0, 0, 1]] * 2)
    np.testing.assert_array_equal(again["corners"], facets["corners"] + np.float32(0.5))


def test_off_keeps_colours_and_comments(tmp_path):
    path = tmp_path / "a.off"
    rows = "\n".join(f"{x:g} {y:g} {z:g} 255 0 0 255" for x, y, z in SQUARE)
    text = f"COFF # by hand\n# a comment\n4 2 0\n{rows}\n\n3 0 1 2 0.5 0.5 0.5\n3 0 2 3\n"
    path.write_text(text)
    mesh = surface.read(path)
    assert mesh.origin.file.model == ("colours or normals of 4 points", "colours or normals of 1 faces")
    assert surface.io.write(path, mesh.replaced(points=MOVED)) == []
    new, old = path.read_text().splitlines(), text.splitlines()
    assert [k for k, line in enumerate(old) if new[k] != line] == [3, 4, 5, 6]
    assert new[3].endswith(" 255 0 0 255")
    np.testing.assert_array_equal(surface.read(path).points, MOVED)


@pytest.mark.parametrize("head", ["4OFF", "nOFF", "OFF BINARY"])
def test_off_of_other_kinds_is_refused_by_name(head, tmp_path):
    (tmp_path / "a.off").write_text(f"{head}\n4 2 0\n")
    with pytest.raises(ReadError, match=f"{head} is not supported"):
        surface.read(tmp_path / "a.off")


def ply_bytes(order, points=SQUARE, precision="float"):
    kind = {"float": "f4", "double": "f8"}[precision]
    mark = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}[order]
    head = f"ply\nformat {order} 1.0\ncomment kept\nelement vertex 4\nproperty uchar red\n"
    head += "".join(f"property {precision} {name}\n" for name in "xyz")
    head += "property float nx\nproperty float ny\nproperty float nz\nelement face 2\n"
    head += (
        "property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int part\nend_header\n"
    )
    faces = [([0, 1, 2], [0.5, 0.25], 4), ([0, 2, 3], [0.75, 1.5], 5)]
    if not mark:
        lines = [f"{k} {x!r} {y!r} {z!r} 0 0 1" for k, (x, y, z) in enumerate(points.tolist())]
        lines += [f"3 {' '.join(map(str, ids))} 2 {' '.join(map(str, uv))} {part}" for ids, uv, part in faces]
        return (head + "\n".join(lines) + "\n").encode()
    body = b""
    for k, point in enumerate(points):
        body += bytes([k]) + np.array(point, mark + kind).tobytes() + np.array([0, 0, 1], mark + "f4").tobytes()
    for ids, uv, part in faces:
        body += b"\3" + np.array(ids, mark + "i4").tobytes() + b"\2" + np.array(uv, mark + "f4").tobytes()
        body += np.array(part, mark + "i4").tobytes()
    return head.encode() + body


@pytest.mark.parametrize("order", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_keeps_all_but_coordinates(order, tmp_path):
    path = tmp_path / "a.ply"
    path.write_bytes(ply_bytes(order))
    mesh = surface.read(path)
    assert surface.io.write(path, mesh) == []
    if order != "ascii":
        assert path.read_bytes() == ply_bytes(order)
    told = ["4 normals, which are those of the file: the surface moved"]
    assert surface.io.write(path, mesh.replaced(points=SQUARE + 0.5)) == told
    assert surface.read(path).points.tolist() == (SQUARE + 0.5).tolist()
    if order != "ascii":
        assert path.read_bytes() == ply_bytes(order, SQUARE + 0.5)
    # Single precision is left where it would cost digits.
    assert surface.io.write(path, mesh.replaced(points=MOVED)) == told
    assert path.read_bytes() == ply_bytes(order, MOVED, "double")
    np.testing.assert_allclose(pv.read(path).points, MOVED)
    lost = surface.io.write(tmp_path / "b.obj", mesh)
    assert lost[0] == "2 'texcoord' of faces of the ply file"


def test_ply_with_arrays_is_read_by_others(tmp_path):
    path = tmp_path / "a.ply"
    arrays = {"quality": np.array([0.5, 1 / 3]), "part": np.array([3, 4]), "flag": np.array([True, False])}
    mesh = surface.as_surface_mesh((SQUARE, [[0, 1, 2], [0, 2, 3]]))
    mesh = mesh.replaced(cell_data=arrays, point_data={"t": SQUARE[:, 0] / 3, "small": np.arange(4, dtype=np.int8)})
    assert surface.io.write(path, mesh) == []
    theirs = meshio.read(path)
    np.testing.assert_array_equal(theirs.points, SQUARE)
    np.testing.assert_array_equal(theirs.cells_dict["triangle"], [[0, 1, 2], [0, 2, 3]])
    for name, values in arrays.items():
        np.testing.assert_array_equal(theirs.cell_data[name][0], values)
    np.testing.assert_array_equal(theirs.point_data["t"], SQUARE[:, 0] / 3)
    assert pv.read(path).n_cells == 2
    assert read_surface(path).n_cells == 2
    back = surface.read(path)
    for name, values in arrays.items():
        np.testing.assert_array_equal(back.cell_data[name], values)
    trimesh = pytest.importorskip("trimesh")
    assert len(trimesh.load(path, process=False).faces) == 2


@pytest.mark.parametrize("face_arrays", [True, False])
def test_ply_of_small_integers_on_points_is_read_by_meshio(face_arrays, tmp_path):
    path = tmp_path / "a.ply"
    mesh = surface.as_surface_mesh((SQUARE, [[0, 1, 2], [0, 2, 3]]))
    kinds = (np.int8, np.int16, np.uint16, np.uint8, np.int32, np.uint32, np.float32)
    points = {np.dtype(kind).name: np.arange(4, dtype=kind) for kind in kinds}
    mesh = mesh.replaced(point_data=points, cell_data={"a": np.arange(2)} if face_arrays else {})
    assert surface.io.write(path, mesh) == []
    theirs = meshio.read(path)
    for name, values in points.items():
        np.testing.assert_array_equal(theirs.point_data[name], values)


def test_polydata_of_vtk_stays(tmp_path):
    path = tmp_path / "a.vtp"
    sheet = pv.Plane(i_resolution=2, j_resolution=2).triangulate()
    sheet.field_data["when"] = [3.5]
    sheet.point_data["T"] = np.arange(9)
    sheet.set_active_scalars("T")
    sheet.save(path)
    mesh = surface.read(path)
    assert surface.io.write(path, mesh.replaced(points=mesh.points + 1 / 3)) == []
    back = pv.read(path)
    assert back.field_data["when"] == [3.5]
    assert back.active_scalars_name == "T"
    assert set(back.point_data) == set(sheet.point_data)
    np.testing.assert_array_equal(back.faces, sheet.faces)
