"""Where there is no MPI the flag says what to install."""

import sys

import pytest
from program import error_line, run

from hexconformal import HexMesh, MeshError, OptionError, Regularization, generate, write
from hexconformal.ranks import MeshPiece


@pytest.mark.parametrize("command", ["regularize part.vtu better.pvtu --mpi", "quality part.vtu --mpi"])
def test_without_mpi4py_the_flag_is_refused(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "mpi4py", None)
    write("part.vtu", HexMesh(*generate.box((2, 2, 2))))
    assert run(command) == 2
    assert "runs on ranks need mpi4py" in error_line(capsys)


def test_pieces_say_what_is_wrong_with_their_ids():
    points, cells = generate.box((1, 1, 1))
    for ids, message in (
        ({"node_ids": range(7), "cell_ids": [0]}, "node_ids must be 8 numbers"),
        ({"node_ids": [0, 0, *range(2, 8)], "cell_ids": [0]}, "there several times: 1 \\(ids 0\\)"),
        ({"node_ids": range(8), "cell_ids": [-1]}, "cell_ids must be 0 or more"),
    ):
        with pytest.raises(MeshError, match=message):
            MeshPiece(points, cells, **ids)
    assert len(MeshPiece.nothing().cells) == 0
    with pytest.raises(OptionError, match="every rank must hand in a"):
        MeshPiece.of(HexMesh(points, cells))
    assert Regularization(HexMesh(points, cells), comm=None).points.shape == (8, 3)
