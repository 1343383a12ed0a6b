"""Options of a remeshing, and the record of an iteration."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from hexconformal.common import (
    OptionError,
    array_of_numbers,
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
    target
        Perfect shape, which the cells shall be conformal to: "equilateral" (quadrilaterals: squares), "flat" (by
        valence), "input" (their own shapes: only their sizes and places change), the (n, 3) points of a reference mesh
        with the same cells, or a pair of arrays of planar corners (t, 3, 2) and (q, 4, 2).
    energy
        "barrier": every cell counts the same whatever its size, and none can collapse; "quaternionic": the
        distortion int |*df - N df|^2 of Gruber & Aulisa itself.
    emphasis
        "mean" makes the cells good on the whole, "worst" raises the smallest angles at a small cost of the mean: for
        meshes that are good already (of the barrier only).
    max_iterations
        Stop after so many, however often the run begins again for a few cells that stand in the way.
    energy_tolerance
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
        Distance that the surface may move, in both directions, as a share of the bounding box's diagonal; for
        project=True only: otherwise the report has a note where the distance is larger.
    feature_angle
        Edges whose cells meet at more than this (degrees) are sharp, unless they are few, or full of corners on a rough
        surface: nodes on them slide along them, corners stay. None: no edge is.
    feature_edges
        (k, 2) sharp edges, which are taken as they are, instead of those that meet at `feature_angle`.
    interfaces
        Lines between regions, which are feature edges besides, kept within `hausdorff`: "auto", where an array on cells
        changes that stands for regions or tags (material, region, part, gmsh:physical, tag and the like), or else
        between the groups, sets or solids of the file as far as they do not overlap; "ignore"; the name of an array; or
        (m,) integers.
    boundary
        Nodes of open boundaries: "slide" along them, or "fixed".
    fixed
        Nodes that stay: (n,) booleans, node ids, or a name: of a set or group of the file, or of a point array that
        is not zero there.

    Raises
    ------
    OptionError
        If a value makes no sense.

    Examples
    --------
    >>> Options(normal="sideways")
    Traceback (most recent call last):
        ...
    hexconformal.OptionError: normal must be 'middle', 'simpson' or 'linear', not 'sideways'
    """

    target: Any = "equilateral"
    energy: str = "barrier"
    emphasis: str = "mean"
    max_iterations: int = 300
    energy_tolerance: float = 3e-4
    eps: float = 1e-5
    normal: str = "linear"
    project: bool = True
    hausdorff: float = 0.01
    feature_angle: float | None = 50.0
    feature_edges: Any = None
    interfaces: Any = "auto"
    boundary: str = "slide"
    fixed: Any = None

    def __post_init__(self) -> None:
        require_choices(self, CHOICES)
        if isinstance(self.target, str) and self.target not in TARGETS:
            names = ", ".join(repr(name) for name in TARGETS)
            raise OptionError(f"target must be {names} or an array, not {self.target!r}")
        require_numbers(self, "energy_tolerance", "eps", "hausdorff", optional=["feature_angle"])
        require_counts(self, "max_iterations")
        require_flags(self, "project")
        if not 0 <= self.energy_tolerance < 1:
            raise OptionError(f"energy_tolerance must lie in [0, 1), not {self.energy_tolerance!r}")
        if not 0 < self.eps < float("inf"):
            raise OptionError(f"eps must be positive, not {self.eps!r}")
        if not 0 < self.hausdorff < float("inf"):
            raise OptionError(f"hausdorff must be positive, not {self.hausdorff!r}")
        if self.feature_angle is not None and not 0 < self.feature_angle < 180:
            raise OptionError(f"feature_angle must lie in (0, 180) degrees, not {self.feature_angle!r}")
        if self.feature_edges is not None:
            array_of_numbers("feature_edges", self.feature_edges, "None or an array (k, 2) of edges")
            if self.feature_angle not in (None, Options.feature_angle):
                raise OptionError("feature_angle must not be given with feature_edges, which are taken as they are")

    def described(self) -> dict[str, Any]:
        """The options in plain types, arrays as "given", for a report."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: value if value is None or isinstance(value, (str, int, float, np.generic)) else "given"
            for name, value in values.items()
        }


@dataclass(frozen=True)
class Record:
    """One iteration of a run.

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
        back from nodes, midpoints and quarters of edges of the input; 0 without projection. The report's is measured
        between all places.

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
