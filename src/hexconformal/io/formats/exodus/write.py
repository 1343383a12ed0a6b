"""Exodus files of meshes that come from elsewhere: blocks by tag, side sets of tagged faces, sets, variables."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...format_tools.capabilities import Capabilities, supported_part
from ...format_tools.captured_output import captured_output
from ...format_tools.meshio_files import permuted_nodes
from ...format_tools.tags import cell_tags, element_numbers, is_told_by_tags
from .blocks import REGION, CellGroup, cell_groups, with_ids
from .elements import ELEMENT_NAMES, NODE_ORDERS
from .netcdf import as_characters, component_names
from .side_sets import SideTable

__all__ = ["CAPABILITIES", "write"]

Ints = NDArray[np.int64]
CAPABILITIES = Capabilities(
    cell_types="""vertex line line3 triangle triangle6 quad quad8 quad9 tetra tetra10 pyramid pyramid13 wedge wedge15
        hexahedron hexahedron20 hexahedron27""",
    point_arrays="all",
    cell_arrays="all",
    field_data=True,
    point_sets=True,
    cell_sets=True,
)


def write(target: Path, mesh: Any) -> list[str]:
    """Write a file; returns what could not be kept."""
    import netCDF4

    out, lost = supported_part(mesh, "exodus", CAPABILITIES)
    with captured_output():
        data = netCDF4.Dataset("memory", "w", format="NETCDF3_64BIT_OFFSET", memory=1024)
        data.set_fill_off()
        data.setncatts({"api_version": np.float32(5.1), "version": np.float32(5.1), "file_size": np.int32(1)})
        data.setncatts({"floating_point_word_size": np.int32(8), "title": "hexconformal"})
        writer = _Writer(data, out)
        writer.write_points()
        writer.write_blocks()
        writer.write_sets()
        writer.write_variables()
        writer.write_labels(mesh)
        content = bytes(data.close())
    target.write_bytes(content)
    return [*lost, *writer.lost]


class _Writer:
    """A netCDF file that is filled with a meshio.Mesh."""

    def __init__(self, data: Any, mesh: Any) -> None:
        self.data, self.mesh = data, mesh
        self.lost: list[str] = []
        self.tag_array, tags = cell_tags(mesh)
        groups = cell_groups(mesh, tags)
        self.sides = SideTable(mesh, groups)
        self.blocks = with_ids([group for group in groups if group not in self.sides.groups])
        self.first: dict[int, CellGroup] = {}
        for group in self.blocks:
            self.first.setdefault(group.region, group)
        renumbered = [group for group in self.first.values() if group.tag and group.id != group.tag]
        if renumbered:
            self.lost.append(f"the numbers of {len(renumbered)} groups of cells (numbered anew, to be different)")
        # Per meshio block the place of each cell among all elements; -1: it is not an element, but a side.
        self.places = [np.full(len(block.data), -1, dtype=np.int64) for block in mesh.cells]
        start = 0
        for group in self.blocks:
            for number, rows in group.rows.items():
                self.places[number][rows] = np.arange(start, start + len(rows))
                start += len(rows)
        names = [*mesh.field_data, *mesh.point_sets, *mesh.cell_sets, *mesh.point_data, *mesh.cell_data]
        # Room for the longest name, that of a component or with a type of elements, and a zero.
        self.width = max([33, *(len(str(name).encode("utf-8", "surrogateescape")) + 12 for name in names)])
        self.data.createDimension("len_string", 33)
        self.data.createDimension("len_name", self.width)
        self.data.createDimension("time_step", None)
        self._create("time_whole", "f8", ("time_step",))

    def write_points(self) -> None:
        points = np.pad(self.mesh.points, ((0, 0), (0, 3 - self.mesh.points.shape[1])))
        self.data.createDimension("num_dim", 3)
        self.data.createDimension("num_nodes", len(points))
        for axis, column in zip("xyz", points.T, strict=True):
            self._create(f"coord{axis}", "f8", ("num_nodes",), column)
        self._create("coor_names", "S1", ("num_dim", "len_name"), as_characters(["x", "y", "z"], self.width))

    def write_blocks(self) -> None:
        blocks = permuted_nodes(self.mesh.cells, NODE_ORDERS, inverse=True)
        self.data.createDimension("num_elem", sum(group.size for group in self.blocks))
        self._write_ids("eb", "num_el_blk", [(group.id, self._block_name(group)) for group in self.blocks])
        if len(self.first) < len(self.blocks):
            regions = [group.region for group in self.blocks]
            self._create("eb_prop2", "i4", ("num_el_blk",), regions).setncattr("name", REGION)
        for k, group in enumerate(self.blocks, 1):
            nodes = np.concatenate([blocks[number].data[rows] for number, rows in group.rows.items()])
            dimensions = (f"num_el_in_blk{k}", f"num_nod_per_el{k}")
            for name, length in zip(dimensions, nodes.shape, strict=True):
                self.data.createDimension(name, length)
            self._create(f"connect{k}", "i4", dimensions, nodes + 1).elem_type = ELEMENT_NAMES[group.kind]

    def _block_name(self, group: CellGroup) -> str:
        further = group.name and group is not self.first[group.region]
        return f"{group.name}_{ELEMENT_NAMES[group.kind]}" if further else group.name

    def write_sets(self) -> None:
        """Node sets; element sets and side sets, of tags and of named sets of cells."""
        sides = [(group.tag, group.name, *self.sides.of(group.rows, self.places)) for group in self.sides.tagged()]
        elements: list[tuple[int, str, Ints]] = []
        free = max([0, *(number for number, *_ in sides)])
        for name, parts in self.mesh.cell_sets.items():
            # Names of tags repeat as sets.
            if name.startswith("gmsh:") or is_told_by_tags(self.mesh, name):
                continue
            rows = {
                k: np.asarray(part, dtype=np.int64) for k, part in enumerate(parts) if part is not None and len(part)
            }
            at = np.concatenate([np.empty(0, np.int64), *(self.places[k][part] for k, part in rows.items())])
            if (at >= 0).any() or not len(at):
                elements.append((len(elements) + 1, name, np.sort(at[at >= 0])))
            faces = {k: part[self.places[k][part] < 0] for k, part in rows.items()}
            if (at < 0).any():
                free += 1
                sides.append((free, name, *self.sides.of(faces, self.places)))
        nodes = [(k, name, np.asarray(ids, np.int64)) for k, (name, ids) in enumerate(self.mesh.point_sets.items(), 1)]
        self._write_set("ns", "num_node_sets", "num_nod_ns", ["node_ns"], nodes)
        self._write_set("ss", "num_side_sets", "num_side_ss", ["elem_ss", "side_ss"], sides)
        self._write_set("els", "num_elem_sets", "num_ele_els", ["elem_els"], elements)

    def write_variables(self) -> None:
        """Arrays, at one time."""
        mesh = self.mesh
        nodal = _components(mesh.point_data)
        cell_data = {name: parts for name, parts in mesh.cell_data.items() if name != self.tag_array}
        self._tell_of_sides(cell_data)
        blocks = [
            _components({name: _of_group(parts, group) for name, parts in cell_data.items()}) for group in self.blocks
        ]
        elemental = list(blocks[0]) if blocks else []
        if nodal or elemental:
            self.data["time_whole"][:1] = 0.0
        self._write_names("nod", list(nodal))
        for k, column in enumerate(nodal.values(), 1):
            self._create(f"vals_nod_var{k}", "f8", ("time_step", "num_nodes"))[0] = column
        self._write_names("elem", elemental)
        if elemental:
            self._create("elem_var_tab", "i4", ("num_el_blk", "num_elem_var"), np.ones((len(blocks), len(elemental))))
        for k, name in enumerate(elemental, 1):
            for number, columns in enumerate(blocks, 1):
                self._create(f"vals_elem_var{k}eb{number}", "f8", ("time_step", f"num_el_in_blk{number}"))[0] = columns[
                    name
                ]

    def write_labels(self, mesh: Any) -> None:
        """The numbers that nodes and hexahedra had; other cells are numbered after them."""
        if mesh.node_labels is not None:
            self._create("node_num_map", "i4", ("num_nodes",), mesh.node_labels)
        numbers = np.zeros(sum(group.size for group in self.blocks), dtype=np.int64)
        for at, part in zip(self.places, element_numbers(mesh, self.mesh), strict=True):
            numbers[at[at >= 0]] = part[at >= 0]
        if (numbers != np.arange(1, len(numbers) + 1)).any():
            self._create("elem_num_map", "i4", ("num_elem",), numbers)

    def _create(self, name: str, kind: str, dimensions: tuple[str, ...], values: Any = None) -> Any:
        variable = self.data.createVariable(name, kind, dimensions)
        variable.set_auto_chartostring(False)
        if values is not None:
            variable[:] = values
        return variable

    def _write_ids(self, kind: str, dimension: str, groups: list[tuple[int, str]]) -> None:
        self.data.createDimension(dimension, len(groups))
        self._create(f"{kind}_prop1", "i4", (dimension,), [number for number, _ in groups]).setncattr("name", "ID")
        self._create(f"{kind}_status", "i4", (dimension,), np.ones(len(groups)))
        names = as_characters([name for _, name in groups], self.width)
        self._create(f"{kind}_names", "S1", (dimension, "len_name"), names)

    def _write_set(self, kind: str, count: str, size: str, variables: list[str], sets: list[Any]) -> None:
        if sets:
            self._write_ids(kind, count, [(number, name) for number, name, *_ in sets])
        for k, (_, _, *columns) in enumerate(sets, 1):
            if len(columns[0]):  # a dimension of length 0 would be the endless one
                self.data.createDimension(f"{size}{k}", len(columns[0]))
                for variable, column in zip(variables, columns, strict=True):
                    self._create(f"{variable}{k}", "i4", (f"{size}{k}",), column + 1)

    def _write_names(self, kind: str, names: list[str]) -> None:
        if names:
            self.data.createDimension(f"num_{kind}_var", len(names))
            table = as_characters(names, self.width)
            self._create(f"name_{kind}_var", "S1", (f"num_{kind}_var", "len_name"), table)

    def _tell_of_sides(self, cell_data: dict[str, Any]) -> None:
        for name, parts in cell_data.items():
            values = [np.asarray(part)[at < 0] for part, at in zip(parts, self.places, strict=True)]
            count = sum(len(part) for part in values if np.nan_to_num(part).any())
            if count:
                self.lost.append(f"cell array {name!r} on {count} faces (kept as side sets)")


def _of_group(parts: list[Any], group: CellGroup) -> Any:
    return np.concatenate([np.asarray(parts[number])[rows] for number, rows in group.rows.items()])


def _components(arrays: Any) -> dict[str, NDArray[np.float64]]:
    """Scalar variables of arrays, by name."""
    result = {}
    for name, array in arrays.items():
        table = np.asarray(array, dtype=np.float64)
        table = table.reshape(len(table), -1) if table.ndim > 1 else table[:, None]
        for axis, column in zip(component_names(name, table.shape[1]), table.T, strict=True):
            result[axis] = column
    return result
