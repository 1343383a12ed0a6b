"""How often a run writes its checkpoint."""

from __future__ import annotations

from dataclasses import dataclass

from ...common import Schedule, tuned

__all__ = ["CheckpointSchedule"]


@dataclass(frozen=True)
class CheckpointSchedule(Schedule):
    """When a checkpoint is due.

    Attributes
    ----------
    share
        Of the time of a run that writing may take: after each checkpoint so much time goes by that the next one costs
        no more than that. At a fiftieth nobody notices, and of a run whose checkpoints take a second what is lost is
        less than a minute.
    """

    share: float = tuned(0.02, 0.0, 1.0)
