"""`hexconformal check` and `orient`: what is told of a mesh, and put right."""

import numpy as np
import pyvista as pv
from program import run

import hexconformal as hc
import surface
from hexconformal import generate


def test_orient_turns_mirrored_cells_round(here, capsys):
    points, cells = generate.box((2, 2, 2))
    hc.write("mirrored.vtu", hc.HexMesh(points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]))
    assert run("check mirrored.vtu") == 1
    assert "error: " in capsys.readouterr().out
    assert run("orient mirrored.vtu sound.vtu") == 0
    assert "8 of 8 cells turned round" in capsys.readouterr().out
    np.testing.assert_array_equal(hc.read("sound.vtu").cells, cells)
    assert run("orient sound.vtu again.vtu") == 0
    assert "nothing to do" in capsys.readouterr().out
    assert run("check again.vtu") == 0


def test_check_tells_of_surfaces_too(here, capsys):
    points, faces = pv.Icosphere(nsub=1).points, pv.Icosphere(nsub=1).regular_faces
    surface.write("sound.ply", (points, faces))
    surface.write("spare.ply", (np.vstack([points, [[3.0, 0, 0]]]), faces))
    surface.write("twice.ply", (points, np.vstack([faces, faces[:1]])))
    surface.write("sound.vtu", (points, faces))
    assert [run(f"check {name}") for name in ("sound.ply", "spare.ply", "twice.ply", "sound.vtu")] == [0, 0, 1, 0]
    told = capsys.readouterr().out.splitlines()
    assert told[:2] == ["sound.ply: 80 triangles, 0 quadrilaterals, 42 points", "can be worked on"]
    assert told[3:5] == ["warning: points in no cell (kept): 1 (ids 42)", "can be worked on"]
    assert told[6].startswith("error: cells with the same nodes as an earlier one: 1 (ids 80)")
    assert told[8] == "can be worked on"


def test_check_reports_points_that_are_not_finite(here, capsys):
    mesh = hc.read("part.vtu")
    points = mesh.points.copy()
    points[7] = np.nan
    hc.write("nan.vtu", mesh.replaced(points=points))
    assert run("check nan.vtu") == 1
    assert "NaN or infinite coordinates: 1 (ids 7)" in capsys.readouterr().out
    assert run("quality nan.vtu") == 1
    assert "nan.vtu: points with NaN or infinite coordinates: 1 (ids 7)" in capsys.readouterr().err
