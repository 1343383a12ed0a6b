"""Files are written completely or not at all, where they were asked for."""

import errno
import os

import meshio
import pytest
from meshes.hexahedra import block

from hexconformal import HexMesh
from hexconformal.common import files
from hexconformal.common.errors import WriteError
from hexconformal.io import read_write as io
from hexconformal.io.formats import WRITE_EXTENSIONS


def test_places_that_cannot_be_written_to(tmp_path):
    mesh = HexMesh(*block(1))
    with pytest.raises(WriteError, match="does not exist"):
        io.write(tmp_path / "no" / "a.vtu", mesh)
    with pytest.raises(WriteError, match=r"unknown extension \.xyz; known are .*\.msh"):
        io.write(tmp_path / "a.xyz", mesh)
    with pytest.raises(WriteError, match=r"\(none\)"):
        files.check_writable(tmp_path / "a", WRITE_EXTENSIONS)
    (tmp_path / "b.vtu").mkdir()
    with pytest.raises(WriteError, match="folder"):
        io.write(tmp_path / "b.vtu", mesh)


@pytest.mark.parametrize("extension", [".vtu", ".msh", ".xdmf"])
def test_a_failed_write_leaves_the_old_file(extension, tmp_path, monkeypatch):
    path = tmp_path / f"a{extension}"
    io.write(path, HexMesh(*block(1)))
    before = {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)}

    def full(source, target):
        # Side by side, so that the move is one step and not a copy to another disk.
        assert source.parent.parent == target.parent == tmp_path
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(WriteError, match="No space left"):
        io.write(path, HexMesh(*block(2)))
    assert {name: (tmp_path / name).read_bytes() for name in os.listdir(tmp_path)} == before


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is always full")
def test_a_writer_that_fails_halfway(tmp_path, monkeypatch):
    def overflow(*_, **__):
        with open("/dev/full", "w") as device:
            device.write("x" * 10**6)

    monkeypatch.setattr(meshio, "write", overflow)
    with pytest.raises(WriteError, match="No space left"):
        io.write(tmp_path / "a.msh", HexMesh(*block(1)))
    assert os.listdir(tmp_path) == []


def test_the_companion_of_xdmf(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    io.write("out/a.xdmf", HexMesh(*block(1)))
    assert sorted(os.listdir("out")) == ["a.h5", "a.xdmf"]
    assert os.listdir(".") == ["out"]
    io.write("out/a.xdmf", HexMesh(*block(2)))
    assert len(io.read("out/a.xdmf").cells) == 8
    # Another file's companion is not overwritten.
    with pytest.raises(WriteError, match="companion"):
        io.write("out/a.xmf", HexMesh(*block(1)))
    with pytest.raises(WriteError, match="companion"):
        files.check_writable("out/a.xmf")  # known before the work
    assert len(io.read("out/a.xdmf").cells) == 8


def test_links_stay_links(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link.vtu").symlink_to(tmp_path / "real" / "a.vtu")
    io.write(tmp_path / "link.vtu", HexMesh(*block(1)))
    assert (tmp_path / "link.vtu").is_symlink()
    assert (tmp_path / "real" / "a.vtu").is_file()
