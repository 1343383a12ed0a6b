"""Time series for ParaView: numbered VTK files and the .pvd that lists them."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from functools import partial
from html import escape
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import Any
from xml.etree import ElementTree

from ..common import (
    OptionError,
    OutputPlace,
    ReadError,
    WriteError,
    agreed,
    check_writable,
    first_names,
    same_file,
    save_atomically,
)
from ..mesh import HexMesh, MixedMesh

__all__ = ["Series", "frames_folder", "frames_listed", "series_place"]


class Series:
    """Writes ``run.pvd`` and the frames ``run_frames/run_0000.vtu``, ``run_0001.vtu``, ...

    The list is replaced after each frame, so that it can be opened at every moment, also after a crash. A list
    of the same name is started anew, and the frames of an earlier run are removed.

    Parameters
    ----------
    path
        The .pvd file.
    until
        Go on with the series that is there, keeping its frames up to this time.
    keep
        Tells of a time whether the frame then is kept; None: all are.
    comm
        The ranks, all of which must do the same with it: frames are ``run_0000.pvtu``, with a piece of each beside it.

    Raises
    ------
    WriteError
        If the files cannot be written there, or the series to go on with cannot be read.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> cube = HexMesh(CORNERS, [range(8)])
    >>> with Series("run.pvd") as series:
    ...     for time in (0.0, 0.5):
    ...         series.add(time, cube.replaced(points=cube.points * (1 + time)))
    >>> [frame for _, frame in series.frames]
    ['run_frames/run_0000.vtu', 'run_frames/run_0001.vtu']
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        until: float | None = None,
        keep: Callable[[float], bool] | None = None,
        comm: Any = None,
    ) -> None:
        self.path, self._comm = Path(path), comm
        with agreed(comm, named=False):
            check_writable(self.path, extensions=(".pvd",))
            self.frames: list[tuple[float, str]] = [] if until is None else self._read_list(until)
        if keep is not None:
            self.frames = [frame for frame in self.frames if keep(frame[0])]

    def __enter__(self) -> Series:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, problem: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Every frame is already listed: there is nothing to close.
        return None

    def add(self, time: float, mesh: Any) -> None:
        """Write a frame.

        Parameters
        ----------
        time
            Its time, later than that of the last frame.
        mesh
            A HexMesh or MixedMesh, or a pyvista dataset (a surface becomes a .vtp file); on ranks the
            :class:`hexconformal.ranks.MeshPiece` of each.

        Raises
        ------
        OptionError
            If the time does not grow, or if a frame would replace, or the series remove, the file that the mesh was
            read from.
        WriteError
            If the file cannot be written.
        """
        time = float(time)
        if not isfinite(time) or (self.frames and time <= self.frames[-1][0]):
            raise OptionError(f"time {time} of a frame must be finite and later than that of the frame before")
        is_first, comm = self._comm is None or self._comm.rank == 0, self._comm
        with agreed(comm, named=False):
            if is_first:
                self._make_folder()
        frame = self._write(mesh) if comm is None else self._write_piece(mesh)
        self.frames.append((time, f"{frame.parent.name}/{frame.name}"))
        with agreed(comm, named=False):
            if is_first:
                save_atomically(self.path, self._write_list)
                if len(self.frames) == 1:
                    self._remove_old_frames(frame)

    def _make_folder(self) -> None:
        folder = frames_folder(self.path)
        try:
            folder.mkdir(exist_ok=True)
        except OSError as problem:
            raise WriteError(f"cannot make the folder {folder}: {problem}") from problem

    def _frame(self, extension: str) -> Path:
        """The file of the next frame."""
        return frames_folder(self.path) / f"{self.path.stem}_{self._next_number():04d}.{extension}"

    def _write_piece(self, mesh: Any) -> Path:
        from ..ranks import write_piece  # not loaded in one process

        frame = self._frame("pvtu")
        write_piece(frame, mesh, self._comm)
        return frame

    def _write(self, mesh: Any) -> Path:
        from ..io import to_pyvista, write_vtk

        grid = to_pyvista(mesh)[0].cast_to_unstructured_grid() if isinstance(mesh, HexMesh | MixedMesh) else mesh
        frame = self._frame("vtp" if type(grid).__name__ == "PolyData" else "vtu")
        source = getattr(getattr(mesh, "origin", None), "file", None)
        if source is not None:
            place = OutputPlace(frame) if self.frames else series_place(self.path)
            if place.harms(source.path):
                raise OptionError(f"{place.path} would replace {source.path}, which the mesh was read from")
        save_atomically(frame, partial(write_vtk, grid=grid))
        return frame

    def _remove_old_frames(self, first: Path) -> None:
        """Remove frames left over from an earlier run of the same name, which no list names any more."""
        for path in _frames_there(self.path):
            if path != first and not path.name.startswith(f"{first.stem}_"):  # nor its pieces
                path.unlink(missing_ok=True)

    def _read_list(self, until: float) -> list[tuple[float, str]]:
        try:
            frames = _parsed(self.path)
        except _DAMAGED as problem:
            raise WriteError(f"cannot go on with the series {self.path}: {problem}") from problem
        frames = [frame for frame in frames if frame[0] <= until]
        missing = [name for _, name in frames if not (self.path.parent / name).is_file()]
        if missing or not frames:
            names = f"frames that are missing: {len(missing)} ({first_names(missing)})"
            reason = names if missing else "it lists no frames"
            raise WriteError(f"cannot go on with the series {self.path}: {reason}")
        return frames

    def _next_number(self) -> int:
        """The number of the next frame, so that it replaces none that is kept."""
        numbers = [re.search(r"_(\d+)\.\w+$", name) for _, name in self.frames]
        return max((int(number[1]) + 1 for number in numbers if number), default=0)

    def _write_list(self, target: Path) -> None:
        rows = [f'    <DataSet timestep="{time!r}" file="{escape(name)}"/>' for time, name in self.frames]
        head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>'
        target.write_text("\n".join([head, *rows, "  </Collection>\n</VTKFile>\n"]), encoding="utf-8")


