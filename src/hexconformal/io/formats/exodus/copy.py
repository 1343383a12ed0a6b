"""An Exodus file as it came, with other coordinates, and with arrays added to its variables."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...format_tools.meshio_files import require_disk_space
from ...source_file import SourceFile
from .netcdf import as_characters, component_names, joined_components, length_of, opened, texts
from .read import element_blocks

__all__ = ["put_points"]

_OWN = "gmsh:physical"


def put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]]:
    """The file with the points of a meshio.Mesh, and with those of its arrays that are new or were changed."""
    # On the disk: in a file that is made in memory, HDF5 forgets the order of the variables.
    with TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.e"
        require_disk_space(path, mesh, len(file.data))
        lost = _copy_with_points(file.data, path, mesh)
        return path.read_bytes(), lost


def _copy_with_points(content: bytes, path: Path, mesh: Any) -> list[str]:
    import netCDF4

    with opened(content) as old, netCDF4.Dataset(path, "w", format=old.data_model) as new:
        times = max(length_of(old, "time_step"), 1)
        nodal = _Variables(old, "nod", {name: [array] for name, array in mesh.point_data.items()})
        count = len(element_blocks(old))
        on_cells = {name: parts[:count] for name, parts in mesh.cell_data.items() if name != _OWN}
        on_elements = _Variables(old, "elem", on_cells)
        _copy(old, new, {**nodal.lengths(), **on_elements.lengths()})
        lost = _set_points(new, mesh.points)
        nodal.add(new, times)
        on_elements.add(new, times)
        if length_of(new, "time_step") == 0 and nodal.names + on_elements.names:
            new["time_whole"][:1] = 0.0
        return [*lost, *nodal.shortened, *on_elements.shortened]


class _Variables:
    """Those arrays of a mesh that are not in the file as they are, by the names of their components."""

    def __init__(self, old: Any, kind: str, arrays: dict[str, list[NDArray[Any]]]) -> None:
        self.kind, self.known = kind, texts(old, f"name_{kind}_var")
        self.blocks = element_blocks(old)
        self.columns: dict[str, list[NDArray[Any]]] = {}
        places = joined_components(self.known)
        for name, parts in arrays.items():
            own = [self.known[k] for k in places.get(name, ())]
            width = 1 if parts[0].ndim == 1 else int(np.prod(parts[0].shape[1:]))
            names = own if len(own) == width else component_names(name, width)
            flat = [np.asarray(part, dtype=np.float64).reshape(len(part), width) for part in parts]
            for column, component in enumerate(names):
                values = [part[:, column] for part in flat]
                if component not in self.known or not self._same(old, component, values):
                    self.columns[component] = values
        self.names = [name for name in self.columns if name not in self.known]
        self.shortened: list[str] = []

    def lengths(self) -> dict[str, int]:
        """The dimension of the variables, if there are more of them."""
        return {f"num_{self.kind}_var": len(self.known) + len(self.names)} if self.names else {}

    def add(self, new: Any, times: int) -> None:
        """Put the arrays into a file, new ones at each of its times, changed ones at the first."""
        if self.names:
            self._add_names(new)
        for name, parts in self.columns.items():
            number = [*self.known, *self.names].index(name) + 1
            for variable, dimension, values in self._variables(number, parts):
                if variable not in new.variables:
                    new.createVariable(variable, "f8", ("time_step", dimension))
                last = times if name in self.names else 1
                for time in range(last):
                    new[variable][time, :] = values

    def _add_names(self, new: Any) -> None:
        key, length = f"name_{self.kind}_var", "len_name" if "len_name" in new.dimensions else "len_string"
        if length not in new.dimensions:
            new.createDimension(length, 33)
        if f"num_{self.kind}_var" not in new.dimensions:
            new.createDimension(f"num_{self.kind}_var", len(self.names))
        if key not in new.variables:
            new.createVariable(key, "S1", (f"num_{self.kind}_var", length))
        new[key].set_auto_chartostring(False)
        width = new[key].shape[1]
        new[key][len(self.known) :] = as_characters(self.names, width)
        self.shortened = [f"the end of the name {name!r}" for name in self.names if len(name.encode()) >= width]
        if self.kind == "elem":
            if "elem_var_tab" not in new.variables:
                new.createVariable("elem_var_tab", "i4", ("num_el_blk", "num_elem_var"))
                new["elem_var_tab"][:] = 0
            if not self.known:
                new["elem_var_tab"][:] = 0
            new["elem_var_tab"][[k - 1 for k in self.blocks], len(self.known) :] = 1

    def _variables(self, number: int, parts: list[NDArray[Any]]) -> list[tuple[str, str, NDArray[Any]]]:
        """Names, and dimensions, of the netCDF variables that hold the parts of an array."""
        if self.kind == "nod":
            return [(f"vals_nod_var{number}", "num_nodes", parts[0])]
        pairs = zip(self.blocks, parts, strict=True)
        return [(f"vals_elem_var{number}eb{k}", f"num_el_in_blk{k}", part) for k, part in pairs]

    def _same(self, old: Any, name: str, parts: list[NDArray[Any]]) -> bool:
        # What the file does not have on some block is NaN there.
        variables = self._variables(self.known.index(name) + 1, parts)
        return all(
            np.array_equal(
                old[key][0] if key in old.variables else np.full(len(values), np.nan), values, equal_nan=True
            )
            for key, _, values in variables
        )


def _copy(old: Any, new: Any, lengths: dict[str, int]) -> None:
    """Copy dimensions, attributes and variables; some dimensions may be longer."""
    new.set_fill_off()
    new.setncatts({name: old.getncattr(name) for name in old.ncattrs()})
    for name, dimension in old.dimensions.items():
        new.createDimension(name, None if dimension.isunlimited() else lengths.get(name, len(dimension)))
    for name, variable in old.variables.items():
        options: dict[str, Any] = {}
        if old.data_model.startswith("NETCDF4"):
            chunks, filters = variable.chunking(), variable.filters() or {}
            longer = set(variable.dimensions) & set(lengths)
            options = {"endian": variable.endian(), "shuffle": filters.get("shuffle", False)}
            options |= {"fletcher32": filters.get("fletcher32", False)}
            if chunks == "contiguous":
                options["contiguous"] = True
            elif chunks and not longer:
                options["chunksizes"] = chunks
            if filters.get("zlib"):
                options |= {"compression": "zlib", "complevel": filters["complevel"]}
        attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
        fill = attributes.pop("_FillValue", None)
        made = new.createVariable(name, variable.dtype, variable.dimensions, fill_value=fill, **options)
        made.setncatts(attributes)
        made.set_auto_maskandscale(False)
        made.set_auto_chartostring(False)
        if variable.size:
            made[tuple(slice(0, length) for length in variable.shape)] = variable[...]


def _set_points(new: Any, points: NDArray[np.float64]) -> list[str]:
    if "coord" in new.variables:
        new["coord"][:] = points.T[: new["coord"].shape[0]]
        kinds = {new["coord"].dtype.str}
    else:
        axes = [axis for axis in "xyz" if f"coord{axis}" in new.variables]
        for axis, column in zip(axes, points.T, strict=False):
            new[f"coord{axis}"][:] = column
        kinds = {new[f"coord{axis}"].dtype.str for axis in axes}
    single = any(kind.endswith("f4") for kind in kinds)
    return ["digits of coordinates beyond the 32 bits that the file has for them"] if single else []
