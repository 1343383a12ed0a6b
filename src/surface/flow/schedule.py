"""The tuned numbers of flows."""

from __future__ import annotations

from dataclasses import dataclass

from hexconformal.common import Schedule, tuned

__all__ = ["FlowSchedule"]


@dataclass(frozen=True)
class FlowSchedule(Schedule):
    """Steps of a flow, and the remeshings between them.

    Attributes
    ----------
    first_displacement, largest_displacement
        Of a node in the first step, and in any, in mean edges.
    halvings
        Of a step, at most.
    vanished_area
        Share of the first area at which a surface has vanished.
    collapsed
        Share of the largest time step so far at which the steps have collapsed.
    stall_steps
        Over which a stall is measured.
    rise
        By a remeshing, as a share of the energy that the flow has lost since the last one: over a run it falls.
    early_remeshings, early_rise
        The first ones may raise the energy by this share in advance, so that the mesh is good early.
    early_iterations
        Of these.
    fractions
        Of the displacements of a remeshing, until the energy rises no more than it may.
    angle_loss
        Degrees of the mean angle, over as many partial remeshings as a stall has steps: the mesh is worn out.
    smoothing_length
        In cells, of the displacements that restore area and volume: those of a rough surface are rough.
    """

    first_displacement: float = tuned(0.1)
    largest_displacement: float = tuned(0.5)
    halvings: int = tuned(40)
    vanished_area: float = tuned(1e-4, 0.0, 1.0)
    collapsed: float = tuned(1e-5, 0.0, 1.0)
    stall_steps: int = tuned(10)
    rise: float = tuned(0.95, 0.0, 1.0)
    early_remeshings: int = tuned(10)
    early_rise: float = tuned(0.05, 0.0, 1.0)
    early_iterations: int = tuned(3)
    fractions: tuple[float, ...] = tuned((1.0, 0.5, 0.25, 0.125), 0.0, 1.0)
    angle_loss: float = tuned(0.5)
    smoothing_length: float = tuned(10.0)
