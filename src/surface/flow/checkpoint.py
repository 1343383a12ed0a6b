"""Checkpoints of a flow: written atomically, and a run that goes on from one equals the one that never stopped."""

from __future__ import annotations

import hashlib
import os
import zipfile
from pathlib import Path

import numpy as np

from hexconformal.errors import OptionError, ReadError
from hexconformal.files import saving

from .evolve import Evolution

__all__ = ["load", "save"]

_VERSION = 2


def save(path: str | os.PathLike[str], run: Evolution) -> None:
    """Write where a run stands.

    Parameters
    ----------
    path
        The file, .npz; replaced at once if it is there.
    run
        A run, at any time between two moments.

    Raises
    ------
    WriteError
        If the file cannot be written; an older one is still there then.
    """

    def put(target: Path) -> None:
        with open(target, "wb") as file:
            np.savez(file, version=_VERSION, problem=_problem(run), **run.standing())

    saving(Path(path), put)


def load(path: str | os.PathLike[str], run: Evolution) -> None:
    """Set a run to where the checkpoint stands.

    Parameters
    ----------
    path
        What :func:`surface.flow.save` has written.
    run
        A run made for the same surface and flow, not begun yet.

    Raises
    ------
    ReadError
        If the file is no checkpoint.
    OptionError
        If it belongs to another surface or flow.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            found = dict(file)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as problem:
        raise ReadError(f"cannot read the checkpoint {path}: {problem}") from problem
    if int(found.pop("version", -1)) != _VERSION:
        raise ReadError(f"{path} is no checkpoint of this version ({_VERSION})")
    if str(found.pop("problem")) != _problem(run):
        raise OptionError(f"the checkpoint {path} belongs to another surface or another flow")
    run.resume(found)


def _problem(run: Evolution) -> str:
    """What has to be the same: input, energy, constraints."""
    cells = run.mesh.cells
    digest = hashlib.sha256()
    for array in (run.mesh.points, cells.triangles, cells.quads):
        digest.update(np.ascontiguousarray(array).tobytes())
    return f"{run.flow!r} {digest.hexdigest()}"
