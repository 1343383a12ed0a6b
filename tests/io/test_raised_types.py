"""Linear cells of all types made quadratic: shared nodes, what came along, in memory and in files."""

import meshio
import numpy as np
import pytest
from meshes.mixed import mixed_block, shuffled_grid
from meshes.quadratic_cells import raised

import hexconformal as hc

COUNTS = {
    20: {"hexahedron": 20, "wedge": 15, "pyramid": 13, "tetra": 10},
    27: {"hexahedron": 27, "wedge": 18, "pyramid": 14, "tetra": 10},
}
each_number = pytest.mark.parametrize("nodes", [20, 27])


def rows(mesh):
    """Nodes of all cells by where they are, and their type."""
    found = {}
    for one in mesh.blocks:
        for cell in one.cells:
            found[tuple(mesh.points[cell].round(6).ravel())] = one.cell_type.name
    return found


@each_number
def test_each_type_has_its_own_number_and_neighbours_share_nodes(nodes):
    linear = mixed_block(1)
    mesh, (expected, _, _) = hc.elevated(linear, nodes), raised(linear, COUNTS[nodes])
    assert len(mesh.points) == len(expected.points)
    np.testing.assert_array_equal(mesh.points[: len(linear.points)], linear.points)
    assert rows(mesh) == rows(expected)
    assert [finding.kind for finding in hc.check(mesh)] == ["higher order"]
    np.testing.assert_allclose(hc.quality(mesh).volume, hc.quality(linear).volume)


def test_cells_keep_their_places_arrays_and_what_lies_on_them():
    grid = shuffled_grid(mixed_block(1))
    grid.cell_data["number"] = np.arange(grid.n_cells)
    mesh = hc.elevated(grid)
    before = hc.as_volume_mesh(grid)
    np.testing.assert_array_equal(mesh.cell_data["number"], before.cell_data["number"])
    np.testing.assert_allclose(hc.quality(mesh).volume, hc.quality(before).volume)
    back = mesh.to_source_type()
    assert set(back.celltypes) <= {23, 24, 25, 26, 27}  # the quadrilaterals are quadratic, too
    assert hc.quality(back).valid.all()
    with pytest.raises(hc.MeshError, match="VTK has no pyramids of 14 nodes"):
        hc.elevated(grid, 27)


@each_number
def test_triangles_on_faces_become_quadratic_too(nodes):
    linear = mixed_block(1)
    tetra = next(one for one in linear.blocks if one.cell_type.name == "tetra").cells
    cells = [(one.cell_type.name, one.cells) for one in linear.blocks]
    source = meshio.Mesh(linear.points, [*cells, ("triangle", tetra[:2, [0, 2, 1]]), ("line", tetra[:1, :2])])
    mesh = hc.elevated(source, nodes).to_source_type()
    by_type = {block.type: block.data for block in mesh.cells}
    tetra = by_type["tetra10"]
    np.testing.assert_array_equal(by_type["triangle6"], tetra[:2, [0, 2, 1, 6, 5, 4]])
    np.testing.assert_array_equal(by_type["line3"], tetra[:1, [0, 1, 4]])


@pytest.mark.parametrize("extension", [".vtu", ".msh", ".e", ".med", ".bdf"])
def test_the_command_raises_all_types(extension, tmp_path):
    from hexconformal.app.cli import main

    hc.write(tmp_path / f"a{extension}", mixed_block(1))
    assert main(["elevate", str(tmp_path / f"a{extension}"), str(tmp_path / f"b{extension}")]) == 0
    found = hc.quality(tmp_path / f"b{extension}")
    assert set(found.by_type()) == {"hexahedron20", "wedge15", "pyramid13", "tetra10"}
    assert found.valid.all()


def test_what_is_quadratic_already_is_refused():
    with pytest.raises(hc.MeshError, match=r"must be linear, and there are .* 15 nodes.*linearize=True"):
        hc.elevated(hc.elevated(mixed_block(1)))
