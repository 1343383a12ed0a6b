"""Files on ranks: what is read, shared out, written and read again is what was there; other programs read it too."""

from pathlib import Path

import numpy as np
import pytest
import pyvista as pv

from hexconformal import HexMesh, check, generate, quality, read, write

PROGRAMS = Path(__file__).with_name("programs")
POINTS, CELLS = generate.jittered(*generate.box((7, 6, 5)), 0.2, seed=1)
FLAGS = (np.arange(len(POINTS)) % 3).astype(np.uint8)
NUMBERS = np.arange(len(CELLS), dtype=np.int32)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pieces")
    data = {"place": POINTS, "flag": FLAGS}, {"number": NUMBERS, "weight": CELLS.sum(axis=1) / 7.0}
    write(folder / "part.vtu", HexMesh(POINTS, CELLS, *data))
    write(folder / "part.vtk", HexMesh(POINTS, CELLS, *data))
    return folder


def check_stage(found, stage):
    assert np.array_equal(found[f"{stage}, nodes"], np.arange(len(POINTS)))
    assert np.array_equal(found[f"{stage}, points"], POINTS)
    assert np.array_equal(found[f"{stage}, cells"], CELLS)
    for name, values in (("points: place", POINTS), ("points: flag", FLAGS), ("cells: number", NUMBERS)):
        assert np.array_equal(found[f"{stage}, at {name}"], values)
        assert found[f"{stage}, at {name}"].dtype == values.dtype


@pytest.mark.parametrize(("source", "ranks"), [("part.vtu", 3), ("part.vtk", 2)])
def test_what_is_read_and_written_in_pieces_is_the_mesh(mpiexec, folder, source, ranks):
    mpiexec(ranks, PROGRAMS / "files.py", folder / source, folder / "out.pvtu", folder / "found.npz")
    found = np.load(folder / "found.npz")
    for stage in ("read", "shared", "again"):
        check_stage(found, stage)
    assert np.array_equal(found["medians"], np.median(found["values"], axis=1))
    expected = np.percentile(found["values"], (1, 5, 25, 50, 75, 95, 99), axis=1, method="inverted_cdf").T
    assert np.array_equal(found["percentiles"], expected)
    assert np.allclose(found["shared"], [found["values"].sum(), 0, 2])
    assert (found["written"] == 17.0).all()
    grid = pv.read(folder / "out.pvtu")
    order = np.argsort(grid.cell_data["GlobalCellId"])
    assert np.array_equal(grid.cell_data["number"][order], NUMBERS)
    one = read(folder / "out.pvtu")
    assert len(one.points) == len(POINTS)  # nodes of several pieces are one
    assert check(one) == ()
    ids = grid.point_data["GlobalNodeId"][grid.cell_connectivity.reshape(-1, 8)][order]
    assert np.array_equal(ids, CELLS)


def test_pieces_are_read_by_other_numbers_of_ranks_with_and_without_ids(mpiexec, folder):
    mpiexec(3, PROGRAMS / "files.py", folder / "part.vtu", folder / "three.pvtu", folder / "found.npz")
    mpiexec(2, PROGRAMS / "files.py", folder / "three.pvtu", folder / "two.pvtu", folder / "found.npz")
    check_stage(np.load(folder / "found.npz"), "again")
    # Without ids nodes are one where they are at the same place.
    for path in folder.glob("three_*.vtu"):
        grid = pv.read(path)
        del grid.point_data["GlobalNodeId"], grid.cell_data["GlobalCellId"]
        grid.save(path)
    mpiexec(2, PROGRAMS / "files.py", folder / "three.pvtu", folder / "two.pvtu", folder / "found.npz")
    found = np.load(folder / "found.npz")
    assert len(found["read, nodes"]) == len(POINTS)
    assert np.array_equal(np.sort(found["read, at cells: number"]), NUMBERS)
    one = HexMesh(found["read, points"], found["read, cells"])
    assert quality(one).summary().total_volume == pytest.approx(quality((POINTS, CELLS)).summary().total_volume)
