"""Files that a file names: they must be regular files in its folder, or below it, unless others are allowed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from ....common import ReadError

__all__ = ["outside_references_allowed", "referenced_file"]

_ALLOWED = ContextVar("outside references are allowed", default=False)


@contextmanager
def outside_references_allowed(allowed: bool = True) -> Iterator[None]:
    """Inside, files that are read may name others (the HDF5 file of an .xdmf, pieces of a .pvtu, what an .inp
    includes) in any folder.

    Otherwise these must be in the folder of the file that names them, or below: who sends a mesh shall not choose what
    else is read on this machine.

    Examples
    --------
    >>> with outside_references_allowed():
    ...     pass
    """
    before = _ALLOWED.set(allowed)
    try:
        yield
    finally:
        _ALLOWED.reset(before)


def referenced_file(path: Path, name: str) -> Path:
    """The file that the file at `path` names.

    Raises
    ------
    ReadError
        If it is outside the folder of `path` and that is not allowed, or no regular file.
    """
    place = path.parent / name
    folder = os.path.realpath(path.parent)
    if not _ALLOWED.get() and os.path.commonpath([folder, os.path.realpath(place)]) != folder:
        raise ReadError(
            f"it names {name!r}, which is outside its folder: put it there, or allow it "
            "(--outside-references; in Python hexconformal.io.outside_references_allowed)"
        )
    if not place.exists():
        raise ReadError(f"it names {name!r}, which does not exist")
    if not place.is_file():
        raise ReadError(f"it names {name!r}, which must be a regular file")
    return place
