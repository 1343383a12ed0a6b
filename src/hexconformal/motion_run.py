"""A motion in a folder: frames, history, and a checkpoint after every step to go on from."""

from __future__ import annotations

import csv
import hashlib
import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import OptionError, ReadError, WriteError, first_ids
from .files import saving
from .interrupt import uninterrupted
from .io import write
from .mesh import HexMesh
from .motion import MeshMotion, MotionStep
from .progress import HistoryFile
from .quality import corner_scaled_jacobian
from .series import Series

__all__ = ["Boundary", "MotionFolder", "MotionRecord", "read_boundary"]

_VERSION = 1


@dataclass(frozen=True)
class Boundary:
    """Prescribed motion: nodes (k,), times (t,) that grow from 0, displacements (t, k, 3) from the initial place."""

    nodes: NDArray[np.int64]
    times: NDArray[np.float64]
    displacements: NDArray[np.float64]


@dataclass(frozen=True)
class MotionRecord:
    """A step in a row of the history; see :class:`hexconformal.motion.MotionReport`."""

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


def read_boundary(path: str | os.PathLike[str]) -> Boundary:
    """Read a table with the columns step or time, node, dx, dy, dz.

    Raises
    ------
    ReadError
        If the file cannot be read, a column is missing, a value is no number, or a time names other nodes than
        the first, or one twice.
    """
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            head, *rows = list(csv.reader(file, skipinitialspace=True)) or [[]]
    except (OSError, ValueError, csv.Error) as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem
    names = [name.strip().lower() for name in head]
    when = "time" if "time" in names else "step"
    missing = [name for name in (when, "node", "dx", "dy", "dz") if name not in names]
    if missing:
        raise ReadError(f"{path} has no column {', '.join(missing)}; needed are step or time, node, dx, dy, dz")
    columns = [names.index(name) for name in (when, "node", "dx", "dy", "dz")]
    rows = [row for row in rows if row]
    try:
        table = np.array([[float(row[column]) for column in columns] for row in rows]).reshape(-1, 5)
    except (ValueError, IndexError) as problem:
        raise ReadError(f"{path} has rows that are not numbers: {problem}") from problem
    if len(table) == 0 or not np.isfinite(table).all() or (table[:, 1] % 1 != 0).any() or table[:, 0].min() <= 0:
        raise ReadError(
            f"{path} needs rows of finite numbers, whole node ids, and times above 0, where the mesh starts"
        )
    times, counts = np.unique(table[:, 0], return_counts=True)
    table = table[np.lexsort((table[:, 1], table[:, 0]))]
    nodes = table[: counts[0], 1].astype(np.int64)
    odd = np.flatnonzero(counts != counts[0])
    if len(odd) == 0:
        odd = np.flatnonzero((table[:, 1].reshape(len(times), -1) != nodes).any(axis=1))
    if len(odd) or len(np.unique(nodes)) < len(nodes):
        raise ReadError(f"{path}: every {when} names the same nodes, each once; {when}s that do not: {first_ids(odd)}")
    return Boundary(nodes, times, table[:, 2:].reshape(len(times), -1, 3))


