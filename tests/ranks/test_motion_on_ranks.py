"""Motions on ranks come to what one process comes to; steps are refused by all of them together, or by none."""

import re
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hexconformal import MeshMotion

sys.path.insert(0, str(Path(__file__).with_name("programs")))
from motion_cases import CASES, TIGHT, lid

RANKS = (1, 2, 3, 4)


@cache
def serial(name):
    mesh, moves, options, ways = CASES[name]()
    moving = np.flatnonzero(moves)
    motion = MeshMotion(mesh, moving, **TIGHT, **options)
    return mesh, motion, [motion.step(way[moving], dt=0.5) for way in ways]


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", CASES)
def test_points_are_those_of_one_process(results, name, ranks):
    (mesh, motion, steps), found = serial(name), results("motions", ranks)
    diagonal = np.linalg.norm(np.ptp(mesh.points, axis=0))
    assert len(found[name]) == len(steps)
    for points, velocity, step in zip(found[name], found[f"{name}: velocity"], steps, strict=True):
        assert np.linalg.norm(points - step.points, axis=1).max() < 1e-8 * diagonal
        np.testing.assert_allclose(velocity, step.velocity, rtol=0, atol=4e-8 * diagonal)
    # Those that were resumed before every step.
    assert np.max(found[f"{name}: apart"]) < 1e-8 * diagonal
    free = ~motion.held.all(axis=1)
    assert np.linalg.norm((steps[0].points - mesh.points)[free], axis=1).max() > 1e-2  # there was something to do


@pytest.mark.parametrize("ranks", RANKS)
@pytest.mark.parametrize("name", CASES)
def test_reports_are_those_of_one_process(results, name, ranks):
    (_, motion, steps), found = serial(name), results("motions", ranks)
    for figures, step in zip(found[f"{name}: figures"], steps, strict=True):
        told = step.report
        expected = [told.reached, told.min_scaled_jacobian, told.mean_scaled_jacobian, *told.types.values()]
        np.testing.assert_allclose(figures, expected, rtol=1e-6)
    assert np.array_equal(found[f"{name}: blocked"], steps[-1].report.blocked)
    # Warnings about the mesh as a whole are those of one process alone.
    notes = [note for note in motion.notes if note.startswith("interfaces")]
    assert found[f"{name}: said"].tolist() == [steps[-1].report.reason, *notes]
    assert np.array_equal(found[f"{name}: held"], motion.held)
    assert np.array_equal(np.flatnonzero(found[f"{name}: carried"]), motion.carried)


def test_the_cases_are_what_they_are_for(results):
    assert serial("refused")[2][-1].report.refused
    assert len(serial("refused")[2][-1].report.blocked)
    assert len(serial("a face inside is carried")[1].carried)
    cells, moving = results("motions", 4)["a block inside turns: shares"]
    assert ((cells > 0) & (moving == 0)).any(), (cells, moving)
    cells, moving = results("motions", 4)["nothing on a rank: shares"]
    assert (cells == 0).any(), cells
    assert moving.any()


@pytest.mark.parametrize("ranks", RANKS)
def test_what_makes_no_sense_is_refused_on_all_ranks_and_changes_nothing(results, ranks):
    found = results("motions", ranks)
    for name, said in (
        ("nothing moves", "OptionError: moving must name a node or more: nothing moves"),
        ("outside", r"OptionError: .*moving must .*outside: 1 .ids 10000."),
        ("no piece", "OptionError: .*every rank must hand in a hexconformal.ranks.MeshPiece"),
        ("invalid", r"MeshError: a mesh that moves must be valid at the start: \d+ \((first )?ids \d+"),
        ("not finite", r"OptionError: .*displacement must be a finite array; NaN or infinite at nodes: 1 \(ids \d+\)"),
        ("target", "OptionError: .*target must be the same on all ranks, not 'current', and 'input' on rank 0"),
        ("operator", "OptionError: .*operator must be the same on all ranks, not 'elastic', and 'conformal' on rank 0"),
        ("interfaces", "OptionError: .*interfaces must be the same on all ranks, not 'auto', and 'ignore' on rank 0"),
        ("schedule", "OptionError: .*schedule must be the same on all ranks"),
        ("dt", "OptionError: .*dt must be the same on all ranks, not 0.1, and 0.2 on rank 0"),
        ("ids", "MeshError: node_ids must be whole numbers, not float64"),
        ("shape", "OptionError: .*displacement must be a finite array"),
        ("copies", "OptionError: .*displacement: copies of a node must go to one place on all ranks"),
        ("state", "OptionError: .*state must be that of the same mesh and moving nodes"),
        ("other state", "OptionError: .*state must be that of the same mesh and moving nodes; nodes without: "),
    ):
        if ranks > 1 or name not in (
            "copies",
            "target",
            "operator",
            "interfaces",
            "schedule",
            "dt",
        ):  # of several ranks
            told = found[f"refused: {name}"].tolist()
            assert [re.match(said, one) is not None for one in told] == [True] * ranks, told
    mesh, moves, _, ways = lid()
    moving = np.flatnonzero(moves)
    step = MeshMotion(mesh, moving).step(ways[0][moving])
    np.testing.assert_allclose(found["at last"], step.points, rtol=0, atol=1e-3)
    assert not found["options"].any()


@pytest.mark.parametrize("ranks", RANKS)
def test_nodes_are_named_where_a_rank_has_nothing(results, ranks):
    mesh, moves, _, ways = lid()
    moving = np.flatnonzero(moves)
    motion = MeshMotion(mesh, moving, np.flatnonzero(mesh.points[:, 2] == 0.0), **TIGHT)
    expected = motion.step(ways[0][moving]).points
    np.testing.assert_allclose(results("motions", ranks)["by name"], expected, rtol=0, atol=1e-8)


def test_some_of_the_ranks_work_while_others_do_something_else(results):
    mesh, moves, _, ways = lid()
    moving = np.flatnonzero(moves)
    expected = MeshMotion(mesh, moving, **TIGHT).step(ways[0][moving]).points
    np.testing.assert_allclose(results("some_ranks", 3)["points"], expected, rtol=0, atol=1e-8)
