"""Time, memory and growth of runs up to some million cells, with one thread and with several.

    python benchmarks/scaling.py --part part.vtu            # writes benchmarks/scaling.md
    python benchmarks/scaling.py --only fixed --sizes 16 24 # quick look, printed only

fixed      a cube twisted by 60 degrees, jittered; fixed boundary, mean distortion, relative gradient 1e-6
part       a real part with a curved boundary, plain defaults, cut in 8^k cells (benchmarks/cut.py)
mixed      a swept cylinder, a quarter wedges and the rest hexahedra, inner nodes off by .25 edges; plain defaults
tangled    a jittered box of which 6 % of the cells are inverted, fixed boundary, plain defaults
flow       a step of mean curvature flow of a sphere of triangles

Every run is a process of its own, after a small mesh that loads the compiled kernels. Wall and CPU seconds are those
of the call, checks and reports included, the making of the mesh not; peak memory is that of the process. Bandwidth is
that of a STREAM triad (a = b + s c, 3 x 8 bytes an entry) with the same threads, measured after each run.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from machine import described, run

SIZES = {
    "fixed": (40, 64, 100),
    "part": (0, 1, 2),
    "mixed": (4, 8),
    "tangled": (32, 64, 100),
    "flow": (20_000, 100_000),
}
TITLES = {
    "fixed": "Cube twisted by 60 degrees, jittered by 0.1; fixed boundary, mean distortion, relative gradient 1e-6",
    "part": "A part with a curved boundary, cut in 8^k; plain defaults",
    "mixed": "Swept cylinder of wedges and hexahedra, inner nodes off by .25 edges; plain defaults",
    "tangled": "Jittered box with 6 % of its cells inverted, fixed boundary; plain defaults",
    "flow": "A step of mean curvature flow of a sphere, with remeshing",
}
HEADER = (
    "| cells | threads | triad GB/s | inverted before | SJ before | iterations | wall s | CPU s | peak GB | "
    "SJ min / mean | ended |"
)


def triad(threads: int) -> float:
    """GB/s of a = b + s c with so many threads, the best of several."""
    from hexconformal.kernel import loop, parallel_ranges

    @loop
    def add(first, last, a, b, c):  # type: ignore[no-untyped-def]
        for i in range(first, last):
            a[i] = b[i] + 3.0 * c[i]

    count, best = 20_000_000, math.inf
    a, b, c = np.zeros(count), np.ones(count), np.ones(count)
    for _ in range(6):
        began = time.perf_counter()
        parallel_ranges(add, count, a, b, c)
        best = min(best, time.perf_counter() - began)
    return 24e-9 * count / best


def regularized(mesh: Any, **options: Any) -> Callable[[], dict[str, Any]]:
    """A run of regularize, to be timed."""
    import hexconformal as hc

    def call() -> dict[str, Any]:
        report = hc.regularize(mesh, **options).report
        return {
            "cells": report.before.count,
            "inverted": report.before.inverted,
            "before": f"{report.before.scaled_jacobian.min:.3f}",
            "iterations": report.iterations,
            "after": f"{report.after.scaled_jacobian.min:.3f} / {report.after.scaled_jacobian.mean:.3f}",
            "ended": report.reason,
        }

    return call


def prepared(case: str, size: int, part: str) -> Callable[[], dict[str, Any]]:
    """What is timed, with its mesh made."""
    from cut import cut_in_eight
    from other_cells import shaken

    import hexconformal as hc
    import surface
    from hexconformal import generate

    if case == "fixed":
        mesh = generate.jittered(*generate.twisted_cube(size), 0.1)
        return regularized(mesh, boundary="fixed", emphasis="mean", gradient_tolerance=1e-6)
    if case == "part":
        points, cells = generate.jittered(*generate.ball(10, 5), 0.3, seed=1)
        if part:
            mesh = hc.read(part)
            points, cells = mesh.points, mesh.cells
        for _ in range(size):
            points, cells = cut_in_eight(points, cells)
        return regularized((points, cells))
    if case == "mixed":
        mixed = hc.as_volume_mesh(generate.swept_cylinder(size, 3 * size, 8 * size, core_size=0.25))
        return regularized(shaken(mixed, 0.25 / (4 * size)))  # edges along the axis are 1 / (4 size)
    if case == "tangled":
        mesh = generate.jittered(*generate.box((size, size, size)), 0.36, valid=False)
        return regularized(mesh, boundary="fixed")
    points, faces = surface_of_ball(round(math.sqrt(size / 12)))
    flow = surface.MeanCurvature((points, faces))

    def call() -> dict[str, Any]:
        moments = list(surface.evolve(flow, steps=1, remesh=True))
        figures = {"cells": len(faces), "inverted": 0, "before": "", "iterations": len(moments) - 1, "after": ""}
        return {**figures, "ended": f"area {moments[-1].record.area / moments[0].record.area:.4f} of what it was"}

    return call


def surface_of_ball(n: int) -> tuple[Any, Any]:
    """The boundary of a cube of n^3 cells on the unit sphere, every quad two triangles."""
    from hexconformal import generate
    from hexconformal.mesh import boundary_quads

    points, cells = generate.box((n, n, n))
    quads = boundary_quads(cells)[0]
    used, quads = np.unique(quads, return_inverse=True)
    points, quads = 2.0 * points[used] / points.max() - 1.0, quads.reshape(-1, 4)
    points = points / np.linalg.norm(points, axis=1)[:, None]
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def measured(case: str, size: int, threads: int, part: str) -> dict[str, Any]:
    """Figures of one run in this process."""
    import hexconformal as hc

    hc.use_threads(threads)
    small = {"fixed": 6, "part": 0, "mixed": 1, "tangled": 6, "flow": 300}
    if case == "part":
        hc.regularize(hc.generate.jittered(*hc.generate.ball(3, 2), 0.2))
    else:
        prepared(case, small[case], part)()
    call = prepared(case, size, part)
    wall, cpu = time.perf_counter(), time.process_time()
    figures = call()
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    return {**figures, "threads": threads, "triad": triad(threads), "wall": wall, "cpu": cpu, "peak": peak}


def growth(rows: list[dict[str, Any]], key: str) -> float:
    """Exponent p in time ~ cells^p between the first row and the last."""
    return math.log(rows[-1][key] / rows[0][key]) / math.log(rows[-1]["cells"] / rows[0]["cells"])


def table(case: str, sizes: list[int], asked: argparse.Namespace) -> list[str]:
    """Lines of the table of a case."""
    lines = [f"## {TITLES[case]}", "", HEADER, "|" + "--:|" * 10 + "---|"]
    rows: dict[int, list[dict[str, Any]]] = {threads: [] for threads in asked.threads}
    for size in sizes:
        for threads in asked.threads:
            one = ["--one", case, "--sizes", str(size), "--threads", str(threads), "--part", asked.part]
            ended = run([sys.executable, __file__, *one], asked.limit)
            if ended.code != 0:
                said = "over time" if ended.code is None else ended.output.splitlines()[-1]
                lines.append(f"| {size} | {threads} | {said} |")
                continue
            row = json.loads(ended.output.splitlines()[-1])
            rows[threads].append(row)
            lines.append(
                "| {cells} | {threads} | {triad:.0f} | {inverted} | {before} | {iterations} | {wall:.1f} | {cpu:.1f} | "
                "{peak:.2f} | {after} | {ended} |".format(**row)
            )
            print(lines[-1], flush=True)
    found = [f"{threads} threads {growth(of, 'wall'):.2f}" for threads, of in rows.items() if len(of) > 1]
    return [*lines, "", *([f"Growth exponent of wall seconds: {', '.join(found)}.", ""] if found else [])]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=SIZES, nargs="+", default=list(SIZES), help="prints instead of writing")
    parser.add_argument("--part", default="", help="the part; without, a generated one")
    parser.add_argument(
        "--sizes", type=int, nargs="+", help="other sizes: edges of cubes, cuts, rings of wedges, triangles; prints"
    )
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--limit", type=float, default=1200.0, help="CPU seconds of a run")
    parser.add_argument("--one", choices=SIZES, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(measured(asked.one, asked.sizes[0], asked.threads[0], asked.part)))
        return
    lines = ["# Scaling", "", described(os.getloadavg()), ""]
    lines += [f"Part: {Path(asked.part).stem or 'generated, a ball with a rough surface'}.", ""]
    for case in asked.only:
        lines += table(case, asked.sizes or list(SIZES[case]), asked)
    text = "\n".join(lines).rstrip() + "\n"
    if asked.sizes or asked.only != list(SIZES):
        print(text)
    else:
        Path(__file__).with_suffix(".md").write_text(text)


if __name__ == "__main__":
    main()
