"""`quality`, `check` and `orient` of meshes of several types."""

import json

import numpy as np
import pytest
import pyvista as pv
from meshes.mixed import four_types, shuffled_grid
from program import run

import hexconformal as hc
from hexconformal.elements import MEASURES


@pytest.fixture
def grid(here):
    """The folder has mixed.vtu, with an inverted cell, and turned.vtu, whose wedges are in the reverse order."""
    found = shuffled_grid(four_types(0.6, seed=3))
    found.save("mixed.vtu")
    sound = four_types()
    cells = {one.cell_type.name: one.cells for one in sound.blocks}
    cells["wedge"] = cells["wedge"][:, [3, 4, 5, 0, 1, 2]]
    shuffled_grid(hc.MixedMesh.of_types(sound.points, cells)).save("turned.vtu")
    return found


def test_quality_tells_of_each_type_and_writes_the_measures_of_all(grid, here, capsys):
    assert run("quality mixed.vtu --worst 3 --out measured.vtu --json q.json --plot q.png") == 0
    out = capsys.readouterr().out.splitlines()
    summary = hc.quality("mixed.vtu").summary(3)
    assert (
        out[0] == f"13 cells, {summary.inverted} inverted, {summary.invalid} invalid, volume {summary.total_volume:.6g}"
    )
    assert [line for line in out if line.startswith("8 tetrahedra, ")]
    assert out[-5] == "worst cells (id, scaled jacobian, centre, type)"
    for line, cell in zip(out[-4:-1], summary.worst, strict=True):
        assert line.split()[0] == str(cell.id)
        assert line.endswith(f")  {cell.type}")
        assert grid.celltypes[cell.id] == {"tetra": 10, "hexahedron": 12, "wedge": 13, "pyramid": 14}[cell.type]
    told = json.loads((here / "q.json").read_text())
    assert told == json.loads(hc.quality("mixed.vtu").summary(3).to_json())
    measured, solid = pv.read("measured.vtu"), grid.celltypes != 9
    for name in MEASURES:
        np.testing.assert_array_equal(measured[name][solid], getattr(hc.quality(grid), name))
        assert np.isnan(measured[name][~solid]).all()


def test_hexahedra_are_told_of_as_before(here, capsys):
    assert run("quality part.vtu --json -") == 0
    told = json.loads(capsys.readouterr().out)
    assert "types" not in told
    assert set(told["worst"][0]) == {"id", "scaled_jacobian", "centre"}
    assert run("quality part.vtu --worst 1") == 0
    out = capsys.readouterr().out.splitlines()
    assert out[-2] == "worst cells (id, scaled jacobian, centre)"
    assert out[-1].endswith(")")
    assert run("check part.vtu") == 0
    assert capsys.readouterr().out.splitlines()[-1] == "can be worked on"


def test_pictures_of_the_worst_cells(grid, rendering, tmp_path):
    assert run("quality mixed.vtu --picture worst.png --worst 3") == 0
    assert pv.read("worst.png").dimensions[0] > 100


def test_check_tells_what_there_is(grid, capsys):
    assert run("check mixed.vtu") == 0
    out = capsys.readouterr().out.splitlines()
    summary = hc.quality("mixed.vtu").summary()
    counts = f"17 points, {summary.inverted} inverted, {summary.invalid} invalid"
    assert out[0] == f"mixed.vtu: 1 hexahedron, 2 wedges, 2 pyramids, 8 tetrahedra, {counts}"
    assert out[1].split() == ["type", "cells", "inverted", "invalid", "volume", "min", "SJ"]
    for line in out[2:6]:
        name, cells, inverted, *_ = line.split()
        one = summary.types[
            {"tetrahedra": "tetra"}.get(name, name.replace("hexahedra", "hexahedron").removesuffix("s"))
        ]
        assert (int(cells), int(inverted)) == (one.count, one.inverted)
    assert out[-1] == "can be worked on"
    assert run("check mixed.vtu --other-cells keep") == 0
    assert "1 hexahedra, 17 points" in capsys.readouterr().out
    pv.examples.cells.Tetrahedron().save("tetrahedron.vtu")
    assert run("check tetrahedron.vtu --other-cells keep") == 0
    assert "1 tetrahedron, 4 points" in capsys.readouterr().out


def test_check_tells_of_regions_and_the_faces_between_them(grid, capsys):
    parts = pv.read("mixed.vtu")
    parts.cell_data["material"] = (parts.celltypes == 10).astype(int)
    parts.save("parts.vtu")
    assert run("check parts.vtu") == 0
    out = capsys.readouterr().out.splitlines()
    assert out[6] == "2 regions (array 'material'), 1 interface"
    assert out[9].split()[:2] == ["1", "8"]
    assert out[11].startswith("0 | 1")
    assert run("check parts.vtu --interfaces ignore") == 0
    assert "region" not in capsys.readouterr().out


def test_wedges_in_the_reverse_order_are_told_and_turned_round(grid, capsys):
    assert run("check turned.vtu") == 0
    out = capsys.readouterr().out
    assert "0 inverted" in out
    assert "warning: wedges with their two triangles in the reverse order: 2 (ids" in out
    assert run("orient turned.vtu sound.vtu") == 0
    assert "2 of 13 cells turned round" in capsys.readouterr().out
    assert hc.check("sound.vtu") == ()
    assert run("orient sound.vtu same.vtu") == 0
    assert "nothing to do" in capsys.readouterr().out


@pytest.mark.long
def test_regularization_works_on_all_of_them_or_on_the_hexahedra(grid, here, capsys):
    assert run("regularize mixed.vtu out.vtu --boundary free --report r.json --picture out.png --frames runs.pvd") == 0
    capsys.readouterr()
    written, told = pv.read("out.vtu"), json.loads((here / "r.json").read_text())
    np.testing.assert_array_equal(written.celltypes, grid.celltypes)
    assert told["before"]["invalid"] > told["after"]["invalid"]
    assert set(told["after"]["types"]) == {"hexahedron", "wedge", "pyramid", "tetra"}
    assert hc.quality("out.vtu").summary().invalid == told["after"]["invalid"]
    assert run("regularize mixed.vtu kept.vtu --other-cells keep --boundary free") == 0
    kept, others = pv.read("kept.vtu"), (grid.celltypes != 12) & (grid.celltypes != 9)
    nodes = np.unique(np.concatenate([grid.get_cell(k).point_ids for k in np.flatnonzero(others)]))
    np.testing.assert_array_equal(kept.points[nodes], grid.points[nodes])
    pv.examples.cells.Tetrahedron().save("tetrahedron.vtu")
    assert run("regularize tetrahedron.vtu one.vtu --other-cells keep --boundary free") == 0
