"""The state of a run in a file; on ranks in one of each rank, and a file that names the set."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..common import MeshError, OptionError, ReadError, agreed, check_writable
from .checkpoint import load_state, save_state

__all__ = ["StateFiles", "damage_told"]

State = dict[str, Any]

_SET: dict[str, Any] = {"token": str, "turn": int, "parts": int}  # which set of parts the file names


class StateFiles:
    """Where the state of a run is kept, for another one to go on from: written completely or not at all.

    On ranks each writes a part beside the file, with what it has of every array; the file, which names the parts, comes
    last, and those of the set before stay until then. Any number of ranks goes on from it, or one process, and ranks
    from what one process has left.

    Parameters
    ----------
    path
        The file, .npz.
    version, other_runs
        As of :func:`load_state`.
    comm
        The ranks, all of which must do the same with it.
    """

    def __init__(self, path: str | os.PathLike[str], version: int, other_runs: str, comm: Any = None) -> None:
        self.path, self._version, self._other_runs, self._comm = Path(path), version, other_runs, comm
        self._turn, self._parts = 0, 0

    def check_writable(self) -> None:
        """Raise a WriteError unless files of these names can be written by this rank."""
        check_writable(self.path)
        if self._comm is not None:
            check_writable(self._part(0, self._comm.rank))

    def save(self, fingerprint: str, state: Mapping[str, Any]) -> None:
        """Write the state of a run: numbers and words, which all ranks have, and rows of arrays, each rank its own.

        Raises
        ------
        WriteError
            If it cannot be written; an older one is still there then.
        """
        comm = self._comm
        if comm is None:
            self._save_index(fingerprint, dict(state), 0, 0)
            return
        rows = {name: value for name, value in state.items() if np.ndim(value)}
        turn, token = 1 - self._turn, comm.bcast(secrets.token_hex(8) if comm.rank == 0 else None)
        with agreed(comm):
            save_state(self._part(turn, comm.rank), self._version, f"{fingerprint} {token}", rows)
        with agreed(comm, named=False):
            if comm.rank == 0:
                none = {name: values[:0] for name, values in rows.items()}
                index = {**state, **none, "token": token, "turn": turn, "parts": comm.size}
                self._save_index(fingerprint, index, turn, comm.size)
        self._turn, self._parts = turn, comm.size

    def load(self, fingerprint: str) -> State:
        """What a run has left there; on ranks each has some of the rows of every array, one process all of them.

        Raises
        ------
        ReadError
            If there is no sound checkpoint.
        OptionError
            If it belongs to another run.
        """
        comm, index, token, turn, parts = self._comm, State(), "", 0, 0
        with agreed(comm, named=False):
            if comm is None or comm.rank == 0:
                index = load_state(self.path, self._version, fingerprint, self._other_runs)
                with damage_told(self.path):
                    token, turn, parts = (kind(index.pop(key, kind())) for key, kind in _SET.items())
        told = token, turn, parts, {name: (value if value.ndim == 0 else value[:0]) for name, value in index.items()}
        token, self._turn, self._parts, known = told if comm is None else comm.bcast(told)
        sets = [index] if index else []
        with agreed(comm):
            for rank in range(0 if comm is None else comm.rank, self._parts, 1 if comm is None else comm.size):
                sets.append(self._rows(rank, f"{fingerprint} {token}", known))
        rows = {name: none for name, none in known.items() if none.ndim}
        return known | {name: np.concatenate([none, *(one[name] for one in sets)]) for name, none in rows.items()}

    def _rows(self, rank: int, fingerprint: str, known: State) -> State:
        """The part of a rank: the arrays that the file names, of the same kind."""
        path = self._part(self._turn, rank)
        found = load_state(path, self._version, fingerprint, f"another set than {self.path.name} names")
        with damage_told(path):
            for name, none in known.items():
                if none.ndim and (found[name].dtype, found[name].shape[1:]) != (none.dtype, none.shape[1:]):
                    raise ValueError(f"{name} of shape {found[name].shape}")
        return found

    def _save_index(self, fingerprint: str, state: Mapping[str, Any], turn: int, parts: int) -> None:
        save_state(self.path, self._version, fingerprint, state)
        for rank in range(self._parts):
            with suppress(OSError):  # what is left of the set before does no harm
                self._part(self._turn, rank).unlink()
        self._turn, self._parts = turn, parts

    def _part(self, turn: int, rank: int) -> Path:
        return self.path.with_name(f"{self.path.stem}_{turn}_{rank:04d}{self.path.suffix}")


@contextmanager
def damage_told(path: Path) -> Iterator[None]:
    """What a checkpoint lacks, or has in another form, comes as a ReadError."""
    try:
        yield
    except (MeshError, OptionError):
        raise
    except (KeyError, IndexError, ValueError, TypeError, AttributeError) as problem:
        raise ReadError(f"the checkpoint {path} is damaged ({type(problem).__name__}: {problem})") from problem
