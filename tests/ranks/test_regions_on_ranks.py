"""Faces between regions are kept on ranks as in one process, whatever a rank has of them."""

import json
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hexconformal import HexMesh, Regularization, regularize

sys.path.insert(0, str(Path(__file__).with_name("programs")))
from cases import GOOD_REGIONS, HELD, REGIONS

RANKS = (1, 2, 3, 4)


@cache
def serial(name):
    make, options, *schedules = (REGIONS | GOOD_REGIONS | HELD)[name]
    points, cells, *arrays = make()
    run = Regularization(HexMesh(points, cells, *arrays), options, *schedules)
    with pytest.MonkeyPatch.context() as monkeypatch:
        if name in HELD:
            monkeypatch.setattr("hexconformal.regularization.stages.sheets_distance", lambda *_: 1.0)
        list(run)
    return run.result()


def report(results, name, ranks):
    return json.loads(str(results("regions", ranks)[f"{name}: report"]))


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", [*REGIONS, *HELD])
def test_final_points_are_those_of_one_process(results, name, ranks):
    one, found = serial(name), results("regions", ranks)[name]
    assert np.linalg.norm(found - one.points, axis=1).max() / one.report.diagonal < 1e-8
    assert one.report.largest_displacement > 1e-3  # there was something to do


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", [*REGIONS, *HELD])
def test_rows_of_regions_and_interfaces_are_those_of_one_process(results, name, ranks):
    told, one = report(results, name, ranks), serial(name).report.to_dict()
    assert [row["name"] for row in told["regions"]] == [row["name"] for row in one["regions"]]
    for rows in ("regions", "interfaces"):
        assert len(told[rows]) == len(one[rows])
        for row, expected in zip(told[rows], one[rows], strict=True):
            assert row == {key: _nearly(value) for key, value in expected.items()}
    said = [note for note in told["notes"] if not note.startswith("ranks")]
    assert said == [note for note in one["notes"] if "pieces that share no node" not in note]
    assert told["converged"] == one["converged"]


def _nearly(value):
    return pytest.approx(value, rel=1e-6, abs=1e-9) if isinstance(value, float) else value


def test_there_are_interfaces_that_slide_and_that_stay():
    moved = {name: [row.moved for row in serial(name).report.interfaces] for name in REGIONS}
    assert moved["flat"] == moved["flat, given"]
    assert moved["flat"][0] > moved["flat, boundary fixed"][0] > 0
    assert moved["ignored"] == moved["numbered"] == []
    assert len(moved["curved"]) == 3
    assert min(moved["curved"]) > 20
    assert moved["curved, boundary fixed"][:2] == [0, 0]
    assert min(row.distance for row in serial("curved").report.interfaces) > 1e-4
    assert [row.moved for row in serial("held").report.interfaces] == [0]


@pytest.mark.parametrize("ranks", RANKS)
def test_volumes_of_regions_are_given_back(results, ranks):
    rows = report(results, "curved, volumes kept", ranks)["regions"]
    assert len(rows) == 3
    for row in rows:
        assert row["volume_after"] == pytest.approx(row["volume_before"], rel=1e-10)
    assert abs(serial("curved").report.regions[0].volume_change) > 1e-4


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", GOOD_REGIONS)
def test_cells_become_as_good_as_in_one_process(results, name, ranks):
    told, one = report(results, name, ranks), serial(name).report
    assert told["after"]["invalid"] == 0
    for figure in ("min", "mean"):
        expected = getattr(one.after.scaled_jacobian, figure)
        assert told["after"]["scaled_jacobian"][figure] == pytest.approx(expected, abs=0.005)
    assert all(0.0 < row["distance"] <= 0.005 for row in told["interfaces"])


def test_ranks_without_interfaces_and_without_anything_are_among_them(results):
    cells, _, inner = results("regions", 3)["flat: shares"]
    assert ((cells > 0) & (inner == 0)).any(), (cells, inner)
    cells, _, inner = results("regions", 4)["curved, nothing on a rank: shares"]
    assert (cells == 0).any(), cells
    # A face with cells on two ranks is on one of them.
    for name in ("flat", "curved"):
        counts = {int(results("regions", ranks)[f"{name}: shares"][2].sum()) for ranks in RANKS}
        assert counts == {sum(row.quads for row in serial(name).report.interfaces)}


def test_a_real_model_of_two_parts_becomes_as_good_as_in_one_process(mpiexec, shared, tmp_path):
    path = shared / "meshes" / "hex2" / "multi_febio_ex02_input.vtu"
    told = tmp_path / "report.json"
    words = ["regularize", path, tmp_path / "better.pvtu", "--mpi", "--quiet", "--report", told]
    mpiexec(3, "-m", "hexconformal", *words)
    found, one = json.loads(told.read_text()), regularize(path).report
    assert found["after"]["invalid"] == 0
    for figure in ("min", "mean"):
        expected = getattr(one.after.scaled_jacobian, figure)
        assert found["after"]["scaled_jacobian"][figure] == pytest.approx(expected, abs=0.005)
    rows = zip(found["regions"], one.regions, strict=True)
    assert all((row["name"], row["cells"]) == (other.name, other.cells) for row, other in rows)
    assert len(one.regions) == 2
