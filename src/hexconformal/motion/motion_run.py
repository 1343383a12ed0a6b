"""A motion by a table, as a run that is followed in a folder."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..elements import corner_scaled_jacobian
from ..io import write
from ..mesh import HexMesh
from ..runs import RunState, run_fingerprint
from .mesh_motion import MeshMotion
from .motion_table import BoundaryMotion

__all__ = ["MotionRecord", "MotionRun"]


@dataclass(frozen=True)
class MotionRecord:
    """A step in a row of the history; see :class:`hexconformal.motion.mesh_motion.MotionReport`."""

    step: int
    time: float
    reached: float
    substeps: int
    iterations: int
    min_scaled_jacobian: float
    mean_scaled_jacobian: float
    seconds: float

    def __str__(self) -> str:
        return (
            f"step {self.step}  t {self.time:.4g}  reached {self.reached:.0%}  substeps {self.substeps}  "
            f"min {self.min_scaled_jacobian:.4f}  mean {self.mean_scaled_jacobian:.4f}  {self.seconds:.2f} s"
        )


class MotionRun:
    """All steps of a table, a stage each, as a :class:`hexconformal.runs.run_folder.FolderRun`.

    Parameters
    ----------
    motion
        At its start.
    boundary
        Displacements of its moving nodes.

    Attributes
    ----------
    step
        The last one that was made completely.
    refusal
        Reason of an early end; "" if there was none.
    """

    version, record, other_runs = 1, MotionRecord, "another mesh, or to other options"

    def __init__(self, motion: MeshMotion, boundary: BoundaryMotion) -> None:
        self.step, self.refusal = 0, ""
        self._motion, self._boundary, self._resumed = motion, boundary, False
        self._blocked = np.empty(0, dtype=np.int64)

    @property
    def time(self) -> float:
        """Time that the motion has reached."""
        return float(self._boundary.times[self.step - 1]) if self.step else 0.0

    @property
    def fingerprint(self) -> str:
        """Digest of what a resumed run must have the same: mesh, nodes and options."""
        motion = self._motion
        return run_fingerprint(motion.options, (motion.mesh.points, motion.mesh.cells, motion.moving, motion.held))

    def __iter__(self) -> Iterator[RunState]:
        if not self._resumed:
            yield RunState(0, 0.0, partial(self._frame, self._motion.points, None))
        for index in range(self.step, len(self._boundary.times)):
            time = float(self._boundary.times[index])
            taken = self._motion.step(self._boundary.displacements[index], dt=time - self.time)
            report = taken.report
            record = MotionRecord(
                index + 1, time, report.reached, report.substeps, report.iterations,
                report.min_scaled_jacobian, report.mean_scaled_jacobian, report.seconds,
            )  # fmt: skip
            if report.refused:
                self.refusal, self._blocked = report.reason, report.blocked
            else:
                self.step = index + 1
            frame = partial(self._frame, taken.points, taken.velocity)
            yield RunState(index + 1, time, frame, record, refused=report.refused)

    def state(self) -> dict[str, Any]:
        """State of the run, for :meth:`resume`."""
        return {"done": self.step, **self._motion.state()}

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""
        self._motion.resume(state)
        self.step, self._resumed = int(state["done"]), True

    def write(self, path: Path) -> None:
        """Write the mesh as far as it went; the cell array `blocked` marks the cells that stood in the way."""
        marks = np.zeros(len(self._motion.mesh.cells), dtype=np.uint8)
        marks[self._blocked] = 1
        write(path, self._frame(self._motion.points, None).replaced(cell_data={"blocked": marks}))

    def _frame(self, points: NDArray[np.float64], velocity: NDArray[np.float64] | None) -> HexMesh:
        mesh = self._motion.mesh
        data = {"mesh_velocity": np.zeros_like(points) if velocity is None else velocity}
        return mesh.replaced(points, data, {"scaled_jacobian": corner_scaled_jacobian(points, mesh.cells)})
