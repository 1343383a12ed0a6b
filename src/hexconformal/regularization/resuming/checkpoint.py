"""Checkpoints of a run: what it has reached, in a file; on ranks in one of each rank, and a file that names the set."""

from __future__ import annotations

import os
import time
from dataclasses import fields
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...common import OptionError, agreed
from ...io import as_volume_mesh
from ...mesh import HexMesh, MixedMesh, blocks_of
from ...ranks import node_ids_of
from ...runs import StateFiles, damage_told, mesh_digest, run_fingerprint
from ..options import Options
from .schedule import CheckpointSchedule
from .start import Start

__all__ = ["Checkpoint"]

Field = NDArray[np.float64]

_VERSION = 1
_OTHERS = "another mesh, or a run with other options"
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
        self._files = StateFiles(path, _VERSION, _OTHERS, comm)
        self._schedule = CheckpointSchedule() if schedule is None else schedule
        self._due = -np.inf
        with agreed(comm):
            taken = mesh if isinstance(mesh, HexMesh | MixedMesh) else as_volume_mesh(mesh)
            _require_resumable(taken, options)
            self._files.check_writable()
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
        state = {"lowered": start.lowered, "on_the_way": start.on_the_way, "ids": ids, "points": start.points}
        self._files.save(self.fingerprint, state)

    def load(self) -> Start:
        """What a run has left there; on ranks each has some of the nodes.

        Raises
        ------
        ReadError
            If there is no sound checkpoint.
        OptionError
            If it belongs to another mesh, or a run with other options.
        """
        found = self._files.load(self.fingerprint)
        with agreed(self._comm), damage_told(self.path):
            ids, points = _rows_of(found)
            return Start(points, bool(found["lowered"]), bool(found["on_the_way"]), ids)

    def _from_first(self, value: Any) -> Any:
        return value if self._comm is None else self._comm.bcast(value)


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
    if any(block.cell_type.straight for block in blocks_of(mesh)):
        raise OptionError("a checkpoint must go without cells of second order: runs cannot go on there yet")


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
    return run_fingerprint(" ".join(words), (mesh_digest(mesh, comm), *arrays))
