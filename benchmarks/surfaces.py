"""Time, memory and growth of remeshing a surface, from 20,000 to a million triangles: a sheared, noisy torus.

    python benchmarks/surfaces.py                       # writes benchmarks/surfaces.md
    python benchmarks/surfaces.py --sizes 5000 20000    # quick look, printed only

The shear is the same at every size, so nodes have to travel 6 edge lengths on the smallest torus and 40 on the
largest; the noise is a quarter of an edge. Every size runs in a process of its own, after a small mesh that loads the
compiled kernels. Wall and CPU seconds are those of ``surface.remesh`` with its defaults, checks and reports included,
the making of the mesh not; peak memory is that of the process.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import sys
import time
from pathlib import Path
from typing import Any

from machine import described, run

sys.path.append(str(Path(__file__).parents[1] / "tests"))
from meshes.surfaces import sheared_torus

SIZES = (20_000, 80_000, 320_000, 1_000_000)
HEADER = (
    "| triangles | iterations | wall s | CPU s | CPU s / iteration | peak GB | smallest angle | mean angle | "
    "turned over | area by | volume by | distance | ended |"
)


def measured(size: int, iterations: int) -> dict[str, Any]:
    """Figures of one run in this process."""
    import surface

    surface.remesh(sheared_torus(16, 8), max_iterations=3)
    m = round(math.sqrt(size / 4))
    mesh = sheared_torus(2 * m, m)
    wall, cpu = time.perf_counter(), time.process_time()
    report = surface.remesh(mesh, max_iterations=iterations).report
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    return {
        "cells": len(mesh[1]),
        "iterations": report.iterations,
        "wall": wall,
        "cpu": cpu,
        "each": cpu / max(report.iterations, 1),
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9,
        "angles": [
            (before, after)
            for before, after in (
                (report.before.min_angle, report.after.min_angle),
                (report.before.mean_angle, report.after.mean_angle),
            )
        ],
        "turned": report.turned,
        "area": report.area_change,
        "volume": report.volume_change,
        "distance": report.hausdorff,
        "ended": report.reason,
    }


def as_line(row: dict[str, Any]) -> str:
    """One line of the table."""
    smallest, mean = (f"{before:.1f} -> {after:.1f}" for before, after in row["angles"])
    return (
        f"| {row['cells']} | {row['iterations']} | {row['wall']:.0f} | {row['cpu']:.1f} | {row['each']:.2f} | "
        f"{row['peak']:.2f} | {smallest} | {mean} | {row['turned']} | {row['area']:+.2%} | {row['volume']:+.0e} | "
        f"{row['distance']:.2%} | {row['ended']} |"
    )


def growth(rows: list[dict[str, Any]], key: str) -> float:
    """Exponent p in figure ~ cells^p between the first row and the last."""
    return math.log(rows[-1][key] / rows[0][key]) / math.log(rows[-1]["cells"] / rows[0]["cells"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", help="triangles, about; prints instead of writing")
    parser.add_argument("--iterations", type=int, default=100, help="most of them")
    parser.add_argument("--limit", type=float, default=1800.0, help="CPU seconds of a run")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(measured(asked.sizes[0], asked.iterations)))
        return
    load = os.getloadavg()
    lines = ["# Surfaces: a sheared, noisy torus", "", described(load), ""]
    threads = os.environ.get("HEXCONFORMAL_THREADS", "all")
    lines += [f"Threads: {threads}. Distance: Hausdorff, over the diagonal of the bounding box.", ""]
    lines += [HEADER, "|" + "--:|" * 12 + "---|"]
    rows = []
    for size in asked.sizes or SIZES:
        one = ["--one", "--sizes", str(size), "--iterations", str(asked.iterations)]
        ended = run([sys.executable, __file__, *one], asked.limit)
        if ended.code != 0:
            lines.append(f"| {size} | {'over time' if ended.code is None else ended.output.splitlines()[-1]} |")
            continue
        rows.append(json.loads(ended.output.splitlines()[-1]))
        lines.append(as_line(rows[-1]))
        print(lines[-1], flush=True)
    if len(rows) > 1:
        lines += ["", f"Growth exponent: CPU {growth(rows, 'cpu'):.2f}, peak memory {growth(rows, 'peak'):.2f}."]
    text = "\n".join(lines) + "\n"
    if asked.sizes:
        print(text)
    else:
        Path(__file__).with_suffix(".md").write_text(text)


if __name__ == "__main__":
    main()
