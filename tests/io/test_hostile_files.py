"""Files made to overcome their reader: refused by name, soon, and in little memory."""

import base64
import os
import shutil
import time
import zlib

import meshio
import numpy as np
import pytest

import hexconformal as hc
from hexconformal.generate import box
from hexconformal.io import outside_references_allowed
from hexconformal.io.format_tools.file_checks import reader_trial

CUBE = """{declaration}
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" {compressor}>
<UnstructuredGrid><Piece {points} NumberOfCells="1">
<PointData>{data}</PointData><CellData></CellData>
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">
0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 1 1 0 1 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 3 4 5 6 7</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">8</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">12</DataArray></Cells>
</Piece></UnstructuredGrid>{appended}</VTKFile>
"""
PIECES = (
    '<VTKFile type="PUnstructuredGrid" version="1.0"><PUnstructuredGrid GhostLevel="0"><PPoints><PDataArray '
    'type="Float64" NumberOfComponents="{}"/></PPoints>{}</PUnstructuredGrid></VTKFile>'
)
ZLIB = 'compressor="vtkZLibDataCompressor"'


def cube(points='NumberOfPoints="8"', data="", compressor="", declaration='<?xml version="1.0"?>', appended=""):
    return CUBE.format(
        points=points, data=data, compressor=compressor, declaration=declaration, appended=appended
    ).encode()


def array(*header, kind="binary", values=b"", components=1):
    text = base64.b64encode(np.array(header, dtype=np.uint64).tobytes()).decode()
    text += base64.b64encode(values).decode()
    return (
        f'<DataArray type="Float64" Name="f" NumberOfComponents="{components}" format="{kind}">\n  {text}\n</DataArray>'
    )


def packed(values):
    data = zlib.compress(values)
    return array(1, 32768, len(values), len(data), values=data)


MINUS = 2**64 - 1
APPENDED = '<DataArray type="Float64" Name="f" format="appended" offset="{}"/>'
RAW = b'<AppendedData encoding="raw">\n_' + np.array([1 << 40, 32768, 0], dtype=np.uint64).tobytes()
REFUSED = {
    "attributes by a document type": (
        cube('NumberOfPoints="8"').replace(b"<VTKFile", b'<!DOCTYPE V [<!ATTLIST Piece a CDATA "1">]><VTKFile', 1),
        "document type must declare nothing",
    ),
    "UTF-16": (cube(declaration='<?xml version="1.0" encoding="UTF-16"?>').decode().encode("utf-16"), "UTF-8"),
    "another encoding": (cube(declaration='<?xml version="1.0" encoding="EBCDIC"?>'), "UTF-8"),
    "a number in character references": (cube('NumberOfPoints="1&#48;0000000000"'), "more than a file of its size"),
    "many components": (cube(data=array(8, components=10**9)), "more than a file of its size"),
    "many arrays": (cube(data=array(8, components=10**4) * 300), "more than a file of its size"),
    "a negative size": (cube(data=array(1, 64, 0, MINUS), compressor=ZLIB), "more than a file of its size"),
    "a last block beyond": (cube(data=array(1, 0, 1 << 40, 12), compressor=ZLIB), "more than a file of its size"),
    "many blocks": (cube(data=array(1 << 40, 32768, 0, 12), compressor=ZLIB), "more than a file of its size"),
    "large blocks": (cube(data=array(1, 1 << 40, 0, 12), compressor=ZLIB), "more than a file of its size"),
    "many bytes": (cube(data=array(1 << 40)), "more than a file of its size"),
    "half a header": (cube(data=array(4, 32768, 0), compressor=ZLIB), "within its header"),
    "appended blocks": (cube(data=APPENDED.format(0), compressor=ZLIB, appended="@").replace(b"@", RAW), "its size"),
    "appended nowhere": (cube(data=APPENDED.format(99999), appended="@").replace(b"@", RAW), "nothing is at offset"),
    "appended in a comment": (cube(data="<!-- <AppendedData -->"), "appended data do not begin"),
    "nested": (cube(data="<a>" * 5000 + "</a>" * 5000), "nested"),
    "an unknown compressor": (cube(compressor='compressor="evil"'), "not known"),
}


@pytest.fixture
def soon():
    begun = time.perf_counter()
    yield
    assert time.perf_counter() - begun < 20


