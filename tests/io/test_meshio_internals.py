"""The private parts of meshio that are relied on: where a new meshio differs, these tests say in what."""

import inspect
from importlib import import_module

import meshio
import numpy as np
import pytest

from hexconformal.io.cell_types import NODE_COUNTS, VTK_TYPES
from hexconformal.io.format_tools.meshio_internals import REPLACED, UNKNOWN_SOLIDS
from hexconformal.io.formats import FORMATS

REPLACEMENTS = [(*place, name, parameters) for place, names in REPLACED.items() for name, parameters in names.items()]


@pytest.mark.parametrize(("module", "function", "name", "parameters"), REPLACEMENTS)
def test_what_is_replaced_is_there(module, function, name, parameters):
    found = getattr(import_module(module), function)
    assert inspect.isfunction(found)
    assert found.__closure__ is None
    assert name in found.__code__.co_names, f"{module}.{function} does not use {name} any more"
    assert name in found.__globals__
    if parameters is not None:
        assert tuple(inspect.signature(found.__globals__[name]).parameters) == parameters


@pytest.mark.parametrize(
    ("public", "module", "function"),
    [
        (meshio.gmsh.read, "meshio.gmsh.main", "read"),
        (meshio.med.read, "meshio.med._med", "read"),
        (meshio.med.write, "meshio.med._med", "write"),
    ],
)
def test_public_functions_are_those_that_are_listed(public, module, function):
    assert getattr(import_module(module), function) is public


def test_gmsh_readers_of_version_2_are_found_by_version():
    readers = meshio.gmsh.read.__globals__["_readers"]
    assert readers["2"] is readers["2.2"] is import_module("meshio.gmsh._gmsh22")
    assert tuple(inspect.signature(readers["2.2"].read_buffer).parameters) == ("f", "is_ascii", "data_size")


def test_meshio_still_does_wrongly_what_is_replaced():
    """Where one of these fails, meshio was mended: the replacement can go."""
    split = import_module("meshio.gmsh._gmsh22").cell_data_from_raw
    assert [
        len(part) for part in split([("line", np.zeros((3, 2))), ("quad", np.zeros((1, 4)))], {"a": range(4)})["a"]
    ] == [2, 2]
    med = import_module("meshio.med._med")
    family = type("Family", (dict,), {"attrs": {"NUM": -1}})()
    with pytest.raises(KeyError):
        med._read_families({"FAM_-1": family})


@pytest.mark.parametrize(
    ("extension", "module", "table"),
    [
        (".msh", "meshio.gmsh", "meshio_to_gmsh_type"),
        (".inp", "meshio.abaqus._abaqus", "meshio_to_abaqus_type"),
        (".med", "meshio.med._med", "meshio_to_med_type"),
        (".xdmf", "meshio.xdmf.common", "meshio_to_xdmf_type"),
    ],
)
def test_meshio_has_the_cells_that_a_format_is_said_to_have(extension, module, table):
    there = {*import_module("meshio._mesh").topological_dimension, *(UNKNOWN_SOLIDS if extension != ".xdmf" else ())}
    known = {name for name in getattr(import_module(module), table) if name in there}
    # What our copies of MED's reader and writer know besides.
    known |= {"quad9", "wedge18", "hexahedron27"} if extension == ".med" else set()
    # What it writes beside other cells, and cannot read.
    known -= {"wedge18"} if extension == ".xdmf" else set()
    assert set(FORMATS[extension].capabilities.cell_types.split()) == known


def test_types_of_cells_are_those_of_meshio():
    theirs = import_module("meshio._vtk_common").meshio_to_vtk_type
    dimensions = import_module("meshio._mesh").topological_dimension
    assert not dimensions.keys() & set(UNKNOWN_SOLIDS), "meshio knows them now: cell_block can go"
    known = {*dimensions, *UNKNOWN_SOLIDS}
    assert {name: code for name, code in theirs.items() if name in known} == VTK_TYPES
    counts = import_module("meshio._common").num_nodes_per_cell
    assert {name: counts[name] for name in NODE_COUNTS} == NODE_COUNTS
