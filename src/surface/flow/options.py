"""Options of a flow, and the record of a step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Integral
from typing import Any

import numpy as np

from hexconformal.common import OptionError, array_of_numbers, require_counts, require_numbers

__all__ = ["Record", "Stepping"]


@dataclass(frozen=True)
class Stepping:
    """Options of :func:`surface.evolve`.

    Attributes
    ----------
    t_end
        Stop at this time, exactly.
    steps
        Stop after so many steps.
    tau
        First time step; None: one that moves no node far beyond a tenth of the mean edge length.
    tau_max
        Largest time step: the error in time is of its order.
    growth
        Factor by which an accepted step grows.
    stall
        Stop where the energy falls by less than this, relatively, over ten steps, or only by wearing out the mesh:
        where ten remeshings in a row would have given back what was gained; 0: never.
    outputs
        Times that steps hit exactly, whatever the adaptive steps are.
    remesh
        Remesh before every step (True), every k-th (an integer), or never (False).
    remesh_below
        Remesh where an angle is below this, degrees.
    remesh_options
        Fields of :class:`surface.Options` for the remeshing. Lines between regions (`interfaces`) go where the flow
        takes them: remeshing holds their nodes.

    Raises
    ------
    OptionError
        If a value makes no sense, or nothing ends the run.

    Examples
    --------
    >>> Stepping(t_end=1.0, growth=0.5)
    Traceback (most recent call last):
        ...
    hexconformal.OptionError: growth must be at least 1, not 0.5
    """

    t_end: float | None = None
    steps: int | None = None
    tau: float | None = None
    tau_max: float = float("inf")
    growth: float = 1.25
    stall: float = 1e-5
    outputs: tuple[float, ...] = ()
    remesh: bool | int = False
    remesh_below: float | None = None
    remesh_options: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_numbers(self, "tau_max", "growth", "stall", optional=["t_end", "tau", "remesh_below"])
        require_counts(self, optional=["steps"])
        for name in ("t_end", "tau", "tau_max"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise OptionError(f"{name} must be positive, not {value!r}")
        if not 1.0 <= self.growth < float("inf"):
            raise OptionError(f"growth must be at least 1, not {self.growth!r}")
        if not 0.0 <= self.stall < 1.0:
            raise OptionError(f"stall must lie in [0, 1), not {self.stall!r}")
        if self.t_end is None and self.steps is None and self.stall == 0.0:
            raise OptionError("t_end, steps or stall must end the run: give one of them")
        if not isinstance(self.remesh, (Integral, np.bool_)) or self.remesh < 0:
            raise OptionError(f"remesh must be a boolean, or every how many steps, not {self.remesh!r}")
        if self.remesh_below is not None and not 0.0 < self.remesh_below < 90.0:
            raise OptionError(f"remesh_below must be an angle in (0, 90) degrees, not {self.remesh_below!r}")
        if not isinstance(self.remesh_options, Mapping):
            raise OptionError(f"remesh_options must be options by name, not {self.remesh_options!r}")
        outputs = array_of_numbers("outputs", self.outputs)
        if outputs.ndim != 1 or not (np.diff(outputs, prepend=0.0) > 0).all():
            raise OptionError("outputs must be positive times that grow")
        object.__setattr__(self, "outputs", tuple(outputs.tolist()))

    def next_stop(self, time: float) -> float:
        """The next time after `time` that a step has to hit; infinity if there is none."""
        stops = [*self.outputs, *([] if self.t_end is None else [self.t_end])]
        return min((stop for stop in stops if stop > time * (1 + 1e-14)), default=float("inf"))


@dataclass(frozen=True)
class Record:
    """One step.

    Attributes
    ----------
    step
        0 is the input.
    time
        Reached.
    tau
        The step that led here.
    energy
        After it.
    remesh_jump
        Energy that remeshing before the step has added; nan where there was none.
    area, volume
        Of the surface; the volume of an open one is that of the cone over it.
    reduced_volume
        6 sqrt(pi) V / A^(3/2), 1 for a ball.
    min_angle, mean_angle
        Smallest angle, and mean over the cells of their smallest angle, degrees.
    nu, lam
        Multipliers of area and volume; nan where they are not conserved.
    conserved_error
        Largest relative deviation of what is conserved.
    halvings
        Number of times that the step had to be halved.
    """

    step: int
    time: float
    tau: float
    energy: float
    remesh_jump: float
    area: float
    volume: float
    reduced_volume: float
    min_angle: float
    mean_angle: float
    nu: float
    lam: float
    conserved_error: float
    halvings: int

    def __str__(self) -> str:
        return (
            f"step {self.step}  t {self.time:.4g}  tau {self.tau:.1e}  energy {self.energy:.6g}  "
            f"reduced volume {self.reduced_volume:.4f}  smallest angle {self.min_angle:.1f}"
        )


def reduced_volume(area: float, volume: float) -> float:
    """6 sqrt(pi) V / A^(3/2).

    >>> round(reduced_volume(6.0, 1.0), 6)
    0.723601
    """
    return float(6 * np.sqrt(np.pi) * volume / area**1.5)