def test_the_cubes_are_sound_but_for_what_is_put_into_them(tmp_path):
    for name, data in (("plain", cube()), ("packed", cube(data=packed(bytes(64)), compressor=ZLIB))):
        (tmp_path / f"{name}.vtu").write_bytes(data)
        assert hc.read(tmp_path / f"{name}.vtu").points.sum() == 12
    ones = np.full(8, 1.0)
    (tmp_path / "a.vtu").write_bytes(cube(data=packed(ones.tobytes()), compressor=ZLIB))
    np.testing.assert_array_equal(hc.read(tmp_path / "a.vtu").point_data["f"], ones)


@pytest.mark.parametrize("kind", REFUSED)
def test_hostile_xml_is_refused(kind, soon, tmp_path):
    data, said = REFUSED[kind]
    (tmp_path / "a.vtu").write_bytes(data)
    with pytest.raises(hc.ReadError, match=said):
        hc.read(tmp_path / "a.vtu")


@pytest.mark.parametrize("mode", ["ascii", "binary", "appended", "raw"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize("header", ["UInt32", "UInt64"])
def test_sound_xml_of_every_kind_is_read(mode, compressor, header, tmp_path):
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    mesh = hc.HexMesh(*box((9, 9, 9)), point_data={"f": np.zeros(1000), "g": np.ones((1000, 3))})
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "a.vtu"))
    writer.SetInputData(hc.io.to_pyvista(mesh)[0])
    getattr(writer, f"SetHeaderTypeTo{header}")()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    getattr(writer, f"SetDataModeTo{mode.replace('raw', 'appended').capitalize()}")()
    writer.SetEncodeAppendedData(mode != "raw")
    writer.SetBlockSize(1024)
    assert writer.Write() == 1
    np.testing.assert_array_equal(hc.read(tmp_path / "a.vtu").points, mesh.points)


def test_pieces_that_name_pieces_are_refused(soon, tmp_path):
    (tmp_path / "ok.vtu").write_bytes(cube())
    for level in range(9):
        (tmp_path / f"fan{level}.pvtu").write_text(PIECES.format(3, f'<Piece Source="fan{level + 1}.pvtu"/>' * 10))
    (tmp_path / "fan9.pvtu").write_text(PIECES.format(3, '<Piece Source="ok.vtu"/>'))
    assert len(hc.read(tmp_path / "fan9.pvtu").cells) == 1
    for text, said in (
        ('<Piece Source="fan1.pvtu"/>' * 10, "different files"),
        ('<Piece Source="fan9.pvtu"/>', "of their own kind"),
        ('<Piece Source="ok.vtu"/><Piece Source="./ok.vtu"/>', "different files"),
        ('<Piece Source="missing.vtu"/>', "does not exist"),
    ):
        (tmp_path / "a.pvtu").write_text(PIECES.format(3, text))
        with pytest.raises(hc.ReadError, match=said):
            hc.read(tmp_path / "a.pvtu")
    (tmp_path / "a.pvtu").write_text(PIECES.format(10**5, '<Piece Source="ok.vtu"/>'))
    with pytest.raises(hc.ReadError, match="more components"):
        hc.read(tmp_path / "a.pvtu")


def test_an_image_of_more_points_than_any_memory_holds(soon, tmp_path):
    head = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\n"
    text = head + "DIMENSIONS {0} {0} {0}\nORIGIN 0 0 0\nSPACING 1 1 1\n"
    (tmp_path / "a.vtk").write_text(text.format(1500))
    with pytest.raises(hc.ReadError, match="more than a file of its size can hold"):
        hc.read(tmp_path / "a.vtk")
    (tmp_path / "a.vtk").write_text(text.format(3))
    assert len(hc.read(tmp_path / "a.vtk").cells) == 8


