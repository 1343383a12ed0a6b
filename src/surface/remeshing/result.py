"""The result of a remeshing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hexconformal.page import Curve, Frame, HasPage, Page, columns_of, curves_of

from ..mesh import Floats, SurfaceMesh
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
class Result(HasPage):
    """A remeshed surface with its report and history; in a notebook it is shown to look at.

    Attributes
    ----------
    mesh
        The better mesh, in the type that came in, with the cell arrays `min_angle` and `min_angle_change` besides.
    points
        (n, 3) its points.
    report
        Before and after, how well the shape was kept, and why it stopped.
    history
        One record per iteration.
    before
        The surface that went in.
    interfaces
        What tells its regions apart, as in :class:`surface.Options`.
    """

    mesh: Any
    points: Floats
    report: Report
    history: tuple[Record, ...]
    before: SurfaceMesh
    interfaces: Any = "auto"

    def __repr__(self) -> str:
        return f"Result({len(self.points)} points, {self.report.after.count} cells: {self.report.reason})"

    @property
    def converged(self) -> bool:
        """True if the run ended because there was nothing left to gain."""
        return self.report.converged

    def page(self, frames: Sequence[Frame] = ()) -> Page:
        """The page of the result, with frames of iterations between input and result if they are there."""
        last = self.history[-1].iteration if self.history else 0
        return surface_page(
            self.before,
            self.before.replaced(self.points, point_data={"moved_by": self.points - self.before.points}),
            frames=frames,
            ends=(("before", 0.0), ("after", float(last))),
            report=self.report,
            curves=curves_of(columns_of(self.history), "iteration", "iterations", _CURVES),
            interfaces=self.interfaces,
        )
