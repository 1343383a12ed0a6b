"""Readers in compiled code are tried on a file in a process of its own first: damaged files crash some of them."""

from __future__ import annotations

from pathlib import Path

from ....common import ReadError, python_can_be_started, run_python

__all__ = ["REFUSED", "try_reader"]

REFUSED = 40  # the first of the exit codes by which a trial says what is wrong
_TIME_LIMIT = 60.0, 1e-6  # seconds: at least, and for every byte
_MEMORY_LIMIT = 4 << 30, 40  # bytes: at least, and for every byte


def try_reader(code: str, path: Path, name: str, reasons: tuple[str, ...] = ()) -> None:
    """Raise a ReadError if code that reads the file ``sys.argv[1]`` crashes or does not come to an end.

    Parameters
    ----------
    code
        Python. An exception in it is none of the trial's business.
    path
        The file.
    name
        Of the reader, for messages.
    reasons
        Why the file is refused where the code ends with `REFUSED`, `REFUSED` + 1, ...
    """
    if not python_can_be_started():
        return
    size = path.stat().st_size
    seconds, memory = _TIME_LIMIT[0] + _TIME_LIMIT[1] * size, _MEMORY_LIMIT[0] + _MEMORY_LIMIT[1] * size
    found = run_python(code, str(path.absolute()), seconds=seconds, memory=memory)
    if found is None:
        raise ReadError(f"the file is malformed: {name} does not come to an end with it")
    if 0 <= found - REFUSED < len(reasons):
        raise ReadError(reasons[found - REFUSED])
    if found not in (0, 1, 2):
        raise ReadError(f"the file is malformed: {name} crashes on it")
