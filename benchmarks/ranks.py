"""Time, memory and traffic of runs on ranks: strong and weak, beside one process without them.

    python benchmarks/ranks.py                          # writes benchmarks/ranks.md, with the model of ranks_model.py
    python benchmarks/ranks.py --sizes 24 --ranks 1 2   # quick look, printed only
    python benchmarks/ranks.py --million                # a million cells on two ranks as well: two minutes, 3 GB

A cube twisted by 60 degrees, jittered; fixed boundary, mean distortion, relative gradient 1e-6, as in scaling.py.
Strong: the same mesh on more ranks. Weak: as many cells for each rank. Every rank makes the planes of the grid that are
its share. Wall seconds are those of the run, checks, distribution and report included, after a small mesh that loads
the compiled kernels. Seconds of work are processor time that a rank takes outside of MPI (reductions and exchanges of
fields; PETSc's own count as work), the largest of all ranks. Bytes that a rank sends and its reductions are counted,
those of fields and values where the program exchanges them, those of the multigrid by PETSc's log; setting this up is
not among them. Peak memory is that of a rank, with 170 MB of libraries; every rank's mesh is made in another process.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import ranks_model
from machine import described

HEADER = (
    "| cells | ranks | iterations | wall s | CPU s, all | work s, most | efficiency by work | peak GB, a rank | "
    "MB sent, a rank and iteration: fields + multigrid | messages | reductions | nodes, copies (most) |"
)
SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMP_NUM_THREADS": "1",
}
SECONDS = 900
_SENT = "bytes", "messages"


def share(size: int, rank: int, ranks: int) -> tuple[Any, Any, Any, Any]:
    """Points, cells, and ids of both, of the layers of a twisted cube that are a rank's."""
    from hexconformal import generate

    points, cells = generate.jittered(*generate.twisted_cube(size), 0.1)
    first, last = (len(cells) * k // ranks for k in (rank, rank + 1))
    nodes, local = np.unique(cells[first:last], return_inverse=True)
    return points[nodes], local.reshape(-1, 8), nodes, np.arange(first, last)


def loaded_share(size: int, rank: int, ranks: int) -> list[Any]:
    """The same, made in a process of its own, so that the whole mesh is in no memory that is measured."""
    with tempfile.NamedTemporaryFile(suffix=".npz") as file:
        make = f"import numpy, ranks; numpy.savez({file.name!r}, *ranks.share({size}, {rank}, {ranks}))"
        subprocess.run([sys.executable, "-c", make], check=True, cwd=Path(__file__).parent)
        with np.load(file.name) as arrays:
            return [arrays[name] for name in arrays.files]


def of_petsc() -> Any:
    """Cycles of the multigrid so far, and what this rank has sent in them: messages, bytes, reductions."""
    from hexconformal.ranks import petsc

    told = petsc().Log.Event("PCApply").getPerfInfo()
    # PETSc adds up what is sent and what is received.
    return np.array([told["count"], told["numMessages"] / 2, told["messageLength"] / 2, told["numReductions"]])


def measure(size: int, ranks: bool) -> dict[str, Any]:
    """One run, in a process or on the ranks that have been started."""
    import hexconformal as hc

    options = hc.Options(boundary="fixed", emphasis="mean")
    comm: Any = None
    if ranks:
        from mpi4py import MPI

        comm = MPI.COMM_WORLD
    rank, count = (comm.rank, comm.size) if comm else (0, 1)

    def run(size: int) -> Any:
        from hexconformal.ranks import MeshPiece

        points, cells, nodes, ids = loaded_share(size, rank, count)
        mesh = MeshPiece(points, cells, node_ids=nodes, cell_ids=ids) if comm else hc.HexMesh(points, cells)
        began, cpu = time.perf_counter(), time.process_time()
        one = hc.Regularization(mesh, options, comm=comm)
        prepared = time.process_time() - cpu
        list(one)
        iterated = time.process_time() - cpu - prepared
        result = one.result()
        return one, result, time.perf_counter() - began, time.process_time() - cpu, iterated

    if comm:
        from hexconformal.ranks import petsc

        petsc().Log.begin()
    run(6)
    before = of_petsc() if comm else 0.0
    one, result, wall, cpu, iterated = run(size)
    found: dict[str, Any] = {
        "cells": result.report.after.count,
        "ranks": count if comm else 0,
        "iterations": result.report.iterations,
        "wall": wall,
        "cpu": cpu,
        "work": cpu,
        "iterated": iterated,
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "min": result.report.after.scaled_jacobian.min,
    }
    if not comm:
        return found
    halo, steps = one._normalized.space.halo, max(result.report.iterations, 1)
    cycles, messages, sent, reductions = ((of_petsc() - before) / steps).tolist()
    found |= {
        "work": cpu - halo.traffic.seconds,
        "iterated": iterated - halo.traffic.seconds,
        "bytes": halo.traffic.bytes / steps,
        "messages": halo.traffic.messages / steps,
        "reductions": halo.traffic.reductions / steps,
        "cycles": cycles,
        "multigrid bytes": sent,
        "multigrid messages": messages,
        "multigrid reductions": reductions,
        "nodes": halo.owned,
        "copies": len(halo.ghosts),
    }
    every = comm.gather(found)
    if comm.rank:
        return {}
    most = {key: max(one[key] for one in every) for key in found}
    sums = {f"{what} of all": sum(one[what] for one in every) for what in found if what.split()[-1] in _SENT}
    return {**most, **sums, "cpu": sum(one["cpu"] for one in every)}


def started(size: int, ranks: int) -> dict[str, Any]:
    """The figures of a run on so many ranks, 0 for a process without them."""
    words = [sys.executable, *(["-m", "mpi4py"] if ranks else []), __file__, "--one", str(size)]
    if ranks:
        words = ["mpiexec", "-n", str(ranks), *words, "--on-ranks"]
    threads = {"HEXCONFORMAL_THREADS": "1"}
    done = subprocess.run(
        words, env={**os.environ, **SETTINGS, **threads}, capture_output=True, text=True, timeout=SECONDS
    )
    if done.returncode:
        raise SystemExit(done.stderr)
    figures: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return figures


def row(found: dict[str, Any], one: float) -> str:
    """A row of the table; `one` is the work of a cell on one rank."""
    by_work, traffic = "-", "- | - | - | -"
    if found["ranks"]:
        by_work = f"{one * found['cells'] / found['ranks'] / found['work']:.0%}"
        mega = f"{found['bytes'] / 1e6:.2f} + {found['multigrid bytes'] / 1e6:.2f}"
        counts = (f"{found[what]:.0f} + {found[f'multigrid {what}']:.1f}" for what in ("messages", "reductions"))
        traffic = f"{mega} | {' | '.join(counts)} | {found['nodes']}, {found['copies']}"
    return (
        f"| {found['cells']} | {found['ranks'] or 'none'} | {found['iterations']} | {found['wall']:.1f} | "
        f"{found['cpu']:.1f} | {found['work']:.1f} | {by_work} | {found['peak']:.2f} | {traffic} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--million", action="store_true")
    parser.add_argument("--figures", type=Path, help="keep what was measured, as JSON")
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--on-ranks", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        found = measure(arguments.one, arguments.on_ranks)
        print(json.dumps(found) if found else "", end="")
        return
    strong = arguments.sizes or [24, 40, 46]
    lines = [
        "# Ranks",
        "",
        described(os.getloadavg()),
        "",
        "## The same mesh on more ranks",
        "",
        HEADER,
        "|" + "--:|" * 12,
    ]
    known: dict[tuple[int, int], dict[str, Any]] = {}
    for size in strong:
        for ranks in [0, *arguments.ranks]:
            known[size, ranks] = started(size, ranks)
            one = known.get((size, 1))
            lines.append(row(known[size, ranks], one["work"] / one["cells"] if one else float("nan")))
            print(lines[-1], flush=True)
    lines += ["", "## As many cells for each rank", "", HEADER, "|" + "--:|" * 12]
    base = strong[0]
    for ranks in arguments.ranks:
        size = round(base * ranks ** (1 / 3))
        found = known.get((size, ranks)) or started(size, ranks)
        one = known[base, 1]
        lines.append(row(found, one["work"] / one["cells"]))
        print(lines[-1], flush=True)
    checked = strong[2:]
    if arguments.million:
        checked.append(100)
        known[100, 2] = started(100, 2)
        lines += [
            "",
            "## A million cells",
            "",
            HEADER,
            "|" + "--:|" * 12,
            row(known[100, 2], one["work"] / one["cells"]),
        ]
        print(lines[-1], flush=True)
    if arguments.figures is not None:
        runs = [{"size": size, **found} for (size, _), found in known.items()]
        arguments.figures.write_text(json.dumps({"fitted": strong[:2], "checked": checked, "runs": runs}))
    if {*arguments.ranks} >= {1, 2} and len(strong) > 1:
        lines += ranks_model.lines(strong[:2], checked, known)
    if arguments.sizes is None:
        Path(__file__).with_suffix(".md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
