"""Files damaged at random, and those damages that once were not taken well: always one of our errors, never a crash."""

import importlib.util
import re
import sys

import meshio
import numpy as np
import pytest
import pyvista as pv
from paths import ROOT

import hexconformal as hc
import surface
from hexconformal.generate import box
from hexconformal.io import read_write as io
from hexconformal.io.format_tools.file_checks import reader_trial, vtk_file_checks

SCRIPT = ROOT / "benchmarks" / "fuzz.py"


def fuzz():
    sys.path.insert(0, str(SCRIPT.parent))
    specification = importlib.util.spec_from_file_location("fuzz", SCRIPT)
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.mark.long
def test_damaged_files_are_read_or_refused(tmp_path):
    script = fuzz()
    paths = []
    for number, sample in enumerate(script.samples(tmp_path)):
        paths.append(sample)
        for k in range(2):
            rng = np.random.default_rng([number, k])
            paths.append(script.numbered(tmp_path, sample, k))
            paths[-1].write_bytes(script.mutant(sample.read_bytes(), rng, sample.name))
    found = script.verdicts(paths, tmp_path)
    assert {path.name: what for path, what in found.items() if what.startswith("!")} == {}
    assert {path.name for path in paths[::3] if found[path] != "mesh"} == set()
    assert {"MeshError", "ReadError"} & {found[path] for path in paths if path not in paths[::3]}


def test_what_was_read_is_remeshed(tmp_path, monkeypatch):
    worked_on = []
    monkeypatch.setattr(surface, "remesh", lambda mesh, **options: worked_on.append(surface.Options(**options)))
    path = tmp_path / "surface.io.ply"
    surface.write(path, pv.Icosphere(nsub=1))
    assert fuzz().probe(path) == "mesh"
    assert [options.max_iterations for options in worked_on] == [1]


@pytest.fixture
def grid():
    points, cells = box((2, 1, 1))
    return pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points)


def damage(path, old, new):
    data = path.read_bytes()
    assert re.search(old, data)
    path.write_bytes(re.sub(old, new, data, count=1))


@pytest.mark.parametrize("number", [b"4294967295", b"-1", b"many"])
def test_counts_beyond_the_file_are_refused(grid, number, tmp_path):
    path = tmp_path / "a.vtu"
    grid.save(path)
    damage(path, rb'NumberOfPoints="\d+"', b'NumberOfPoints="%s"' % number)
    with pytest.raises(hc.ReadError, match="NumberOfPoints"):
        hc.read(path)
    (tmp_path / "a.pvtu").write_text(
        '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><Piece Source="a.vtu"/></PUnstructuredGrid></VTKFile>'
    )
    with pytest.raises(hc.ReadError, match="NumberOfPoints"):
        hc.read(tmp_path / "a.pvtu")


def test_an_image_no_memory_holds_is_refused(tmp_path):
    path = tmp_path / "a.vti"
    pv.ImageData(dimensions=(2, 2, 2)).save(path)
    assert len(hc.read(path).cells) == 1
    damage(path, b'WholeExtent="0 1 0 1 0 1"', b'WholeExtent="0 99999999 0 99999999 0 1"')
    with pytest.raises(hc.ReadError, match="WholeExtent"):
        hc.read(path)


def test_a_legacy_file_that_vtk_crashes_on_is_refused(grid, tmp_path):
    path = tmp_path / "a.vtk"
    grid.save(path, binary=False)
    # Where the cells begin among their nodes: one far beyond.
    damage(path, rb"OFFSETS vtktypeint64\s+0 8 16", b"OFFSETS vtktypeint64\n0 99999999999 16")
    with pytest.raises(hc.MeshError, match=r"a\.vtk"):
        hc.read(path)


