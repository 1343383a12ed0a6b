"""The command line: its parser, and the exit codes of all commands."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Sequence

from ..common import MeshError, OptionError, WriteError, interruptible
from ..io import READ_EXTENSIONS, SURFACES_ONLY, WRITE_EXTENSIONS, outside_references_allowed
from ..kernel import use_threads
from ..version import __version__
from .commands import COMMANDS, Command, load
from .terminal import Parser, flush_standard_streams, open_standard_streams, print_line

__all__ = ["main", "parser"]

_EXIT_CODES = """exit codes:
  0    done; a run that stops before its tolerance says why, and counts as done
  1    the mesh cannot be worked on, or a file cannot be read or written
  2    the command line makes no sense
  130  interrupted (Ctrl-C or SIGTERM); `regularize` and `remesh` have written the mesh they had reached
"""


_FORMATS = f"""formats:
  read      {" ".join(READ_EXTENSIONS[:14])}
            {" ".join(READ_EXTENSIONS[14:])}
  written   {" ".join(WRITE_EXTENSIONS)}
  surfaces  also {" ".join(SURFACES_ONLY)}
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
    open_standard_streams()
    code = _run(arguments)
    problem = flush_standard_streams()
    if problem is None or code != 0:
        return code
    # The reader of our output is gone, or has no room.
    return 1 if isinstance(problem, BrokenPipeError) else _print_error(f"error: {problem}", 1)


def _run(arguments: Sequence[str] | None) -> int:
    try:
        words = sys.argv[1:] if arguments is None else arguments
        parsed = parser(next((word for word in words if word in COMMANDS), "")).parse_args(words)
    except SystemExit as ending:
        return int(ending.code or 0)
    try:
        with interruptible(), outside_references_allowed(getattr(parsed, "outside_references", False)):
            if not getattr(parsed, "mpi", False):  # ranks do it themselves, as one says what is wrong with it
                use_threads(parsed.threads)
            return int(parsed.run(parsed))
    except KeyboardInterrupt:
        return _print_error("interrupted: what was not complete was not written", 130)
    except OptionError as problem:
        return _print_error(f"error: {problem}", 2)
    except (MeshError, WriteError) as problem:
        return _print_error(f"error: {problem}", 1)
    except MemoryError:
        return _print_error("error: not enough memory for this mesh", 1)
    except OSError as problem:
        return 1 if isinstance(problem, BrokenPipeError) else _print_error(f"error: {problem}", 1)


def _print_error(message: str, code: int) -> int:
    """Print a message on one line of stderr; returns the exit code."""
    print_line(" ".join(message.split()), error=True)
    return code


def parser(command: str | None = None) -> ArgumentParser:
    """The parser of the command line; where one command is named, the others have no arguments, and are not loaded."""
    result = Parser(
        prog="hexconformal",
        description="Make meshes of solid cells, and surfaces, regular by minimizing their quaternionic distortion.",
        epilog=f"{_FORMATS}\n{_EXIT_CODES}\n`hexconformal COMMAND --help` shows options and examples.",
        formatter_class=RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    result.add_argument("--version", action="version", version=f"hexconformal {__version__}")
    subparsers = result.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        subparser = subparsers.add_parser(
            name,
            help=summary[0].lower() + summary[1:].partition(".")[0],
            description=summary,
            formatter_class=RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        if command in (None, name):
            _complete(subparser, load(name))
    return result


def _complete(subparser: ArgumentParser, command: Command) -> None:
    subparser.epilog = f"examples:\n{command.EXAMPLES}"
    subparser.set_defaults(run=command.run)
    subparser.add_argument(
        "--threads", type=int, metavar="N", help="processors to use; default all that the process may (same result)"
    )
    command.add_arguments(subparser)
