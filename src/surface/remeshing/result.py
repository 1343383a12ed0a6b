"""The result of a remeshing."""

from __future__ import annotations

from dataclasses import dataclass

from hexconformal.page import Curve, RunResult

from ..mesh import SurfaceMesh
from ..page import surface_page
from .options import Record
from .report import Report

__all__ = ["Result"]


_CURVES = (
    Curve("energy", ("energy",), logarithmic=True),
    Curve("smallest angle of a cell, degrees", ("mean_angle", "min_angle")),
    Curve("nodes that were held", ("held",)),
)


@dataclass(frozen=True, eq=False, repr=False)
class Result(RunResult):
    """A remeshed surface with its report and history; in a notebook it is shown to look at.

    The mesh has the cell arrays `min_angle` and `min_angle_change` besides those that came.

    Attributes
    ----------
    report
        Before and after, how well the shape was kept, and why it stopped.
    history
        One record per iteration.
    before
        The surface that went in.
    """

    report: Report
    history: tuple[Record, ...]
    before: SurfaceMesh

    curves = _CURVES
    page_of = staticmethod(surface_page)
