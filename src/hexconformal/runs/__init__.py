"""Runs that are followed in a folder: history, time series, checkpoints, and going on from them.

Belongs here: what a run writes while it goes on, whatever it computes. Imports `common`, `mesh` and `io`.
"""

from .checkpoint import load_state, run_fingerprint, save_state
from .history import HistoryFile
from .row_digests import row_digest
from .run_folder import RunFolder, RunState
from .series import Series, frames_listed, series_place

__all__ = [
    "HistoryFile",
    "RunFolder",
    "RunState",
    "Series",
    "frames_listed",
    "load_state",
    "row_digest",
    "run_fingerprint",
    "save_state",
    "series_place",
]
