"""Quality and checks of quadratic hexahedra, alone and beside other cells."""

import numpy as np
import pytest
import pyvista as pv
from meshes.hexahedra import jittered_box
from meshes.mixed import cut_into_pyramids, cut_into_tetrahedra, cut_up
from meshes.quadratic_cells import QUADRATIC, raised

import hexconformal as hc
from hexconformal.elements import MEASURES, measures_of
from hexconformal.quality import MixedQuality

LINEAR = {
    "hexahedron": lambda: hc.as_volume_mesh(jittered_box(3)),
    "wedge": lambda: cut_up(*jittered_box(2), np.full(8, "wedge")),
    "pyramid": lambda: cut_into_pyramids(*jittered_box(2)),
    "tetra": lambda: cut_into_tetrahedra(*jittered_box(2)),
}
each_number = pytest.mark.parametrize("nodes", [20, 27])


def curved(nodes, amount=0.012, n=3):
    """A block of cells whose nodes, those on edges and in faces too, are moved."""
    mesh = hc.elevated(jittered_box(n), nodes)
    return mesh.replaced(mesh.points + np.random.default_rng(0).uniform(-amount, amount, mesh.points.shape))


def kinds(mesh):
    return [finding.kind for finding in hc.check(mesh)]


@each_number
def test_quality_has_the_measures_of_each_cell(nodes):
    mesh = curved(nodes)
    measured = hc.quality(mesh)
    assert isinstance(measured, MixedQuality)
    expected = measures_of(mesh.points, mesh.blocks[0].cells, mesh.blocks[0].cell_type)
    for name, row in zip(MEASURES, expected, strict=True):
        np.testing.assert_array_equal(getattr(measured, name), row)
    assert list(measured.summary().types) == [f"hexahedron{nodes}"]
    assert f"27 hexahedra of {nodes} nodes, 0 inverted" in str(measured.summary())


@each_number
def test_beside_linear_cells_each_has_its_own_place(nodes):
    mesh = curved(nodes, n=2)
    points, cells = np.vstack([mesh.points, [[0.5, 0.5, 3.0]]]), mesh.blocks[0].cells
    flat, types = [], []
    for cell in cells.tolist():
        flat += [nodes, *cell, 4, *cell[4:7], len(points) - 1]
        types += [{20: 25, 27: 29}[nodes], 10]
    measured = hc.quality(pv.UnstructuredGrid(flat, types, points))
    assert measured.labels.tolist() == list(range(16))
    np.testing.assert_array_equal(measured.scaled_jacobian[::2], hc.quality(mesh).scaled_jacobian)
    found = measured.by_type()
    assert found[f"hexahedron{nodes}"].labels.tolist() == list(range(0, 16, 2))
    assert found["tetra"].labels.tolist() == list(range(1, 16, 2))


@each_number
def test_check_says_how_they_are_worked_on(nodes):
    mesh = curved(nodes)
    (finding,) = hc.check(mesh)
    assert finding.severity == "warning"
    assert finding.ids.tolist() == list(range(27))
    assert f"27 hexahedron{nodes}; they are worked on as they are, or by their corners" in finding.message
    points = np.vstack([mesh.points, [[0.5, 0.5, 3.0]]])
    cells = {f"hexahedron{nodes}": mesh.blocks[0].cells, "tetra": [[*mesh.blocks[0].cells[26, 4:7], len(points) - 1]]}
    found = [(finding.kind, finding.severity) for finding in hc.check(hc.MixedMesh.of_types(points, cells))]
    assert found[:2] == [("torn edges", "error"), ("higher order", "warning")]
    with pytest.raises(hc.MeshError, match="of hexahedra alone"):
        hc.as_hex_mesh(mesh)


