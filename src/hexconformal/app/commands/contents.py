"""What a mesh carries besides its cells, told by `check`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...common import aligned, first_names
from ...mesh import (
    HexMesh,
    Interfaces,
    Regions,
    boundary_quads,
    curves_of,
    find_couplings,
    find_embedded,
    find_interfaces,
    find_regions,
)
from ...quality import Quality, measure_regions

__all__ = ["describe_contents"]

_SHOWN = 12  # rows of a table


@dataclass(frozen=True, eq=False)
class _Contents:
    """A mesh, its measures, and what the sections below tell of."""

    mesh: HexMesh
    measured: Quality
    regions: Regions | None

    @cached_property
    def quads(self) -> Any:
        """(q, 4) boundary quads."""
        return boundary_quads(self.mesh.cells)[0]

    @cached_property
    def interfaces(self) -> Interfaces | None:
        """The faces between the regions, if there are regions."""
        return None if self.regions is None else find_interfaces(self.mesh.cells, self.regions.labels)

    @cached_property
    def skin(self) -> Any:
        """(n,) nodes on the boundary."""
        on_skin = np.zeros(len(self.mesh.points), dtype=bool)
        on_skin[self.quads] = True
        return on_skin


def describe_contents(mesh: HexMesh, measured: Quality, interfaces: Any = "auto") -> list[str]:
    """Lines that tell what was found in a mesh, a section after the other; none for what is not there.

    Parameters
    ----------
    mesh
        A mesh whose cells have nodes that are there.
    measured
        Its measures.
    interfaces
        What regions come from; see :func:`hexconformal.mesh.find_regions`.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.quality import quality
    >>> mesh = HexMesh(*box((4, 1, 1)), cell_data={"part": np.array([0, 0, 0, 1])})
    >>> print(*describe_contents(mesh, quality(mesh)), sep="\\n")
    2 regions (array 'part'), 1 interface
    region  cells  volume  min SJ
    0           3    0.75   1.000
    1           1    0.25   1.000
    interface  faces  nodes  on the skin
    0 | 1          1      4            4
    """
    contents = _Contents(mesh, measured, find_regions(mesh, interfaces))
    return [line for section in _SECTIONS for line in section(contents)]


def _regions(contents: _Contents) -> list[str]:
    if contents.regions is None or contents.interfaces is None:
        return []
    names, measures = contents.regions.names, measure_regions(contents.regions, contents.measured)
    columns = names, measures.cells, measures.volume, measures.min_scaled_jacobian
    rows = [
        (name, str(cells), f"{volume:.5g}", f"{least:.3f}") for name, cells, volume, least in zip(*columns, strict=True)
    ]
    count = len(contents.interfaces.pairs)
    source = first_names([contents.regions.source])
    head = f"{len(names)} regions ({source}), {count} interface{'s' if count != 1 else ''}"
    return [head, *aligned(("region", "cells", "volume", "min SJ"), rows, _SHOWN)]


def _interfaces(contents: _Contents) -> list[str]:
    """The largest interfaces first, where not all are shown."""
    if contents.regions is None or contents.interfaces is None or not len(contents.interfaces.pairs):
        return []
    names, found = contents.regions.names, contents.interfaces
    order = np.argsort(-found.counts, kind="stable") if len(found.pairs) > _SHOWN else np.arange(len(found.pairs))
    parts, rows = found.parts(), []
    for number in order.tolist():
        (one, other), nodes = found.pairs[number].tolist(), np.unique(parts[number])
        on_skin = np.count_nonzero(contents.skin[nodes])
        rows.append((f"{names[one]} | {names[other]}", str(len(parts[number])), str(len(nodes)), str(on_skin)))
    return aligned(("interface", "faces", "nodes", "on the skin"), rows, _SHOWN)


def _junctions(contents: _Contents) -> list[str]:
    if contents.interfaces is None:
        return []
    edges = contents.interfaces.junction_edges()
    count, ends = curves_of(edges)
    on_skin = np.count_nonzero(contents.skin[ends])
    what = f"curves where three or more regions meet: {count} ({len(edges)} edges), with {on_skin} ends on the skin"
    return [what] if count else []


def _embedded(contents: _Contents) -> list[str]:
    """Faces, curves, sets and nodes that are kept."""
    return list(find_embedded(contents.mesh, contents.quads).notes)


def _couplings(contents: _Contents) -> list[str]:
    return list(find_couplings(contents.mesh).notes)


# What else a mesh may carry adds a function here, in the order in which it is told.
_SECTIONS: tuple[Callable[[_Contents], list[str]], ...] = (_regions, _interfaces, _junctions, _embedded, _couplings)