def test_a_reader_that_dies_or_hangs_is_told_from_one_that_complains(tmp_path, monkeypatch):
    path = tmp_path / "a.vtk"
    path.write_text("x")
    vtk_file_checks.check_reader_survives(path)  # not a sound file, but no danger
    monkeypatch.setattr(vtk_file_checks, "_READING", "import os; os.abort()")
    with pytest.raises(hc.ReadError, match="crashes"):
        vtk_file_checks.check_reader_survives(path)
    monkeypatch.setattr(vtk_file_checks, "_READING", "import time; time.sleep(60)")
    monkeypatch.setattr(reader_trial, "_TIME_LIMIT", (0.2, 0.0))
    with pytest.raises(hc.ReadError, match="end"):
        vtk_file_checks.check_reader_survives(path)
    # Within another program nothing is started.
    monkeypatch.setattr(sys, "executable", "/usr/bin/freecad")
    vtk_file_checks.check_reader_survives(path)


@pytest.mark.parametrize("extension", [".vtk", ".vtu"])
def test_nodes_that_are_no_points_are_named(grid, extension, tmp_path):
    path = tmp_path / f"a{extension}"
    grid.cell_connectivity[9] = 12345
    grid.save(path)
    with pytest.raises(hc.MeshError, match=r"outside 0\.\.11: 1 \(ids 1\)"):
        hc.read(path)
    with pytest.raises(hc.MeshError, match=r"outside 0\.\.11: 1 \(ids 1\)"):
        io.read_surface(path)


def test_cells_of_too_few_nodes_are_named(tmp_path):
    points, cells = box((1, 1, 1))
    grid = pv.UnstructuredGrid(np.r_[8, cells[0], 7, cells[0, :7]], np.array([12, 12]), points)
    grid.save(tmp_path / "a.vtu")
    with pytest.raises(hc.MeshError, match=r"as many nodes as their type; others: 1 \(ids 1\)"):
        hc.read(tmp_path / "a.vtu")


@pytest.mark.parametrize("name", ["a.off", "a.ply", "a.obj"])
def test_corners_of_faces_that_are_no_points_are_named(name, tmp_path):
    path = tmp_path / name
    surface.write(path, (np.eye(3), [[0, 1, 2]]))
    if name == "a.ply":
        data = bytearray(path.read_bytes())
        data[-4:] = (99).to_bytes(4, "little")
        path.write_bytes(data)
    else:
        damage(path, rb"2\s*$" if name == "a.off" else rb"3\s*$", b"99\n")
    for read in (surface.read, io.read_surface):
        with pytest.raises(hc.MeshError, match=r"outside 0\.\.2"):
            read(path)


def test_points_in_a_plane_are_read_as_a_surface(tmp_path):
    meshio.write(tmp_path / "a.mesh", meshio.Mesh([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [("triangle", [[0, 1, 2]])]))
    assert io.read_surface(tmp_path / "a.mesh").area == pytest.approx(0.5)


@pytest.mark.parametrize("size", [1e60, 1e300])
def test_coordinates_beyond_all_measure_are_refused(size):
    points, cells = box((1, 1, 1))
    points[3, 1] = size
    with pytest.raises(hc.MeshError, match=r"coordinates beyond 1e\+50: 1 \(ids 3\)"):
        hc.regularize((points, cells))
    with pytest.raises(hc.MeshError, match=r"coordinates beyond 1e\+50: 1 \(ids 3\)"):
        surface.remesh((points, [[0, 1, 2], [0, 2, 3]]))


def test_what_vtk_says_in_another_encoding_is_read(grid, tmp_path):
    path = tmp_path / "a.vtk"
    grid.save(path, binary=False)
    damage(path, rb"CELL_TYPES 2", b"CELL_T\xff\xfeES 2")
    with pytest.raises(hc.MeshError, match=r"a\.vtk"):
        hc.read(path)


@pytest.mark.parametrize("text", ["$ only\n$ comments\n", "BEGIN BULK\n", "BEGIN BULK\n$\n", "\n"])
def test_nastran_without_bulk_data_is_refused(text, tmp_path):
    """meshio's reader looked for its beginning for ever."""
    (tmp_path / "a.nas").write_text(text)
    with pytest.raises(hc.ReadError, match="no bulk data"):
        hc.read(tmp_path / "a.nas")
