"""Going on from where an earlier run has come to: what is handed in, and the files that keep it."""

from .checkpoint import Checkpoint
from .start import Start, begun_at

__all__ = ["Checkpoint", "Start", "begun_at"]
