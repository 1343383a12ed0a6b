"""MED of Salome: orders of nodes, families, one block per type of cell."""

import meshio
import numpy as np
import pytest
from meshes.files import EDGES, mixed_meshio
from meshes.hexahedra import block

from hexconformal import as_hex_mesh
from hexconformal.io import read_write as io

SOLIDS = {
    "hexahedron": (block(1)[0][block(1)[1][0]], ()),
    "hexahedron20": (block(1)[0][block(1)[1][0]], EDGES),
    "tetra": (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), ()),
    "tetra10": (
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]),
        [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    ),
    "wedge": (np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1]]), ()),
    "pyramid": (np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1]]), ()),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_med_has_solid_cells_the_other_way_round(name, tmp_path):
    """As in Salome's documentation, and in what Gmsh writes: seen from inside, bases go round counter-clockwise."""
    pytest.importorskip("h5py")
    corners, edges = SOLIDS[name]
    points = np.concatenate([corners, *(corners[[edge]].mean(axis=1) for edge in edges)]).astype(float)
    x, cells = block(1)
    mixed = meshio.Mesh(
        np.concatenate([points, x + 5]), [(name, [range(len(points))]), ("hexahedron", cells + len(points))]
    )
    mesh = as_hex_mesh(mixed, other_cells="keep", linearise=True)
    path = tmp_path / "a.med"
    io.write(path, mesh)
    raw = meshio.read(path)
    there = next(block_.data[0] for block_ in raw.cells if block_.type == name)
    y = raw.points[there]
    top = {"hexahedron": 4, "tetra": 3, "wedge": 3, "pyramid": 4}[name.rstrip("0123456789")]
    base = np.cross(y[1] - y[0], y[2] - y[1])
    assert base @ (y[top] - y[0]) < 0
    for middle, edge in zip(y[len(corners) :], edges, strict=True):
        np.testing.assert_array_equal(middle, y[list(edge)].mean(axis=0))
    back = io.read(path, other_cells="keep", linearise=True)
    np.testing.assert_array_equal(back.cells, mesh.cells)
    np.testing.assert_array_equal(
        next(block_.data[0] for block_ in back.origin.source.cells if block_.type == name), np.arange(len(points))
    )


def test_med_families_may_be_in_no_group(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.med"
    points, cells = block(2)
    mesh = meshio.Mesh(points, [("hexahedron", cells)], cell_data={"cell_tags": [np.repeat([-6, -7], 4)]})
    mesh.cell_tags = {-6: ["left", "größe"], -7: ["right"]}
    io.write(path, mesh)
    with h5py.File(path, "a") as file:
        families = next(iter(file["FAS"].values()))["ELEME"]
        del families["FAM_-7_right"]["GRO"]
    for _ in range(2):
        mesh = io.read(path)
        tags = mesh.origin.source.cell_tags
        assert {int(key): names for key, names in tags.items()} == {-7: [], -6: ["left", "größe"]}
        np.testing.assert_array_equal(mesh.cell_data["cell_tags"], np.repeat([-6, -7], 4))
        io.write(path, mesh)


def test_blocks_of_one_type_are_joined_for_med(tmp_path):
    path = tmp_path / "mesh.med"
    lost = io.write(path, as_hex_mesh(mixed_meshio()))
    assert "point set 'inlet'" in lost
    assert "cell set 'some'" in lost
    again = io.read(path)
    np.testing.assert_array_equal(again.cell_data["gmsh:physical"], [11] * 5 + [13] * 3)
    # A second round, with an array more than the file had names for.
    io.write(path, again.replaced(point_data={"more": np.arange(28.0)}, cell_data={"w": np.arange(8.0)}))
    np.testing.assert_array_equal(io.read(path).cell_data["p"], again.cell_data["p"])
    np.testing.assert_array_equal(io.read(path).point_data["more"], np.arange(28.0))