def test_nodes_in_the_middle_that_neighbours_do_not_share_are_told():
    mesh = hc.elevated(hc.generate.box((2, 1, 1)), 27)
    for node, kind in ((9, "torn edges"), (21, "torn faces")):
        cells = mesh.blocks[0].cells.copy()
        cells[0, node] = len(mesh.points)
        points = np.vstack([mesh.points, mesh.points[mesh.blocks[0].cells[0, node]] + [0, 0.01, 0]])
        torn = hc.MixedMesh.of_types(points, {"hexahedron27": cells})
        assert kinds(torn) == [kind, "higher order"]
        finding = hc.check(torn)[0]
        assert finding.severity == "error"
        assert finding.ids.tolist() == [0, 1]
        assert "in VTK's order of nodes" in finding.message


def test_a_linear_cell_beside_a_quadratic_one_has_no_node_in_the_middle():
    mesh = hc.elevated(hc.generate.box((3, 1, 1)), 20)
    cells = mesh.blocks[0].cells
    both = hc.MixedMesh.of_types(mesh.points, {"hexahedron20": cells[:2], "hexahedron": cells[2:, :8]})
    finding = next(one for one in hc.check(both) if one.kind == "torn edges")
    assert finding.ids.tolist() == [1, 2]


def test_check_tells_of_linear_hexahedra_beside_as_of_what_is_worked_on():
    curved, linear = hc.elevated(hc.generate.box((1, 1, 1)), 20), hc.generate.box((1, 1, 1))
    points = np.vstack([curved.points, linear[0] + [2.0, 0, 0]])
    both = hc.MixedMesh.of_types(points, {"hexahedron20": curved.blocks[0].cells, "hexahedron": linear[1] + 20})
    assert [finding.severity for finding in hc.check(both) if finding.kind == "higher order"] == ["warning"]


@pytest.mark.parametrize("cell_type", QUADRATIC, ids=lambda one: one.name)
def test_mirrored_cells_are_turned_round(cell_type):
    name = cell_type.linear.name
    mesh, _, _ = raised(LINEAR[name](), {name: len(cell_type.nodes)})
    mesh = mesh.replaced(mesh.points + np.random.default_rng(0).uniform(-0.01, 0.01, mesh.points.shape))
    cells = mesh.blocks[0].cells.copy()
    cells[4] = cells[4][list(cell_type.mirrored)]
    mirrored = hc.MixedMesh.of_types(mesh.points, {cell_type.name: cells})
    assert "mirrored" in kinds(mirrored)
    turned, report = hc.orient(mirrored)
    assert report.mirrored.tolist() == [4]
    np.testing.assert_array_equal(turned.blocks[0].cells, mesh.blocks[0].cells)


def test_real_meshes(shared):
    folder = shared / "meshes"
    for name, count, invalid in (
        ("elements/sphere_hex20_tangled", 189, 188),
        ("hex2/hex20_febio_bi17_input", 960, 0),
        ("hex2/hex27_msq_cylinder_input", 1044, 0),
        ("hex2/hex27_msq_part_input", 174, 5),
    ):
        summary = hc.quality(folder / f"{name}.vtu").summary()
        assert (summary.count, summary.invalid) == (count, invalid)
        assert "higher order" in kinds(folder / f"{name}.vtu")


@pytest.mark.parametrize("shift", [1, -1, 10**9])
@pytest.mark.parametrize("name", ["hexahedron", "hexahedron20"])
def test_nodes_that_there_are_none_of_are_refused_and_not_looked_for(shift, name):
    points, cells = jittered_box(2)
    if name == "hexahedron20":
        mesh = hc.elevated((points, cells), 20)
        points, cells = mesh.points, mesh.blocks[0].cells
    for work in (hc.quality, hc.orient):
        with pytest.raises(hc.MeshError, match=rf"node ids outside 0\.\.{len(points) - 1}: \d"):
            work((points, {name: cells + shift}))


def test_nodes_between_corners_of_what_is_taken_as_linear_are_no_points_in_no_cell():
    mesh = hc.elevated(hc.generate.box((2, 1, 1)), 27)
    points = np.vstack([mesh.points, [[5.0, 5.0, 5.0]]])
    linear = hc.as_hex_mesh((points, {"hexahedron27": mesh.blocks[0].cells}), linearize=True)
    assert [finding.message for finding in hc.check(linear)] == ["points in no hexahedron (kept): 1 (ids 45)"]
