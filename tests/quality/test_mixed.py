"""Quality, checks and node order of meshes of several types."""

import ast
import json

import numpy as np
import pytest
from meshes.hexahedra import block
from meshes.mixed import cut_block, four_types, shuffled_grid

import hexconformal as hc
from hexconformal.elements import CELL_TYPES, MEASURES, measures_of
from hexconformal.quality import MixedQuality


def kinds(mesh):
    return [finding.kind for finding in hc.check(mesh)]


def test_each_cell_has_the_measures_of_its_type_in_the_order_of_the_file():
    mesh = four_types(0.1)
    grid = shuffled_grid(mesh)
    measured = hc.quality(grid)
    solid = np.flatnonzero(grid.celltypes != 9)
    np.testing.assert_array_equal(measured.labels, solid)
    for place, row in enumerate(solid.tolist()):
        cell_type = next(one for one in CELL_TYPES.values() if one.vtk == grid.celltypes[row])
        nodes = np.array([grid.get_cell(row).point_ids])
        expected = measures_of(mesh.points, nodes, cell_type)[:, 0]
        np.testing.assert_array_equal([getattr(measured, name)[place] for name in MEASURES], expected)
    assert measured.volume.sum() == pytest.approx(grid.extract_cells(solid).volume, rel=1e-2)


def test_summary_is_that_of_all_and_of_each_type():
    grid = shuffled_grid(four_types(0.6, seed=3))
    measured = hc.quality(grid)
    summary = measured.summary(4)
    assert summary.count == 13
    assert 0 < summary.inverted == sum(one.inverted for one in summary.types.values())
    assert summary.invalid == sum(one.invalid for one in summary.types.values())
    assert {name: one.count for name, one in summary.types.items()} == {
        "hexahedron": 1,
        "wedge": 2,
        "pyramid": 2,
        "tetra": 8,
    }
    assert summary.total_volume == pytest.approx(sum(one.total_volume for one in summary.types.values()))
    assert summary.shape.min == min(one.shape.min for one in summary.types.values())
    for cell in summary.worst:
        assert CELL_TYPES[cell.type].vtk == grid.celltypes[cell.id]
        nodes = grid.get_cell(cell.id).point_ids
        np.testing.assert_allclose(cell.centre, np.asarray(grid.points)[nodes].mean(axis=0))
    assert [cell.scaled_jacobian for cell in summary.worst] == np.sort(measured.scaled_jacobian)[:4].tolist()
    worst = summary.types["tetra"].worst[0]
    assert grid.celltypes[worst.id] == 10
    assert worst.scaled_jacobian == summary.types["tetra"].scaled_jacobian.min
    told = json.loads(summary.to_json())
    assert told["types"]["wedge"]["count"] == 2
    assert told["worst"][0]["type"] == summary.worst[0].type
    assert "8 tetrahedra, " in str(summary)
    assert "1 hexahedron, " in str(summary)


def test_hexahedra_alone_are_measured_as_before():
    points, cells = block(2)
    one, other = hc.quality((points, cells)), hc.quality((points, {"hexahedron": cells}))
    assert type(one) is type(other) is hc.Quality
    assert "types" not in one.summary().to_dict()
    assert isinstance(hc.quality(four_types()), MixedQuality)


def test_a_sound_mesh_has_no_findings():
    assert hc.check(four_types()) == ()
    assert hc.check(cut_block(2)) == ()
    assert hc.check(four_types(0.2)) == ()  # inverted cells are what the work is for


@pytest.mark.parametrize("name", ["wedge", "pyramid", "hexahedron"])
def test_a_type_in_the_reverse_order_is_told_and_turned_round(name):
    sound = four_types()
    cells = {one.cell_type.name: one.cells.copy() for one in sound.blocks}
    cells[name] = cells[name][:, list(CELL_TYPES[name].mirrored)]
    mesh = hc.MixedMesh.of_types(sound.points, cells)
    (finding,) = hc.check(mesh)
    # Of wedges two orders are in use, and both are taken.
    assert finding.kind == ("reversed wedges" if name == "wedge" else "mirrored")
    assert finding.severity == ("warning" if name == "wedge" else "error")
    assert finding.message.startswith(CELL_TYPES[name].plural)
    assert hc.quality(mesh).summary().inverted == (0 if name == "wedge" else len(cells[name]))
    turned, report = hc.orient(mesh)
    assert sorted(report.mirrored) == sorted(finding.ids)
    assert hc.check(turned) == ()
    np.testing.assert_allclose(hc.quality(turned).volume, hc.quality(sound).volume)
    assert hc.orient(turned)[0] is turned


def test_a_mesh_that_is_mirrored_as_a_whole_is_turned_round():
    mesh = four_types()
    mirrored = mesh.replaced(mesh.points * [1, 1, -1])
    assert kinds(mirrored) == ["mirrored"] * 4
    assert hc.quality(hc.orient(mirrored)[0]).volume.min() > 0


