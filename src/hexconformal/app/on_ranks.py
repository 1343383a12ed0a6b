"""Commands on the ranks of MPI: every rank runs them, rank 0 speaks."""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from ..common import (
    MeshError,
    OptionError,
    WriteError,
    agreed,
    interruption_waits,
    is_agreed,
    uninterrupted,
    unusable_points,
    write_text,
)
from ..kernel import use_threads
from ..quality import quality
from ..ranks import MeshPiece, RankSpace, check_piece_writable, mpi, piece_path, rank_summary, read_piece, write_piece
from ..runs import HistoryFile
from .commands.arguments import STDOUT, check_checkpoint
from .commands.results.outputs import check_paths, named_inputs, print_summary
from .progress import Progress
from .terminal import print_line, print_text

if TYPE_CHECKING:
    from ..regularization import Checkpoint, Options, Regularization

__all__ = ["finished_first", "on_all_ranks", "quality_on_ranks", "refuse", "regularize_on_ranks"]

_HEADSTART = 1.0  # seconds: where all ranks fail alike rank 0 says so before another ends them all


def regularize_on_ranks(arguments: Namespace, options_of: Callable[[Namespace], Options]) -> int:
    """Regularize a mesh on all ranks; an interruption of any of them leaves the mesh reached so far."""
    from ..regularization import Checkpoint, Regularization  # not loaded for what does not regularize

    def work(comm: Any) -> int:
        with agreed(comm, named=False):
            options = options_of(arguments)
        for flag in ("frames", "plot", "picture", "worst_picture", "html"):
            refuse(getattr(arguments, flag) is not None, f"--{flag.replace('_', '-')}")
        refuse(arguments.other_cells != "refuse", "--other-cells keep")
        refuse(arguments.linearize, "--linearize")
        _check(arguments, [arguments.output, arguments.history, _file(arguments.report), arguments.checkpoint], comm)
        check_piece_writable(arguments.output, comm)
        with agreed(comm, named=False):
            check_checkpoint(arguments)
        with Progress(arguments.quiet or comm.rank > 0) as progress, finished_first():
            progress.show(f"reading {arguments.input}")
            piece, path, start = read_piece(arguments.input, comm), arguments.checkpoint, None
            checkpoint = None if path is None else Checkpoint(path, piece, options, comm)
            if checkpoint is not None and arguments.resume and comm.bcast(checkpoint.path.exists()):
                start = checkpoint.load()
            run = Regularization(piece, options, comm=comm, start=start)
            history = arguments.history if comm.rank == 0 else None
            _iterate(run, history, checkpoint, progress, comm)
            progress.show(f"writing {arguments.output}")
            result = run.result()
            write_piece(arguments.output, result.mesh, comm)
            if checkpoint is not None and (last := run.reached(result)) is not None:
                checkpoint.save(last)
            interrupted = is_interrupted(comm)
            if comm.rank == 0:
                _tell(arguments, result.report, interrupted)
        return 130 if interrupted else 0

    return on_all_ranks(arguments, work)


def quality_on_ranks(arguments: Namespace, check: Callable[[], None]) -> int:
    """Measure a mesh on all ranks; what the command line says is checked first."""

    def work(comm: Any) -> int:
        with agreed(comm, named=False):
            check()
        for flag in ("plot", "picture", "html"):
            refuse(getattr(arguments, flag) is not None, f"--{flag}")
        _check(arguments, [arguments.output, _file(arguments.json)], comm)
        if arguments.output is not None:
            check_piece_writable(arguments.output, comm)
        piece = read_piece(arguments.input, comm)
        with agreed(comm):
            odd, text = unusable_points(piece.points, piece.node_labels)
            if len(odd):
                raise MeshError(f"{arguments.input}: {text}")
        measured = quality(piece)
        summary = rank_summary(measured, RankSpace.of_cells(comm), arguments.worst)
        if arguments.output is not None:
            better: MeshPiece = piece.replaced(cell_data=measured.arrays())
            write_piece(arguments.output, better, comm)
        if comm.rank == 0:
            if arguments.json is None:
                print_summary(summary, "scaled_jacobian")
            else:
                _write_or_print(arguments.json, summary.to_json())
        return 0

    return on_all_ranks(arguments, work)


