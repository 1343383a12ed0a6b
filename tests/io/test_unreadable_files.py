"""Files that are truncated, garbage, of another format, or not there: a ReadError that says so."""

import os
import sys

import meshio
import pytest
import pyvista as pv
from meshes.files import as_grid, awkward_mesh, mixed_meshio
from meshes.hexahedra import block

from hexconformal import HexMesh, as_hex_mesh
from hexconformal.common import files
from hexconformal.common.errors import MeshError, ReadError, WriteError
from hexconformal.io import read_write as io
from hexconformal.io.formats import READ_EXTENSIONS


# Formats that state their counts or their end; the others cannot show that whole lines are missing.
@pytest.mark.long
@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".msh", ".mesh", ".meshb", ".e", ".med", ".xdmf"])
def test_truncated_files_are_refused(extension, tmp_path, capfd):
    path = tmp_path / f"mesh{extension}"
    io.write(path, awkward_mesh())
    check_truncations(path, capfd)


@pytest.mark.parametrize("extension", [".vtu", ".vtk", ".msh", ".inp"])
def test_truncated_text_files_are_refused(extension, tmp_path, capfd):
    path = tmp_path / f"mesh{extension}"
    if extension == ".msh":
        meshio.write(path, mixed_meshio_bare(), file_format="gmsh22", binary=False)
    elif extension == ".inp":
        io.write(path, awkward_mesh())
        path.write_bytes(path.read_bytes()[: path.read_bytes().index(b"*ELEMENT") + 80])
    else:
        as_grid(awkward_mesh()).save(path, binary=False)
    check_truncations(path, capfd)


def mixed_meshio_bare():
    mesh = mixed_meshio()
    return meshio.Mesh(mesh.points, mesh.cells)


def check_truncations(path, capfd):
    data = path.read_bytes()
    capfd.readouterr()
    for fraction in (0, 0.02, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97):
        path.write_bytes(data[: int(fraction * len(data))])
        with pytest.raises(ReadError, match="mesh") as caught:
            io.read(path)
        assert str(path) in str(caught.value)
    printed = capfd.readouterr()
    assert (printed.out, printed.err) == ("", "")


@pytest.mark.parametrize("extension", READ_EXTENSIONS)
@pytest.mark.parametrize("content", [b"", b"\x00\xff\xfe garbage \x80" * 50, b"hello\nworld\n1 2 3\n", b"# nothing\n"])
def test_garbage_is_a_read_error(extension, content, tmp_path, capfd):
    path = tmp_path / f"bad{extension}"
    path.write_bytes(content)
    with pytest.raises(ReadError, match="bad"):
        io.read(path)
    assert capfd.readouterr() == ("", "")


def test_a_file_of_another_format_is_a_read_error(tmp_path):
    io.write(tmp_path / "a.vtu", HexMesh(*block(1)))
    for extension in (".vtk", ".msh", ".inp", ".mesh", ".xdmf", ".e", ".med"):
        os.replace(io_copy(tmp_path / "a.vtu"), tmp_path / f"b{extension}")
        with pytest.raises(ReadError):
            io.read(tmp_path / f"b{extension}")


def io_copy(path):
    copy = path.with_name("copy")
    copy.write_bytes(path.read_bytes())
    return copy


@pytest.mark.parametrize(
    ("name", "text", "advice"),
    [
        ("a.mesh", "MFEM NC mesh v1.0\n\ndimension\n3\n", "MFEM NC mesh v1.0' is not supported: .* conforming"),
        ("a.inp", "# a comment\n8 1 0 0 0\n1 0. 0. 0.\n", r"UCD .* \.avs"),
        ("a.msh", "$NOD\n8\n1 0 0 0\n", "Gmsh 1 .* 4.1"),
    ],
)
def test_formats_of_the_same_extension_are_told_apart(name, text, advice, tmp_path):
    (tmp_path / name).write_text(text)
    with pytest.raises(ReadError, match=advice):
        io.read(tmp_path / name)


def test_what_is_not_there_or_not_known(tmp_path):
    with pytest.raises(ReadError, match="does not exist"):
        io.read(tmp_path / "none.vtu")
    with pytest.raises(ReadError, match="folder"):
        io.read(tmp_path)
    (tmp_path / "a.xyz").write_text("1")
    with pytest.raises(ReadError, match=r"unknown extension \.xyz; known are .*\.vtu"):
        io.read(tmp_path / "a.xyz")
    with pytest.raises(ReadError):
        as_hex_mesh(tmp_path / "none.vtu")
    with pytest.raises(ReadError):
        as_hex_mesh(str(tmp_path / "none.vtu"))
    pv.Sphere().save(tmp_path / "surface.vtk")
    with pytest.raises(MeshError, match=r"surface\.vtk.*no hexahedra"):
        io.read(tmp_path / "surface.vtk")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="everything is readable for root")
def test_unreadable_files(tmp_path):
    (tmp_path / "a.vtu").write_text("x")
    (tmp_path / "a.vtu").chmod(0)
    with pytest.raises(ReadError, match="denied"):
        io.read(tmp_path / "a.vtu")
    tmp_path.chmod(0o500)
    with pytest.raises(WriteError, match="denied"):
        files.check_writable(tmp_path / "b.vtu")


@pytest.mark.parametrize(("extension", "module"), [(".med", "h5py"), (".e", "netCDF4"), (".xdmf", "h5py")])
def test_missing_packages_are_named(extension, module, tmp_path, monkeypatch):
    path = tmp_path / f"a{extension}"
    io.write(path, HexMesh(*block(1)))
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ReadError, match=r"hexconformal\[formats\]"):
        io.read(path)
    with pytest.raises(WriteError, match=r"hexconformal\[formats\]"):
        io.write(path, HexMesh(*block(1)))


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("a.vtm", r"collections of blocks are not supported: .* \.vtu"),
        ("a.vtkhdf", "VTK's HDF files are not supported"),
        ("a.cgns", "CGNS files are not supported"),
        ("a.pvd", "series of files are not supported"),
    ],
)
def test_formats_that_are_not_supported_say_so(name, reason, tmp_path):
    (tmp_path / name).write_text("something")
    with pytest.raises(ReadError, match=reason):
        io.read(tmp_path / name)
    with pytest.raises(WriteError, match=reason):
        io.write(tmp_path / name, HexMesh(*block(1)))


def test_xdmf_of_several_grids_is_refused_by_name(tmp_path):
    grids = "".join(f'<Grid Name="{name}" GridType="Uniform"></Grid>' for name in ("mesh", "cell_tags"))
    (tmp_path / "a.xdmf").write_text(f'<?xml version="1.0"?><Xdmf Version="3.0"><Domain>{grids}</Domain></Xdmf>')
    with pytest.raises(ReadError, match=r"holds 2 grids \(mesh, cell_tags\): .* DOLFINx.* not supported"):
        io.read(tmp_path / "a.xdmf")
