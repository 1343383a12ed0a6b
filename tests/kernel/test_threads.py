"""Several threads at once: each gets its own answer, and the streams of the process stay what they were."""

import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import hexconformal as hc
import surface
from hexconformal import generate
from hexconformal.io.format_tools.captured_output import captured_output
from hexconformal.mesh import boundary_quads


def made_regular(seed):
    points, cells = generate.jittered(*generate.ball(3, 2), 0.6, seed=seed)
    return hc.regularize((points, cells), max_iterations=8).points


def remeshed(seed):
    points, cells = generate.jittered(*generate.ball(3, 1), 0.3, seed=seed)
    faces = boundary_quads(cells)[0]
    return surface.remesh((points, faces), max_iterations=3).points


def test_threads_do_not_disturb_each_other():
    for work in (made_regular, remeshed):
        alone = [work(seed) for seed in range(3)]
        with ThreadPoolExecutor(3) as threads:
            for one, other in zip(alone, threads.map(work, range(3)), strict=True):
                np.testing.assert_array_equal(one, other)


def test_files_read_at_once_leave_the_streams_alone():
    streams = sys.stdout, sys.stderr
    inside, left = threading.Event(), threading.Event()

    def second():
        inside.wait(5)
        with captured_output():
            left.wait(0.5)  # ends after the first, unless it has to wait for it

    other = threading.Thread(target=second)
    other.start()
    with captured_output():
        inside.set()
        left.wait(0.2)
    left.set()
    other.join()
    assert (sys.stdout, sys.stderr) == streams