def test_tangled_cells_are_not_turned_round():
    mesh = four_types(0.45, seed=1)
    assert hc.quality(mesh).summary().inverted >= 1
    assert "mirrored" not in kinds(mesh)
    assert hc.orient(mesh)[0] is mesh


def test_every_fault_is_found_and_named():
    sound = four_types()
    cells = {one.cell_type.name: one.cells.copy() for one in sound.blocks}

    def findings(points=sound.points, **changed):
        return {one.kind: one for one in hc.check(hc.MixedMesh.of_types(points, cells | changed))}

    bad = cells["tetra"].copy()
    bad[3, 1] = 99
    assert findings(tetra=bad)["bad index"].ids.tolist() == [3]
    bad[3] = cells["tetra"][3, [0, 1, 2, 2]]
    assert findings(tetra=bad)["repeated nodes"].ids.tolist() == [3]
    again = np.concatenate([cells["tetra"], cells["tetra"][2:3, [1, 2, 0, 3]]])
    found = findings(tetra=again)
    assert found["duplicate cells"].ids.tolist() == [8]
    assert found["crowded faces"].severity == "error"
    first = ast.literal_eval(found["crowded faces"].message.split("(nodes ")[1].split("), of")[0])[0]
    assert len(first) == 3
    assert set(first) < set(cells["tetra"][2].tolist())
    later = {name: rows + 1 for name, rows in cells.items()}
    assert findings(**later)["bad index"].message.endswith("ids start at 1 here, subtract 1")
    unused = np.concatenate([sound.points, [[9.0, 9, 9], [9.0, 9, 9]]])
    assert findings(unused)["unreferenced points"].ids.tolist() == [17, 18]
    assert findings(np.where(np.arange(17)[:, None] == 4, np.nan, sound.points))["not finite"].ids.tolist() == [4]
    flat = sound.points.copy()
    flat[16] = [1.5, 0.0, 0.5]
    assert set(findings(flat)["flat cells"].ids) == {
        k for k, row in enumerate(cells["tetra"]) if np.ptp(flat[row], axis=0)[1] == 0
    }
    # A cell with one flat corner has volume.
    straight = CELL_TYPES["pyramid"].ideal.copy()
    straight[2] = (straight[1] + straight[3]) / 2
    assert hc.check(hc.MixedMesh.of_types(straight, {"pyramid": [range(5)]})) == ()
    apart = np.concatenate([sound.points, sound.points[cells["pyramid"][0]] + 7])
    pieces = findings(apart, pyramid=np.concatenate([cells["pyramid"], [[17, 18, 19, 20, 21]]]))["pieces"]
    assert pieces.ids.tolist() == [0, 13]


def test_nodes_that_hang_beside_a_wedge_are_told():
    # A prism on the half of a cube that is cut at half its height.
    points, cells = block(1)
    wedge = np.array([[0.0, 1, 0], [1, 1, 0], [0.5, 2, 0], [0, 1, 1], [1, 1, 1], [0.5, 2, 1]])
    low, high = points.copy(), points.copy()
    low[:, 2] /= 2
    high[:, 2] = high[:, 2] / 2 + 0.5
    unique, ids = np.unique(np.concatenate([low, high, wedge]), axis=0, return_inverse=True)
    ids = ids.ravel()
    mesh = hc.MixedMesh.of_types(unique, {"hexahedron": ids[np.vstack([cells, cells + 8])], "wedge": [ids[16:]]})
    (finding,) = hc.check(mesh)
    assert finding.kind == "hanging nodes"
    np.testing.assert_array_equal(unique[finding.ids], [[0, 1, 0.5], [1, 1, 0.5]])


def test_quadrilaterals_against_triangles_are_told():
    points, cells = block(2)
    right = points[cells].mean(axis=1)[:, 0] > 1
    cut = cut_block(2).blocks[0].cells.reshape(6, 8, 4)[:, right].reshape(-1, 4)
    mesh = hc.MixedMesh.of_types(points, {"hexahedron": cells[~right], "tetra": cut})
    (finding,) = hc.check(mesh)
    assert finding.kind == "split faces"
    assert finding.ids.tolist() == [0, 1, 2, 3]


def test_fixtures_of_the_design(shared):
    folder = shared / "meshes"
    summary = hc.quality(folder / "elements" / "hexpyrtet_tangled.vtu").summary()
    assert {name: one.count for name, one in summary.types.items()} == {"hexahedron": 27, "pyramid": 54, "tetra": 1424}
    assert summary.total_volume == pytest.approx(27)
    for name, count in (("hexsmoothing", 323), ("notch_stress", 4), ("febio_fl17", 8)):
        mesh = hc.as_volume_mesh(folder / "hex2" / f"mixed_{name}_input.vtu")
        (finding,) = hc.check(mesh)
        assert finding.message.startswith(f"wedges with their two triangles in the reverse order: {count} ")
        assert hc.quality(mesh).summary().inverted == 0
        assert hc.check(hc.orient(mesh)[0]) == ()
        assert hc.quality(hc.orient(mesh)[0]).summary().inverted == 0
