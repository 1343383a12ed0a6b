"""`hexconformal check` and `orient`: what is told of a mesh, and put right."""

import meshio
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


def test_check_tells_regions_interfaces_and_where_three_of_them_meet(here, capsys):
    points, cells = generate.box((4, 4, 2), (2.0, 1.0, 1.0))
    x, y, _ = points[cells].mean(axis=1).T
    material = np.where(x < 1.0, 1, np.where(y < 0.5, 2, 3))
    hc.write("three.vtu", hc.HexMesh(points, cells, cell_data={"material": material, "half": (x < 1.0).astype(int)}))
    assert run("check three.vtu") == 0
    assert capsys.readouterr().out.splitlines()[1:] == [
        "3 regions (array 'material'), 3 interfaces",
        "region  cells  volume  min SJ",
        "1          16       1   1.000",
        "2           8     0.5   1.000",
        "3           8     0.5   1.000",
        "interface  faces  nodes  on the skin",
        "1 | 2          4      9            7",
        "1 | 3          4      9            7",
        "2 | 3          4      9            7",
        "curves where three or more regions meet: 1 (2 edges), with 2 ends on the skin",
        "can be worked on",
    ]
    assert run("check three.vtu --interfaces half") == 0
    told = capsys.readouterr().out
    assert "2 regions (array 'half'), 1 interface\n" in told
    assert "curves" not in told
    assert run("check three.vtu --interfaces ignore") == 0
    assert "regions" not in capsys.readouterr().out
    assert run("check three.vtu --interfaces phase") == 2
    assert "not 'phase'; there are: material, half" in capsys.readouterr().err


def test_check_tells_sections_of_a_deck(here, capsys):
    points, cells = generate.box((2, 1, 1))
    sets = {"steel": [np.array([0])], "rubber": [np.array([1])], "probe": [np.array([0])]}
    hc.write("a.inp", meshio.Mesh(points, [("hexahedron", cells)], cell_sets=sets))
    with open("a.inp", "a") as deck:
        deck.write("*SOLID SECTION, ELSET=steel, MATERIAL=A\n*SOLID SECTION, ELSET=rubber, MATERIAL=B\n")
    assert run("check a.inp") == 0
    told = capsys.readouterr().out
    assert "2 regions (sections), 1 interface" in told
    assert "probe" not in told


def test_check_shows_some_of_many_regions(here, capsys):
    points, cells = generate.box((40, 2, 1))
    hc.write("many.vtu", hc.HexMesh(points, cells, cell_data={"grain": np.arange(80) // 4, "part": np.arange(80) // 4}))
    assert run("check many.vtu") == 0
    told = capsys.readouterr().out.splitlines()
    assert told.count("and 8 more") == 1
    assert len(told) < 35
