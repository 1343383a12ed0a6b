"""Runs that are followed in a folder: history, time series, checkpoints, and going on from them.

Belongs here: what a run writes while it goes on, whatever it computes. Imports `common`, `mesh`, `io` and `ranks`.
"""

from .checkpoint import load_state, run_fingerprint, save_state
from .history import HistoryFile
from .mesh_digest import mesh_digest
from .row_digests import row_digest
from .run_folder import RunFolder, RunState
from .series import Series, frames_listed, series_place
from .state_files import StateFiles, damage_told

__all__ = [
    "HistoryFile",
    "RunFolder",
    "RunState",
    "Series",
    "StateFiles",
    "damage_told",
    "frames_listed",
    "load_state",
    "mesh_digest",
    "row_digest",
    "run_fingerprint",
    "save_state",
    "series_place",
]
