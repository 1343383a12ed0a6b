"""Exodus files into a meshio.Mesh: blocks and side sets as tagged cells with names, the arrays of the first time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError, first_ids
from ...format_tools.meshio_files import checked_contents, parsing, permuted_nodes
from ...format_tools.meshio_internals import cell_block
from ...source_file import FileContents, SourceFile
from .blocks import REGION
from .elements import NODE_ORDERS, SIDES, cell_type, side_nodes
from .netcdf import ids_of, joined_components, length_of, names_of, opened, property_of, texts

__all__ = ["element_blocks", "read"]

Ints = NDArray[np.int64]


def read(path: Path) -> FileContents:
    """Read a file."""
    with parsing("exodus") as output:
        content = path.read_bytes()
        with opened(content) as data:
            reader = _Reader(data)
            mesh = reader.mesh()
            labels = _labels(data, "node", length_of(data, "num_nodes"))
            model = _model(data)
            cell_labels = _labels(data, "elem", reader.element_count)
    sides = sum(len(block.data) for block in mesh.cells) - len(cell_labels)
    cell_labels = np.append(cell_labels, np.zeros(sides, dtype=np.int64))
    file = SourceFile(path, "exodus", data=content, node_labels=labels, cell_labels=cell_labels, model=model)
    contents = checked_contents(mesh, file, output)
    return FileContents(contents.data, file, tuple(reader.notes))


def element_blocks(data: Any) -> list[int]:
    """Numbers, from 1, of the blocks that have elements."""
    return [k for k in range(1, length_of(data, "num_el_blk") + 1) if f"connect{k}" in data.variables]


class _Reader:
    """The parts of a file, put together to a mesh."""

    def __init__(self, data: Any) -> None:
        self.data = data
        self.notes: list[str] = []
        self.blocks: list[tuple[str, Ints]] = []
        self.tags: list[Ints] = []
        self.groups: dict[str, Any] = {}
        self.cell_sets: dict[str, dict[int, Ints]] = {}
        self._read_blocks()
        self.element_count = self.starts[-1]

    def mesh(self) -> Any:
        """The whole mesh."""
        import meshio

        self._read_sets()
        cells = permuted_nodes([cell_block(kind, nodes) for kind, nodes in self.blocks], NODE_ORDERS)
        self.blocks = [(block.type, block.data) for block in cells]
        self._read_side_sets()
        empty = np.empty(0, dtype=np.int64)
        return meshio.Mesh(
            self._points(),
            [cell_block(kind, nodes) for kind, nodes in self.blocks],
            point_data=self._point_data(),
            cell_data={"gmsh:physical": self.tags, **self._cell_data()},
            field_data=self.groups,
            point_sets=self._node_sets(),
            cell_sets={
                name: [parts.get(number, empty) for number in range(len(self.blocks))]
                for name, parts in self.cell_sets.items()
            },
        )

    def _read_blocks(self) -> None:
        data, count = self.data, length_of(self.data, "num_el_blk")
        ids = ids_of(data, "eb", count)
        names = names_of(data, "eb", ids, "block")
        regions, first = property_of(data, "eb", REGION, count), dict[int, str]()
        self.starts = [0]
        for k in element_blocks(data):
            connect = data[f"connect{k}"]
            given = getattr(connect, "elem_type", "")
            nodes = np.asarray(connect[:])
            if nodes.ndim != 2:
                raise ReadError(f"the block {names[k - 1]!r} has no table of elements, as polygons and polyhedra")
            kind, taken = cell_type(given if isinstance(given, str) else "", nodes.shape[1])
            if taken < nodes.shape[1]:
                self.notes.append(
                    f"{len(nodes)} elements of type {given} are taken by their corners; they stay in the file"
                )
            self.blocks.append((kind, nodes[:, :taken].astype(np.int64) - 1))
            name = first.setdefault(regions[k - 1], names[k - 1]) if regions[k - 1] else names[k - 1]
            self._tag(name, ids[k - 1], len(nodes), cell_block(kind, self.blocks[-1][1]).dim)
            self.starts.append(self.starts[-1] + len(nodes))

    def _tag(self, name: str, number: int, count: int, dimension: int) -> None:
        """Note the tag, and the name, of the cells of the last block."""
        taken = {tuple(np.asarray(value).tolist()) for value in self.groups.values()}
        while (number, dimension) in taken and name not in self.groups:
            number += 1
        if name in self.groups:
            number = int(self.groups[name][0])
        self.groups[name] = np.array([number, dimension])
        block = len(self.tags)
        self.tags.append(np.full(count, number, dtype=np.int64))
        self.cell_sets.setdefault(name, {})[block] = np.arange(count)

    def _read_side_sets(self) -> None:
        data, count = self.data, length_of(self.data, "num_side_sets")
        ids = ids_of(data, "ss", count)
        solid_blocks = len(self.starts) - 1
        for k, (number, name) in enumerate(zip(ids, names_of(data, "ss", ids, "surface"), strict=True), 1):
            if f"elem_ss{k}" not in data.variables:
                continue
            elements = self._elements(f"elem_ss{k}", name)
            sides = np.asarray(data[f"side_ss{k}"][:]).astype(np.int64) - 1
            block = np.searchsorted(self.starts, elements, side="right") - 1
            faces: dict[str, list[Ints]] = {}
            edges = 0
            for b in range(solid_blocks):
                kind, nodes = self.blocks[b]
                for side in np.unique(sides[block == b]).tolist():
                    rows = elements[(block == b) & (sides == side)] - self.starts[b]
                    if not 0 <= side < len(SIDES.get(kind, ())):
                        edges += len(rows)
                        continue
                    face, places = side_nodes(kind, side)
                    faces.setdefault(face, []).append(nodes[rows][:, places])
            if edges:
                self.notes.append(f"{edges} sides of {name!r} are edges of shells or lines; they stay in the file")
            free = name if name not in self.groups else f"{name}_{number}"
            for face, parts in faces.items():
                self.blocks.append((face, np.concatenate(parts)))
                self._tag(free, number, len(self.blocks[-1][1]), 2)

    def _elements(self, variable: str, name: str) -> Ints:
        """Places, among all elements, of those that a set lists."""
        elements = np.asarray(self.data[variable][:]).astype(np.int64) - 1
        bad = elements[(elements < 0) | (elements >= self.element_count)]
        if len(bad):
            raise ReadError(f"the set {name!r} has elements that are not there: {first_ids(bad + 1)}")
        return elements

    def _read_sets(self) -> None:
        """Sets of elements."""
        count = length_of(self.data, "num_elem_sets")
        ids = ids_of(self.data, "els", count)
        for k, name in enumerate(names_of(self.data, "els", ids, "elementlist"), 1):
            if f"elem_els{k}" in self.data.variables and name not in self.cell_sets:
                elements = np.unique(self._elements(f"elem_els{k}", name))
                block = np.searchsorted(self.starts, elements, side="right") - 1
                self.cell_sets[name] = {int(b): elements[block == b] - self.starts[b] for b in np.unique(block)}

    def _node_sets(self) -> dict[str, Ints]:
        data, count = self.data, length_of(self.data, "num_node_sets")
        ids = ids_of(data, "ns", count)
        names = names_of(data, "ns", ids, "nodelist")
        sets = {name: data.variables.get(f"node_ns{k}") for k, name in enumerate(names, 1)}
        result = {name: np.asarray(nodes[:]).astype(np.int64) - 1 for name, nodes in sets.items() if nodes is not None}
        for name, nodes in result.items():
            bad = nodes[(nodes < 0) | (nodes >= length_of(data, "num_nodes"))]
            if len(bad):
                raise ReadError(f"the set {name!r} has nodes that are not there: {first_ids(bad + 1)}")
        return result

    def _points(self) -> NDArray[np.float64]:
        data = self.data
        if "coord" in data.variables:
            columns = np.asarray(data["coord"][:]).astype(np.float64)
        else:
            axes = [axis for axis in "xyz" if f"coord{axis}" in data.variables]
            columns = np.array([np.asarray(data[f"coord{axis}"][:]) for axis in axes], dtype=np.float64)
        return np.ascontiguousarray(np.pad(columns, ((0, 3 - len(columns)), (0, 0))).T)

    def _point_data(self) -> dict[str, Any]:
        data, names = self.data, texts(self.data, "name_nod_var")
        times = length_of(data, "time_step")
        if times > 1 and any(name.startswith(("vals_nod_var", "vals_elem_var")) for name in data.variables):
            self.notes.append(f"the first of {times} times is taken; the others stay in the file")
        columns = []
        for k in range(1, len(names) + 1):
            variable = data.variables.get(f"vals_nod_var{k}")
            if variable is not None and times:
                columns.append(np.asarray(variable[0]))
            elif "vals_nod_var" in data.variables and times:  # as old files have it, in one table
                columns.append(np.asarray(data["vals_nod_var"][0, k - 1]))
            else:
                return {}
        return {name: _stacked([columns[k] for k in places]) for name, places in joined_components(names).items()}

    def _cell_data(self) -> dict[str, list[Any]]:
        data, names = self.data, texts(self.data, "name_elem_var")
        if not length_of(data, "time_step"):
            return {}
        result = {}
        numbers = element_blocks(data)
        for name, places in joined_components(names).items():
            parts = []
            for block, (_, nodes) in enumerate(self.blocks):
                number = numbers[block] if block < len(numbers) else 0
                variables = [data.variables.get(f"vals_elem_var{k + 1}eb{number}") for k in places]
                missing = np.full(len(nodes), np.nan)
                parts.append(_stacked([missing if one is None else np.asarray(one[0]) for one in variables]))
            result[name] = parts
        return result


def _stacked(columns: list[Any]) -> Any:
    return columns[0] if len(columns) == 1 else np.stack(columns, axis=1)


def _labels(data: Any, kind: str, count: int) -> Ints:
    """The numbers that a file gives to nodes or elements: from 1, where there is no map."""
    name = f"{kind}_num_map"
    if name in data.variables and data[name].shape == (count,):
        return np.asarray(data[name][:]).astype(np.int64)
    return np.arange(1, count + 1)


def _model(data: Any) -> tuple[str, ...]:
    """What no other format has, by number and name."""
    counts = {
        "later times": length_of(data, "time_step") - 1,
        "global variables": length_of(data, "num_glo_var"),
        "QA records": length_of(data, "num_qa_rec") * ("qa_records" in data.variables),
        "lines of information": length_of(data, "num_info") * ("info_records" in data.variables),
        "tables of attributes": sum(name.startswith("attrib") for name in data.variables),
        "tables of distribution factors": sum(name.startswith("dist_fact") for name in data.variables),
    }
    return tuple(f"{count} {what}" for what, count in counts.items() if count > 0)
