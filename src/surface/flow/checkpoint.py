"""Checkpoints of a flow: a run that is resumed from one equals the run that never stopped."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from hexconformal.runs import RunState, load_state, run_fingerprint, save_state

from ..io import as_pyvista, write
from .evolve import Evolution
from .moment import Moment
from .options import Record

__all__ = ["FlowRun", "load", "save"]


def save(path: str | os.PathLike[str], run: Evolution) -> None:
    """Write the state of a run.

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
    flow = FlowRun(run)
    save_state(path, flow.version, flow.fingerprint, flow.state())


def load(path: str | os.PathLike[str], run: Evolution) -> None:
    """Set a run to the state of a checkpoint.

    Parameters
    ----------
    path
        The file that :func:`surface.flow.save` has written.
    run
        A run made for the same surface and flow, not begun yet.

    Raises
    ------
    ReadError
        If the file is no checkpoint.
    OptionError
        If it belongs to another surface or flow.
    """
    flow = FlowRun(run)
    flow.resume(load_state(path, flow.version, flow.fingerprint, flow.other_runs))


class FlowRun:
    """A flow, a stage per moment, as a :class:`hexconformal.runs.run_folder.FolderRun`.

    Parameters
    ----------
    run
        The flow.
    """

    version, record, other_runs = 3, Record, "another surface or another flow"

    def __init__(self, run: Evolution) -> None:
        self._run = run
        self._moment: Moment | None = None

    @property
    def step(self) -> int:
        """Number of steps done."""
        return self._run.step

    @property
    def time(self) -> float:
        """Time reached."""
        return self._run.time

    @property
    def fingerprint(self) -> str:
        """A text that identifies input, energy and constraints, with which a checkpoint must agree."""
        mesh = self._run.mesh
        return run_fingerprint(repr(self._run.flow), (mesh.points, mesh.cells.triangles, mesh.cells.quads))

    def __iter__(self) -> Iterator[RunState]:
        for moment in self._run:
            self._moment, record = moment, moment.record
            frame_wanted = record.time in self._run.stepping.outputs
            yield RunState(record.step, record.time, partial(_frame, moment), record, frame_wanted)

    def state(self) -> dict[str, Any]:
        """The state of the run."""
        return self._run.state()

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        self._run.resume(state)

    def write(self, path: Path) -> None:
        """Write the surface at the end, if a moment was seen."""
        if self._moment is not None:
            write(path, self._moment.surface_mesh)


def _frame(moment: Moment) -> Any:
    return as_pyvista(moment.surface_mesh)