def frames_listed(path: str | os.PathLike[str]) -> list[tuple[float, Path]]:
    """Times and files of the frames of a series.

    Raises
    ------
    ReadError
        If the list cannot be read, or is empty, or names files that do not exist.

    Examples
    --------
    >>> from hexconformal.elements.hexahedron import CORNERS
    >>> with Series("run.pvd") as series:
    ...     series.add(0.5, HexMesh(CORNERS, [range(8)]))
    >>> [(time, file.name) for time, file in frames_listed("run.pvd")]
    [(0.5, 'run_0000.vtu')]
    """
    path = Path(path)
    try:
        frames = _parsed(path)
    except _DAMAGED as problem:
        raise ReadError(f"cannot read the series {path}: {problem}") from problem
    if not frames:
        raise ReadError(f"cannot read the series {path}: it lists no frames")
    missing = [name for _, name in frames if not (path.parent / name).is_file()]
    if missing:
        text = f"{len(missing)} of the {len(frames)} files that it lists do not exist: {first_names(missing)}"
        raise ReadError(f"cannot read the series {path}: {text}")
    return [(time, path.parent / name) for time, name in frames]


_DAMAGED = (OSError, ElementTree.ParseError, KeyError, ValueError)


def _parsed(path: Path) -> list[tuple[float, str]]:
    """Times of frames, and their files by the names in the list; raises one of `_DAMAGED` if it is not sound."""
    found = ElementTree.parse(path).iter("DataSet")
    return [(float(entry.attrib["timestep"]), entry.attrib["file"]) for entry in found]


def frames_folder(path: Path) -> Path:
    """The folder of the frames of a series."""
    return path.parent / f"{path.stem}_frames"


def series_place(path: Path) -> OutputPlace:
    """The place of a series: its list, and every frame that it will write, or find from an earlier run and remove."""

    def is_frame(other: Path) -> bool:
        folder = os.path.realpath(frames_folder(path))
        real = Path(os.path.realpath(other))
        if str(real.parent) == folder and _frame_names(path).fullmatch(real.name):
            return True
        # Also what a link in the folder leads to: writing goes through links.
        return any(same_file(frame, other) for frame in _frames_there(path))

    return OutputPlace(path, is_frame)


def _frame_names(path: Path) -> re.Pattern[str]:
    return re.compile(rf"{re.escape(path.stem)}_\d{{4,}}(\.vt[pu]|\.pvtu|_\d{{4,}}\.vtu)", re.IGNORECASE)


def _frames_there(path: Path) -> list[Path]:
    folder = frames_folder(path)
    return [frame for frame in folder.iterdir() if _frame_names(path).fullmatch(frame.name)] if folder.is_dir() else []
