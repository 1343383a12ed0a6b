"""No output of any command takes the place of an input, or of another output, whatever path or link leads there."""

import os
import shutil

import numpy as np
import pytest
import pyvista as pv
from meshes.surfaces import icosphere
from program import error_line, run

import hexconformal as hc
import surface
from hexconformal.common import OptionError
from hexconformal.generate import box, jittered
from hexconformal.runs import Series


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Inputs, the frames of an earlier series that has one of them, and links of both kinds to them."""
    monkeypatch.chdir(tmp_path)
    points, cells = jittered(*box((2, 2, 2)), 0.2)
    hc.write("part.vtu", hc.HexMesh(points, cells))
    pv.read("part.vtu").extract_surface(algorithm=None).triangulate().save("skin.stl")
    ball = icosphere(0)
    surface.write("ball.vtp", (ball[0], ball[1].triangles))
    (tmp_path / "lid.csv").write_text("step,node,dx,dy,dz\n1,26,0,0,0.01\n")
    (tmp_path / "run_frames").mkdir()
    for name in ("part.vtu", "ball.vtp"):
        shutil.copy(name, f"run_frames/run_0003{name[-4:]}")
    for folder in ("first", "second", "third", "fourth"):
        (tmp_path / folder).mkdir()
    os.symlink("../part.vtu", "first/last.vtu")
    os.link("ball.vtp", "second/last.vtu")
    os.link("lid.csv", "third/history.csv")
    os.symlink("part.vtu", "link.csv")
    os.link("part.vtu", "link.json")
    (tmp_path / "linked_frames").mkdir()
    os.symlink("../part.vtu", "linked_frames/linked_0007.vtu")
    shutil.copy("ball.vtp", "reference.vtp")
    os.link("reference.vtp", "hard.csv")
    return tmp_path


REGULARIZE = "regularize part.vtu out.vtu --max-iterations 1 --quiet"
REMESH = "remesh ball.vtp out.vtp --max-iterations 1 --quiet"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (f"{REGULARIZE} --history link.csv", "link.csv is the input"),
        (f"{REGULARIZE} --report link.json", "link.json is the input"),
        (f"{REGULARIZE} --frames linked.pvd", "linked.pvd would replace part.vtu, which is the input"),
        (f"{REGULARIZE} --surface skin.stl --history skin.stl", "skin.stl is the file of --surface"),
        (f"{REGULARIZE} --surface run_frames/run_0003.vtu --frames run.pvd", "which is the file of --surface"),
        ("regularize part.vtu link.json --overwrite --report link.json", "link.json is the input already: write else"),
        ("regularize part.vtu run_frames/run_0001.vtu --frames run.pvd", "which is an output"),
        ("regularize run_frames/run_0003.vtu out.vtu --frames ./run.pvd", "which is the input"),
        (f"{REMESH} --target reference.vtp --history hard.csv", "hard.csv is the file of --target"),
        ("remesh run_frames/run_0003.vtp out.vtp --frames run.pvd", "which is the input"),
        ("remesh ball.vtp second/last.vtu", "add --overwrite"),
        ("flow ball.vtp second --steps 1 --overwrite", "second/last.vtu is the input"),
        ("flow run_frames/run_0003.vtp . --steps 1 --overwrite", "run.pvd would replace"),
        ("move part.vtu first --motion lid.csv --overwrite", "first/last.vtu is the input"),
        ("move part.vtu third --motion lid.csv --overwrite", "third/history.csv is the table of the motion"),
        (
            "move part.vtu fourth --motion lid.csv --frames linked.pvd --overwrite",
            "linked.pvd would replace part.vtu",
        ),
        ("quality part.vtu --json link.json", "link.json is the input"),
        ("quality part.vtu --out link.vtu --json ./link.vtu", "link.vtu is an output"),
        ("orient part.vtu linked_frames/linked_0007.vtu", "is the input already: add --overwrite"),
    ],
)
def test_what_would_replace_an_input_is_refused_by_name(here, capsys, words, said):
    files = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    assert run(words) == 2
    assert said in error_line(capsys)
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == files


PIECES = (
    '<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid><PPoints><PDataArray type="Float64" NumberOfComponents="3"/>'
    '</PPoints><Piece Source="parts_frames/parts_0001.vtu"/></PUnstructuredGrid></VTKFile>'
)


@pytest.fixture
def named(here):
    """Inputs that name other files: an HDF5 file, a piece, one that is included and one that is referred to."""
    pytest.importorskip("h5py")
    mesh = hc.read("part.vtu")
    hc.write("in.xdmf", mesh)
    hc.write("whole.inp", mesh)
    nodes, elements = (here / "whole.inp").read_text().split("*ELEMENT", 1)
    (here / "nodes.txt").write_text(nodes)
    (here / "in.inp").write_text(f"*INCLUDE, INPUT=nodes.txt\n*ELEMENT{elements}*AMPLITUDE, NAME=A, INPUT=load.csv\n")
    (here / "load.csv").write_text("0., 1.\n")
    (here / "parts_frames").mkdir()
    shutil.copy("part.vtu", "parts_frames/parts_0001.vtu")
    (here / "in.pvtu").write_text(PIECES)
    return here


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("regularize in.xdmf out.vtu --history in.h5", "in.h5 is a file that the input names already: write elsewhere"),
        ("orient in.xdmf in.xmf", "in.xmf would replace in.h5, which is a file that the input names"),
        ("regularize in.pvtu parts_frames/parts_0001.vtu --overwrite", "is a file that the input names already: write"),
        ("regularize in.pvtu out.vtu --frames parts.pvd", "parts.pvd would replace parts_frames/parts_0001.vtu"),
        ("move in.pvtu first --motion lid.csv --frames parts.pvd --overwrite", "parts.pvd would replace parts_frames"),
        ("regularize in.inp out.vtu --report nodes.txt", "nodes.txt is a file that the input names"),
        ("quality in.inp --json load.csv", "load.csv is a file that the input names"),
        ("regularize part.vtu out.vtu --surface in.xdmf --plot in.h5", "a file that the file of --surface names"),
    ],
)
def test_files_that_an_input_names_are_kept_too(named, capsys, words, said):
    files = {path: path.read_bytes() for path in named.rglob("*") if path.is_file()}
    assert run(words) == 2
    assert said in error_line(capsys)
    assert {path: path.read_bytes() for path in named.rglob("*") if path.is_file()} == files


def test_a_file_is_replaced_with_its_numbers_where_that_is_asked_for(named, capsys):
    assert run("orient in.xdmf in.xdmf --overwrite") == 0
    assert run("orient in.inp in.inp --overwrite") == 0
    assert hc.read("in.xdmf").cells.tolist() == hc.read("in.inp").cells.tolist() == hc.read("part.vtu").cells.tolist()
    assert (named / "nodes.txt").exists()
    assert capsys.readouterr().err == ""


def test_a_series_keeps_the_file_that_its_mesh_was_read_from(here):
    mesh = hc.read("run_frames/run_0003.vtu")
    with Series("run.pvd") as series, pytest.raises(OptionError, match="which the mesh was read from"):
        series.add(0.0, mesh)
    assert (here / "run_frames" / "run_0003.vtu").exists()
    # One that goes on after its last frame replaces none.
    with Series("other.pvd") as series:
        series.add(0.0, mesh)
        series.add(1.0, mesh)
    last = hc.read("other_frames/other_0001.vtu")
    with Series("other.pvd", until=1.0) as series:
        series.add(2.0, last)
    with Series("other.pvd", until=0.0) as series, pytest.raises(OptionError, match="which the mesh was read from"):
        series.add(2.0, last)
    np.testing.assert_array_equal(hc.read("other_frames/other_0001.vtu").points, mesh.points)
