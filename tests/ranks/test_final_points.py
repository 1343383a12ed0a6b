"""Runs on ranks come to what one process comes to, whatever a rank has: no boundary, no bad cell, nothing at all."""

import json
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hexconformal import HexMesh, Regularization

sys.path.insert(0, str(Path(__file__).with_name("programs")))
from cases import CASES, GOOD, OPENED

RANKS = (1, 2, 3, 4)


@cache
def serial(name):
    make, options, *schedules = (CASES | GOOD | OPENED)[name]
    points, cells, *arrays = make()
    run = Regularization(HexMesh(points, cells, *arrays), options, *schedules)
    list(run)
    return run.result()


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", CASES)
def test_final_points_are_those_of_one_process(results, name, ranks):
    one, found = serial(name), results("final_points", ranks)[name]
    away = np.linalg.norm(found - one.points, axis=1).max() / one.report.diagonal
    assert away < 1e-8
    assert one.report.largest_displacement > 1e-3  # there was something to do


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", CASES)
def test_reports_are_those_of_one_process(results, name, ranks):
    told = json.loads(str(results("final_points", ranks)[f"{name}: report"]))
    one = serial(name).report.to_dict()
    for when in ("before", "after"):
        for measure in ("scaled_jacobian", "minimum_jacobian", "shape", "edge_ratio"):
            for figure in ("min", "mean", "max"):
                assert told[when][measure][figure] == pytest.approx(one[when][measure][figure], rel=1e-6, abs=1e-9)
            for share, value in one[when][measure]["percentiles"].items():
                assert told[when][measure]["percentiles"][share] == pytest.approx(value, rel=1e-6, abs=1e-9)
        assert told[when]["count"] == one[when]["count"]
        assert told[when]["invalid"] == one[when]["invalid"]
        assert told[when]["total_volume"] == pytest.approx(one[when]["total_volume"], rel=1e-12)
    for figure in ("energy_before", "energy_after", "largest_displacement", "diagonal"):
        assert told[figure] == pytest.approx(one[figure], rel=1e-6, abs=1e-9)
    assert told["hausdorff"] == pytest.approx(one["hausdorff"], rel=0.02, abs=1e-9)
    assert told["mean_distance"] == pytest.approx(one["mean_distance"], rel=1e-6, abs=1e-9)
    # Of nodes that are where they belong some move in the last digit.
    assert (told["boundary_moved"] > 0) == (one["boundary_moved"] > 0)
    assert told["after"]["invalid"] == 0
    assert told["converged"] == one["converged"]


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", GOOD)
def test_worst_cells_become_as_good_as_in_one_process(results, name, ranks):
    assert as_good(results, name, ranks) > 0.75  # .72 where distortion alone is lowered


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", OPENED)
def test_what_is_opened_once_more_becomes_as_good_as_in_one_process(results, name, ranks):
    assert as_good(results, name, ranks) > 0.7  # .60 where nothing is


def as_good(results, name, ranks):
    """The smallest scaled Jacobian on ranks, which differs little from that in one process."""
    told = json.loads(str(results("final_points", ranks)[f"{name}: report"]))["after"]
    one = serial(name).report.after
    assert told["scaled_jacobian"]["min"] == pytest.approx(one.scaled_jacobian.min, abs=0.005)
    assert told["scaled_jacobian"]["mean"] == pytest.approx(one.scaled_jacobian.mean, abs=0.005)
    assert told["invalid"] == 0
    return told["scaled_jacobian"]["min"]


@pytest.mark.parametrize("name", CASES)
def test_iterations_do_not_depend_on_ranks(results, name):
    counts = [json.loads(str(results("final_points", n)[f"{name}: report"]))["iterations"] for n in RANKS]
    # Where cells fold on the way, differences in the last digit lead to other step lengths.
    assert max(counts) - min(counts) <= max(2, 0.05 * max(counts)), counts


def test_ranks_without_boundary_and_without_anything_are_among_them(results):
    cells, skin, _ = results("final_points", 4)["no boundary on a rank: shares"]
    assert ((cells > 0) & (skin == 0)).any(), (cells, skin)
    cells, *_ = results("final_points", 4)["nothing on a rank: shares"]
    assert (cells == 0).any(), cells
