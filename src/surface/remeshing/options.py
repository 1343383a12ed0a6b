"""Options of a remeshing, and the record of an iteration."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hexconformal.common import (
    OptionError,
    array_of_numbers,
    is_number,
    require_choices,
    require_counts,
    require_flags,
    require_numbers,
)

from ..constraint import NORMALS
from ..energy import ENERGIES, TARGETS

__all__ = ["EMPHASES", "Options", "Record"]

EMPHASES = ("mean", "worst")
CHOICES = {"energy": ENERGIES, "emphasis": EMPHASES, "normal": NORMALS, "boundary": ("slide", "fixed")}


@dataclass(frozen=True)
class Options:
    """Options of :func:`surface.remesh`.

    Attributes
    ----------
    reference
        What the cells shall be conformal to: "equilateral" (quadrilaterals: squares), "flat" (by valence), "input"
        (their own shapes: only their sizes and places change), the (n, 3) points of a reference mesh with the same
        cells, or a pair of arrays of planar corners (t, 3, 2) and (q, 4, 2).
    energy
        "barrier": every cell counts the same whatever its size, and none can collapse; "quaternionic": the note's
        int |*df - N df|^2.
    emphasis
        "mean" makes the cells good on the whole, "worst" raises the smallest angles at a small cost of the mean: for
        meshes that are good already (of the barrier only).
    iterations
        Stop after so many, however often the run begins again for a few cells that stand in the way.
    tolerance
        Stop where a further iteration would lower the energy by less than this, relatively.
    eps
        Relaxation of the constraint that points move along the surface, in squares of the mean edge length; for
        project=False only, since points that are put back onto the input need none.
    normal
        Where the normal N~ of that constraint is taken: "middle", "simpson" (encloses exactly the same volume) or
        "linear" (at the old surface; a projected surface needs no more).
    project
        Put the nodes back onto the input surface, keep the volume, and the area within 0.8 %: right for a surface
        that does not move.
    hausdorff
        How far the result may be from the input, as a fraction of the bounding box's diagonal; for project=True only:
        otherwise the report has a note where the distance is larger.
    features
        Edges whose cells meet at more than this (degrees) are sharp, unless they are few, or full of corners on a rough
        surface: nodes on them slide along them, corners stay. None: no edge is; or a (k, 2) array of edges, which are
        taken as they are.
    boundary
        Nodes of open boundaries: "slide" along them, or "fixed".
    fixed
        Nodes that stay: (n,) booleans, node ids, or the name of a point array that is not zero there.

    Raises
    ------
    OptionError
        If a value makes no sense.

    Examples
    --------
    >>> Options(normal="sideways")
    Traceback (most recent call last):
        ...
    hexconformal.OptionError: normal is 'middle', 'simpson' or 'linear', not 'sideways'
    """

    reference: Any = "equilateral"
    energy: str = "barrier"
    emphasis: str = "mean"
    iterations: int = 300
    tolerance: float = 3e-4
    eps: float = 1e-5
    normal: str = "linear"
    project: bool = True
    hausdorff: float = 0.01
    features: Any = 50.0
    boundary: str = "slide"
    fixed: Any = None

    def __post_init__(self) -> None:
        require_choices(self, CHOICES)
        if isinstance(self.reference, str) and self.reference not in TARGETS:
            names = ", ".join(repr(name) for name in TARGETS)
            raise OptionError(f"reference must be {names} or an array, not {self.reference!r}")
        require_numbers(self, "tolerance", "eps", "hausdorff")
        require_counts(self, "iterations")
        require_flags(self, "project")
        if not 0 <= self.tolerance < 1:
            raise OptionError(f"tolerance must lie in [0, 1), not {self.tolerance!r}")
        if not 0 < self.eps < float("inf"):
            raise OptionError(f"eps must be positive, not {self.eps!r}")
        if not 0 < self.hausdorff < float("inf"):
            raise OptionError(f"hausdorff must be positive, not {self.hausdorff!r}")
        if is_number(self.features):
            if not 0 < self.features < 180:
                raise OptionError(f"features must be an angle in (0, 180) degrees, not {self.features!r}")
        elif self.features is not None:
            array_of_numbers("features", self.features, "an angle, None or an array of edges")

    def described(self) -> dict[str, Any]:
        """The options in plain types, arrays as "given", for a report."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: value if value is None or isinstance(value, (str, int, float, np.generic)) else "given"
            for name, value in values.items()
        }


@dataclass(frozen=True)
class Record:
    """One iteration.

    Attributes
    ----------
    iteration
        0 is the input.
    energy
        The energy that is minimized, mean over the cells; the quaternionic one in squares of the mesh's unit.
    decrease
        Relative decrease of the energy in this iteration.
    step
        Largest displacement, in mean edge lengths.
    min_angle, mean_angle
        Smallest corner angle of the mesh, mean over cells of their smallest corner angle, degrees.
    turned
        Number of cells whose normal points against the input's below them.
    held
        Number of nodes that were held so that cells and shape are kept.
    seconds
        Since the run began.
    distance
        Largest distance from the input, relative to its diagonal, where the run measures it: at nodes and centres, and
        back from nodes and edge midpoints of the input; 0 without projection. The report's is measured at more places.

    Examples
    --------
    >>> print(Record(7, 0.4685, 0.01336, 0.25, 31.5, 52.25, 0, 3, 1.36))
    7  energy 4.685e-01  decrease 1.3e-02  smallest angle 31.50  mean 52.25  1.4 s
    """

    iteration: int
    energy: float
    decrease: float
    step: float
    min_angle: float
    mean_angle: float
    turned: int
    held: int
    seconds: float
    distance: float = 0.0

    def __str__(self) -> str:
        return (
            f"{self.iteration}  energy {self.energy:.3e}  decrease {self.decrease:.1e}  smallest angle "
            f"{self.min_angle:.2f}  mean {self.mean_angle:.2f}  {self.seconds:.1f} s"
        )
