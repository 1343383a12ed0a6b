"""Nanoseconds a hexahedron of the kernels at corners, to be compared with those of another version.

    python benchmarks/corner_kernels.py
    PYTHONPATH=OTHER/src python benchmarks/corner_kernels.py   # a checkout of another commit

CPU time of one thread, the best of 15 calls, on a twisted cube of 64,000 cells: run both in turn some times, and take
the best of each.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import hexconformal as hc
from hexconformal import generate
from hexconformal.energy.corner_term import CornerTerm, CornerWeights


def nanoseconds(call: Callable[[], Any], cells: int) -> float:
    """CPU time a cell, the best of some calls."""
    times = []
    for _ in range(17):  # the first two load what is compiled
        began = time.process_time()
        call()
        times.append(time.process_time() - began)
    return 1e9 * min(times[2:]) / cells


def main() -> None:
    hc.use_threads(1)
    points, cells = generate.jittered(*generate.twisted_cube(40), 0.1)
    points = points / np.linalg.norm(points[cells[0, 1]] - points[cells[0, 0]])
    variation = np.random.default_rng(0).normal(size=points.shape)
    print("| terms | value | with gradient | second derivatives |\n|---|--:|--:|--:|")
    for name, weights in (("distortion", CornerWeights()), ("and angles", CornerWeights(angle=1.0))):
        term = CornerTerm(cells, np.empty((0, 1, 3, 3)), weights)
        calls: tuple[Callable[[], Any], ...] = (
            lambda term=term: term.value(points),
            lambda term=term: term.value_gradient(points),
            lambda term=term: term.second_product(points, variation),
        )
        print(f"| {name} | {' | '.join(f'{nanoseconds(call, len(cells)):.0f}' for call in calls)} |")


if __name__ == "__main__":
    main()
