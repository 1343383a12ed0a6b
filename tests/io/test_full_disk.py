"""Disks that are full: an error that says so, what was reached is kept, and no half of a file is left."""

import os
import shutil
import subprocess
import sys
from types import SimpleNamespace

import pytest

import hexconformal as hc
from hexconformal.generate import box
from hexconformal.runs.history import HistoryFile

full = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")


@pytest.mark.skipif(os.name == "nt", reason="no limit on the size of files")
def test_a_full_disk_is_an_error_and_no_crash(tmp_path):
    """A limit on the size of files stands for the disk. VTK died of it, or left half a file without a word."""
    script = """
import os, resource, numpy as np, hexconformal as hc, surface
from hexconformal.generate import box
points, cells = box((12, 12, 12))
mesh = hc.HexMesh(points + 1e-3 * np.random.default_rng(0).random(points.shape), cells)
faces = points[:1728] + np.random.default_rng(0).random((1728, 3)), np.arange(3 * 576).reshape(-1, 3)
for limit in (4096, 10240, 16384):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, 16384))
    for write, what, names in (
        (hc.write, mesh, ("a.vtu", "a.vtk", "a.msh", "a.inp", "a.bdf")),
        (surface.write, faces, ("s.vtp", "s.vtu", "s.vtk", "s.ply", "s.stl")),
    ):
        for name in names:
            try:
                write(name, what)
            except hc.WriteError as problem:
                assert "File too large" in str(problem) or "disk full?" in str(problem), problem
                print("refused", name)
assert os.listdir() == [], os.listdir()
"""
    found = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stderr
    assert found.stdout.count("refused") == 30


@pytest.mark.parametrize("extension", [".med", ".xdmf"])
def test_hdf5_is_not_begun_where_there_is_no_room(extension, tmp_path, monkeypatch):
    pytest.importorskip("h5py")
    pytest.importorskip("netCDF4")
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=100_500))
    with pytest.raises(hc.WriteError, match="the disk is full: some"):
        hc.write(tmp_path / f"a{extension}", hc.HexMesh(*box((3, 3, 3))))
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.name == "nt", reason="no limit on the size of files")
def test_a_picture_for_which_there_is_no_room_costs_the_picture_alone(tmp_path):
    hc.write(tmp_path / "in.vtu", hc.HexMesh(*box((2, 2, 2))))
    words = ["regularize", "in.vtu", "out.vtu", "--plot", "quality.png"]
    script = f"""
import resource
from hexconformal.app.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
raise SystemExit(main({words}))
"""
    found = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert found.returncode == 1
    assert hc.quality(tmp_path / "out.vtu").valid.all()
    assert "wrote out.vtu\n" in found.stdout
    assert "cannot write quality.png" in found.stderr
    assert "the mesh of iteration 0 is in out.vtu" in found.stderr
    assert sorted(os.listdir(tmp_path)) == ["in.vtu", "out.vtu"]


@full
def test_a_history_on_a_full_disk():
    with pytest.raises(hc.WriteError, match="No space left"), HistoryFile("/dev/full") as history:
        history.add(hc.Record(0, "input", 24.0, 1.0, 0.0, 0.5, 0.75, 0, 0.125))


@full
def test_what_is_told_has_no_room(tmp_path):
    hc.write(tmp_path / "in.vtu", hc.HexMesh(*box((2, 2, 2))))
    with open("/dev/full", "w") as device:
        words = [sys.executable, "-m", "hexconformal", "quality", "in.vtu"]
        found = subprocess.run(words, cwd=tmp_path, stdout=device, stderr=subprocess.PIPE, text=True, check=False)
    assert (found.returncode, found.stderr) == (1, "error: [Errno 28] No space left on device\n")
