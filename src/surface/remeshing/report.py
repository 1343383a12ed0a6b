"""The report of a remeshing, for people and for programs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hexconformal.common import Serializable

from ..quality import Summary

__all__ = ["Report"]


@dataclass(frozen=True, repr=False)
class Report(Serializable):
    """The surface before and after, how well its shape was kept, and why the run stopped.

    Attributes
    ----------
    before, after
        Quality.
    energy_before, energy_after
        The energy that was minimized, mean over the cells.
    area_change, volume_change
        Relative; the volume's is None for an open surface.
    hausdorff
        Distance between input and result over the diagonal of the bounding box, lines between regions included.
    mean_distance
        The same in the mean over both surfaces.
    turned
        Cells whose normal points against the input's below them.
    largest_displacement
        In the mesh's unit of length.
    iterations, seconds, reason, converged
        Number of iterations, time, the reason for the end, and whether nothing was left to gain.
    options
        All options, defaults included.
    notes
        Remarks for the user.
    """

    before: Summary
    after: Summary
    energy_before: float
    energy_after: float
    area_change: float
    volume_change: float | None
    hausdorff: float
    mean_distance: float
    turned: int
    largest_displacement: float
    iterations: int
    seconds: float
    reason: str
    converged: bool
    options: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        state = "converged" if self.converged else "not converged"
        lines = [
            f"{self.after.count} cells, {self.iterations} iterations, {self.seconds:.2f} s, {state}: {self.reason}",
            f"{'':24s}{'before':>12s}{'after':>12s}",
        ]
        for name in ("min_angle", "mean_angle", "max_angle", "radius_ratio", "scaled_jacobian", "dilatation"):
            b, a = getattr(self.before, name), getattr(self.after, name)
            if b == b:
                lines.append(f"{name.replace('_', ' '):24s}{b:>12.5g}{a:>12.5g}")
        lines.append(f"{'area ratio':24s}{self.before.area_ratio:>12.5g}{self.after.area_ratio:>12.5g}")
        lines.append(f"{'energy':24s}{self.energy_before:>12.5g}{self.energy_after:>12.5g}")
        volume = "" if self.volume_change is None else f", volume by {self.volume_change:+.1e}"
        lines.append(
            f"area changed by {self.area_change:+.2%}{volume}, surface by {self.hausdorff:.2%} of the diagonal, "
            f"{self.mean_distance:.2g} in the mean, {self.turned} cells turned over"
        )
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    __repr__ = __str__