@pytest.mark.parametrize("extension", [".mdpa", ".dat", ".avs", ".f3grid", ".su2", ".vol", ".ugrid"])
def test_text_that_ends_too_early(extension, soon, tmp_path):
    points, cells = box((2, 2, 2))
    name = "lb8.ugrid" if extension == ".ugrid" else extension[1:]
    whole = tmp_path / f"whole.{name}"
    try:
        meshio.write(whole, meshio.Mesh(points, [("hexahedron", cells)]))
    except Exception as problem:
        pytest.skip(f"meshio does not write it: {problem}")
    data = whole.read_bytes()
    assert len(hc.read(whole).cells) == 8
    path = tmp_path / f"cut.{name}"
    for length in range(1, len(data), max(len(data) // 60, 1)):
        path.write_bytes(data[:length])
        try:
            hc.read(path)
        except hc.MeshError:
            continue


def test_files_outside_the_folder_are_refused_unless_allowed(tmp_path):
    pytest.importorskip("h5py")
    secret, sent = tmp_path / "secret", tmp_path / "sent"
    secret.mkdir()
    sent.mkdir()
    hc.write(secret / "a.xdmf", hc.HexMesh(*box((2, 2, 2))))
    (secret / "a.vtu").write_bytes(cube())
    text = (secret / "a.xdmf").read_text()
    (sent / "up.xdmf").write_text(text.replace("a.h5", "../secret/a.h5"))
    (sent / "whole.xdmf").write_text(text.replace("a.h5", str(secret / "a.h5")))
    (sent / "up.pvtu").write_text(PIECES.format(3, '<Piece Source="../secret/a.vtu"/>'))
    os.symlink("../secret/a.vtu", sent / "link.vtu")
    (sent / "link.pvtu").write_text(PIECES.format(3, '<Piece Source="link.vtu"/>'))
    hc.write(secret / "a.inp", hc.HexMesh(*box((1, 1, 1))))
    os.symlink("../secret/a.inp", sent / "link.txt")
    for name, included in (("up.inp", "../secret/a.inp"), ("whole.inp", secret / "a.inp"), ("link.inp", "link.txt")):
        (sent / name).write_text(f"*INCLUDE, INPUT={included}\n")
    for name in ("up.xdmf", "whole.xdmf", "up.pvtu", "link.pvtu", "up.inp", "whole.inp", "link.inp"):
        with pytest.raises(hc.ReadError, match="outside its folder"):
            hc.read(sent / name)
        with outside_references_allowed():
            assert len(hc.read(sent / name).cells) in (1, 8)
    shutil.copy(secret / "a.h5", sent / "a.h5")
    (sent / "a.xdmf").write_text(text)
    assert len(hc.read(sent / "a.xdmf").cells) == 8
    (sent / "b.xdmf").write_text(text.replace("<Xdmf", '<!DOCTYPE Xdmf [<!ENTITY a "x">]>\n<Xdmf', 1))
    with pytest.raises(hc.ReadError, match="document type"):
        hc.read(sent / "b.xdmf")
    (sent / "b.xdmf").write_text(text.replace('Format="HDF"', 'Format="Binary"').replace("a.h5:/data0", "/dev/zero"))
    with pytest.raises(hc.ReadError, match=r"outside its folder|must be a regular file"):
        hc.read(sent / "b.xdmf")


def test_hdf5_that_names_other_files_or_more_than_it_holds(soon, tmp_path, monkeypatch):
    h5py = pytest.importorskip("h5py")
    hc.write(tmp_path / "sound.med", hc.HexMesh(*box((2, 2, 2))))
    assert len(hc.read(tmp_path / "sound.med").cells) == 8

    def refused(said, change):
        shutil.copy(tmp_path / "sound.med", tmp_path / "a.med")
        with h5py.File(tmp_path / "a.med", "r+") as file:
            change(file)
        with pytest.raises(hc.ReadError, match=said):
            hc.read(tmp_path / "a.med")

    def circle(file):
        file["a/b"] = 1.0
        file["a/c"] = file["/"]
        group = file["a"]
        for _ in range(300):
            group = group.create_group("d")

    refused("names other files", lambda file: file.__setitem__("x", h5py.ExternalLink("sound.med", "/")))
    refused("more than a file", lambda file: file.create_dataset("x", (1 << 40,), "f8", chunks=(1024,)))
    refused("names other files", lambda file: file.create_dataset("x", (8,), "f8", external=[("/dev/zero", 0, 64)]))
    refused("nested", circle)
    # A reader that dies does so elsewhere.
    monkeypatch.setattr(reader_trial, "run_python", lambda *words, **limits: -11)
    with pytest.raises(hc.ReadError, match="HDF5 crashes on it"):
        hc.read(tmp_path / "sound.med")


def test_pipes_and_devices_are_refused(tmp_path):
    if not hasattr(os, "mkfifo"):
        pytest.skip("no pipes with names")
    mesh = hc.HexMesh(*box((2, 2, 2)))
    for name in ("a.vtu", "a.stl"):
        os.mkfifo(tmp_path / name)
        with pytest.raises(hc.ReadError, match="must be a regular file"):
            hc.read(tmp_path / name) if name == "a.vtu" else hc.io.read_surface(tmp_path / name)
    with pytest.raises(hc.WriteError, match="must be a regular file"):
        hc.write(tmp_path / "a.vtu", mesh)
    (tmp_path / "b.pvtu").write_text(PIECES.format(3, '<Piece Source="a.vtu"/>'))
    with pytest.raises(hc.ReadError, match="must be a regular file"):
        hc.read(tmp_path / "b.pvtu")
    assert (tmp_path / "a.vtu").is_fifo()
