"""MED of Salome (.med): solid cells are mirrored there, and families name groups."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from ..convert import to_meshio
from ..format_tools.capabilities import Capabilities, supported_part
from ..format_tools.captured_output import captured_output
from ..format_tools.format import Format
from ..format_tools.meshio_files import checked_contents, join_blocks, parsing, permuted_nodes, require_disk_space
from ..format_tools.meshio_internals import cell_block, med_reader, med_writer
from ..format_tools.rewriting import changed_arrays
from ..source_file import FileContents, SourceFile

__all__ = ["MED"]

_CAPABILITIES = Capabilities(
    cell_types="""vertex line line3 triangle triangle6 quad quad8 quad9 tetra tetra10 pyramid pyramid13 wedge wedge15
        wedge18 hexahedron hexahedron20 hexahedron27""",
    point_arrays="all",
    cell_arrays="all",
)
_MODEL = ("names, units and times",)
_NO_STEP, _NO_PROFILE, _REALS = "-0000000000000000001-0000000000000000001", "MED_NO_PROFILE_INTERNAL", 6
_LONGEST_NAME = 64  # bytes
# What new arrays are on: names of types of cells, and the bits of these.
_SOLIDS = {
    "tetra": ("MAI.TE4", 1 << 10),
    "pyramid": ("MAI.PY5", 1 << 11),
    "wedge": ("MAI.PE6", 1 << 12),
    "hexahedron": ("MAI.HE8", 1 << 13),
    "tetra10": ("MAI.T10", 1 << 14),
    "pyramid13": ("MAI.P13", 1 << 16),
    "wedge15": ("MAI.P15", 1 << 17),
    "wedge18": ("MAI.P18", 1 << 18),
    "hexahedron20": ("MAI.H20", 1 << 19),
    "hexahedron27": ("MAI.H27", 1 << 20),
}
_TYPE_BITS = dict(_SOLIDS.values())
_HEX20 = [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17]
# Where the format has the nodes that VTK names in turn: it goes round the bottom, and the top, the other way.
_NODE_ORDERS = {
    "tetra": [0, 2, 1, 3],
    "tetra10": [0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
    "pyramid": [0, 3, 2, 1, 4],
    "wedge": [0, 2, 1, 3, 5, 4],
    "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5],
    "hexahedron20": _HEX20,
    "hexahedron27": [*_HEX20, 21, 23, 24, 22, 20, 25, 26],
    "pyramid13": [0, 3, 2, 1, 4, 8, 7, 6, 5, 9, 12, 11, 10],
    "wedge15": [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13],
    "wedge18": [0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13, 17, 16, 15],
}


def _read(path: Path) -> FileContents:
    with parsing("med") as output:
        mesh = med_reader(_read_families, _mesh_of_whole_fields)(str(path))
        mesh.cells = permuted_nodes(mesh.cells, _NODE_ORDERS)
    return checked_contents(mesh, SourceFile(path, "med", data=path.read_bytes(), model=_MODEL), output)


def _put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]] | None:
    """The file with other coordinates and new fields: names, units, times, groups and other fields stay.

    None if arrays changed that cannot be put into it.
    """
    import h5py

    of_points, of_cells = changed_arrays(mesh)
    copy = io.BytesIO(file.data)
    with h5py.File(copy, "r+") as data:
        (whole,) = data["ENS_MAA"].values()
        step = whole if "NOE" in whole else next(iter(whole.values()))
        # MED looks groups up by the order in which they were made.
        fields = data["CHA"] if "CHA" in data else data.create_group("CHA", track_order=True)
        if not all(_can_be_put(fields, *item) for item in (*of_points.items(), *of_cells.items())):
            return None
        out = to_meshio(mesh)[0]
        coordinates = step["NOE"]["COO"]
        coordinates[...] = out.points[:, : coordinates.size // len(out.points)].ravel(order="F")
        for name, array in of_points.items():
            _put_field(fields, whole.name.rpartition("/")[2], name, [("NOE", array)])
        for name in of_cells:
            pairs = zip(out.cells, out.cell_data[name], strict=True)
            parts = [(_SOLIDS[block.type][0], array) for block, array in pairs if block.type in _SOLIDS]
            _put_field(fields, whole.name.rpartition("/")[2], name, parts)
    return copy.getvalue(), []


def _can_be_put(fields: Any, name: str, array: Any) -> bool:
    """Whether an array may become a field: of reals, and there is none of its name, or one without times and units."""
    fits = array.dtype.kind == "f" and array.ndim <= 2 and len(name.encode()) <= _LONGEST_NAME and "/" not in name
    if not fits or name not in fields:
        return bool(fits)
    steps = list(fields[name].values())
    return len(steps) == 1 and steps[0].attrs.get("PDT", 0.0) <= 0.0 and not fields[name].attrs.get("UNI", b"").strip()


def _put_field(fields: Any, mesh_name: str, name: str, parts: list[tuple[str, Any]]) -> None:
    """Write a field without a time, with its values on each support, in the place of one that is there."""
    if name in fields:
        del fields[name]
    field = fields.create_group(name, track_order=True)
    width = 1 if parts[0][1].ndim == 1 else parts[0][1].shape[1]
    texts = {"MAI": mesh_name, "NOM": " " * 16 * width, "UNI": " " * 16 * width, "UNT": ""}
    for key, text in texts.items():
        field.attrs.create(key, np.bytes_(text.encode()))
    field.attrs.update({"NCO": width, "TYP": _REALS})
    step = field.create_group(_NO_STEP, track_order=True)
    step.attrs.update({"NDT": -1, "NOR": -1, "PDT": 0.0, "RDT": -1, "ROR": -1})
    # From 4.1 on MED looks up here what there are values on: kinds of entities, types, whether at all times the same.
    on_nodes = parts[0][0] == "NOE"
    field.attrs.update(dict.fromkeys(("LAA", "LNA" if on_nodes else "LCA"), 1))
    for group in (field, step):
        _put_bits(group, "LEN", 1 << (3 if on_nodes else 0))
        _put_bits(group, "LGN" if on_nodes else "LGC", 1 if on_nodes else sum(_TYPE_BITS[key] for key, _ in parts))
    for support, array in parts:
        where = step.create_group(support, track_order=True)
        where.attrs.create("GAU", np.bytes_(b""))
        where.attrs.create("PFL", np.bytes_(_NO_PROFILE))
        values = where.create_group(_NO_PROFILE)
        values.attrs.create("GAU", np.bytes_(b""))
        values.attrs.update({"NBR": len(array), "NGA": 1})
        values.create_dataset("CO", data=np.asarray(array, np.float64).ravel(order="F"))


def _put_bits(group: Any, name: str, bits: int) -> None:
    """Give a group an attribute of bits, which MED does not take integers for."""
    import h5py

    kind = h5py.h5t.STD_B32LE
    attribute = h5py.h5a.create(group.id, name.encode(), kind, h5py.h5s.create(h5py.h5s.SCALAR))
    attribute.write(np.array(bits, dtype=np.uint32), mtype=kind)


def _write(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "med", _CAPABILITIES)
    out = join_blocks(out)
    if len(out.field_data.get("med:nom", ())) != len({*out.point_data, *out.cell_data} - {"point_tags", "cell_tags"}):
        # Names of components are given by position, which holds only as long as no array is added.
        out.field_data.pop("med:nom", None)
    out.cells = permuted_nodes(out.cells, _NODE_ORDERS, inverse=True)
    require_disk_space(target, out)
    with captured_output():
        med_writer(_write_families)(target, out)
    return lost


def _mesh_of_whole_fields(points: Any, cells: Any, **options: Any) -> Any:
    """meshio.Mesh, with NaN where a field is on some types of cells only."""
    import meshio

    for parts in options["cell_data"].values():
        shape = next(np.shape(part)[1:] for part in parts if part is not None)
        missing = [number for number, part in enumerate(parts) if part is None]
        for number in missing:
            parts[number] = np.full((len(cells[number][1]), *shape), np.nan)
    return meshio.Mesh(points, [cell_block(*block) for block in cells], **options)


def _read_families(group: Any) -> dict[int, list[str]]:
    """Names of the groups of each family; meshio's own stops at one that is in none, as Gmsh writes them."""
    named = {family.attrs["NUM"]: family["GRO"]["NOM"][()] if "GRO" in family else () for family in group.values()}
    return {
        number: [bytes(name.astype(np.uint8)).decode("utf-8", "surrogateescape").strip("\0 ") for name in names]
        for number, names in named.items()
    }


def _write_families(group: Any, families: dict[int, list[str]]) -> None:
    """Write them; meshio's own spoils letters with accents."""
    for number, names in families.items():
        title = "_".join(["FAM", str(number), *names])
        family = group.create_group(title.encode("utf-8", "replace").decode())
        family.attrs.create("NUM", number)
        groups = family.create_group("GRO")
        groups.attrs.create("NBR", len(names))
        data = groups.create_dataset("NOM", (len(names),), dtype="80int8")
        for row, name in enumerate(names):
            data[row] = np.frombuffer(name.encode("utf-8", "surrogateescape")[:80].ljust(80, b"\0"), dtype=np.int8)


MED = Format("med", _read, _write, _CAPABILITIES, put_points=_put_points)
