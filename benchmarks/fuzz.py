"""Damaged and hostile files: bytes changed at random in files of every format that is read, and changes that know
their structure (hostile.py): counts, sizes and references that a reader would fail of.

    python benchmarks/fuzz.py                      # 400 mutants of each file, as a table; some minutes
    python benchmarks/fuzz.py --only .vtk --seed 7 --keep /some/folder

Every mutant is read, and what could be read is checked, measured and regularized for an iteration, in a process that
may die. Allowed are a mesh and one of the library's own errors. Not allowed are a crash, any other exception, a way
out such as SystemExit, anything printed, and more than LIMIT seconds. The exit code is 1 if one of these happened.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from hostile import hostile

LIMIT = 60.0  # seconds for one file
MEMORY = 6 << 30  # bytes a process may ask for
WORDS = [b"-1", b"0", b"1", b"99999999999", b"2147483647", b"4294967295", b"nan", b"1e308", b"1e999", b"x", b""]
NUMBERS = [0, 1, -1, 2**31 - 1, 2**32 - 1, 2**40, 2**62, -(2**31)]
BYTES = [0x00, 0xFF, 0x7F, 0x80, *b'09-. \n"<>/']


def mutant(data: bytes, rng: np.random.Generator, name: str = "") -> bytes:
    """The bytes with one to three changes, or every third time with one that knows the structure of the named file."""
    if name and rng.random() < 1 / 3:
        return hostile(name, data, rng)
    for _ in range(rng.integers(1, 4)):
        data = _changed(data, rng)
    return data


def _changed(data: bytes, rng: np.random.Generator) -> bytes:
    # Half of the changes near the beginning, where counts and types are.
    size = len(data) if rng.random() < 0.5 else min(len(data), 600)
    at = int(rng.integers(0, max(size, 1)))
    length = int(rng.integers(1, 40))
    kind = rng.choice(["bits", "byte", "cut", "drop", "repeat", "insert", "swap", "word", "word", "number"])
    if kind == "bits":
        return data[:at] + bytes([(data[at : at + 1] or b"\0")[0] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
    if kind == "byte":
        return data[:at] + bytes([BYTES[rng.integers(len(BYTES))]]) + data[at + 1 :]
    if kind == "cut":
        return data[: int(rng.integers(0, len(data) + 1))]
    if kind == "drop":
        return data[:at] + data[at + length :]
    if kind == "repeat":
        return data[:at] + data[at : at + length] * int(rng.integers(2, 5)) + data[at + length :]
    if kind == "insert":
        return data[:at] + rng.bytes(length) + data[at:]
    if kind == "swap":
        there = at + length + int(rng.integers(0, max(len(data) - at - length, 0) + 1))
        one, other = data[at : at + length], data[there : there + length]
        return data[:at] + other + data[at + length : there] + one + data[there + length :]
    if kind == "word":
        return _other_word(data, at, rng)
    number = NUMBERS[rng.integers(len(NUMBERS))]
    width = int(rng.choice([4, 8]))
    packed = (number % 2 ** (8 * width)).to_bytes(width, rng.choice(["little", "big"]))
    return data[:at] + packed + data[at + width :]


def numbered(folder: Path, sample: Path, number: int) -> Path:
    """A name for a mutant, with all that stands behind the first dot."""
    stem, _, rest = sample.name.partition(".")
    return folder / f"{stem}_{number}.{rest}"


def _other_word(data: bytes, at: int, rng: np.random.Generator) -> bytes:
    """Another word in the place of the next number from there."""
    digits = b"0123456789"
    while at < len(data) and data[at] not in digits:
        at += 1
    end = at
    while end < len(data) and data[end] in digits + b".e+-":
        end += 1
    return data[:at] + WORDS[rng.integers(len(WORDS))] + data[end:]


# ------------------------------------------------------------------------------------------- the sound files
def samples(folder: Path) -> list[Path]:
    """One small sound file of each format and variant."""
    return [*_volumes(folder), *_surfaces(folder), *_only_read(folder)]


def _only_read(folder: Path) -> Iterator[Path]:
    """Files of the formats that are read alone, most as meshio writes them, and pieces in files of their own."""
    import h5py
    import meshio

    import hexconformal as hc
    from hexconformal.generate import box, jittered

    points, cells = jittered(*box((2, 2, 2)), 0.2)
    for name in ("only.avs", "only.dat", "only.f3grid", "only.mdpa", "only.su2", "only.tec"):
        yield from _written(folder / name, meshio.Mesh(points, [("hexahedron", cells)]))
    for name in ("only.vol", "only.lb8.ugrid"):
        yield from _written(folder / name, meshio.Mesh(points, [("hexahedron", cells)]))
    with h5py.File(folder / "only.h5m", "w") as file:  # meshio reads hexahedra in it, but leaves them out of its own
        file["tstt/nodes/coordinates"] = points
        file["tstt/elements/Hex8/connectivity"] = cells + 1
    yield folder / "only.h5m"
    hc.write(folder / "piece.vtu", hc.HexMesh(points, cells))
    array = '<PPoints><PDataArray type="Float64" NumberOfComponents="3"/></PPoints><Piece Source="piece.vtu"/>'
    text = f'<VTKFile type="PUnstructuredGrid"><PUnstructuredGrid>{array}</PUnstructuredGrid></VTKFile>'
    (folder / "pieces.pvtu").write_text(text)
    yield folder / "pieces.pvtu"


def _written(path: Path, mesh: Any) -> Iterator[Path]:
    import meshio

    try:
        meshio.write(path, mesh)
    except Exception as problem:  # a package is missing, or meshio fails of its own file
        print(f"no {path.name}: {problem}", file=sys.stderr)
    else:
        yield path


def _volumes(folder: Path) -> Iterator[Path]:
    import meshio
    import pyvista as pv

    import hexconformal as hc
    from hexconformal.generate import box, jittered

    points, cells = jittered(*box((2, 2, 2)), 0.2)
    bare = meshio.Mesh(points, [("hexahedron", cells), ("quad", cells[:4, :4])])
    tagged = meshio.Mesh(points, bare.cells, cell_data={"medit:ref": [np.arange(8), np.arange(4)]})
    mesh = hc.as_hex_mesh(bare).replaced(
        point_data={"f": np.arange(27) / 7, "v": np.ones((27, 3)), "i": np.arange(27)}, cell_data={"c": np.arange(8.0)}
    )
    for extension in hc.io.WRITE_EXTENSIONS:
        path = folder / f"volume_{extension[1:]}{extension}"
        try:
            hc.write(path, mesh)
        except hc.WriteError as problem:
            if "formats" not in str(problem):  # an optional package
                raise
        else:
            yield path
    grid = pv.wrap(hc.read(folder / "volume_vtu.vtu").origin.source)
    for name in ("text.vtu", "text.vtk"):
        grid.save(folder / name, binary=False)
        yield folder / name
    for form in ("gmsh22", "gmsh"):
        for binary in (False, True):
            path = folder / f"{form}_{'binary' if binary else 'text'}.msh"
            meshio.write(path, _gmsh(bare, entities=form == "gmsh"), file_format=form, binary=binary)
            yield path
    meshio.write(folder / "tagged.mesh", tagged)
    yield folder / "tagged.mesh"
    (folder / "mfem.mesh").write_text(_mfem(points, cells))
    yield folder / "mfem.mesh"
    image = pv.ImageData(dimensions=(3, 3, 3))
    image.cell_data["c"] = np.arange(8.0)
    for made, extension in (
        (image, ".vti"),
        (image.cast_to_rectilinear_grid(), ".vtr"),
        (image.cast_to_structured_grid(), ".vts"),
        (image.cast_to_structured_grid(), ".vtk"),
    ):
        path = folder / f"structured{extension}"
        made.save(path)
        yield path


def _gmsh(mesh: Any, entities: bool) -> Any:
    import meshio

    tags = np.tile([3, 1], (len(mesh.points), 1))
    tags[mesh.cells[1].data[0]] = [2, 1]
    numbers = [np.ones(len(block.data), dtype=int) for block in mesh.cells]
    return meshio.Mesh(
        mesh.points,
        mesh.cells,
        point_data={"gmsh:dim_tags": tags} if entities else {},
        cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers},
    )


def _mfem(points: Any, cells: Any) -> str:
    elements = [f"1 5 {' '.join(map(str, cell))}" for cell in cells.tolist()]
    sides = [f"1 3 {' '.join(map(str, cell[:4]))}" for cell in cells[:4].tolist()]
    vertices = [" ".join(map(str, point)) for point in points.tolist()]
    parts = [
        ("dimension", ["3"]),
        ("elements", [str(len(elements)), *elements]),
        ("boundary", [str(len(sides)), *sides]),
        ("vertices", [str(len(vertices)), "3", *vertices]),
    ]
    return "\n".join(["MFEM mesh v1.0", *("\n".join(["", name, *lines]) for name, lines in parts), ""])


def _surfaces(folder: Path) -> Iterator[Path]:
    import pyvista as pv

    import surface

    sphere = pv.Sphere(theta_resolution=6, phi_resolution=5)
    sphere.point_data["f"] = np.arange(float(sphere.n_points))
    for extension in surface.io.read_write.EXTENSIONS:
        path = folder / f"surface{extension}"
        surface.write(path, sphere)
        yield path
    for extension in (".ply", ".stl", ".vtp"):
        path = folder / f"surface_text{extension}"
        sphere.save(path, binary=False)
        yield path


# ------------------------------------------------------------------------------------------- the process that may die
def probe(path: Path) -> str:
    """What comes of reading a file and going on with it: "mesh", the name of an error of ours, or what is wrong."""
    import hexconformal as hc
    import surface

    results = []
    readers: list[Any] = []
    if path.stem.startswith("surface"):
        readers += [(surface.read, lambda mesh: surface.remesh(mesh, max_iterations=1)), (hc.io.read_surface, None)]
    else:
        readers += [(hc.read, _go_on)]
    for read, then in readers:
        try:
            mesh = read(path)
            results.append("mesh")
            if then is not None:
                then(mesh)
        except hc.MeshError as problem:
            results.append(type(problem).__name__)
        except BaseException as problem:
            if isinstance(problem, KeyboardInterrupt):
                raise
            place = problem.__traceback__
            while place is not None and place.tb_next is not None:
                place = place.tb_next
            where = "" if place is None else f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}"
            return f"! {type(problem).__name__} at {where}: {problem}"
    return results[0]


def _go_on(mesh: Any) -> None:
    import hexconformal as hc

    hc.check(mesh)
    hc.regularize(mesh, max_iterations=1)


def work(listing: Path, journal: Path) -> None:
    """Probe the listed files, and write down what became of each, as it goes."""
    import hexconformal as hc
    import surface
    from hexconformal.generate import box

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.environ["HDF5_USE_FILE_LOCKING"] = "FALSE"
    with tempfile.TemporaryFile() as printed, journal.open("a") as log:
        os.dup2(printed.fileno(), 1)
        os.dup2(printed.fileno(), 2)
        logging.getLogger("hexconformal").setLevel(logging.ERROR)  # that it compiles may be said
        _go_on(hc.HexMesh(*box((2, 2, 2))))
        surface.remesh((np.eye(3), [[0, 1, 2]]))
        for name in listing.read_text().split("\n"):
            print(json.dumps(["begin", name, time.time()]), file=log, flush=True)
            verdict = probe(Path(name))
            sys.stdout.flush()
            sys.stderr.flush()
            size = os.lseek(1, 0, os.SEEK_END)
            if size and not verdict.startswith("!"):
                printed.seek(0)
                verdict = f"! printed: {printed.read(200).decode('utf-8', 'replace')}"
            os.ftruncate(1, 0)
            os.lseek(1, 0, os.SEEK_SET)
            print(json.dumps(["end", name, verdict]), file=log, flush=True)


def verdicts(paths: list[Path], folder: Path) -> dict[Path, str]:
    """Probe files in a process of their own, another one for the rest after each that died."""
    found: dict[Path, str] = {}
    while len(found) < len(paths):
        left = [path for path in paths if path not in found]
        listing, journal = folder / "listing", folder / "journal"
        listing.write_text("\n".join(map(str, left)))
        journal.write_text("")
        process = subprocess.Popen([sys.executable, __file__, "--work", str(listing), str(journal)])
        begun: tuple[str, float] | None = None
        code = None
        while code is None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                code = process.wait(timeout=0.5)
            rows = [json.loads(row) for row in journal.read_text().split("\n")[:-1]]
            begun = None
            for kind, name, what in rows:
                if kind == "begin":
                    begun = (name, what)
                else:
                    found[Path(name)] = what
                    begun = None
            if begun is not None and code is None and time.time() - begun[1] > LIMIT:
                process.kill()
                process.wait()
                found[Path(begun[0])], begun, code = f"! took more than {LIMIT:g} s", None, 0
        if begun is not None:
            how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            found[Path(begun[0])] = f"! died: {how}"
        elif code not in (0, None) and len(left) == len([path for path in paths if path not in found]):
            raise RuntimeError(f"the process does not start: exit code {code}")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=400, help="mutants of each file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="files whose name has this in it")
    parser.add_argument("--keep", type=Path, help="where to leave the mutants that were not taken well")
    parser.add_argument("--work", type=Path, nargs=2, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.work:
        work(*arguments.work)
        return 0
    print("| file | mutants | read | refused | not taken well |\n|---|--:|--:|--:|--:|")
    failures: list[str] = []
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        for sample in samples(folder):
            if arguments.only not in sample.name:
                continue
            data = sample.read_bytes()
            paths = []
            for number in range(arguments.count):
                rng = np.random.default_rng([arguments.seed, number, *sample.name.encode()])
                paths.append(numbered(folder, sample, number))  # beside what the file refers to
                paths[-1].write_bytes(mutant(data, rng, sample.name))
            found = verdicts([sample, *paths], folder)
            sound = found.pop(sample)
            if sound != "mesh":
                failures.append(f"{sample.name}, sound: {sound}")
            bad = {path: what for path, what in found.items() if what.startswith("!")}
            kinds = Counter(found.values())
            refused = len(found) - len(bad) - kinds["mesh"]
            print(f"| {sample.name} | {len(found)} | {kinds['mesh']} | {refused} | {len(bad)} |", flush=True)
            for path, what in bad.items():
                failures.append(f"{path.name}: {what[2:]}")
                if arguments.keep is not None:
                    arguments.keep.mkdir(parents=True, exist_ok=True)
                    (arguments.keep / path.name).write_bytes(path.read_bytes())
            for path in paths:
                path.unlink()
    print("\n".join(["", *failures]))
    return int(bool(failures))


if __name__ == "__main__":
    sys.exit(main())
