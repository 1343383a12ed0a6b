"""A file of Gmsh as it came, with other coordinates of its nodes, and with further arrays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ....common import WriteError
from ...convert import to_meshio
from ...format_tools.rewriting import changed_arrays
from ...source_file import SourceFile
from .nodes import encode_nodes, read_nodes
from .periodic import parted_pairs
from .sections import Encoding, Section, file_encoding, file_sections
from .views import View, encode_view, view_name

__all__ = ["put_points"]

_COMPONENTS = (1, 3, 9)


def put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]] | None:
    """The file that a mesh came from with the points of the mesh, and what could not be kept, in words.

    Sections that say nothing of coordinates stay byte for byte. Arrays that were added, or changed, take the place
    of those of their name. Periodic pairs that no longer face each other are left out.

    Returns
    -------
    None if the tags of elements or nodes changed, which the file's entities are about.
    """
    data, arrays = file.data, changed_arrays(mesh)
    if any(name.startswith("gmsh:") for names in arrays for name in names):
        return None
    encoding, sections = file_encoding(data), file_sections(data)
    out, lost = to_meshio(mesh)
    bodies = {section.name: data[section.body_start : section.body_end] for section in sections}
    new: dict[int, bytes] = {}  # by number of section: what takes its place
    blocks, place = [], 0
    for block in read_nodes(bodies["Nodes"], encoding):
        points = out.points[place : place + len(block.tags)]
        place += len(points)
        if block.parameters.shape[1] and not np.array_equal(points, block.points):
            lost.append(f"the places of {len(points)} nodes on entity {block.entity} of dimension {block.dimension}")
            block = replace(block, parameters=np.empty((len(points), 0)))
        blocks.append(replace(block, points=points))
    if place != len(out.points):
        raise WriteError(f"the file has {place} nodes, the mesh {len(out.points)}")
    for number, section in enumerate(sections):
        if section.name == "Nodes":
            new[number] = b"$Nodes\n" + encode_nodes(blocks, encoding) + b"$EndNodes\n"
        elif section.name == "Periodic":
            parted = parted_pairs(out.gmsh_periodic or [], mesh.origin.source.points, out.points)
            if parted:
                new[number] = b""
                lost.append(f"the periodic section: {parted} pairs of nodes no longer face each other")
        elif section.name in ("NodeData", "ElementData"):
            here = arrays[section.name == "ElementData"]
            if view_name(data[section.body_start : section.body_end]) in here:
                new[number] = b""
    tags = file.node_labels, file.cell_labels
    # On all cells, whatever they are: some readers know no others.
    on_cells = {name: np.concatenate(out.cell_data[name]) for name in arrays[1]}
    views = _views((arrays[0], on_cells), tags, encoding, lost)
    return _joined(data, sections, new) + views, lost


def _views(arrays: Any, tags: Any, encoding: Encoding, lost: list[str]) -> bytes:
    """Sections of arrays on nodes and elements."""
    result = []
    for kind, section, here, about in zip(("point", "cell"), ("NodeData", "ElementData"), arrays, tags, strict=True):
        for name, array in here.items():
            values = np.asarray(array).reshape(len(array), -1)
            if values.dtype.kind not in "biuf" or values.shape[1] not in _COMPONENTS:
                lost.append(f"{kind} array {name!r}")
                continue
            if values.dtype.kind in "iu":
                lost.append(f"the integer type of {name} (kept as floating point)")
            view = View(name, about, values.astype(np.float64))
            result.append(encode_view(section, view, encoding))
    return b"".join(result)


def _joined(data: bytes, sections: list[Section], new: dict[int, bytes]) -> bytes:
    parts, place = [], 0
    for number, section in enumerate(sections):
        if number in new:
            parts += [data[place : section.start], new[number]]
            place = section.end
    tail = data[place:]
    return b"".join([*parts, tail, b"" if tail.endswith(b"\n") or not tail else b"\n"])
