"""Gmsh's meshes: tags, names and the version stay."""

import meshio
import numpy as np
import pytest
from meshes.files import mixed_meshio
from meshes.hexahedra import block

from hexconformal.io import read_write as io


@pytest.mark.parametrize("binary", [True, False])
def test_gmsh_22_keeps_its_tags_names_and_kind(binary, tmp_path):
    path = tmp_path / "mesh.msh"
    source = mixed_meshio()
    source.cell_data["gmsh:geometrical"] = [np.full(len(c.data), 7) for c in source.cells]
    source.point_data.clear()
    del source.cell_data["p"]
    meshio.write(path, source, file_format="gmsh22", binary=binary)
    mesh = io.read(path)
    np.testing.assert_array_equal(mesh.cell_data["gmsh:physical"], [11] * 5 + [13] * 3)
    lost = io.write(path, mesh.replaced(cell_data={"q": np.arange(8) / 3}, point_data={"T": np.linspace(0, 1, 28)}))
    assert lost == []
    assert path.read_bytes().startswith(b"$MeshFormat\n2.2 %d 8" % binary)
    again = io.read(path)
    np.testing.assert_array_equal(again.points, source.points)
    np.testing.assert_array_equal(again.cell_data["q"], np.arange(8) / 3)
    np.testing.assert_array_equal(again.point_data["T"], np.linspace(0, 1, 28))
    np.testing.assert_array_equal(again.cell_data["gmsh:physical"], mesh.cell_data["gmsh:physical"])
    assert again.cell_data["gmsh:physical"].dtype.kind == "i"
    back = again.origin.source
    np.testing.assert_array_equal(back.field_data["fluid"], [11, 3])
    assert [c.type for c in back.cells] == ["quad", "hexahedron", "line", "hexahedron", "vertex"]


@pytest.mark.parametrize("known", [True, False])
def test_gmsh_41_is_kept_where_meshio_can(known, tmp_path):
    points, cells = block(1)
    quad = cells[:, :4]
    source = meshio.Mesh(points, [("hexahedron", cells), ("quad", quad)])
    source.cell_data = {
        "gmsh:physical": [np.array([5]), np.array([6])],
        "gmsh:geometrical": [np.array([1]), np.array([2])],
    }
    source.field_data = {"solid": np.array([5, 3])}
    tags = np.array([[3, 1]] * 8)
    tags[:4] = [2, 2]
    source.point_data["gmsh:dim_tags"] = tags
    path = tmp_path / "mesh.msh"
    meshio.write(path, source, file_format="gmsh", binary=True)
    mesh = io.read(path)
    if not known:
        mesh = mesh.replaced(point_data={"gmsh:dim_tags": np.array([[3, 1]] * 8)})
    lost = io.write(path, mesh)
    assert path.read_bytes().startswith(b"$MeshFormat\n4.1" if known else b"$MeshFormat\n2.2")
    assert any("entities" in text for text in lost) is not known
    back = io.read(path).origin.source
    assert [part.tolist() for part in back.cell_data["gmsh:physical"]] == [[5], [6]]
    np.testing.assert_array_equal(back.field_data["solid"], [5, 3])


GMSH_41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
0 0 0 1
1 0 0 0 1 1 1 0 0
$EndEntities
$Nodes
1 8 1 8
3 1 0 8
1\n2\n3\n4\n5\n6\n7\n8
0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1
$EndNodes
$Elements
1 1 1 1
3 1 5 1
1 1 2 3 4 5 6 7 8
$EndElements
"""


def test_gmsh_41_without_physical_groups_is_written_back(tmp_path):
    path = tmp_path / "mesh.msh"
    path.write_text(GMSH_41)
    mesh = io.read(path)
    io.write(path, mesh)
    assert path.read_bytes().startswith(b"$MeshFormat\n4.1")
    back = io.read(path)
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(back.cells, mesh.cells)
