"""Files of any format: opened with readable errors, written completely or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from .errors import MeshError, OptionError, ReadError, WriteError, first_names
from .interruption import uninterrupted

__all__ = ["check_writable", "companion_file", "reading", "save_atomically", "temporary_folder_beside", "write_text"]

_COMPANION_EXTENSIONS = (".xdmf", ".xmf")  # numbers go into an .h5 file beside them
_SURFACE_EXTENSIONS = (".obj", ".off", ".ply", ".stl", ".vtp")
_MISSING_PACKAGE = "{} files need an optional package: pip install 'hexconformal[formats]' ({})"


@contextmanager
def reading(path: Path, extensions: tuple[str, ...]) -> Iterator[str]:
    """The extension of a file that is there and can be opened; what goes wrong becomes a readable error."""
    extension = path.suffix.lower()
    if path.is_dir():
        inside = sorted(file.name for file in path.iterdir() if file.suffix.lower() in extensions)
        advice = f"give one of the files in it: {first_names(inside)}" if inside else "and there is no such file in it"
        raise ReadError(f"{path} is a folder, not a mesh file; {advice}")
    if not path.exists():
        raise ReadError(f"{path} does not exist")
    if extension not in extensions:
        raise ReadError(f"{path}: {_unknown_extension(extension, extensions)}")
    try:
        if not path.is_file():
            raise ReadError("it must be a regular file, not a pipe, a socket or a device")
        if path.stat().st_size == 0:
            raise ReadError("the file is empty")
        with path.open("rb"):
            pass
        yield extension
    except ReadError as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem
    except MeshError as problem:
        raise MeshError(f"{path}: {problem}") from problem
    except ImportError as problem:
        raise ReadError(f"cannot read {path}: {_MISSING_PACKAGE.format(extension, problem)}") from problem
    except OptionError:
        raise
    except MemoryError as problem:
        raise ReadError(f"cannot read {path}: there is not enough memory for it") from problem
    except OSError as problem:
        raise ReadError(f"cannot read {path}: {problem}") from problem
    except Exception as problem:
        # What a parser has let through is found at the latest when the mesh is put together.
        reason = f"not a sound {extension} file ({type(problem).__name__}: {problem})"
        raise ReadError(f"cannot read {path}: {reason}") from problem


def check_writable(path: str | os.PathLike[str], extensions: tuple[str, ...] | None = None) -> None:
    """Raise unless a file of this name can be written: meant to be called before long work.

    Parameters
    ----------
    path
        The file.
    extensions
        Those that it may have; None: any.

    Raises
    ------
    WriteError
        If the extension is unknown, the folder is missing or cannot be written to, or a file that would come
        with it belongs to another.
    """
    path = Path(path)
    if extensions is not None and path.suffix.lower() not in extensions:
        raise WriteError(f"cannot write {path}: {_unknown_extension(path.suffix.lower(), extensions)}")
    folder = _real_path(path).parent
    if not folder.is_dir():
        raise WriteError(f"cannot write {path}: the folder {folder} does not exist")
    if path.is_dir():
        raise WriteError(f"cannot write {path}: it is a folder")
    if path.exists() and not path.is_file():
        raise WriteError(f"cannot write {path}: it must be a regular file, not a pipe, a socket or a device")
    if not os.access(folder, os.W_OK | os.X_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise WriteError(f"cannot write {path}: permission denied")
    companion = companion_file(path)
    if companion is not None and companion.exists() and not path.exists():
        raise WriteError(f"cannot write {path}: its companion {companion.name} belongs to another file already")


# Extensions of meshes that are not supported, and what to do.
_NOT_SUPPORTED = {
    ".vtm": "collections of blocks are not supported: save the block that is meant as .vtu",
    ".vtmb": "collections of blocks are not supported: save the block that is meant as .vtu",
    ".vtkhdf": "VTK's HDF files are not supported: save the mesh as .vtu, for example with ParaView",
    ".cgns": "CGNS files are not supported: save the mesh as .vtu or .msh, for example with ParaView or Gmsh",
    ".pvd": "series of files are not supported: read one of the files that it names",
}


def companion_file(path: Path) -> Path | None:
    """The file that is written along with one of this name; None if there is none."""
    return _real_path(path).with_suffix(".h5") if path.suffix.lower() in _COMPANION_EXTENSIONS else None


def _unknown_extension(extension: str, known: tuple[str, ...]) -> str:
    if extension in _NOT_SUPPORTED and extension not in known:
        return _NOT_SUPPORTED[extension]
    hint = " (of surfaces: for these there are surface.remesh, and the command remesh)"
    is_surface = extension in _SURFACE_EXTENSIONS and ".vtu" in known
    return f"unknown extension {extension or '(none)'}{hint if is_surface else ''}; known are {' '.join(known)}"


def save_atomically(path: Path, writer: Callable[[Path], list[str] | None]) -> list[str]:
    """Let `writer` make the file in a folder beside its place, then move it (and its companions) there at once."""
    place = _real_path(path)
    with _as_write_error(path), temporary_folder_beside(place) as folder:
        target = folder / place.name
        lost = writer(target) or []
        if not target.is_file() or target.stat().st_size == 0:
            raise WriteError("nothing was written; is the disk full?")
        # The file that names the others comes last.
        files = sorted(folder.iterdir(), key=lambda made: made == target)
        with uninterrupted():
            for made in files:
                if (place.parent / made.name).exists():  # who may read a file stays as it was
                    with suppress(OSError):
                        shutil.copymode(place.parent / made.name, made)
                os.replace(made, place.parent / made.name)
    return lost


@contextmanager
def temporary_folder_beside(place: Path) -> Iterator[Path]:
    """A hidden folder beside a file, gone afterwards, whenever an interruption comes."""
    with uninterrupted():
        folder = tempfile.TemporaryDirectory(prefix=".hexconformal-", dir=place.parent)
    try:
        yield Path(folder.name)
    finally:
        with uninterrupted():
            folder.cleanup()


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write a text file that is complete or not there.

    Raises
    ------
    WriteError
        If it cannot be written.
    """

    def put(target: Path) -> None:
        target.write_text(text, encoding="utf-8")

    save_atomically(Path(path), put)


def _real_path(path: Path) -> Path:
    # Where a link points to, so that the link stays one.
    return Path(os.path.realpath(path))


@contextmanager
def _as_write_error(path: Path) -> Iterator[None]:
    try:
        yield
    except MeshError:
        raise
    except ImportError as problem:
        raise WriteError(f"cannot write {path}: {_MISSING_PACKAGE.format(path.suffix, problem)}") from problem
    except (Exception, SystemExit) as problem:
        raise WriteError(f"cannot write {path}: {_reason_in_words(problem)}") from problem


def _reason_in_words(problem: Any) -> str:
    if isinstance(problem, MemoryError):
        return "there is not enough memory for it"
    if not isinstance(problem, OSError):
        return f"{type(problem).__name__}: {problem}"
    # NumPy only counts the numbers that it got rid of.
    return str(problem) if problem.errno or isinstance(problem, WriteError) else f"{problem}; is the disk full?"
