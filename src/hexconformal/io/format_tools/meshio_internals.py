"""The private parts of meshio that are relied on, all in one place; tests compare them with the installed meshio.

Some of its parsers and writers fail at something that one function, or table, of theirs does wrongly. They are run as
copies that find another one under its name: meshio itself is not changed, so that no other user of it is concerned.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib import import_module
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "REPLACED",
    "UNKNOWN_SOLIDS",
    "cell_block",
    "gmsh_cell_types",
    "gmsh_node_order",
    "med_reader",
    "med_writer",
    "with_globals",
]

# Solid cells of which meshio has the nodes, but not the dimension.
UNKNOWN_SOLIDS = ("wedge15", "pyramid13")

# By module and function of meshio: what is replaced among its global names, with its parameters (None: not called).
REPLACED: dict[tuple[str, str], dict[str, tuple[str, ...] | None]] = {
    ("meshio.med._med", "read"): {
        "_read_families": ("fas_data",),
        "_read_data": ("fields", "profiles", "cell_types", "point_data", "cell_data", "field_data"),
        "Mesh": None,
        "med_to_meshio_type": None,
    },
    ("meshio.med._med", "_read_data"): {"med_to_meshio_type": None},
    ("meshio.med._med", "write"): {"_write_families": ("fm_group", "tags"), "meshio_to_med_type": None},
}


def with_globals(function: Any, **replacements: Any) -> Any:
    """A copy of a function for which some of its global names stand for other things.

    >>> def area(radius):
    ...     return abs(radius) ** 2
    >>> with_globals(area, abs=lambda x: 10 * x)(2), area(2)
    (400, 4)
    """
    names = {**function.__globals__, **replacements}
    copy = FunctionType(function.__code__, names, function.__name__, function.__defaults__, function.__closure__)
    copy.__kwdefaults__ = function.__kwdefaults__
    return copy


def cell_block(name: str, nodes: Any, tags: list[str] | None = None) -> Any:
    """A meshio.CellBlock, also of the types of second order whose dimension meshio does not know.

    >>> cell_block("wedge15", [range(15)]).dim
    3
    """
    import meshio

    if name not in UNKNOWN_SOLIDS:
        return meshio.CellBlock(name, nodes, tags)
    block = meshio.CellBlock("hexahedron", nodes, tags)
    block.type = name
    return block


@cache
def gmsh_cell_types() -> dict[int, tuple[str, int]]:
    """By Gmsh's number of a type of elements: its meshio name, and the number of nodes."""
    names = import_module("meshio.gmsh.common")._gmsh_to_meshio_type
    counts = import_module("meshio._common").num_nodes_per_cell
    return {code: (name, counts[name]) for code, name in names.items()}


def gmsh_node_order(name: str, node_count: int) -> NDArray[np.int64]:
    """For each node of a type of cells, its place in Gmsh's order."""
    order = import_module("meshio.gmsh.common")._gmsh_to_meshio_order(name, np.arange(node_count)[None])
    return np.asarray(order[0], dtype=np.int64)


def med_reader(read_families: Callable[[Any], dict[int, list[str]]], make_mesh: Callable[..., Any]) -> Any:
    """meshio.med.read, where other functions read the families and make the meshio.Mesh."""
    import meshio

    types = {code: name for name, code in _med_types().items()}
    read_data = with_globals(import_module("meshio.med._med")._read_data, med_to_meshio_type=types)
    names = {"_read_families": read_families, "_read_data": read_data, "Mesh": make_mesh, "med_to_meshio_type": types}
    return with_globals(meshio.med.read, **names)


def med_writer(write_families: Callable[[Any, dict[int, list[str]]], None]) -> Any:
    """meshio.med.write, where another function writes the families."""
    import meshio

    return with_globals(meshio.med.write, _write_families=write_families, meshio_to_med_type=_med_types())


def _med_types() -> dict[str, str]:
    """MED's names of types of cells, those that meshio does not know, too."""
    known = import_module("meshio.med._med").meshio_to_med_type
    return {**known, "quad9": "QU9", "wedge18": "P18", "hexahedron27": "H27"}
