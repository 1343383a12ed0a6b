"""Python in a process of its own, which may crash, hang, or ask for too much memory, and is ended then."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

__all__ = ["python_can_be_started", "run_python"]

# The current folder is no place to import from: files that came with a mesh could be modules.
_BEGINNING = """import sys
sys.path[:] = sys.argv[1].split(chr(10))
try:
    import resource
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if int(sys.argv[2]):
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        most = int(sys.argv[2]) if hard == resource.RLIM_INFINITY else min(hard, int(sys.argv[2]))
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
except (ImportError, OSError, ValueError):
    pass
del sys.argv[1:3]
"""


def python_can_be_started() -> bool:
    """Whether there is an interpreter to start: inside another program `sys.executable` may be that program."""
    return Path(sys.executable or "none").name.lower().startswith(("python", "pypy"))


def run_python(code: str, *arguments: str, seconds: float | None = None, memory: int = 0) -> int | None:
    """Run code with the environment and the modules of this process, but none from the current folder.

    Parameters
    ----------
    code
        What to run; ``sys.argv[1:]`` are the arguments. What it prints is thrown away.
    seconds
        It is ended after so long; None: never.
    memory
        Bytes that it may ask for, where the system can limit that; 0: any number.

    Returns
    -------
    Its exit code, negative for a signal, and None if it was ended.

    Examples
    --------
    >>> run_python("import sys; sys.exit(len(sys.argv[1]))", "abc")
    3
    """
    here = os.path.realpath(os.curdir)
    folders = [path for path in sys.path if os.path.isabs(path) and os.path.realpath(path) != here]
    words = [sys.executable, "-c", _BEGINNING + code, "\n".join(folders), str(memory), *arguments]
    quiet = subprocess.DEVNULL
    try:
        return subprocess.run(words, stdin=quiet, stdout=quiet, stderr=quiet, timeout=seconds, check=False).returncode
    except subprocess.TimeoutExpired:
        return None
