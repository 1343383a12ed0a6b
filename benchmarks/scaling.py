"""Time, memory and growth of a run from 40^3 to 100^3 cells: a cube twisted by 60 degrees, jittered.

    python benchmarks/scaling.py                    # writes benchmarks/scaling.md
    python benchmarks/scaling.py --sizes 16 24      # quick look, printed only

The boundary is fixed, the worst cells are not raised, the tolerance is a relative gradient of 1e-6. Every size
runs in a process of its own, after a small mesh that loads the compiled kernels. Wall and CPU seconds are those
of ``regularize``, checks and reports included, the making of the mesh not; peak memory is that of the process.
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

SIZES = (40, 64, 100)
ENERGIES = ("barrier", "quaternionic")
HEADER = "| cells | smallest SJ before | iterations | wall s | CPU s | set-up s | peak GB | SJ min / mean | ended |"


def measured(n: int, energy: str, jitter: float) -> dict[str, Any]:
    """Figures of one run in this process."""
    import hexconformal as hc
    from hexconformal.generate import jittered, twisted_cube

    options = {"boundary": "fixed", "energy": energy, "emphasis": "mean", "gradient_tolerance": 1e-6}
    hc.regularize(jittered(*twisted_cube(6), jitter), **options)
    mesh = jittered(*twisted_cube(n), jitter)
    first = []
    wall, cpu = time.perf_counter(), time.process_time()
    result = hc.regularize(mesh, callback=lambda record: first.append(record.seconds), **options)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    report = result.report
    return {
        "cells": n**3,
        "before": report.before.scaled_jacobian.min,
        "iterations": report.iterations,
        "wall": wall,
        "cpu": cpu,
        # Up to the end of the first iteration, less what the others take on average.
        "setup": first[1] - (first[-1] - first[1]) / max(len(first) - 2, 1),
        "peak": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9,
        "min": report.after.scaled_jacobian.min,
        "mean": report.after.scaled_jacobian.mean,
        "ended": report.reason,
    }


def growth(rows: list[dict[str, Any]], key: str) -> float:
    """Exponent p in time ~ cells^p between the first row and the last."""
    return math.log(rows[-1][key] / rows[0][key]) / math.log(rows[-1]["cells"] / rows[0]["cells"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="+", help="cells along an edge; prints instead of writing")
    parser.add_argument("--energy", choices=ENERGIES, nargs="+", default=ENERGIES)
    parser.add_argument("--jitter", type=float, default=0.1, help="of the shortest edge around a node")
    parser.add_argument("--limit", type=float, default=1200.0, help="wall seconds of a run")
    parser.add_argument("--one", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(measured(asked.sizes[0], asked.energy[0], asked.jitter)))
        return
    load = os.getloadavg()
    lines = ["# Scaling", "", described(load), ""]
    lines += [f"Cube twisted by 60 degrees, jittered by {asked.jitter:g}; fixed boundary; relative gradient 1e-6.", ""]
    for energy in asked.energy:
        lines += [f"## energy = {energy!r}", "", HEADER, "|" + "--:|" * 8 + "---|"]
        rows = []
        for n in asked.sizes or SIZES:
            one = ["--one", "--sizes", str(n), "--energy", energy, "--jitter", str(asked.jitter)]
            ended = run([sys.executable, __file__, *one], asked.limit)
            if ended.code != 0:
                lines.append(f"| {n**3} | {'over time' if ended.code is None else ended.output.splitlines()[-1]} |")
                continue
            row = json.loads(ended.output.splitlines()[-1])
            rows.append(row)
            lines.append(
                "| {cells} | {before:.3f} | {iterations} | {wall:.1f} | {cpu:.1f} | {setup:.1f} | {peak:.2f} | "
                "{min:.3f} / {mean:.3f} | {ended} |".format(**row)
            )
            print(lines[-1], flush=True)
        if len(rows) > 1:
            lines += ["", f"Growth exponent: wall {growth(rows, 'wall'):.2f}, CPU {growth(rows, 'cpu'):.2f}.", ""]
    text = "\n".join(lines).rstrip() + "\n"
    if asked.sizes:
        print(text)
    else:
        Path(__file__).with_suffix(".md").write_text(text)


if __name__ == "__main__":
    main()
