"""Checkpoints: the state of a run as arrays, and of which run it is, written completely or not at all."""

from __future__ import annotations

import hashlib
import math
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
    path = Path(path)
    try:
        if not path.is_file():
            raise ValueError("it must be a regular file" if path.exists() else "it does not exist")
        _check_sizes(path)
        with np.load(path, allow_pickle=False) as file:
            found: dict[str, Any] = dict(file)
        if int(found.pop("version", -1)) != version:
            raise ReadError(f"{path} is no checkpoint of this version ({version})")
        problem = str(found.pop("problem"))
    except ReadError:
        raise
    except Exception as reason:  # whatever is wrong with a file that may be damaged
        raise ReadError(f"cannot read the checkpoint {path}: {reason}") from reason
    if problem != fingerprint:
        raise OptionError(f"the checkpoint {path} belongs to {other_runs}")
    return found


def _check_sizes(path: Path) -> None:
    """Raise a ValueError unless all arrays in a file lie there as they are: none is packed, none larger than told."""
    total = 0
    with zipfile.ZipFile(path) as archive:
        for member in archive.infolist():
            total += member.file_size
            if member.compress_type != zipfile.ZIP_STORED or total > path.stat().st_size:
                raise ValueError(f"its array {member.filename} must not be packed, nor larger than the file")
            with archive.open(member) as file:
                magic = np.lib.format.read_magic(file)
                read = np.lib.format.read_array_header_1_0 if magic == (1, 0) else np.lib.format.read_array_header_2_0
                shape, _, kind = read(file)
                if kind.hasobject or math.prod(shape) * kind.itemsize > member.file_size:
                    raise ValueError(f"its array {member.filename} must be of numbers, and as large as its header says")
