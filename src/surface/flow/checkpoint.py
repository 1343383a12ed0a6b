"""Checkpoints of a flow: a run that is resumed from one equals the run that never stopped."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from hexconformal.runs import RunState, load_state, run_fingerprint, save_state

from ..io import as_pyvista, write
from ..mesh import SurfaceMesh
from .evolve import Evolution
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
        # A step may have begun since: the surface of the run itself is not that after the last step then.
        self._surface: Callable[[], SurfaceMesh] = run.surface_mesh

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
            record, self._surface = moment.record, partial(getattr, moment, "surface_mesh")
            yield RunState(record.step, record.time, self.frame, record)

    def wants_frame(self, time: float) -> bool:
        """Whether a time is one of those to hit exactly."""
        return time in self._run.stepping.outputs

    def frame(self) -> Any:
        """The surface after the last step."""
        return as_pyvista(self._surface())

    def state(self) -> dict[str, Any]:
        """The state of the run."""
        return self._run.state()

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from a state."""
        self._run.resume(state)
        self._surface = self._run.surface_mesh

    def write(self, path: Path) -> None:
        """Write the surface after the last step."""
        write(path, self._surface())
