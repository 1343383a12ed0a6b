"""Checkpoints of a run: what it has reached, in a file; on ranks in one of each rank, and a file that names the set."""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, ReadError, check_writable
from ...elements import QUADRATIC_TYPES
from ...io import as_volume_mesh
from ...mesh import HexMesh, MixedMesh, blocks_of
from ...ranks import agreed, each_once, mpi
from ...runs import load_state, row_digest, run_fingerprint, save_state
from ..options import Options
from .schedule import CheckpointSchedule
from .start import Start, cell_ids_of, node_ids_of

__all__ = ["Checkpoint"]

Field = NDArray[np.float64]

_VERSION = 1
_OTHERS = "another mesh, or a run with other options"
_TOLD = {"token": str, "turn": int, "parts": int, "lowered": bool, "on_the_way": bool}
_LIMITS = ("gradient_tolerance", "max_iterations")  # a run that goes on may be given other ones


class _Run(Protocol):
    def reached(self, result: Any = None) -> Start | None: ...


class Checkpoint:
    """The file in which a run leaves what it has reached, for another one to go on from.

    It is written completely or not at all. On ranks each writes a part beside it, of nodes by their ids; the file,
    which names the parts, comes last, and those of the set before stay until then. Any number of ranks goes on from
    it, or one process.

    Parameters
    ----------
    path
        The file, .npz.
    mesh
        The mesh of the run, as :func:`hexconformal.as_volume_mesh` takes it; on ranks the
        :class:`hexconformal.ranks.MeshPiece` of each.
    options
        Those of the run. What is reached belongs to the same mesh and the same ones alone, but for the limits.
    comm
        The ranks, all of which must do the same with it.
    schedule
        How often it is written.

    Raises
    ------
    WriteError
        If a file of this name cannot be written.
    OptionError
        If the options ask for another surface to slide on, or cells are quadratic: runs cannot go on there yet.

    Examples
    --------
    >>> from hexconformal import Options, Regularization, generate
    >>> mesh, options = generate.sheared_cube(4), Options(hausdorff=0.01)
    >>> checkpoint, run = Checkpoint("run.npz", mesh, options), Regularization(mesh, options)
    >>> for record in run:
    ...     checkpoint.offer(run)
    >>> again = Regularization(mesh, options, start=checkpoint.load())
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        mesh: Any,
        options: Options,
        comm: Any = None,
        schedule: CheckpointSchedule | None = None,
    ) -> None:
        self.path, self._comm = Path(path), comm
        self._schedule = CheckpointSchedule() if schedule is None else schedule
        self._due, self._turn, self._parts = -np.inf, 0, 0
        with self._together():
            taken = mesh if isinstance(mesh, HexMesh | MixedMesh) else as_volume_mesh(mesh)
            _require_resumable(taken, options)
            check_writable(self.path)
            if comm is not None:
                check_writable(self._part(0, comm.rank))
        self._node_ids = node_ids_of(taken)
        self.fingerprint = _fingerprint(taken, options, comm)

    def offer(self, run: _Run) -> None:
        """Write what a run has reached, if that is due, and there is something to go on from.

        Raises
        ------
        WriteError
            If it cannot be written; an older one is still there then.
        """
        began = time.monotonic()
        if self._from_first(began < self._due):
            return
        start = run.reached()
        if start is not None:
            self.save(start)
        now = time.monotonic()
        self._due = now + (now - began) / self._schedule.share if self._schedule.share > 0.0 else np.inf

    def save(self, start: Start) -> None:
        """Write what a run has reached; raises a WriteError if that cannot be, an older one is still there then."""
        ids = self._node_ids if start.node_ids is None else start.node_ids
        rows = {"ids": ids, "points": start.points}
        if self._comm is None:
            self._save_index(rows, "", 0, 0, start)
            self._turn, self._parts = 0, 0
            return
        comm, turn = self._comm, 1 - self._turn
        token = comm.bcast(secrets.token_hex(8) if comm.rank == 0 else None)
        with agreed(comm):
            save_state(self._part(turn, comm.rank), _VERSION, f"{self.fingerprint} {token}", rows)
        with agreed(comm, named=False):
            if comm.rank == 0:
                none = {name: values[:0] for name, values in rows.items()}
                self._save_index(none, token, turn, comm.size, start)
        self._turn, self._parts = turn, comm.size

    def load(self) -> Start:
        """What a run has left there; on ranks each has some of the nodes.

        Raises
        ------
        ReadError
            If there is no sound checkpoint.
        OptionError
            If it belongs to another mesh, or a run with other options.
        """
        sets: list[tuple[NDArray[np.int64], Field]] = []
        told: dict[str, Any] = {}
        with self._together(named=False):
            if self._comm is None or self._comm.rank == 0:
                index = load_state(self.path, _VERSION, self.fingerprint, _OTHERS)
                with _damage_told(self.path):
                    told = {key: kind(index[key].item()) for key, kind in _TOLD.items()}
                    sets.append(_rows_of(index))
        told = self._from_first(told)
        first, step = (0, 1) if self._comm is None else (self._comm.rank, self._comm.size)
        self._turn, self._parts = told["turn"], told["parts"]
        with self._together():
            for rank in range(first, self._parts, step):
                part, fingerprint = self._part(self._turn, rank), f"{self.fingerprint} {told['token']}"
                found = load_state(part, _VERSION, fingerprint, f"another set than {self.path.name} names")
                with _damage_told(part):
                    sets.append(_rows_of(found))
        ids = np.concatenate([np.empty(0, np.int64), *(one[0] for one in sets)])
        points = np.concatenate([np.empty((0, 3)), *(one[1] for one in sets)])
        return Start(points, told["lowered"], told["on_the_way"], ids)

    def _save_index(self, rows: dict[str, NDArray[Any]], token: str, turn: int, parts: int, start: Start) -> None:
        told = token, turn, parts, start.lowered, start.on_the_way
        state = {**rows, **dict(zip(_TOLD, told, strict=True))}
        save_state(self.path, _VERSION, self.fingerprint, state)
        for rank in range(self._parts):
            with suppress(OSError):  # what is left of the set before does no harm
                self._part(self._turn, rank).unlink()

    def _part(self, turn: int, rank: int) -> Path:
        return self.path.with_name(f"{self.path.stem}_{turn}_{rank:04d}{self.path.suffix}")

    def _together(self, named: bool = True) -> AbstractContextManager[None]:
        return nullcontext() if self._comm is None else agreed(self._comm, named)

    def _from_first(self, value: Any) -> Any:
        return value if self._comm is None else self._comm.bcast(value)


@contextmanager
def _damage_told(path: Path) -> Iterator[None]:
    """What a file lacks, or has in another form, comes as a ReadError."""
    try:
        yield
    except (KeyError, ValueError, TypeError, AttributeError) as problem:
        raise ReadError(f"the checkpoint {path} is damaged ({type(problem).__name__}: {problem})") from problem


def _rows_of(state: dict[str, Any]) -> tuple[NDArray[np.int64], Field]:
    """Ids (k,) and points (k, 3)."""
    ids, points = np.asarray(state["ids"]), np.asarray(state["points"])
    if ids.dtype != np.int64 or points.dtype != np.float64 or points.shape != (*ids.shape, 3) or ids.ndim != 1:
        raise ValueError(f"ids of shape {ids.shape} and points of shape {points.shape}")
    return ids, points


def _require_resumable(mesh: HexMesh | MixedMesh, options: Options) -> None:
    """Raise an OptionError where runs cannot go on from what an earlier one has reached yet."""
    if options.surface is not None:
        raise OptionError("a checkpoint must go without another surface to slide on: runs cannot go on there yet")
    if any(block.cell_type.name in QUADRATIC_TYPES for block in blocks_of(mesh)):
        raise OptionError("a checkpoint must go without hexahedra of 20 or 27 nodes: runs cannot go on there yet")


def _fingerprint(mesh: HexMesh | MixedMesh, options: Options, comm: Any) -> str:
    """Which run it is: the same on any ranks, in whatever order these have nodes and cells."""
    words, arrays = ["regularize"], []
    for one in fields(options):
        value = getattr(options, one.name)
        if one.name in _LIMITS:
            continue
        if value is None or isinstance(value, str | int | float | np.generic):
            words.append(f"{one.name}={value!r}")
        else:
            words.append(one.name)
            arrays.append(np.asarray(value))
    nodes: tuple[NDArray[Any], NDArray[Any]] = node_ids_of(mesh), mesh.points
    names, cells = nodes[0], cell_ids_of(mesh)
    sums = [row_digest(cells[block.places], names[block.cells]) for block in blocks_of(mesh)]
    if comm is not None:
        nodes = each_once(comm, *nodes)  # a node is on all ranks with cells at it, a cell on one
    own = np.concatenate([row_digest(*nodes), *sums])
    digest = own if comm is None else np.empty_like(own)
    if comm is not None:
        comm.Allreduce(own, digest, mpi().SUM)
    return run_fingerprint(" ".join(words), (digest, *arrays))
