"""Checkpoints: arrays that tell where a run stands, and of which run, written completely or not at all."""

from __future__ import annotations

import hashlib
import os
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, ReadError, saving

__all__ = ["load_state", "problem_of", "save_state"]


def problem_of(words: str, arrays: Iterable[NDArray[Any]]) -> str:
    """What has to be the same for a run to go on: its options in words, and a digest of what it was given."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return f"{words} {digest.hexdigest()}"


def save_state(path: str | os.PathLike[str], version: int, problem: str, state: Mapping[str, Any]) -> None:
    """Write where a run stands.

    Parameters
    ----------
    path
        The file, .npz; replaced at once if it is there.
    version
        Of what `state` holds.
    problem
        See :func:`problem_of`.
    standing
        Arrays and numbers by name.

    Raises
    ------
    WriteError
        If the file cannot be written; an older one is still there then.
    """

    def put(target: Path) -> None:
        with open(target, "wb") as file:
            np.savez(file, version=version, problem=problem, **state)

    saving(Path(path), put)


def load_state(path: str | os.PathLike[str], version: int, problem: str, others: str) -> dict[str, Any]:
    """Read where a run stands.

    Parameters
    ----------
    path, version, problem
        As it was written.
    others
        What a checkpoint with another problem belongs to, in words.

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
    if str(found.pop("problem")) != problem:
        raise OptionError(f"the checkpoint {path} belongs to {others}")
    return found
