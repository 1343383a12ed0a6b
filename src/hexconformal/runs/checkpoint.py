"""Checkpoints: the state of a run as arrays, and of which run it is, written completely or not at all."""

from __future__ import annotations

import hashlib
import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, ReadError, save_atomically

__all__ = ["load_state", "run_fingerprint", "save_state"]


def run_fingerprint(words: str, arrays: Iterable[NDArray[Any]]) -> str:
    """Options in words and a digest of what a run was given: a run goes on from checkpoints with the same alone."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return f"{words} {digest.hexdigest()}"


def save_state(path: str | os.PathLike[str], version: int, fingerprint: str, state: Mapping[str, Any]) -> None:
    """Write the state of a run.

    Parameters
    ----------
    path
        The file, .npz; replaced at once if it is there.
    version
        Of what `state` holds.
    fingerprint
        See :func:`run_fingerprint`.
    state
        Arrays and numbers by name.

    Raises
    ------
    WriteError
        If the file cannot be written; an older one is still there then.
    """

    def put(target: Path) -> None:
        with open(target, "wb") as file:
            np.savez(file, version=version, problem=fingerprint, **state)

    save_atomically(Path(path), put)


def load_state(path: str | os.PathLike[str], version: int, fingerprint: str, other_runs: str) -> dict[str, Any]:
    """Read the state of a run.

    Parameters
    ----------
    path, version, fingerprint
        As it was written.
    other_runs
        What a checkpoint with another fingerprint belongs to, in words.

    Raises
    ------
    ReadError
        If the file is no checkpoint of this version.
    OptionError
        If it belongs to another run.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            found: dict[str, Any] = dict(file)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as reason:
        raise ReadError(f"cannot read the checkpoint {path}: {reason}") from reason
    if int(found.pop("version", -1)) != version:
        raise ReadError(f"{path} is no checkpoint of this version ({version})")
    if str(found.pop("problem")) != fingerprint:
        raise OptionError(f"the checkpoint {path} belongs to {other_runs}")
    return found
