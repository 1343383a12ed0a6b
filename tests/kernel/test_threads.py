"""Several threads at once: each gets its own answer, and the streams of the process stay what they were."""

import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import hexconformal as hc
import surface
from hexconformal import generate
from hexconformal.io.format_tools.captured_output import captured_output
from hexconformal.kernel import threads
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
        with ThreadPoolExecutor(3) as pool:
            for one, other in zip(alone, pool.map(work, range(3)), strict=True):
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


@pytest.mark.parametrize("count", [0, -1, 1.5, "two", True])
def test_a_number_of_threads_is_positive(count):
    with pytest.raises(hc.OptionError, match="threads must be a positive number"):
        hc.use_threads(count)


def test_threads_are_as_many_as_asked_for(monkeypatch):
    threads._usual_count.cache_clear()
    monkeypatch.setenv("HEXCONFORMAL_THREADS", "3")
    assert threads.thread_count() == 3
    hc.use_threads(2)
    assert threads.thread_count() == 2
    hc.use_threads(None)
    assert threads.thread_count() == 3
    threads._usual_count.cache_clear()


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({"cpu.max": "150000 100000\n"}, 2),
        ({"cpu.max": "max 100000\n"}, None),
        ({"cpu/cpu.cfs_quota_us": "100000\n", "cpu/cpu.cfs_period_us": "100000\n"}, 1),
        ({"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, None),
        ({}, None),
    ],
)
def test_a_container_limits_the_threads(files, expected, tmp_path, monkeypatch):
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(threads, "_GROUPS", tmp_path)
    monkeypatch.setattr(threads.os, "sched_getaffinity", lambda process: range(64), raising=False)
    monkeypatch.delenv("HEXCONFORMAL_THREADS", raising=False)
    threads._usual_count.cache_clear()
    assert threads.thread_count() == (expected or 64)
    threads._usual_count.cache_clear()


def test_an_error_in_a_thread_arrives(monkeypatch):
    monkeypatch.setattr(threads, "thread_count", lambda: 3)

    def fails(first, last):
        if first > 0:
            raise MemoryError(first)

    with pytest.raises(MemoryError):
        threads.parallel_ranges(fails, 3, smallest=1)
