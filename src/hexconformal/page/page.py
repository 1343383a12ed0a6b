"""The page itself: what it shows, as a file or inside a notebook."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import check_writable, json_safe, write_text
from ..version import __version__
from .array_store import ArrayStore
from .colour_maps import colour_maps
from .contents import Cells, Frame, Measure, ReportText, numeric
from .document import document, inline
from .histograms import histogram_of
from .schedule import PageSchedule
from .selection import cells_to_show, coarse_faces
from .volume_cells import drawn_part

__all__ = ["PAGE_EXTENSIONS", "Page"]

Ints = NDArray[np.int64]

PAGE_EXTENSIONS = (".htm", ".html")


@dataclass(frozen=True, eq=False, repr=False)
class Page:
    """A mesh, or what came of a run, to look at in a browser.

    Attributes
    ----------
    title, subtitle
        Of the page.
    cells
        All cells of the mesh.
    frames
        The mesh at different times, the first and the last one with all measures.
    measures
        What its cells are measured by.
    worst_measure
        The one that tells which cells are the worst.
    regions
        (m,) the region of each cell, and their names; None where there are no regions.
    features
        (k, 2) feature edges and (c,) corners, by their nodes; None where they were not looked for.
    report
        What the report of the run says.
    curves
        Of the run, see :func:`hexconformal.page.curves_of`.
    schedule
        How much the page holds.

    Examples
    --------
    >>> from hexconformal.generate import sheared_cube
    >>> from hexconformal.page import volume_page
    >>> page = volume_page(sheared_cube(4))
    >>> page
    Page(64 cells, 1 frames)
    >>> page.to_html().startswith("<!DOCTYPE html>")
    True
    """

    title: str
    subtitle: str
    cells: Cells
    frames: Sequence[Frame]
    measures: Sequence[Measure]
    worst_measure: str
    regions: tuple[Ints, tuple[str, ...]] | None = None
    features: tuple[Ints, Ints] | None = None
    report: ReportText = field(default_factory=lambda: ReportText(""))
    curves: Sequence[Mapping[str, Any]] = ()
    schedule: PageSchedule = field(default_factory=PageSchedule)

    def __repr__(self) -> str:
        return f"Page({self.cells.total} cells, {len(self.frames)} frames)"

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write the page as one file, which needs nothing else.

        Raises
        ------
        WriteError
            If the file cannot be written, or its name does not end in .html or .htm.
        """
        check_writable(path, PAGE_EXTENSIONS)
        write_text(path, self.to_html())

    def to_html(self) -> str:
        """The text of the file."""
        return self._document(self.schedule.most_cells)

    def _repr_html_(self) -> str:
        """The page inside a notebook."""
        return inline(self._document(self.schedule.most_inline))

    def _document(self, most: int) -> str:
        histograms = [self._histogram(measure) for measure in self.measures]
        page, remarks = (self, []) if self.cells.count <= most else self._reduced(int(self.schedule.coarse * most))
        store = ArrayStore()
        contents = {
            "program": f"hexconformal {__version__}",
            "title": self.title,
            "subtitle": self.subtitle,
            "remarks": remarks,
            **page._mesh_contents(store),
            "measures": [histogram for histogram in histograms if histogram is not None],
            "worst_measure": self.worst_measure,
            "maps": colour_maps(),
            "curves": self.curves,
            "report": self.report,
        }
        return document(f"{self.title} – hexconformal", json_safe(contents), store.texts)

    def _histogram(self, measure: Measure) -> dict[str, Any] | None:
        ends = self.frames[:1] if len(self.frames) == 1 else (self.frames[0], self.frames[-1])
        return histogram_of(measure, [frame.cell_data[measure.name] for frame in ends], self.schedule)

    def _reduced(self, coarse_faces_wanted: int) -> tuple[Page, list[str]]:
        """The page of the cells that are kept of a large mesh, and what it says of that."""
        measure = next(measure for measure in self.measures if measure.name == self.worst_measure)
        sign = 1.0 if measure.best == "high" else -1.0
        ends = (self.frames[0], self.frames[-1])
        rankings = [sign * np.asarray(frame.cell_data[self.worst_measure]) for frame in ends]
        kept = cells_to_show(self.cells, rankings, int(self.schedule.worst))
        is_surface = self.cells.layers is None
        left_out = self.cells.faces[~kept] if is_surface else np.empty((0, 4), dtype=np.int64)
        coarse = coarse_faces(self.frames[0].points, left_out, coarse_faces_wanted)
        curves = np.empty(0, dtype=np.int64) if self.features is None else self.features[0]
        cells, places, nodes = drawn_part(self.cells, kept, coarse, curves)
        number = np.full(len(self.frames[0].points), -1)
        number[nodes] = np.arange(len(nodes))
        features = None
        if self.features is not None:
            features = number[self.features[0]], number[self.features[1]]
        page = replace(
            self,
            cells=cells,
            frames=[frame.part(places, nodes) for frame in self.frames],
            regions=None if self.regions is None else (self.regions[0][places], self.regions[1]),
            features=features,
        )
        worst = f"the worst ones by {measure.title} and those around these"
        held = f"The mesh has {cells.total:,} cells. This page has {cells.count:,} of them: "
        if is_surface:
            held += (
                f"{worst}. In the place of the others it has {len(coarse):,} larger triangles, without values of cells."
            )
        else:
            held += f"those at the boundary, {worst}."
        return page, [f"{held} Histograms are of all."]

    def _mesh_contents(self, store: ArrayStore) -> dict[str, Any]:
        cells = self.cells

        def put(values: NDArray[Any] | None) -> Any:
            return None if values is None else store.put(values)

        def arrays(data: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
            return {name: store.put(values) for name, values in numeric(data).items()}

        return {
            "cells": {
                "count": cells.count,
                "total": cells.total,
                "labels": None if cells.labels is None else cells.labels.tolist(),
                "types": put(cells.types if len(cells.type_names) > 1 else None),
                "type_names": list(cells.type_names),
            },
            "faces": put(cells.faces),
            "sides": put(cells.sides),
            "middles": put(cells.middles),
            "layers": put(cells.layers),
            "regions": None
            if self.regions is None
            else {"labels": store.put(self.regions[0]), "names": list(self.regions[1])},
            "features": None
            if self.features is None
            else {"edges": store.put(self.features[0]), "corners": store.put(self.features[1])},
            "frames": [
                {
                    "name": frame.name,
                    "position": frame.position,
                    "points": store.put(frame.points),
                    "cell_arrays": arrays(frame.cell_data),
                    "point_arrays": arrays(frame.point_data),
                }
                for frame in self.frames
            ],
        }
