"""What a page shows: cells by their faces, frames, measures, the text of a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import json_safe

__all__ = ["Cells", "Frame", "Measure", "ReportText", "numeric"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a page, which are drawn by their faces.

    Attributes
    ----------
    faces
        (f, 4) nodes of every face once; triangles have their last node twice.
    sides
        (f, 2) the cells on both sides; the second is -1 on the boundary, -2 where it is a cell that is not in the page.
        Of faces that stand for many cells of a surface that are not in the page both are -2.
    type_names
        Of the types of cells that there are.
    types
        (m,) number of each cell's type.
    total
        Number of cells of the mesh, of which the page may have some only.
    middles
        (f, 5) nodes in the middle of the sides of curved faces, in the order of the sides, and in that of the face, -1
        where there is none; None where no face is curved.
    labels
        (m,) what the file calls the cells; None if they are counted from 0.
    layers
        (m,) layers of cells that lie between a cell and the boundary; None for surfaces.
    """

    faces: Ints
    sides: Ints
    type_names: tuple[str, ...]
    types: Ints
    total: int
    middles: Ints | None = None
    labels: NDArray[Any] | None = None
    layers: Ints | None = None

    @property
    def count(self) -> int:
        """Number of cells of the page."""
        return len(self.types)


@dataclass(frozen=True, eq=False)
class Frame:
    """The mesh at one time of a run.

    Attributes
    ----------
    name
        As the page calls it: "before", "iteration 7".
    points
        (n, 3) positions.
    cell_data, point_data
        Arrays by name, first axis m or n; those that hold no numbers are left out of the page.
    position
        Where it is on the axis of the curves: its iteration, or step.
    """

    name: str
    points: Floats
    cell_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    position: float | None = None

    def part(self, cells: Ints, nodes: Ints) -> Frame:
        """The frame of some of the cells and nodes, by their ids."""
        return Frame(
            self.name,
            self.points[nodes],
            {name: np.asarray(values)[cells] for name, values in self.cell_data.items()},
            {name: np.asarray(values)[nodes] for name, values in self.point_data.items()},
            self.position,
        )


@dataclass(frozen=True)
class Measure:
    """A measure of cells, as the page shows it.

    Attributes
    ----------
    name
        Of the array on cells.
    title
        For people.
    best
        Which end of its range is good: "high", "low", or None where neither is.
    range
        What colours stand for at first; None at an end: the smallest or largest value that there is.
    folded_at_zero
        True where a cell with a value of 0 or less is turned inside out, at some corner at least.
    is_ratio
        True where its histogram may be logarithmic.
    """

    name: str
    title: str
    best: str | None
    range: tuple[float | None, float | None] = (None, None)
    folded_at_zero: bool = False
    is_ratio: bool = False


@dataclass(frozen=True)
class ReportText:
    """What a report says, its notes and options apart.

    Attributes
    ----------
    text
        In lines of fixed width.
    notes
        Remarks for the user.
    options
        Of the run, by name, in plain types.
    """

    text: str
    notes: tuple[str, ...] = ()
    options: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, report: Any) -> ReportText:
        """That of a report, a summary, or anything else that can be printed."""
        if isinstance(report, cls):
            return report
        options = json_safe(dict(getattr(report, "options", {})))
        return cls(str(report), tuple(getattr(report, "notes", ())), options)


def numeric(data: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Those of the arrays that hold numbers, one or a row of them for each cell or point."""
    return {
        name: np.asarray(values)
        for name, values in data.items()
        if np.asarray(values).dtype.kind in "biuf" and np.asarray(values).ndim in (1, 2)
    }
