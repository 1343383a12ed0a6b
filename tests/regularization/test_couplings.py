"""Nodes that are coupled move together, exactly, whatever else is asked for."""

import numpy as np
import pytest
from meshes.coupled import QUARTER, gaps, periodic_box, sector, unmerged

import hexconformal as hc
from hexconformal import generate

EXACT = 1e-12  # diagonals


def parted(result, points, pairs, turn=None):
    """Largest change of the gap of a pair, in diagonals."""
    change = np.linalg.norm(gaps(result.points, pairs, turn) - gaps(points, pairs, turn), axis=1).max()
    return change / np.linalg.norm(np.ptp(points, axis=0))


WAYS = [
    *({"boundary": "free", "method": method} for method in ("lbfgs", "newton", "majorize")),
    {"boundary": "free"},
    {"hausdorff": 0.05},
    {"hausdorff": 0.05, "conserve_volume": True},
    {"hausdorff": 0.05, "constraint": "compatible", "eps": 1e-3},
    {"boundary": "free", "fixed": [0, 1], "energy": "quaternionic"},
    {"hausdorff": 0.05, "energy": "quaternionic"},
    {"hausdorff": 0.05, "target": "1:1:1", "sizes": "free", "weight": "volume", "emphasis": "mean"},
]


@pytest.mark.long
@pytest.mark.parametrize("options", WAYS, ids=str)
def test_periodic_faces_stay_periodic_while_cells_get_better(options):
    points, cells, pairs = periodic_box((4, 4, 4), 0.15)
    result = hc.regularize((points, cells), couplings=pairs, **options)
    assert parted(result, points, pairs) < EXACT
    skin = np.unique(pairs)
    assert np.abs(result.points[skin] - points[skin]).max() > 1e-3
    assert result.report.after.invalid == 0
    assert "couplings: 75 pairs of nodes move together (given)" in result.report.notes


@pytest.mark.parametrize("options", [{"boundary": "free"}, {"hausdorff": 0.02}], ids=str)
def test_cells_get_nearly_as_good_as_without_couplings(options):
    points, cells, pairs = periodic_box((4, 4, 4), 0.15)
    coupled, alone = (hc.regularize((points, cells), couplings=c, **options) for c in (pairs, "ignore"))
    assert parted(alone, points, pairs) > 1e-3
    assert coupled.report.after.scaled_jacobian.min > alone.report.after.scaled_jacobian.min - 0.05
    assert coupled.report.after.scaled_jacobian.min > coupled.report.before.scaled_jacobian.min + 0.05


@pytest.mark.parametrize("options", [{"boundary": "fixed"}, {"hausdorff": 0.0}], ids=str)
def test_a_rough_skin_that_stays_does_so_bit_by_bit(options):
    points, cells, pairs = periodic_box((4, 4, 4), 0.15)
    result = hc.regularize((points, cells), couplings=pairs, **options)
    skin = np.unique(pairs)
    np.testing.assert_array_equal(result.points[skin], points[skin])
    assert result.report.after.scaled_jacobian.mean > result.report.before.scaled_jacobian.mean


@pytest.mark.parametrize("flat", [False, True])
@pytest.mark.parametrize("options", [{}, {"boundary": "free"}, {"boundary": "free", "method": "majorize"}], ids=str)
def test_the_faces_of_a_sector_are_turned_copies_of_each_other(options, flat):
    points, cells, pairs = sector(amount=0.25, flat=flat)
    assert np.abs(gaps(points, pairs, QUARTER)).max() < 1e-15
    result = hc.regularize((points, cells), couplings=pairs, **options)
    assert np.abs(gaps(result.points, pairs, QUARTER)).max() < EXACT
    assert np.abs(result.points[pairs] - points[pairs]).max() > 0.01
    assert result.report.after.scaled_jacobian.min > result.report.before.scaled_jacobian.min + 0.3


