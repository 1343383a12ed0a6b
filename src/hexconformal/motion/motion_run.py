"""A motion by a table, as a run that is followed in a folder."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common import OptionError, agreed
from ..elements import CELL_TYPES, corner_scaled_jacobian
from ..io import write
from ..mesh import HexMesh, MixedMesh, collapsed_mesh
from ..ranks import MeshPiece, write_piece
from ..runs import RunState, mesh_digest, run_fingerprint
from .mesh_motion import MeshMotion
from .motion_table import BoundaryMotion

__all__ = ["MotionRecord", "MotionRun"]


@dataclass(frozen=True)
class MotionRecord:
    """A step in a row of the history; see :class:`hexconformal.motion.MotionReport`.

    The last columns are the smallest scaled Jacobians of the types of cells that there are.
    """

    step: int
    time: float
    reached: float
    substeps: int
    iterations: int
    min_scaled_jacobian: float
    mean_scaled_jacobian: float
    seconds: float
    min_hexahedron: float | None = None
    min_wedge: float | None = None
    min_pyramid: float | None = None
    min_tetra: float | None = None

    def __str__(self) -> str:
        types = {name: getattr(self, f"min_{name}") for name in CELL_TYPES}
        minima = [f"{CELL_TYPES[name].plural} {least:.4f}" for name, least in types.items() if least is not None]
        of_types = f" ({', '.join(minima)})" if len(minima) > 1 else ""
        return (
            f"step {self.step}  t {self.time:.4g}  reached {self.reached:.0%}  substeps {self.substeps}  "
            f"min {self.min_scaled_jacobian:.4f}{of_types}  mean {self.mean_scaled_jacobian:.4f}  {self.seconds:.2f} s"
        )


class MotionRun:
    """All steps of a table, a stage each, as a :class:`hexconformal.runs.run_folder.FolderRun`; on ranks of all.

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

    version, record, other_runs = 4, MotionRecord, "another mesh, or to other options"

    def __init__(self, motion: MeshMotion, boundary: BoundaryMotion) -> None:
        self.step, self.refusal = 0, ""
        self._motion, self._boundary, self._resumed = motion, boundary, False
        self._table = collapsed_mesh(motion.mesh).cells
        self._blocked = np.empty(0, dtype=np.int64)
        # After the last complete step, and as far as the last one went.
        self._done = self._reached = motion.points
        self._velocity: NDArray[np.float64] | None = None

    @property
    def time(self) -> float:
        """Time that the motion has reached."""
        return float(self._boundary.times[self.step - 1]) if self.step else 0.0

    @property
    def fingerprint(self) -> str:
        """Digest of what a resumed run must have the same: mesh, nodes and options."""
        motion = self._motion
        carried = np.zeros(len(motion.held), dtype=bool)
        carried[motion.carried] = True
        marks = np.column_stack([motion.moves, motion.held, carried])
        return run_fingerprint(motion.options, (mesh_digest(motion.mesh, motion.comm, marks),))

    def __iter__(self) -> Iterator[RunState]:
        if not self._resumed:
            yield RunState(0, 0.0, self.frame)
        for index in range(self.step, len(self._boundary.times)):
            time = float(self._boundary.times[index])
            taken = self._motion.step(self._boundary.displacements[index], dt=time - self.time)
            report = taken.report
            record = MotionRecord(
                index + 1, time, report.reached, report.substeps, report.iterations,
                report.min_scaled_jacobian, report.mean_scaled_jacobian, report.seconds,
                **{f"min_{name}": least for name, least in report.types.items()},
            )  # fmt: skip
            self._reached = taken.points
            if report.refused:
                self.refusal, self._blocked = report.reason, report.blocked
            else:
                self.step, self._done, self._velocity = index + 1, taken.points, taken.velocity
            yield RunState(index + 1, time, self.frame, record, refused=report.refused)

    def state(self) -> dict[str, Any]:
        """State of the run, for :meth:`resume`; on ranks of the nodes of this one."""
        state = {"done": self.step, "time": self.time, "displacement": self._displacement(), **self._motion.state()}
        return state if self._velocity is None else {**state, "velocity": self._velocity}

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from there.

        Raises
        ------
        OptionError
            If the table ends before that, or is another one at that step.
        """
        motion, steps = self._motion, len(self._boundary.times)
        step, time = int(state["done"]), state["time"]
        there, ids, moving, _, _ = (state[key] for key in ("displacement", "ids", "moving", "points", "prescribed"))
        if step > steps:
            raise OptionError(f"the table must have the {step} steps that are done already, and more; it has {steps}")
        motion.resume(state)
        self.step, self._resumed = step, True
        there = motion.at_moving_nodes(there, moving)
        with agreed(motion.comm, named=False):
            if self.time != time or not np.array_equal(self._displacement(), there):
                raise OptionError(f"the table must be that of the run up to step {step}: there it is another one")
        self._done = self._reached = motion.points
        self._velocity = motion.at_nodes(state["velocity"], ids) if "velocity" in state else None

    def wants_frame(self, time: float) -> bool:
        """No time has a frame but by the number of its step."""
        return False

    def frame(self) -> HexMesh | MixedMesh:
        """The mesh after the last complete step, with the velocity in it."""
        return self._frame(self._done, self._velocity)

    def write(self, path: Path) -> None:
        """Write the mesh as far as it went; the cell array `blocked` marks the cells that stood in the way."""
        marks = np.isin(self._motion.cell_ids, self._blocked).astype(np.uint8)
        mesh = self._frame(self._reached, None).replaced(cell_data={"blocked": marks})
        if isinstance(mesh, MeshPiece):
            write_piece(path, mesh, self._motion.comm)
        else:
            write(path, mesh)

    def _displacement(self) -> NDArray[np.float64]:
        """That of the last complete step."""
        table = self._boundary.displacements
        return table[self.step - 1] if self.step else np.zeros_like(table[0])

    def _frame(self, points: NDArray[np.float64], velocity: NDArray[np.float64] | None) -> HexMesh | MixedMesh:
        mesh = self._motion.mesh
        data = {"mesh_velocity": np.zeros_like(points) if velocity is None else velocity}
        return mesh.replaced(points, data, {"scaled_jacobian": corner_scaled_jacobian(points, self._table)})
