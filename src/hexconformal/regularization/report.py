"""What a run comes to, and its report, for people and for programs."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import Serializable, json_safe
from ..elements import SOLID_TYPES
from ..geometry import SHARP
from ..mesh import HexMesh, MixedMesh
from ..page import Curve, RunResult, volume_page
from ..quality import MixedSummary, Summary
from .options import Record
from .region_rows import InterfaceRow, RegionRow, table_lines

__all__ = ["Report", "Result"]

Field = NDArray[np.float64]

_CURVES = (
    Curve("energy", ("energy",), logarithmic=True),
    Curve("scaled Jacobian", ("mean_scaled_jacobian", "min_scaled_jacobian")),
    Curve("smallest shape", ("min_shape",)),
    Curve("inverted cells", ("inverted",)),
)


@dataclass(frozen=True, repr=False)
class Report(Serializable):
    """Report of a run: the mesh before and after, what moved, and why it stopped.

    Attributes
    ----------
    before, after
        Quality of the mesh that went in and of the one that came out.
    energy_before, energy_after
        The summed distortion; NaN where it is infinite.
    boundary_moved
        Number of boundary nodes that are not where they were.
    largest_displacement
        Of any node, in the mesh's unit of length.
    diagonal
        Of the input's bounding box, in the same unit.
    iterations, seconds
        Work done.
    reason
        Reason of its end, in words.
    converged
        True where that was a stopping criterion, not a limit.
    options
        Options of the run, defaults included.
    notes
        Decisions and warnings, in words.
    hausdorff
        Hausdorff distance between the boundaries before and after, relative to `diagonal`; from the surface that
        was given to slide on, if one was. None where it was not measured.
    mean_distance
        Mean of the distances between the same two surfaces, over both, relative to `diagonal`.
    sharp_edges
        Length of the edges of the boundary at which it turns by more than 45 degrees, before and after, in the mesh's
        unit of length.
    size_ratios
        Smallest and largest ratio of a cell's volume after to the one it should have, None where none should.
    regions, interfaces
        A row for each region of the mesh and for each two that meet; empty where the mesh has no regions.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal.quality.assessment import quality
    >>> summary = quality(box((2, 2, 2))).summary()
    >>> report = Report(summary, summary, 0.0, 0.0, 0, 0.0, 3**0.5, 1, 0.01, "nothing to do", True)
    >>> print(str(report).splitlines()[0])
    8 cells, 1 iterations, 0.01 s, converged: nothing to do
    >>> report.to_dict()["after"]["invalid"]
    0
    """

    before: Summary
    after: Summary
    energy_before: float
    energy_after: float
    boundary_moved: int
    largest_displacement: float
    diagonal: float
    iterations: int
    seconds: float
    reason: str
    converged: bool
    options: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    hausdorff: float | None = None
    mean_distance: float | None = None
    sharp_edges: tuple[float, float] | None = None
    size_ratios: tuple[float, float] | None = None
    regions: tuple[RegionRow, ...] = ()
    interfaces: tuple[InterfaceRow, ...] = ()

    @property
    def volume_change(self) -> float:
        """Change of the volume relative to its size before; 0 if there was none."""
        before = self.before.total_volume
        return (self.after.total_volume - before) / abs(before) if before else 0.0

    @property
    def hausdorff_bound(self) -> float | None:
        """Largest `hausdorff` that was allowed; None where the boundary does not slide."""
        return self.options.get("hausdorff") if self.options.get("boundary") == "slide" else None

    @property
    def relative_displacement(self) -> float:
        """Largest displacement over the diagonal of the bounding box."""
        return self.largest_displacement / self.diagonal if self.diagonal else 0.0

    def __str__(self) -> str:
        before, after = self.before, self.after
        rows: list[tuple[str, float, float]] = [
            ("inverted cells", before.inverted, after.inverted),
            ("invalid cells", before.invalid, after.invalid),
            ("scaled jacobian, min", before.scaled_jacobian.min, after.scaled_jacobian.min),
            ("scaled jacobian, 5 %", before.scaled_jacobian.percentiles[5], after.scaled_jacobian.percentiles[5]),
            ("scaled jacobian, mean", before.scaled_jacobian.mean, after.scaled_jacobian.mean),
            ("minimum jacobian, min", before.minimum_jacobian.min, after.minimum_jacobian.min),
            ("shape, min", before.shape.min, after.shape.min),
            ("shape, mean", before.shape.mean, after.shape.mean),
            ("conformal distortion, mean", before.conformal_distortion.mean, after.conformal_distortion.mean),
            ("conformal distortion, max", before.conformal_distortion.max, after.conformal_distortion.max),
            ("edge ratio, max", before.edge_ratio.max, after.edge_ratio.max),
            ("volume", before.total_volume, after.total_volume),
        ]
        if isinstance(before, MixedSummary) and isinstance(after, MixedSummary):
            for name, one in before.types.items() if len(before.types) > 1 else ():
                minimum = one.scaled_jacobian.min, after.types[name].scaled_jacobian.min
                rows.append((f"{SOLID_TYPES[name].plural}, scaled jac. min", *minimum))
        if isfinite(self.energy_before) and isfinite(self.energy_after):
            rows.append(("energy", self.energy_before, self.energy_after))
        state = "converged" if self.converged else "not converged"
        relative = f"{self.relative_displacement:.2%} of the diagonal"
        return "\n".join(
            [
                f"{after.count} cells, {self.iterations} iterations, {self.seconds:.2f} s, {state}: {self.reason}",
                f"{'':28s}{'before':>12s}{'after':>12s}",
                *(f"{name:28s}{_number(x):>12s}{_number(y):>12s}" for name, x, y in rows),
                f"largest displacement {self.largest_displacement:.4g}, {relative}",
                *self._boundary_and_sizes(),
                *table_lines(self.regions, self.interfaces),
                *(f"note: {note}" for note in self.notes),
            ]
        )

    __repr__ = __str__

    def _boundary_and_sizes(self) -> list[str]:
        """Lines that tell of the boundary and of the sizes."""
        lines = [f"{self.boundary_moved} boundary nodes moved, volume changed by {self.volume_change:+.1e}"]
        if self.hausdorff is not None:
            bound = "" if self.hausdorff_bound is None else f", allowed {self.hausdorff_bound:g}"
            mean = "" if self.mean_distance is None else f"; in the mean {self.mean_distance:.2g}"
            lines.append(f"Hausdorff distance of the surface {self.hausdorff:.3g} diagonals{bound}{mean}")
        if self.sharp_edges is not None and max(self.sharp_edges) > 0.0:
            before, after = self.sharp_edges
            lines.append(f"edges sharper than {SHARP:g} degrees {after:.4g} long, {before:.4g} before")
        if self.size_ratios is not None:
            low, high = self.size_ratios
            whose = "those of the input, or the sizes that were given"
            lines.append(f"volumes of cells {low:.3g} to {high:.3g} times their targets: {whose}")
        return lines

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as JSON takes them; what is not finite becomes None."""
        derived = ("volume_change", "relative_displacement", "hausdorff_bound")
        return {**super().to_dict(), **json_safe({name: getattr(self, name) for name in derived})}


def _number(value: float) -> str:
    return str(value) if isinstance(value, int) else f"{value:.5g}"


@dataclass(frozen=True, eq=False, repr=False)
class Result(RunResult):
    """The mesh that a run comes to, its report and history; in a notebook it is shown to look at.

    Attributes
    ----------
    report
        Before and after, what moved, and why it stopped.
    history
        One record per iteration.
    before
        The mesh that went in, as a :class:`hexconformal.HexMesh` or MixedMesh.
    """

    report: Report
    history: tuple[Record, ...]
    before: HexMesh | MixedMesh

    curves = _CURVES
    page_of = staticmethod(volume_page)
