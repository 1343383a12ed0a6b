"""The result of a remeshing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..mesh import Floats
from .options import Record
from .report import Report

__all__ = ["Result"]


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """A remeshed surface with its report and history.

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
    """

    mesh: Any
    points: Floats
    report: Report
    history: tuple[Record, ...]

    def __repr__(self) -> str:
        return f"Result({len(self.points)} points, {self.report.after.count} cells: {self.report.reason})"

    @property
    def converged(self) -> bool:
        """True if the run ended because there was nothing left to gain."""
        return self.report.converged
