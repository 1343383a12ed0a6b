"""Time and memory of meshes of quadratic hexahedra, fixed boundary or not, each in a process of its own, as a table.

    python benchmarks/quadratic_scaling.py --threads 1 2

A ball as an O-grid of second order, its inner nodes of all kinds off by .1 edges along each axis. Kernels are loaded by
a tiny mesh before the clock starts.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import resource
import sys
import time

from curved_meshes import ball, perturbed
from machine import described, run

import hexconformal as hc

GRIDS = {"small": (7, 7), "large": (14, 15)}  # cells along an edge of the core, and in layers around it


def one(nodes: int, core: int, layers: int, threads: int, amount: float, boundary: str) -> None:
    """The process of a run: prints its figures."""
    hc.use_threads(threads)
    hc.regularize(perturbed(ball(nodes, 2, 2), amount), boundary=boundary)
    mesh = perturbed(ball(nodes, core, layers), amount)
    wall, cpu = time.perf_counter(), time.process_time()
    report = hc.regularize(mesh, boundary=boundary).report
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    before, after = report.before, report.after
    figures = [after.count, nodes, boundary, threads, before.invalid, after.invalid]
    figures += [f"{before.scaled_jacobian.min:.3f}"]
    figures += [f"{after.scaled_jacobian.min:.3f} / {after.scaled_jacobian.mean:.3f}", report.iterations]
    figures += [f"{wall:.1f}", f"{cpu:.1f}", f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9:.2f}"]
    print(json.dumps([str(figure) for figure in [*figures, report.reason]]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--grids", nargs="+", choices=GRIDS, default=list(GRIDS))
    parser.add_argument("--nodes", type=int, nargs="+", choices=(20, 27), default=[27])
    parser.add_argument("--boundary", nargs="+", choices=("fixed", "slide"), default=["fixed", "slide"])
    parser.add_argument("--threads", type=int, nargs="+", default=[2])
    parser.add_argument("--amount", type=float, default=0.1, help="how far inner nodes are off, in edges")
    parser.add_argument("--limit", type=float, default=1800.0, help="CPU seconds of a run")
    parser.add_argument("--one", nargs=6, help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.one:
        *numbers, amount, boundary = asked.one
        one(*map(int, numbers), float(amount), boundary)
        return
    print(described(os.getloadavg()), end="\n\n")
    titles = (
        "cells | nodes | boundary | threads | invalid before | after | SJ before | SJ min / mean | iterations | "
        "wall s | CPU s"
    )
    print(f"| {titles} | peak GB | ended |\n|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|")
    for nodes in asked.nodes:
        for grid in asked.grids:
            for boundary, threads in itertools.product(asked.boundary, asked.threads):
                words = [str(word) for word in (nodes, *GRIDS[grid], threads, asked.amount, boundary)]
                ended = run([sys.executable, __file__, "--one", *words], asked.limit)
                said = ended.output.strip().splitlines()[-1] if ended.output.strip() else "no output"
                print(f"| {' | '.join(json.loads(said))} |" if ended.code == 0 else f"| {grid}: {said} |", flush=True)


if __name__ == "__main__":
    main()
