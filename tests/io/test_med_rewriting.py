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


def test_new_arrays_become_fields_beside_those_that_came(tmp_path):
    path, written = tmp_path / "a.med", tmp_path / "b.med"
    points = med_file(path)
    new = {"point_data": {"moved by": np.arange(81.0).reshape(27, 3)}, "cell_data": {"more": np.arange(8) / 7}}
    assert io.write(written, io.read(path).replaced(points=points * 2, **new)) == []
    old, all_of_it = everything(path), everything(written)
    assert [name.rsplit("/", 1)[1] for name in old if old[name] != all_of_it[name]] == ["COO"]
    again = io.read(written)
    np.testing.assert_array_equal(again.point_data["moved by"], new["point_data"]["moved by"])
    np.testing.assert_array_equal(again.cell_data["more"], new["cell_data"]["more"])
    np.testing.assert_array_equal(again.cell_data["SIG"], np.arange(8) / 3)
    # Once more: what was written then is replaced, as it has neither times nor units.
    assert io.write(path, again.replaced(cell_data={"more": np.ones(8)})) == []
    np.testing.assert_array_equal(io.read(path).cell_data["more"], np.ones(8))
    assert everything(path).keys() == all_of_it.keys()


@pytest.mark.parametrize(
    "arrays", [{"SIG": np.ones(8)}, {"tag": np.arange(8)}, {"a/b": np.ones(8)}, {"n" * 65: np.ones(8)}]
)
def test_what_med_loses_with_arrays_that_are_no_new_fields_is_told(arrays, tmp_path):
    path = tmp_path / "a.med"
    med_file(path)
    lost = io.write(path, io.read(path).replaced(cell_data=arrays))
    assert "names, units and times of the med file" in lost


def test_a_field_with_a_time_is_not_replaced_without_a_word(tmp_path):
    path = tmp_path / "a.med"
    med_file(path)
    with h5py.File(path, "r+") as file:
        file["CHA/SIG"].attrs["UNI"] = np.bytes_("")
    lost = io.write(path, io.read(path).replaced(cell_data={"SIG": np.ones(8)}))
    assert lost == ["names, units and times of the med file"]


def test_medcoupling_reads_what_is_written(tmp_path):
    medcoupling = pytest.importorskip("medcoupling")
    cells = np.array([[0, 1, 3, 2, 4, 5, 7, 6]])
    mesh = medcoupling.MEDCouplingUMesh("bloc béton", 3)
    mesh.setCoords(medcoupling.DataArrayDouble(block(1)[0][np.argsort(cells[0])].tolist()))
    mesh.allocateCells(1)
    mesh.insertNextCell(medcoupling.NORM_HEXA8, [0, 3, 2, 1, 4, 7, 6, 5])
    mesh.finishInsertingCells()
    field = medcoupling.MEDCouplingFieldDouble(medcoupling.ON_CELLS, medcoupling.ONE_TIME)
    field.setName("SIG")
    field.setMesh(mesh)
    field.setTime(1.5, 3, 0)
    field.setArray(medcoupling.DataArrayDouble([2.0]))
    medcoupling.WriteField(str(tmp_path / "a.med"), field, True)
    new = {"point_data": {"moved_by": np.arange(24.0).reshape(8, 3)}, "cell_data": {"quality": np.array([0.5])}}
    assert io.write(tmp_path / "b.med", io.read(tmp_path / "a.med").replaced(**new)) == []
    found = medcoupling.MEDFileData(str(tmp_path / "b.med"))
    times = {field.getName(): field.getTimeSteps() for field in found.getFields()}
    assert times == {"SIG": [(3, 0, 1.5)], "moved_by": [(-1, -1, 0.0)], "quality": [(-1, -1, 0.0)]}
    whole = found.getMeshes()[0]
    kinds = {"moved_by": medcoupling.ON_NODES, "quality": medcoupling.ON_CELLS}
    for name, expected in (*new["point_data"].items(), *new["cell_data"].items()):
        values = found.getFields()[name][0].getFieldOnMeshAtLevel(kinds[name], 0, whole).getArray()
        np.testing.assert_array_equal(values.toNumPyArray(), expected)
