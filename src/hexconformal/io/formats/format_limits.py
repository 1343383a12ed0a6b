"""What meshio's formats cannot hold: taken from a mesh before it is written, and told."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from ...common import WriteError

__all__ = ["GMSH_TAGS", "drop_unknown_cells", "drop_what_is_not_kept"]

GMSH_TAGS = ("gmsh:physical", "gmsh:geometrical", "gmsh:dim_tags")

# What each of meshio's formats keeps: number of point arrays and cell arrays, field data, point sets, cell sets.
_KEEPS = {
    "gmsh": ("all", "all", True, False, False),
    "abaqus": ("none", "none", False, True, True),
    "medit": ("one", "one", False, False, False),
    "exodus": ("all", "none", False, True, False),
    "med": ("all", "all", False, False, False),
    "xdmf": ("all", "all", False, False, False),
    "nastran": ("none", "none", False, False, False),
}
# Where meshio lists the types of cells a format has.
_CELL_TYPES = {
    "gmsh": "meshio.gmsh.common:_meshio_to_gmsh_type",
    "abaqus": "meshio.abaqus._abaqus:meshio_to_abaqus_type",
    "exodus": "meshio.exodus._exodus:meshio_to_exodus_type",
    "med": "meshio.med._med:meshio_to_med_type",
    "xdmf": "meshio.xdmf.common:meshio_to_xdmf_type",
    "nastran": "meshio.nastran._nastran:meshio_to_nastran_type",
}
_MEDIT_TYPES = ("line", "triangle", "quad", "tetra", "wedge", "pyramid", "hexahedron")
_LABELS = {"medit": "medit:ref"}


def drop_unknown_cells(out: Any, name: str) -> list[str]:
    """Take lower-dimensional cells a format has no type for from a meshio.Mesh, and say so."""
    module, _, table = _CELL_TYPES.get(name, "").partition(":")
    known = getattr(importlib.import_module(module), table) if module else _MEDIT_TYPES
    kept = [number for number, block in enumerate(out.cells) if block.type in known]
    unknown = [block for block in out.cells if block.type not in known]
    solid = [block for block in unknown if block.dim == 3]
    if solid:
        raise WriteError(f"{name} files have no {solid[0].type} cells")
    for arrays in (out.cell_data, out.cell_sets):
        for key, parts in arrays.items():
            arrays[key] = [parts[number] for number in kept]
    out.cells = [out.cells[number] for number in kept]
    return [f"{len(block.data)} {block.type} cells" for block in unknown]


def drop_what_is_not_kept(out: Any, name: str) -> list[str]:
    """Take from a meshio.Mesh what the format cannot hold, and say so."""
    point_arrays, cell_arrays, fields, point_sets, cell_sets = _KEEPS[name]
    lost = []
    for kind, data, keeps in (("point", out.point_data, point_arrays), ("cell", out.cell_data, cell_arrays)):
        for key in list(data):
            if name == "gmsh" and key in GMSH_TAGS:
                continue
            parts = [_plain(array, name) for array in (data[key] if kind == "cell" else [data[key]])]
            if keeps == "none" or any(part is None for part in parts):
                del data[key]
                lost.append(f"{kind} array {key!r}")
            else:
                data[key] = parts if kind == "cell" else parts[0]
        if keeps == "one":
            whole = [key for key, value in data.items() if np.asarray(value[0]).dtype.kind in "iu"]
            label = _LABELS[name] if _LABELS[name] in whole else next(iter(whole), None)
            lost += [f"{kind} array {key!r}" for key in data if key != label]
            if label not in (None, _LABELS[name]):
                lost.append(f"the name of the {kind} array {label!r} (kept as {_LABELS[name]})")
            for key in set(data) - {label}:
                del data[key]
    for kept, what, values in (
        (fields, "field data", out.field_data),
        (point_sets, "point set", out.point_sets),
        (cell_sets, "cell set", out.cell_sets),
    ):
        if not kept:
            lost += [f"{what} {key!r}" for key in values if not str(key).startswith(("gmsh:", "med:"))]
    if name == "gmsh":
        # Names of physical groups repeat as cell sets, which their tags already tell.
        lost = [text for text in lost if text not in {f"cell set {key!r}" for key in out.field_data}]
    return lost


def _plain(array: Any, name: str) -> Any:
    """The array in a type and shape the format knows, or None."""
    array = np.asarray(array)
    if array.dtype.kind == "b":
        array = array.astype(np.int32)
    if array.ndim > 2:
        array = array.reshape(len(array), -1)
    if array.dtype.kind not in "iuf":
        return None
    return None if name == "gmsh" and array.ndim == 2 and array.shape[1] not in (1, 3, 9) else array
