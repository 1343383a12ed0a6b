"""Decks that multiply what they say: read, or refused, in bounded time and memory."""

import time
import tracemalloc
from contextlib import contextmanager

import pytest
from io_decks import BRICK, CUBE, read

import hexconformal as hc


@contextmanager
def bounded(seconds, megabytes):
    """Fails where more time or memory is taken."""
    tracemalloc.start()
    began = time.perf_counter()
    try:
        yield
        taken, peak = time.perf_counter() - began, tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert taken < seconds
    assert peak < megabytes * 1e6


def hostile(name):
    cube = f"*NODE\n{CUBE}{BRICK}"
    doubling = "*NSET, NSET=A0\n1, 2\n" + "".join(f"*NSET, NSET=A{k}\nA{k - 1}, A{k - 1}\n" for k in range(1, 60))
    chain = "*NSET, NSET=A0\n1\n" + "".join(f"*NSET, NSET=A{k}\nA{k - 1}\n" for k in range(1, 5000))
    return {
        "doubling": cube + doubling,
        "chain backwards": cube
        + "".join(f"*NSET, NSET=A{k}\nA{k + 1}\n" for k in range(3000))
        + "*NSET, NSET=A3000\n1\n",
        "chain": cube + chain,
        "ranges": cube + "*NSET, NSET=A, GENERATE\n" + "1, 3000000000, 1\n" * 3000 + "2, 3000000000, 2\n" * 3000,
        "many names": cube + "".join(f"*NSET, NSET=A{k}\n1\n" for k in range(4000)),
        "quotes": cube + "*NSET, NSET=A\n" + '"a,' * 20000 + "\n",
    }[name]


@pytest.mark.long
@pytest.mark.parametrize("name", ["doubling", "chain", "chain backwards", "ranges", "many names"])
def test_sets_that_multiply_are_read_in_no_time(name, tmp_path):
    with bounded(seconds=10, megabytes=200):
        mesh = read(tmp_path, hostile(name))
    assert all(mask.any() for mask in mesh.named_nodes().values())


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("# " * 40 + "\nx\n", "no nodes"),
        (f"*NODE\n{CUBE}{BRICK}*ELGEN\n1, 100000, 0, 1, 100000, 0, 100000, 100000\n", "must not be more than"),
        (f"*NODE\n1,0,0,0\n900000000,1,0,0\n*NGEN\n1, 900000000, 1\n{BRICK}", "must not be more than"),
        (f"*NODE\n{CUBE}{BRICK}*NSET, NSET=A\n" + '"a,' * 20001 + "\n", "which is not a set"),
    ],
)
def test_statements_that_generate_without_end_are_refused(text, reason, tmp_path):
    with bounded(seconds=10, megabytes=200), pytest.raises(hc.ReadError, match=reason):
        read(tmp_path, text)


def test_files_that_include_others_too_often_are_refused(tmp_path):
    for level in range(1, 5):
        (tmp_path / f"{level}.inc").write_text(f"*INCLUDE, INPUT={level + 1}.inc\n" * 30)
    (tmp_path / "5.inc").write_text("** \n")
    with bounded(seconds=10, megabytes=200), pytest.raises(hc.ReadError, match="too deep, or too often"):
        read(tmp_path, f"*NODE\n{CUBE}{BRICK}*INCLUDE, INPUT=1.inc\n")


def test_a_file_that_is_included_again_and_again_is_refused(tmp_path):
    (tmp_path / "1.inc").write_text("** " + "x" * 1_000_000 + "\n")
    with bounded(seconds=10, megabytes=50), pytest.raises(hc.ReadError, match="again and again"):
        read(tmp_path, f"*NODE\n{CUBE}{BRICK}" + "*INCLUDE, INPUT=1.inc\n" * 500)