def test_the_volume_of_a_sector_is_given_back_with_partners_together():
    points, cells, pairs = sector(amount=0.25)
    result = hc.regularize((points, cells), couplings=pairs, conserve_volume=True, hausdorff=0.02)
    assert np.abs(gaps(result.points, pairs, QUARTER)).max() < EXACT
    assert abs(result.report.volume_change) < 1e-10
    assert any("was made up for" in note for note in result.report.notes)


def test_nodes_of_flat_faces_of_a_sector_slide_in_them():
    points, cells, pairs = sector(amount=0.25, flat=True)
    result = hc.regularize((points, cells), couplings=pairs, hausdorff=0.0)
    assert np.abs(gaps(result.points, pairs, QUARTER)).max() < EXACT
    assert np.abs(result.points[pairs[:, 1], 1]).max() < 1e-15
    assert np.abs(result.points[pairs] - points[pairs]).max() > 0.01


@pytest.mark.parametrize("options", [{"boundary": "free"}, {"hausdorff": 0.1}], ids=str)
def test_a_tangled_periodic_mesh_is_unfolded(options):
    points, cells, pairs = periodic_box((4, 4, 4), 0.42, seed=3)
    result = hc.regularize((points, cells), couplings=pairs, **options)
    assert result.report.before.inverted > 2
    assert result.report.after.invalid == 0
    assert parted(result, points, pairs) < EXACT


def test_every_record_and_an_early_end_have_partners_together():
    points, cells, pairs = periodic_box((4, 4, 4), 0.42, seed=3)
    run = hc.Regularization((points, cells), hc.Options(couplings=pairs, hausdorff=0.1))
    for count, _ in enumerate(run):
        assert np.abs(gaps(run.points, pairs) - gaps(points, pairs)).max() < EXACT
        if count == 8:
            break
    assert parted(run.result(), points, pairs) < EXACT


def two_parts(seed=1):
    points, cells = generate.box((6, 3, 3), (2.0, 1.0, 1.0))
    second = points[cells].mean(axis=1)[:, 0] > 1.0
    return generate.jittered(points, cells, 0.3, seed=seed)[0], cells, second


@pytest.mark.parametrize("method", ["lbfgs", "newton", "majorize"])
def test_parts_that_are_not_merged_stay_together_and_come_to_what_one_mesh_does(method):
    points, cells, second = two_parts()
    apart, own, pairs = unmerged(points, cells, second)
    options = {"boundary": "free", "method": method}
    one, two = hc.regularize((points, cells), **options), hc.regularize((apart, own), **options)
    np.testing.assert_array_equal(two.points[pairs[:, 0]], two.points[pairs[:, 1]])
    assert any("couplings: 16 pairs of nodes move together (at the same place" in note for note in two.report.notes)
    np.testing.assert_allclose(
        two.points[: len(points)][np.unique(cells[~second])], one.points[np.unique(cells[~second])], atol=1e-6
    )
    ignored = hc.regularize((apart, own), couplings="ignore", **options)
    assert np.abs(ignored.points[pairs[:, 0]] - ignored.points[pairs[:, 1]]).max() > 1e-3


def test_the_lips_of_a_slit_are_not_coupled():
    points, cells = generate.box((4, 4, 2))
    index = np.rint(points * [4, 4, 2] / points.max(axis=0)).astype(int)
    slit = np.flatnonzero((index[:, 0] == 2) & (index[:, 1] < 2))
    copies = np.arange(len(points))
    copies[slit] = len(points) + np.arange(len(slit))
    beyond = points[cells].mean(axis=1)[:, 0] > points[:, 0].max() / 2
    points, cells = np.concatenate([points, points[slit]]), np.where(beyond[:, None], copies[cells], cells)
    result = hc.regularize((points, cells))
    assert not any("couplings" in note for note in result.report.notes)


def test_where_nothing_is_coupled_results_are_the_same_to_the_last_bit():
    points, cells = generate.jittered(*generate.cylinder(3, 2, 3), 0.25, seed=2)
    with_option, without = (hc.regularize((points, cells), couplings=c) for c in ("auto", "ignore"))
    np.testing.assert_array_equal(with_option.points, without.points)
    none = hc.regularize((points, cells), couplings=np.empty((0, 2), int))
    np.testing.assert_array_equal(none.points, without.points)


