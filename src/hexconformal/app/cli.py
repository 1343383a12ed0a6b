"""The command line: all commands, and how they end."""

from __future__ import annotations

import os
import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence

from ..common import MeshError, OptionError, WriteError, interruptible
from ..io import READ_EXTENSIONS, WRITE_EXTENSIONS
from ..version import __version__
from .commands.check import add_check
from .commands.demo import add_demo
from .commands.flow import add_flow
from .commands.move import add_move
from .commands.orient import add_orient
from .commands.quality import add_quality
from .commands.regularize import add_regularize
from .commands.remesh import add_remesh

__all__ = ["main", "parser"]

_EXIT_CODES = """exit codes:
  0    done; a run that stops before its tolerance says why, and counts as done
  1    the mesh cannot be worked on, or a file cannot be read or written
  2    the command line makes no sense
  130  interrupted (Ctrl-C or SIGTERM); `regularize` and `remesh` have written the mesh they had reached
"""


_FORMATS = f"""formats:
  read     {" ".join(READ_EXTENSIONS[:14])}
           {" ".join(READ_EXTENSIONS[14:])}
  written  {" ".join(WRITE_EXTENSIONS)}
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments
        Words after the program's name; default those it was started with.

    Returns
    -------
    The exit code: 0 done, 1 a mesh or file that cannot be used, 2 wrong usage, 130 interrupted.

    Examples
    --------
    >>> from hexconformal.generate import box
    >>> from hexconformal import HexMesh, write
    >>> write("box.vtu", HexMesh(*box((2, 2, 2))))
    []
    >>> main(["check", "box.vtu"])
    box.vtu: 8 hexahedra, 27 points, 0 inverted, 0 invalid
    can be worked on
    0
    """
    try:
        parsed = parser().parse_args(arguments)
    except SystemExit as ending:
        return int(ending.code or 0)
    try:
        with interruptible():
            return int(parsed.run(parsed))
    except KeyboardInterrupt:
        return _failed("interrupted: nothing was written", 130)
    except OptionError as problem:
        return _failed(f"error: {problem}", 2)
    except (MeshError, WriteError) as problem:
        return _failed(f"error: {problem}", 1)
    except MemoryError:
        return _failed("error: not enough memory for this mesh", 1)
    except OSError as problem:
        # Whoever reads our output has had enough, or has no room; Python would complain again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1 if isinstance(problem, BrokenPipeError) else _failed(f"error: {problem}", 1)


def _failed(message: str, code: int) -> int:
    print(" ".join(message.split()), file=sys.stderr)
    return code


def parser() -> ArgumentParser:
    """The parser of the command line, with all commands."""
    result = ArgumentParser(
        prog="hexconformal",
        description="Make hexahedral meshes, and surfaces, regular by minimizing quaternionic conformal distortion.",
        epilog=f"{_FORMATS}\n{_EXIT_CODES}\n`hexconformal COMMAND --help` shows options and examples.",
        formatter_class=RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    result.add_argument("--version", action="version", version=f"hexconformal {__version__}")
    added = result.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for add in (add_regularize, add_remesh, add_flow, add_move, add_quality, add_orient, add_check, add_demo):
        add(added)
    return result