def on_all_ranks(arguments: Namespace, work: Callable[[Any], int]) -> int:
    """Do something on all ranks: what one of them cannot go on from ends all, with its message."""
    comm = mpi().COMM_WORLD
    try:
        with agreed(comm, named=False):
            # Processors are for ranks, unless somebody says how many each has.
            use_threads(1 if arguments.threads is None else arguments.threads)
        return work(comm)
    except KeyboardInterrupt:
        # The others wait for this rank.
        _end_all(comm, "interrupted: what was not complete was not written", 130)
        raise
    except Exception as problem:
        if is_agreed(problem):
            if comm.rank == 0:
                raise
            return 2 if isinstance(problem, OptionError) else 1
        known = isinstance(problem, MeshError | OptionError | WriteError)
        kind = "" if known else f"{type(problem).__name__}: "
        text = f"error on rank {comm.rank}: {kind}{' '.join(str(problem).split())}"
        _end_all(comm, text, 2 if isinstance(problem, OptionError) else 1)
        raise


def _end_all(comm: Any, text: str, code: int) -> None:
    """End all ranks, which may be waiting for this one, with a message; where there is one alone it goes on."""
    if comm.size == 1:
        return
    if comm.rank > 0:
        time.sleep(_HEADSTART)
    print_line(text, error=True)
    sys.stderr.flush()
    comm.Abort(code)


@contextmanager
def finished_first() -> Iterator[None]:
    """Inside, interruptions wait; they are over where it comes to its end: ranks ask :func:`is_interrupted`."""
    finished = False
    try:
        with uninterrupted():
            yield
            finished = True
    except KeyboardInterrupt:
        if not finished:
            raise


def is_interrupted(comm: Any) -> bool:
    """True on all ranks where an interruption of one of them waits; all must call it."""
    return bool(comm.allreduce(int(interruption_waits()), mpi().MAX))


def refuse(asked: bool, what: str) -> None:
    """Raise an OptionError where something is asked for that is not there on ranks."""
    if asked:
        raise OptionError(f"{what} must go without --mpi: it is not there on ranks yet")


def _file(path: str | None) -> str | None:
    return None if path == STDOUT else path


def _check(arguments: Namespace, outputs: list[str | None], comm: Any) -> None:
    """Raise on all ranks unless outputs can be written and are none of the inputs."""
    with agreed(comm, named=False):
        inputs = named_inputs(arguments.input)
        if comm.rank == 0:
            check_paths(outputs, inputs, arguments.overwrite)
        pieces = set() if outputs[0] is None else {piece_path(outputs[0], rank).resolve() for rank in range(comm.size)}
        if not arguments.overwrite and pieces & {path.resolve() for path in inputs}:
            raise OptionError(f"pieces of {outputs[0]} are pieces of the input: add --overwrite to replace them")


def _iterate(
    run: Regularization, history: str | None, checkpoint: Checkpoint | None, progress: Progress, comm: Any
) -> None:
    """Run to the end, or until a rank was interrupted, which all leave at the same iteration."""
    with ExitStack() as stack:
        file = None if history is None else stack.enter_context(HistoryFile(history))
        for record in run:
            if file is not None:
                file.add(record)
            if checkpoint is not None:
                checkpoint.offer(run)
            progress.show(str(record))
            if is_interrupted(comm):
                break


def _tell(arguments: Namespace, report: Any, interrupted: bool) -> None:
    if arguments.report is not None:
        _write_or_print(arguments.report, report.to_json())
    if arguments.report != STDOUT and not arguments.quiet:
        print_text(report)
        print_line(f"wrote {arguments.output} and its pieces")
    if interrupted:
        print_line(f"interrupted: the mesh of iteration {report.iterations} is in {arguments.output}", error=True)


def _write_or_print(path: str, text: str) -> None:
    if path == STDOUT:
        print_text(text)
    else:
        write_text(path, text + "\n")
