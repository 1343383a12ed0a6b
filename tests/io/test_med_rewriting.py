"""MED's files are copied with other coordinates: names, units, times, groups and fields stay."""

import meshio
import numpy as np
import pytest
from meshes.hexahedra import block

from hexconformal.io import read_write as io

h5py = pytest.importorskip("h5py")


def med_file(path):
    """A mesh with quads, groups, and a field with a unit and a time on the hexahedra only."""
    points, cells = block(2)
    mesh = meshio.Mesh(points, [("hexahedron", cells), ("quad", cells[:2, :4])])
    mesh.cell_data = {"cell_tags": [np.repeat([-1, -2], 4), np.array([-3, 0])]}
    mesh.cell_tags = {-1: ["béton"], -2: ["acier", "tout"], -3: ["bas"]}
    io.write(path, mesh)
    with h5py.File(path, "r+") as file:
        file.move("ENS_MAA/mesh", "ENS_MAA/bloc béton")
        file.move("FAS/mesh", "FAS/bloc béton")
        file["ENS_MAA/bloc béton"].attrs["UNI"] = np.bytes_("mm".ljust(16) * 3)
        field = file.require_group("CHA").create_group("SIG")
        for name, value in {"NCO": 1, "NOM": np.bytes_("S"), "UNI": np.bytes_("MPa"), "MAI": b"bloc"}.items():
            field.attrs[name] = value
        step = field.create_group("0000000000000000000300000000000000000000")
        step.attrs["PDT"], step.attrs["NDT"] = 1.5, 3
        support = step.create_group("MAI.HE8")
        support.attrs["PFL"] = np.bytes_("MED_NO_PROFILE_INTERNAL")
        values = support.create_group("MED_NO_PROFILE_INTERNAL")
        values.attrs["NBR"], values.attrs["NGA"] = 8, 1
        values.create_dataset("CO", data=np.arange(8) / 3)
    return points


def everything(path):
    found = {}
    with h5py.File(path) as file:

        def visit(name, item):
            found[name] = {key: np.asarray(value).tolist() for key, value in item.attrs.items()}
            if isinstance(item, h5py.Dataset):
                found[name]["values"] = item[()].tolist()

        file.visititems(visit)
    return found


def test_all_of_a_med_file_but_coordinates_stays(tmp_path):
    path, written = tmp_path / "a.med", tmp_path / "b.med"
    points = med_file(path)
    mesh = io.read(path)
    np.testing.assert_array_equal(mesh.cell_data["SIG"], np.arange(8) / 3)
    assert np.isnan(mesh.origin.source.cell_data["SIG"][1]).all()
    assert io.write(written, mesh.replaced(points=points * [1, 2, 3] + 1 / 3)) == []
    old, new = everything(path), everything(written)
    changed = {name for name in old if old[name] != new[name]}
    assert old.keys() == new.keys()
    assert [name.rsplit("/", 1)[1] for name in changed] == ["COO"]
    np.testing.assert_array_equal(io.read(written).points, points * [1, 2, 3] + 1 / 3)


def test_what_med_loses_with_new_arrays_is_told(tmp_path):
    path = tmp_path / "a.med"
    med_file(path)
    mesh = io.read(path)
    lost = io.write(path, mesh.replaced(cell_data={"more": np.ones(8)}))
    assert lost == ["names, units and times of the med file"]
    again = io.read(path)
    np.testing.assert_array_equal(again.cell_data["more"], np.ones(8))
    np.testing.assert_array_equal(again.cell_data["SIG"], np.arange(8) / 3)
