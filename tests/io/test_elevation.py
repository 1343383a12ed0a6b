"""Linear hexahedra made quadratic, and quadratic ones in files."""

import numpy as np
import pytest
from meshes.hexahedra import block, jittered_box

import hexconformal as hc

each_number = pytest.mark.parametrize("nodes", [20, 27])


@each_number
def test_the_shape_stays_and_nodes_are_shared(nodes):
    points, cells = jittered_box(3)
    mesh = hc.elevated((points, cells), nodes)
    # A grid of 3 cells a side has 4^3 nodes, 3 (3 4^2) edges, 3 (3^2 4) faces.
    assert len(mesh.points) == 64 + 144 + (108 + 27 if nodes == 27 else 0)
    np.testing.assert_array_equal(mesh.points[:64], points)
    np.testing.assert_array_equal(mesh.blocks[0].cells[:, :8], cells)
    assert len(np.unique(mesh.cells)) == len(mesh.points)
    assert [finding.kind for finding in hc.check(mesh)] == ["higher order"]
    np.testing.assert_allclose(hc.quality(mesh).volume, hc.quality((points, cells)).volume, rtol=1e-13)


def test_arrays_come_along():
    points, cells = block(2)
    mask = points[:, 0] == 0
    mesh = hc.HexMesh(
        points, cells, {"height": points[:, 2], "v": points, "side": mask, "tag": np.full(27, 5)}, {"p": np.arange(8)}
    )
    raised = hc.elevated(mesh, 27)
    np.testing.assert_allclose(raised.point_data["height"], raised.points[:, 2], atol=1e-15)
    np.testing.assert_allclose(raised.point_data["v"], raised.points, atol=1e-15)
    np.testing.assert_array_equal(raised.point_data["side"], raised.points[:, 0] == 0)
    assert raised.point_data["side"].dtype == bool
    assert set(raised.point_data["tag"]) == {5}
    np.testing.assert_array_equal(raised.cell_data["p"], mesh.cell_data["p"])


def test_what_is_not_linear_is_refused():
    with pytest.raises(hc.OptionError, match="must be 20 or 27, not 21"):
        hc.elevated(block(1), 21)
    with pytest.raises(hc.MeshError, match="hexahedra alone"):
        hc.elevated(hc.elevated(block(1), 20), 27)


@pytest.mark.parametrize(
    ("nodes", "extension"),
    [(20, "vtu"), (20, "vtk"), (20, "inp"), (20, "e"), (20, "msh"), (20, "med"), (20, "bdf"), (20, "xdmf")]
    + [(27, "vtu"), (27, "vtk"), (27, "e"), (27, "msh"), (27, "xdmf")],
)
def test_files_keep_the_order_of_nodes(nodes, extension, tmp_path):
    mesh = hc.elevated(jittered_box(2), nodes)
    mesh = mesh.replaced(mesh.points + np.random.default_rng(0).uniform(-0.02, 0.02, mesh.points.shape))
    hc.write(tmp_path / f"curved.{extension}", mesh)
    back = hc.quality(tmp_path / f"curved.{extension}")
    np.testing.assert_allclose(back.minimum_jacobian, hc.quality(mesh).minimum_jacobian, atol=1e-9)
    assert list(back.by_type()) == [f"hexahedron{nodes}"]


def test_a_deck_of_abaqus(tmp_path):
    # Nodes as the manual numbers them: bottom, top, then in the middle of bottom, top and vertical edges.
    x = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
    x += [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)]
    x += [(-0.5, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)]
    rows = "".join(f"{n + 11}, {a}, {b}, {c}\n" for n, (a, b, c) in enumerate(x))
    nodes = ", ".join(str(n + 11) for n in range(15)) + ",\n" + ", ".join(str(n + 26) for n in range(5))
    path = tmp_path / "deck.inp"
    path.write_text(f"*NODE\n{rows}*ELEMENT, TYPE=C3D20R\n77, {nodes}\n")
    measured = hc.quality(path)
    assert measured.labels.tolist() == [77]
    assert measured.valid.all()
    # One vertical edge bulges out by .5: faces beside it gain a third of .5 * 4 z (1 - z), of which 2/3 on average.
    assert measured.volume[0] == pytest.approx(8 + 0.5 * 2 * (2 / 3) * 2 / 2, rel=1e-12)
