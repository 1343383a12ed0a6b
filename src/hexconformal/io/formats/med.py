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
from ..format_tools.meshio_internals import med_reader, med_writer
from ..format_tools.rewriting import changed_arrays
from ..source_file import FileContents, SourceFile

__all__ = ["MED"]

_CAPABILITIES = Capabilities(
    cell_types="vertex line line3 triangle triangle6 quad quad8 tetra tetra10 pyramid wedge hexahedron hexahedron20",
    point_arrays="all",
    cell_arrays="all",
)
_MODEL = ("names, units and times",)
# Where the format has the nodes that VTK names in turn: it goes round the bottom, and the top, the other way.
_NODE_ORDERS = {
    "tetra": [0, 2, 1, 3],
    "tetra10": [0, 2, 1, 3, 6, 5, 4, 7, 9, 8],
    "pyramid": [0, 3, 2, 1, 4],
    "wedge": [0, 2, 1, 3, 5, 4],
    "hexahedron": [0, 3, 2, 1, 4, 7, 6, 5],
    "hexahedron20": [0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17],
}


def _read(path: Path) -> FileContents:
    with parsing("med") as output:
        mesh = med_reader(_read_families, _mesh_of_whole_fields)(str(path))
        mesh.cells = permuted_nodes(mesh.cells, _NODE_ORDERS)
    return checked_contents(mesh, SourceFile(path, "med", data=path.read_bytes(), model=_MODEL), output)


def _put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]] | None:
    """The file with other coordinates: names, units, times, groups and fields stay; None if arrays changed."""
    if any(changed_arrays(mesh)):
        return None
    import h5py

    copy = io.BytesIO(file.data)
    with h5py.File(copy, "r+") as data:
        (whole,) = data["ENS_MAA"].values()
        step = whole if "NOE" in whole else next(iter(whole.values()))
        coordinates = step["NOE"]["COO"]
        points = to_meshio(mesh)[0].points
        coordinates[...] = points[:, : coordinates.size // len(points)].ravel(order="F").astype(coordinates.dtype)
    return copy.getvalue(), []


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
    return meshio.Mesh(points, cells, **options)


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


MED = Format("med", (".med",), _read, _write, _CAPABILITIES, put_points=_put_points)
