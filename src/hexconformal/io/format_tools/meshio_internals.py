"""The private parts of meshio that are relied on, all in one place; tests compare them with the installed meshio.

Some of its parsers and writers fail at something that one function, or table, of theirs does wrongly. They are run as
copies that find another one under its name: meshio itself is not changed, so that no other user of it is concerned.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, SimpleNamespace
from typing import Any

__all__ = ["REPLACED", "gmsh_reader", "med_reader", "med_writer", "with_globals"]

# By module and function of meshio: what is replaced among its global names, with its parameters (None: not called).
REPLACED: dict[tuple[str, str], dict[str, tuple[str, ...] | None]] = {
    ("meshio.gmsh.main", "read"): {"read_buffer": ("f",)},
    ("meshio.gmsh.main", "read_buffer"): {"_readers": None},
    ("meshio.gmsh._gmsh22", "read_buffer"): {"cell_data_from_raw": ("cells", "cell_data_raw")},
    ("meshio.med._med", "read"): {"_read_families": ("fas_data",)},
    ("meshio.med._med", "write"): {"_write_families": ("fm_group", "tags")},
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


def gmsh_reader(cell_data_from_raw: Callable[[Any, dict[str, Any]], dict[str, list[Any]]]) -> Any:
    """meshio.gmsh.read, where another function splits the cell data of version 2 among the blocks of cells."""
    import meshio

    names = meshio.gmsh.read.__globals__
    version_2 = with_globals(names["_readers"]["2.2"].read_buffer, cell_data_from_raw=cell_data_from_raw)
    readers = {**names["_readers"], **dict.fromkeys(["2", "2.2"], SimpleNamespace(read_buffer=version_2))}
    return with_globals(meshio.gmsh.read, read_buffer=with_globals(names["read_buffer"], _readers=readers))


def med_reader(read_families: Callable[[Any], dict[int, list[str]]]) -> Any:
    """meshio.med.read, where another function reads the families."""
    import meshio

    return with_globals(meshio.med.read, _read_families=read_families)


def med_writer(write_families: Callable[[Any, dict[int, list[str]]], None]) -> Any:
    """meshio.med.write, where another function writes the families."""
    import meshio

    return with_globals(meshio.med.write, _write_families=write_families)
