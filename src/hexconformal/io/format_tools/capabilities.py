"""Capabilities of file formats: what one cannot hold is taken from a mesh, and listed, before it is written."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ...common import WriteError
from ..cell_types import NODE_COUNTS
from ..convert import to_meshio

__all__ = ["Capabilities", "drop_unsupported_data", "supported_part"]

Amount = Literal["none", "one", "all"]


@dataclass(frozen=True)
class Capabilities:
    """Kinds of cells and data that a format can hold.

    Attributes
    ----------
    cell_types
        Their meshio names, with spaces between them.
    point_arrays, cell_arrays
        How many: "one" is one with integers.
    array_name
        What the one array is called when it is read again.
    own_arrays
        Names of arrays that have a place of their own.
    components
        How many components an array may have; None: any number.
    field_data, point_sets, cell_sets
        Whether it has them.
    """

    cell_types: str
    point_arrays: Amount = "none"
    cell_arrays: Amount = "none"
    array_name: str = ""
    own_arrays: tuple[str, ...] = ()
    components: tuple[int, ...] | None = None
    field_data: bool = False
    point_sets: bool = False
    cell_sets: bool = False


def supported_part(mesh: Any, name: str, can: Capabilities) -> tuple[Any, list[str]]:
    """The part of a mesh that a format can hold, as a new meshio.Mesh, and what it cannot hold, in words.

    Raises
    ------
    WriteError
        If there are three-dimensional cells that the format does not have.
    """
    out, lost = to_meshio(mesh)
    if out.gmsh_periodic is not None and name != "gmsh":
        lost.append("periodic nodes")
    return out, [*lost, *_drop_unsupported_cells(out, name, can), *drop_unsupported_data(out, can)]


def _drop_unsupported_cells(out: Any, name: str, can: Capabilities) -> list[str]:
    known = can.cell_types.split()
    kept = [number for number, block in enumerate(out.cells) if block.type in known]
    dropped = [block for block in out.cells if block.type not in known]
    solid = [block for block in dropped if block.dim == 3]
    if solid:
        raise WriteError(f"{name} files have no {solid[0].type} cells")
    for arrays in (out.cell_data, out.cell_sets):
        for key, parts in arrays.items():
            arrays[key] = [parts[number] for number in kept]
    out.cells = [out.cells[number] for number in kept]
    for block in out.cells:
        if block.data.shape[1] != NODE_COUNTS.get(block.type, block.data.shape[1]):
            raise WriteError(f"{block.type} cells must have {NODE_COUNTS[block.type]} nodes, not {block.data.shape[1]}")
    return [f"{len(block.data)} {block.type} cells" for block in dropped]


def drop_unsupported_data(out: Any, can: Capabilities) -> list[str]:
    """Take the arrays that a format cannot hold from a meshio.Mesh, and list them, and the sets it cannot hold."""
    lost = []
    for kind, data, amount in (("point", out.point_data, can.point_arrays), ("cell", out.cell_data, can.cell_arrays)):
        for key in list(data):
            if key in can.own_arrays:
                continue
            parts = [_supported_array(array, can) for array in (data[key] if kind == "cell" else [data[key]])]
            if amount == "none" or any(part is None for part in parts):
                del data[key]
                lost.append(f"{kind} array {key!r}")
            else:
                data[key] = parts if kind == "cell" else parts[0]
        if amount == "one":
            integers = [key for key, value in data.items() if np.asarray(value[0]).dtype.kind in "iu"]
            chosen = can.array_name if can.array_name in integers else next(iter(integers), None)
            lost += [f"{kind} array {key!r}" for key in data if key != chosen]
            if chosen not in (None, can.array_name):
                lost.append(f"the name of the {kind} array {chosen!r} (kept as {can.array_name})")
            for key in set(data) - {chosen}:
                del data[key]
    for has, what, values in (
        (can.field_data, "field data", out.field_data),
        (can.point_sets, "point set", out.point_sets),
        (can.cell_sets, "cell set", out.cell_sets),
    ):
        if not has:
            lost += [f"{what} {key!r}" for key in values if not str(key).startswith(("gmsh:", "med:"))]
    return lost


def _supported_array(array: Any, can: Capabilities) -> Any:
    """The array in a type and shape that can be written, or None."""
    array = np.asarray(array)
    if array.dtype.kind == "b":
        array = array.astype(np.int32)
    if array.ndim > 2:
        array = array.reshape(len(array), -1)
    if array.dtype.kind not in "iuf":
        return None
    return None if can.components and array.ndim == 2 and array.shape[1] not in can.components else array
