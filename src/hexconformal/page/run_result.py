"""What comes of a run: a mesh with its report and history, and the page that shows it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .contents import Frame
from .curves import Curve, columns_of, curves_of
from .page import Page

__all__ = ["RunResult"]


@dataclass(frozen=True, eq=False, repr=False)
class RunResult:
    """Base of results of runs, which can be looked at in a browser, or inside a notebook.

    Attributes
    ----------
    mesh
        The better mesh, in the type that came in, with everything it carried.
    points
        (n, 3) its points.
    report
        Before and after, what moved, and why it stopped.
    history
        One record per iteration.
    before
        The mesh that went in.
    interfaces
        What tells its regions apart.
    curves
        Those of the history that the page shows, over the iterations.
    page_of
        Makes the page of a mesh before and after.
    """

    mesh: Any
    points: NDArray[np.float64]
    report: Any
    history: tuple[Any, ...]
    before: Any
    interfaces: Any = "auto"

    curves: ClassVar[Sequence[Curve]] = ()
    page_of: ClassVar[Callable[..., Page]]

    def __repr__(self) -> str:
        return f"Result({len(self.points)} points, {self.report.after.count} cells: {self.report.reason})"

    @property
    def converged(self) -> bool:
        """True where the run ended by a stopping criterion, not a limit."""
        return bool(self.report.converged)

    def page(self, frames: Sequence[Frame] = ()) -> Page:
        """The page of the result.

        Parameters
        ----------
        frames
            The mesh at iterations between the first and the last one, if they are there.
        """
        last = self.history[-1].iteration if self.history else 0
        return type(self).page_of(
            self.before,
            self.before.replaced(self.points, point_data={"moved_by": self.points - self.before.points}),
            frames=frames,
            ends=(("before", 0.0), ("after", float(last))),
            report=self.report,
            curves=curves_of(columns_of(self.history), "iteration", "iterations", self.curves),
            interfaces=self.interfaces,
        )

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Write the result as one HTML file, to look at in a browser; it needs no network and no server.

        Raises
        ------
        WriteError
            If the file cannot be written, or its name does not end in .html or .htm.
        """
        self.page().write(path)

    def _repr_html_(self) -> str:
        return self.page()._repr_html_()
