"""Ghost cells and collapsed hexahedra: they are not worked on, and their nodes stay."""

import meshio
import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import block

import hexconformal as hc
from hexconformal.common.errors import MeshError
from hexconformal.io import from_vtk
from hexconformal.io import read_write as io


def ghost_grid():
    """A block of 3 x 3 x 3 distorted cells, of which the last layer belongs to the neighbour."""
    points, cells = block(3)
    inner = ((points > 0.01) & (points < points.max() - 0.01)).all(axis=1)
    points = points + 0.15 * np.random.default_rng(0).uniform(-1, 1, points.shape) * inner[:, None]
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points)
    ghost = points[cells][:, :, 0].mean(axis=1) > points[:, 0].max() * 2 / 3
    assert ghost.sum() == 9
    grid.cell_data["vtkGhostType"] = ghost.astype(np.uint8)
    grid.cell_data["rank"] = ghost.astype(np.int32)
    return grid, ghost


@pytest.mark.parametrize("by_file", [True, False])
def test_ghost_cells_do_not_count_and_do_not_move(by_file, tmp_path):
    grid, ghost = ghost_grid()
    grid.save(tmp_path / "a.vtu")
    mesh = io.read(tmp_path / "a.vtu") if by_file else hc.as_hex_mesh(grid)
    assert len(mesh.cells) == 18
    assert "ghost cells are carried along, their nodes held: 9" in mesh.notes
    theirs = np.unique(block(3)[1][ghost])
    assert np.flatnonzero(mesh.held).tolist() == theirs.tolist()
    result = hc.regularize(mesh, max_iterations=3)
    np.testing.assert_array_equal(result.points[theirs], mesh.points[theirs])
    assert (result.points != mesh.points).any()
    assert io.write(tmp_path / "b.vtu", mesh.replaced(points=result.points)) == []
    back = pv.read(tmp_path / "b.vtu")
    assert back.n_cells == 27
    np.testing.assert_array_equal(back.cell_data["vtkGhostType"], ghost)
    np.testing.assert_array_equal(back.cell_data["rank"], ghost)


def test_ghost_cells_of_vtk_grids():
    grid, ghost = ghost_grid()
    mesh = from_vtk(grid)
    assert len(mesh.cells) == 18
    assert mesh.held.sum() == len(np.unique(block(3)[1][ghost]))


def collapsed(library):
    points, cells = block(2)
    cells = cells.copy()
    cells[7, 6] = cells[7, 5]
    if library == "meshio":
        return meshio.Mesh(points, [("hexahedron", cells)]), cells
    return pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points), cells


@pytest.mark.parametrize("library", ["meshio", "pyvista"])
def test_collapsed_hexahedra_are_refused_or_held(library):
    source, cells = collapsed(library)
    with pytest.raises(MeshError, match=r"1 collapsed hexahedron; other_cells='keep' \(--other-cells keep\)"):
        hc.as_hex_mesh(source)
    mesh = hc.as_hex_mesh(source, other_cells="keep")
    np.testing.assert_array_equal(mesh.cells, cells[:7])
    assert np.flatnonzero(mesh.held).tolist() == np.unique(cells[7]).tolist()
    back = mesh.to_source_type()
    kept = back.cells[0].data if library == "meshio" else np.asarray(back.cells_dict[12])
    np.testing.assert_array_equal(kept, cells)
