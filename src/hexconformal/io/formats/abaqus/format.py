"""The format of decks: reads them, writes new coordinates into them, or a mesh from elsewhere as one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ....common import ReadError, first_names
from ...format_tools.capabilities import Capabilities, supported_part
from ...format_tools.format import Format
from ...format_tools.meshio_files import checked_contents, file_head, parsing
from ...format_tools.rewriting import through_meshio
from ...format_tools.tags import TAG_ARRAYS, cell_tags, tag_names
from ...meshio_mesh import MeshioOrigin
from ...source_file import FileContents, SourceFile
from .deck import Deck
from .includes import files_of_deck, with_included_files
from .mesh import mesh_of
from .read_deck import read_deck
from .rewrite import rewritten
from .statements import ELEMENT_NAMES, split_lines
from .write import write_deck

__all__ = ["ABAQUS"]

_CAPABILITIES = Capabilities(cell_types=" ".join(ELEMENT_NAMES), point_sets=True, cell_sets=True)
_NAMED = 20  # kinds of statements that are listed


def _read(path: Path) -> FileContents:
    with parsing("abaqus") as output:
        if _is_avs_ucd(file_head(path)):
            raise ReadError("this is an AVS UCD file: give it the extension .avs")
        text, notes = with_included_files(path)
        deck = read_deck(split_lines(text))
        found = mesh_of(deck, len(text))
    file = SourceFile(
        path,
        "abaqus",
        text=text,
        node_labels=found.node_labels,
        cell_labels=found.cell_labels,
        type_names=found.type_names,
        face_sets=found.face_sets,
        sections=found.sections,
        model=_model(deck),
        coupled_pairs=found.coupled_pairs,
    )
    contents = checked_contents(found.mesh, file, output)
    return replace(contents, notes=(*notes, *_notes(deck)), held=found.held)


def _is_avs_ucd(head: bytes) -> bool:
    """Whether the first line that is no comment holds five whole numbers."""
    for line in head.splitlines():
        if line.strip() and not line.startswith(b"#"):
            fields = line.split()
            return len(fields) == 5 and all(field.isdigit() for field in fields)
    return False


def _notes(deck: Deck) -> list[str]:
    notes = [
        f"{count} elements of type {first_names([name])} are set aside, and their nodes stay where they are: a deck "
        "with the same cells keeps them"
        for name, count in deck.set_aside.items()
    ]
    if deck.instances:
        used = {id(instance.part) for instance in deck.instances}
        unused = [part.name for part in deck.parts.values() if id(part) not in used and part.nodes]
        if unused:
            notes.append(f"parts without an instance stay in the deck as they are: {first_names(unused)}")
    return notes


def _model(deck: Deck) -> tuple[str, ...]:
    """What other formats do not keep, by name and count."""
    listed = [f"{count} elements of type {first_names([name])}" for name, count in deck.set_aside.items()]
    listed += [f"{count} *{first_names([title])}" for title, count in deck.keywords.items()]
    more = [f"{len(listed) - _NAMED} other kinds of statements"] if len(listed) > _NAMED else []
    return (*listed[:_NAMED], *more)


def _write(target: Path, mesh: Any) -> list[str]:
    out, lost = supported_part(mesh, "abaqus", replace(_CAPABILITIES, own_arrays=TAG_ARRAYS))
    lost = _tags_as_sets(out, lost)
    file = getattr(mesh.origin, "file", None)
    node_labels = None if file is None else file.node_labels
    # Other sources have their cells in another order than a meshio.Mesh.
    own = file if isinstance(mesh.origin, MeshioOrigin) else None
    cell_labels, names = (None, None) if own is None else (own.cell_labels, own.type_names)
    count = sum(len(block.data) for block in out.cells)
    names = None if names is None or len(names) != count else names
    return lost + write_deck(target, out, _usable(node_labels, len(out.points)), _usable(cell_labels, count), names)


def _tags_as_sets(out: Any, lost: list[str]) -> list[str]:
    """Give a meshio.Mesh a set of all cells of each tag; what is lost, less the names that the sets have."""
    array, tags = cell_tags(out)
    names = tag_names(out)
    for dimension, tag in dict.fromkeys(
        (block.dim, tag) for block, part in zip(out.cells, tags, strict=True) for tag in np.unique(part).tolist() if tag
    ):
        name = names.get((dimension, tag), f"{array.rpartition(':')[2]}_{tag}")
        if name not in out.cell_sets:
            masks = [(part == tag) & (block.dim == dimension) for block, part in zip(out.cells, tags, strict=True)]
            out.cell_sets[name] = [np.flatnonzero(mask) for mask in masks]
    told = {f"field data {name!r}" for name in out.cell_sets}
    others = [f"cell array {name!r}" for name in TAG_ARRAYS if name in out.cell_data and name != array]
    kept = [f"the numbers of cell array {array!r} (kept as sets)"] if array else []
    return [*(text for text in lost if text not in told), *others, *kept]


def _usable(labels: Any, count: int) -> Any:
    """Labels of a file that are all there, whole numbers from 1; otherwise None."""
    if labels is None or len(labels) != count or labels.dtype.kind not in "iu" or (count and labels.min() < 1):
        return None
    return labels if len(set(labels.tolist())) == count else None


def _put_points(file: SourceFile, mesh: Any) -> tuple[bytes, list[str]]:
    lines = split_lines(file.text)
    text, lost = rewritten(read_deck(lines), lines, mesh.points)
    return text.encode("utf-8", "surrogateescape"), lost


ABAQUS = Format(
    "abaqus",
    _read,
    _write,
    _CAPABILITIES,
    put_points=through_meshio(_put_points, _CAPABILITIES),
    files_named=files_of_deck,
)