@dataclass
class MotionFolder:
    """Where a motion is written.

    Attributes
    ----------
    path
        The folder; it is made if it is not there.
    series
        The .pvd file, None for run.pvd in the folder.
    refusal
        Why the motion ended early; "" if it did not.
    """

    path: Path
    series: Path | None = None
    refusal: str = field(default="", init=False)

    @property
    def frames(self) -> Path:
        """The series that ParaView plays."""
        return self.path / "run.pvd" if self.series is None else self.series

    @property
    def history(self) -> Path:
        """A row per step."""
        return self.path / "history.csv"

    @property
    def checkpoint(self) -> Path:
        """Where the motion stands."""
        return self.path / "checkpoint.npz"

    @property
    def last(self) -> Path:
        """The mesh at the end; the cell array `blocked` marks what stood in the way."""
        return self.path / "last.vtu"

    def prepare(self, resume: bool, overwrite: bool) -> None:
        """Make the folder, or see that the run in it may be gone on with, or replaced.

        Raises
        ------
        OptionError
            If there is a run already and neither is asked for, or none to go on with.
        WriteError
            If the folder cannot be made.
        """
        there = self.checkpoint.exists()
        if resume and not there:
            raise OptionError(f"there is no run in {self.path} to resume: {self.checkpoint.name} is missing")
        if there and not (resume or overwrite):
            raise OptionError(f"{self.path} holds a run: --resume goes on with it, --overwrite starts anew")
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as problem:
            raise WriteError(f"cannot make the folder {self.path}: {problem}") from problem

    def follow(
        self, motion: MeshMotion, boundary: Boundary, resume: bool, every: int, told: Callable[[str], None]
    ) -> tuple[int, BaseException | None]:
        """Make all steps and write everything.

        Parameters
        ----------
        motion
            At its start.
        boundary
            Where its moving nodes go.
        resume
            Go on from the checkpoint.
        every
            A frame every so many steps, and at the end.
        told
            Called with every step in a line.

        Returns
        -------
        The last step that was made completely, and what interrupted the motion, None if nothing did.
        """
        done = self._load(motion) if resume else 0
        rows = _rows_until(self.history, done) if resume else []
        at = float(boundary.times[done - 1]) if done else 0.0
        blocked = np.empty(0, dtype=np.int64)
        stopped: BaseException | None = None
        step: MotionStep | None = None
        with HistoryFile(self.history, rows) as history, Series(self.frames, at if resume else None) as series:
            if not resume:
                series.add(0.0, _frame(motion, None))
                self._save(motion, 0)
            try:
                for index in range(done, len(boundary.times)):
                    time = float(boundary.times[index])
                    taken = motion.step(boundary.displacements[index], dt=time - at)
                    report = taken.report
                    record = MotionRecord(
                        index + 1, time, report.reached, report.substeps, report.iterations,
                        report.min_scaled_jacobian, report.mean_scaled_jacobian, report.seconds,
                    )  # fmt: skip
                    with uninterrupted():
                        history.add(record)
                        told(str(record))
                        if report.refused:
                            self.refusal, blocked = report.reason, report.blocked
                            break
                        step, done, at = taken, index + 1, time
                        if done % every == 0:
                            series.add(time, _frame(motion, step))
                        # Last: what it counts as done is written.
                        self._save(motion, done)
            except KeyboardInterrupt as problem:
                stopped = problem
            with uninterrupted():
                if step is not None and series.frames[-1][0] < at:
                    series.add(at, _frame(motion, step))
                marks = np.zeros(len(motion.mesh.cells), dtype=np.uint8)
                marks[blocked] = 1
                write(self.last, _frame(motion, None).replaced(cell_data={"blocked": marks}))
        return done, stopped

    def _save(self, motion: MeshMotion, done: int) -> None:
        def put(target: Path) -> None:
            with open(target, "wb") as file:
                np.savez(file, version=_VERSION, problem=_problem(motion), done=done, **motion.standing())  # type: ignore[arg-type]

        saving(self.checkpoint, put)

    def _load(self, motion: MeshMotion) -> int:
        try:
            with np.load(self.checkpoint, allow_pickle=False) as file:
                found: dict[str, Any] = dict(file)
        except (OSError, ValueError, EOFError, zipfile.BadZipFile) as problem:
            raise ReadError(f"cannot read the checkpoint {self.checkpoint}: {problem}") from problem
        if int(found.get("version", -1)) != _VERSION:
            raise ReadError(f"{self.checkpoint} is no checkpoint of this version ({_VERSION})")
        if str(found["problem"]) != _problem(motion):
            raise OptionError(f"the checkpoint {self.checkpoint} belongs to another mesh, or to other options")
        motion.resume(found)
        return int(found["done"])


def _frame(motion: MeshMotion, step: MotionStep | None) -> HexMesh:
    points = motion.points
    velocity = np.zeros_like(points) if step is None or step.velocity is None else step.velocity
    good = corner_scaled_jacobian(points, motion.mesh.cells)
    return motion.mesh.replaced(points, {"mesh_velocity": velocity}, {"scaled_jacobian": good})


def _problem(motion: MeshMotion) -> str:
    """What has to be the same: mesh, nodes, options."""
    digest = hashlib.sha256(motion.options.encode())
    for array in (motion.mesh.points, motion.mesh.cells, motion.moving, motion.held):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def _rows_until(path: Path, step: int) -> list[list[str]]:
    """The header and the rows of a history up to a step."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            head, *rows = list(csv.reader(file)) or [[]]
    except (OSError, ValueError) as problem:
        raise OptionError(f"cannot go on with the history {path}: {problem}") from problem
    names = [entry.name for entry in fields(MotionRecord)]
    if head and head != names:
        raise OptionError(f"{path} is no history of a motion")
    return [names, *(row for row in rows if len(row) == len(names) and int(row[0]) <= step)]