def test_a_node_that_is_fixed_holds_its_partners():
    points, cells, pairs = periodic_box((4, 4, 4), 0.15)
    held = np.zeros(len(points), dtype=bool)
    held[pairs[7, 0]] = True
    result = hc.regularize((points, cells), couplings=pairs, boundary="free", fixed=held)
    np.testing.assert_array_equal(result.points[pairs[7]], points[pairs[7]])


def test_nodes_on_the_axis_of_a_rotation_stay_on_it():
    # A quarter of a cube about an edge: two faces that meet in the axis, whose nodes are their own partners.
    points, cells = generate.box((4, 4, 4))
    rng = np.random.default_rng(0)
    inner = ((points > 0) & (points < 1)).all(axis=1)
    first, second = np.flatnonzero(points[:, 1] == 0), []
    index = np.rint(points * 4).astype(int)
    look = {tuple(i): k for k, i in enumerate(index)}
    second = [look[(0, i[0], i[2])] for i in index[first]]
    points = points + 0.05 * rng.uniform(-1, 1, points.shape) * inner[:, None]
    pairs = np.column_stack([second, first])
    points[first] += 0.04 * rng.uniform(-1, 1, (len(first), 3)) * (points[first, 0] > 0)[:, None]
    points[second] = points[first] @ QUARTER.T
    axis = first[points[first, 0] == 0]
    result = hc.regularize((points, cells), couplings=pairs, boundary="free")
    assert np.abs(gaps(result.points, pairs, QUARTER)).max() < EXACT
    np.testing.assert_array_equal(result.points[axis, :2], 0.0)
    assert np.abs(result.points - points).max() > 0.01


@pytest.mark.parametrize(
    ("couplings", "message"),
    [
        ("all", "couplings must be 'auto', 'ignore' or"),
        ([[0, 1, 2]], "ids of nodes, not of shape"),
        ([[0, 10**6]], "ids of nodes from 0 to 124, not 0 to 1e"),
        ([[0.5, 1]], "not of shape"),
        ([[-1, 1]], "not -1 to 1"),
    ],
)
def test_pairs_that_make_no_sense_are_refused(couplings, message):
    with pytest.raises(hc.OptionError, match=message):
        hc.regularize(generate.box((4, 4, 4)), couplings=couplings)


def test_pairs_that_no_rigid_map_takes_to_each_other_are_refused_by_name():
    points, cells, pairs = periodic_box((4, 4, 4), 0.1)
    points[pairs[0, 0]] += [0.01, 0.0, 0.0]
    with pytest.raises(hc.OptionError, match=rf"nodes {pairs[0, 0]} and {pairs[0, 1]} are off by 0\.005"):
        hc.regularize((points, cells), couplings=pairs)


def test_the_command_line_ignores_them(tmp_path, capsys):
    from hexconformal.app.cli import main

    apart, own, _ = unmerged(*two_parts())
    path, better = tmp_path / "parts.vtu", tmp_path / "better.vtu"
    hc.write(path, hc.HexMesh(apart, own))
    assert main(["regularize", str(path), str(better), "--boundary", "free"]) == 0
    assert "couplings: 16 pairs" in capsys.readouterr().out
    assert (
        main(["regularize", str(path), str(better), "--boundary", "free", "--couplings", "ignore", "--overwrite"]) == 0
    )
    assert "couplings" not in capsys.readouterr().out


@pytest.mark.parametrize("problem", [periodic_box, sector])
def test_the_order_of_nodes_cells_and_pairs_makes_no_difference_in_any_bit(problem):
    points, cells, pairs = problem((3, 4, 3), 0.2)
    rng = np.random.default_rng(0)
    order = rng.permutation(len(points))
    place = np.argsort(order)
    others = place[cells][rng.permutation(len(cells))], place[pairs][rng.permutation(len(pairs))]
    one = hc.regularize((points, cells), couplings=pairs, boundary="free")
    two = hc.regularize((points[order], others[0]), couplings=others[1], boundary="free")
    np.testing.assert_array_equal(two.points, one.points[order])
