"""The main job against exact minimizers, invariances, and its promises."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements.lengths_volumes import cell_volumes
from hexconformal.energy.distortion_energy import Distortion
from hexconformal.mesh.topology import boundary_quads
from hexconformal.solver.minimizers import lbfgs

ENERGIES = ["barrier", "quaternionic"]


def jittered_box(n=5, seed=0, amount=0.2):
    return generate.jittered(*generate.box((n, n, n)), amount, seed=seed)


@pytest.mark.parametrize("energy", ENERGIES)
def test_sheared_cube_of_figure_3_becomes_perfectly_regular(energy):
    result = hc.regularize(generate.sheared_cube(15), energy=energy, gradient_tolerance=1e-12)
    regular, _ = generate.box((15, 15, 15))
    assert np.abs(result.points - regular).max() < 1e-12
    assert result.report.energy_after < 1e-20
    assert result.converged


@pytest.mark.parametrize("energy", ENERGIES)
def test_sheared_block_held_at_its_bottom_becomes_the_cube(energy):
    points, cells = generate.sheared_block(6, shear=1.5)
    bottom = points[:, 1] == 0.0
    result = hc.regularize((points, cells), boundary="free", fixed=bottom, energy=energy, gradient_tolerance=1e-10)
    straight = points - 1.5 * points[:, 1:2] * [1.0, 0.0, 0.0]
    assert np.abs(result.points - straight).max() < 1e-9


def test_majorize_minimize_never_raises_the_energy_and_finds_the_same_minimum():
    mesh = generate.twisted_cube(5, 50)
    options = {"boundary": "fixed", "energy": "quaternionic", "gradient_tolerance": 1e-8}
    slow = hc.regularize(mesh, method="majorize", **options)
    energies = [record.energy for record in slow.history]
    assert slow.converged
    assert len(energies) > 5
    assert all(b <= a * (1 + 1e-14) for a, b in zip(energies[:-1], energies[1:], strict=True))
    fast = hc.regularize(mesh, method="newton", **options)
    assert np.abs(slow.points - fast.points).max() < 1e-8


@pytest.mark.parametrize("method", ["lbfgs", "newton", "auto"])
def test_solvers_agree_on_the_minimizer(method):
    mesh = generate.twisted_cube(5, 50)
    exact = hc.regularize(mesh, boundary="fixed", method="newton", emphasis="mean", gradient_tolerance=1e-12)
    result = hc.regularize(mesh, boundary="fixed", method=method, emphasis="mean", gradient_tolerance=1e-9)
    assert result.converged
    assert np.abs(result.points - exact.points).max() < 1e-9


def test_newton_converges_superlinearly():
    options = {"boundary": "fixed", "method": "newton", "emphasis": "mean", "gradient_tolerance": 1e-12}
    history = hc.regularize(generate.twisted_cube(5, 50), **options).history
    gradients = np.array([record.gradient for record in history if record.gradient > 1e-11])
    orders = np.log(gradients[2:]) / np.log(gradients[1:-1])
    assert orders[-2:].min() > 1.4  # systems are solved to the root of the gradient: order 3/2


@pytest.mark.parametrize("energy", ENERGIES)
def test_a_regular_mesh_is_a_fixed_point(energy):
    mesh = generate.box((4, 4, 4))
    result = hc.regularize(mesh, energy=energy)
    assert result.converged
    assert np.abs(result.points - mesh[0]).max() < 1e-14


@pytest.mark.parametrize("energy", ENERGIES)
def test_rotation_translation_and_scale_carry_over(energy):
    points, cells = jittered_box()
    plain = hc.regularize((points, cells), boundary="fixed", energy=energy, gradient_tolerance=1e-10).points
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    for size, shift in ((1.0, 0.0), (1e-9, 0.0), (1e9, 0.0), (1.0, 1e4)):
        moved = hc.regularize(
            (size * points @ turn.T + shift, cells), boundary="fixed", energy=energy, gradient_tolerance=1e-10
        )
        assert np.abs(moved.points - (size * plain @ turn.T + shift)).max() < 1e-10 * size


def test_permuted_cells_and_nodes_give_the_permuted_result():
    for amount in (0.2, 0.6):
        points, cells = generate.jittered(*generate.box((5, 5, 5)), amount, seed=0, valid=False)
        plain = hc.regularize((points, cells), boundary="fixed", gradient_tolerance=1e-10)
        assert (plain.report.before.inverted > 0) == (amount == 0.6)
        rng = np.random.default_rng(1)
        nodes, order = rng.permutation(len(points)), rng.permutation(len(cells))
        shuffled = points[nodes], np.argsort(nodes)[cells[order]]
        permuted = hc.regularize(shuffled, boundary="fixed", gradient_tolerance=1e-10)
        assert np.array_equal(permuted.points, plain.points[nodes])


def test_two_runs_are_bit_identical():
    mesh = jittered_box(8)
    assert np.array_equal(hc.regularize(mesh).points, hc.regularize(mesh).points)


def rough(make):
    """A mesh whose inner nodes are moved at random, and those of its curved boundary a little, too."""
    points, cells = generate.jittered(*make, 0.3, seed=1)
    surface = np.unique(boundary_quads(cells)[0])
    points[surface] += 0.01 * np.random.default_rng(2).normal(size=(len(surface), 3))
    return points, cells


CURVED = {"cylinder": generate.cylinder(4, 3, 6), "ball": generate.ball(3, 2)}


@pytest.mark.parametrize("shape", CURVED)
def test_a_curved_boundary_slides_the_same_in_every_unit_and_far_away(shape):
    points, cells = rough(CURVED[shape])
    plain = hc.regularize((points, cells))
    diagonal = plain.report.diagonal
    surface = np.unique(boundary_quads(cells)[0])
    assert np.abs(plain.points - points)[surface].max() > 1e-3 * diagonal
    assert plain.report.hausdorff <= plain.report.hausdorff_bound
    assert plain.report.after.scaled_jacobian.min > plain.report.before.scaled_jacobian.min
    assert plain.report.after.scaled_jacobian.mean > plain.report.before.scaled_jacobian.mean
    for size, shift in ((1e-6, 0.0), (1e6, 0.0), (1.0, 1e4 * diagonal)):
        moved = hc.regularize((size * points + shift, cells))
        # What the input's digits have lost, and no more: far away four of sixteen.
        assert np.abs((moved.points - shift) / size - plain.points).max() < (1e-11 if shift else 1e-14) * diagonal
        assert moved.report.hausdorff == pytest.approx(plain.report.hausdorff, rel=1e-8)


@pytest.mark.parametrize("shape", CURVED)
def test_a_curved_boundary_slides_the_same_in_another_order_of_nodes_and_cells(shape):
    points, cells = rough(CURVED[shape])
    plain = hc.regularize((points, cells))
    rng = np.random.default_rng(1)
    nodes, order = rng.permutation(len(points)), rng.permutation(len(cells))
    permuted = hc.regularize((points[nodes], np.argsort(nodes)[cells[order]]))
    assert permuted.report.hausdorff <= permuted.report.hausdorff_bound
    assert np.array_equal(permuted.points, plain.points[nodes])


def test_runs_with_a_curved_boundary_are_bit_identical_with_any_number_of_threads(monkeypatch):
    from hexconformal.kernel import threads

    mesh = rough(CURVED["cylinder"])
    results = []
    monkeypatch.setattr(threads, "_SMALLEST_RANGE", 20)
    for count in (1, 2, 3, 2):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        results.append(hc.regularize(mesh).points)
    assert all(np.array_equal(result, results[0]) for result in results[1:])


def test_a_mesh_comes_back_rather_than_a_worse_one():
    run = hc.Regularization(generate.bent_bar())
    records = list(run)
    report = run.result().report
    # The smallest scaled Jacobian, or the mean, is below the input's in every iteration but the first.
    assert len(records) > 1
    for record in records[1:]:
        change = record.min_scaled_jacobian - records[0].min_scaled_jacobian
        assert min(change, record.mean_scaled_jacobian - records[0].mean_scaled_jacobian) < -1e-5
    assert report.largest_displacement == 0.0
    assert report.reason.endswith("nothing better than the input was found")


def test_a_corner_that_is_held_does_not_keep_the_rest_from_getting_better():
    # The smallest scaled Jacobian is that of the input's edges, which it can only approach from below.
    report = hc.regularize(generate.sheared_block(5, 1.0)).report
    assert report.after.scaled_jacobian.min == pytest.approx(0.5**0.5, abs=1e-6)
    assert report.after.scaled_jacobian.mean > 0.9


def test_box_targets_reach_zero_energy_where_cubes_cannot():
    points, cells = generate.box((6, 6, 6), (1.0, 1.0, 2.0))
    cubes = hc.regularize((points, cells), energy="quaternionic")
    boxes = hc.regularize((points, cells), energy="quaternionic", target="1:1:2")
    assert cubes.report.energy_before == pytest.approx(24.0, rel=1e-12)
    assert boxes.report.energy_before == pytest.approx(0.0, abs=1e-20)


def test_every_cell_may_have_a_box_of_its_own():
    points, cells = generate.boundary_layer((4, 4, 8), aspect=20.0)
    edges = np.ptp(points[cells], axis=1)
    rough = generate.jittered(points, cells, 0.1, seed=2)[0]
    result = hc.regularize((rough, cells), boundary="fixed", target=edges, emphasis="mean", gradient_tolerance=1e-12)
    assert np.abs(result.points - points).max() < 1e-12
    with pytest.raises(hc.OptionError, match="positive edge lengths"):
        hc.regularize((rough, cells), target=-edges)


def test_input_targets_keep_a_boundary_layer():
    points, cells = generate.boundary_layer((4, 4, 8), aspect=100.0)
    rough = generate.jittered(points, cells, 0.05, seed=2)[0]
    kept = hc.regularize((rough, cells), boundary="fixed", target=points, gradient_tolerance=1e-10)
    assert np.abs(kept.points - points).max() < 1e-11
    itself = hc.regularize((points, cells), boundary="fixed", target="input")
    assert np.abs(itself.points - points).max() < 1e-12


@pytest.mark.parametrize(("target", "kept"), [("auto", True), ("input", True), ("cube", False)])
def test_a_boundary_layer_of_aspect_1000_keeps_its_sizes_unless_cubes_are_asked_for(target, kept):
    points, cells = generate.boundary_layer((6, 6, 12), aspect=1000.0)
    mesh = generate.jittered(points, cells, 0.2, seed=0)
    result = hc.regularize(mesh, target=target)
    sizes = cell_volumes(result.points, cells) / cell_volumes(mesh[0], cells)
    assert result.report.after.invalid == 0
    # With the input's own targets nothing moves, to rounding.
    assert result.report.after.scaled_jacobian.min >= result.report.before.scaled_jacobian.min - 1e-12
    assert (max(sizes.max(), 1.0 / sizes.min()) < 3.0) == kept
    told = "360 cells are stretched in the input and keep their proportions"
    assert any(told in note for note in result.report.notes) == (target == "auto")
    same = hc.regularize((points, cells), target=target)
    assert np.abs(same.points - points).max() < 1e-9


def test_what_target_auto_has_decided_is_told():
    points, cells = generate.sheared_block(4, shear=3.0)
    points *= [1.0, 1.0, 0.1]  # stretched, but skewed
    notes = hc.regularize((points, cells), boundary="fixed").report.notes
    assert any("cubes, as the 64 cells of aspect 2 or more are skewed" in note for note in notes)
    plain = hc.regularize(jittered_box()).report.notes
    assert not any("target auto" in note for note in plain)


def test_target_input_keeps_a_skewed_mesh_that_the_default_makes_regular(shared):
    path = shared / "meshes" / "hex" / "msq_1000hex_block_internal_bias_input.vtu"
    mesh = hc.read(path)
    kept = hc.regularize(path, target="input")
    assert np.abs(kept.points - mesh.points).max() < 1e-12 * kept.report.diagonal
    assert kept.report.options["target"] == "input"
    cubes = hc.regularize(path).report
    assert any("target='input' would keep their shapes" in note for note in cubes.notes)
    assert cubes.after.scaled_jacobian.min > 0.9999
    assert cubes.after.edge_ratio.max == pytest.approx(1.0, abs=1e-3)


def test_volume_weights_change_the_compromise_but_not_a_perfect_mesh():
    points, cells = generate.box((5, 5, 5))
    mesh = generate.jittered(points**2, cells, 0.1, seed=3)
    one = hc.regularize(mesh, boundary="fixed", emphasis="mean", weight="reference").points
    other = hc.regularize(mesh, boundary="fixed", emphasis="mean", weight="volume").points
    assert np.abs(one - other).max() > 1e-4
    sheared = hc.regularize(generate.sheared_cube(6), weight="volume", gradient_tolerance=1e-12).points
    assert np.abs(sheared - generate.box((6, 6, 6))[0]).max() < 1e-11


def test_the_plain_energy_would_fold_and_the_line_search_does_not_let_it():
    points, cells = generate.sheared_cube(12)
    result = hc.regularize((points, cells), boundary="fixed", energy="quaternionic", max_iterations=60)
    assert result.report.before.invalid == 0
    assert result.report.after.invalid == 0
    assert all(record.inverted == 0 for record in result.history)
    assert result.report.energy_after < result.report.energy_before


@pytest.mark.parametrize("boundary", ["fixed", "slide"])
def test_what_is_held_is_bit_identical(boundary):
    points, cells = jittered_box(5)
    rng = np.random.default_rng(0)
    held = rng.random(len(points)) < 0.1
    result = hc.regularize((points + 1e3, cells), boundary=boundary, fixed=held)
    assert np.array_equal(result.points[held], (points + 1e3)[held])
    if boundary == "fixed":
        surface = np.unique(boundary_quads(cells)[0])
        assert np.array_equal(result.points[surface], (points + 1e3)[surface])
        assert result.report.boundary_moved == 0


def test_sliding_keeps_the_faces_of_a_turned_cube():
    points, cells = generate.sheared_cube(6)
    turn = Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    result = hc.regularize((points @ turn.T, cells), gradient_tolerance=1e-11)
    regular = generate.box((6, 6, 6))[0] @ turn.T
    assert np.abs(result.points - regular).max() < 1e-10


def test_components_can_be_held_one_by_one():
    points, cells = jittered_box(4)
    mask = np.zeros((len(points), 3), dtype=bool)
    mask[:, 2] = True
    result = hc.regularize((points, cells), boundary="fixed", fixed=mask)
    assert np.array_equal(result.points[:, 2], points[:, 2])
    assert np.abs(result.points - points).max() > 1e-3


def test_components_are_held_in_tangled_meshes_too():
    # Each node that is held in x or y is one that an unfolding start at the mean of its neighbours would move.
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.9, seed=3, valid=False)
    assert (hc.quality((points, cells)).scaled_jacobian <= 0).any()
    fixed = np.random.default_rng(0).random(points.shape) < 0.3
    moved = hc.regularize((points, cells), fixed=fixed, max_iterations=5).points
    np.testing.assert_array_equal(moved[fixed], points[fixed])
    assert (moved[~fixed] != points[~fixed]).any()


def test_a_point_array_names_the_fixed_nodes():
    import pyvista as pv

    points, cells = jittered_box(4)
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points)
    grid.point_data["clamp"] = (points[:, 0] < 0.5).astype(np.int32)
    result = hc.regularize(grid, fixed="clamp")
    held = points[:, 0] < 0.5
    assert isinstance(result.mesh, pv.UnstructuredGrid)
    assert np.array_equal(np.asarray(result.mesh.points)[held], points[held])
    with pytest.raises(hc.OptionError, match="'clam' names no point array; there are: 'clamp'"):
        hc.regularize(grid, fixed="clam")


def test_records_come_one_by_one_and_the_run_can_be_left():
    run = hc.Regularization(generate.twisted_cube(6, 60), hc.Options(boundary="fixed"))
    for record in run:
        if record.iteration == 3:
            break
    result = run.result()
    assert [r.iteration for r in result.history] == [0, 1, 2, 3]
    assert not result.converged
    assert result.report.reason == "interrupted"
    assert result.history[3].energy < result.history[0].energy


def test_a_run_that_was_left_goes_on_where_it_was():
    mesh = generate.twisted_cube(6, 60)
    run = hc.Regularization(mesh, hc.Options(boundary="fixed"))
    for record in run:
        if record.iteration == 3:
            break
    for _ in run:
        pass
    assert list(run) == []
    whole = hc.regularize(mesh, boundary="fixed")
    assert np.array_equal(run.points, whole.points)
    assert [record.phase for record in run.history] == [record.phase for record in whole.history]


def test_energies_of_all_phases_are_one_measure():
    points, cells = rough(CURVED["cylinder"])
    result = hc.regularize((points, cells), target="cube")
    assert {record.phase for record in result.history} >= {"input", "distortion", "angles", "stiffen", "worst cells"}
    measure = Distortion(cells, len(points), eps=0.0, quadrature="corners")
    for x, energy in ((points, result.report.energy_before), (result.points, result.report.energy_after)):
        assert energy == pytest.approx(measure.cell_energies(x).sum(), rel=1e-10)
    assert result.report.energy_after < 0.7 * result.report.energy_before
    longest = max(record.energy for record in result.history)
    assert longest == pytest.approx(result.report.energy_before, rel=1e-12)


def test_what_is_given_in_vain_is_told():
    given = {"weight": "volume", "quadrature": "gauss", "method": "newton", "gradient_tolerance": 0.5}
    mesh = rough(CURVED["cylinder"])
    told = hc.regularize(mesh, **given).report.notes
    assert "without effect on this mesh: weight, quadrature, method, gradient_tolerance" in told
    assert not any("without effect" in note for note in hc.regularize(mesh).report.notes)
    assert not any("without effect" in note for note in hc.regularize(jittered_box(), **given).report.notes)


def test_no_step_is_taken_beyond_the_last(monkeypatch):
    from hexconformal.regularization import minimize

    taken = []

    def counted(problem, at):
        for following in lbfgs(problem, at):
            taken.append(following)
            yield following

    monkeypatch.setattr(minimize, "MINIMIZERS", {"lbfgs": counted})
    for most in (0, 2):
        taken.clear()
        report = hc.regularize(jittered_box(), method="lbfgs", emphasis="mean", max_iterations=most).report
        assert (report.iterations, len(taken)) == (most, most)
    taken.clear()
    result = hc.regularize(jittered_box(), method="lbfgs", emphasis="mean")
    assert result.converged
    assert len(taken) == result.report.iterations > 5


def test_a_limit_on_iterations_is_a_result_with_a_reason():
    result = hc.regularize(generate.twisted_cube(6, 60), boundary="fixed", max_iterations=2)
    assert not result.converged
    assert result.report.reason == "reached max_iterations = 2"
    assert len(result.history) == 3
    untouched = hc.regularize(generate.twisted_cube(6, 60), max_iterations=0)
    assert untouched.report.largest_displacement == 0.0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"boundary": "glide"}, "boundary must be 'slide', 'fixed' or 'free'"),
        ({"target": "sphere"}, "target must be 'auto', 'cube', 'input' or 'a:b:c'"),
        ({"target": "1:-1:2"}, "three positive edge lengths"),
        ({"target": ["a", "b", "c"]}, "target must be a name, edge lengths or points"),
        ({"target": np.zeros((3, 3))}, "three edge lengths or reference points"),
        ({"fixed": np.ones(3, dtype=bool)}, "fixed"),
        ({"fixed": [10**6]}, "fixed"),
        ({"gradient_tolerance": -1.0}, "gradient_tolerance must lie in"),
        ({"hausdorff": -0.1}, r"in \[0, 1\), not -0.1"),
        ({"hausdorff": float("nan")}, r"in \[0, 1\), not nan"),
        ({"hausdorff": 1.0}, r"in \[0, 1\), not 1.0"),
        ({"features": "hard"}, "features must be 'auto', 'keep' or 'soft'"),
        ({"max_iterations": -1}, "max_iterations must be 0 or more"),
        ({"method": "majorize"}, "must go with energy='quaternionic'"),
        ({"boundary": "free", "energy": "quaternionic"}, "shrinks the mesh to a point"),
        ({"emphasis": "worst", "energy": "quaternionic"}, "blind to orientation"),
        ({"speed": 3}, "unknown option 'speed'; there are: boundary"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, words):
    with pytest.raises(hc.OptionError, match=words):
        hc.regularize(generate.box((2, 2, 2)), **options)


def test_mirrored_meshes_are_refused_with_the_remedy():
    points, cells = generate.box((3, 3, 3))
    with pytest.raises(hc.MeshError, match=r"orient"):
        hc.regularize((points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]))


def test_a_target_mesh_must_be_valid():
    points, cells = generate.box((3, 3, 3))
    with pytest.raises(hc.MeshError, match=r"inverted or flat cells: 27 \(first ids 0, 1, 2, 3, 4\)"):
        hc.regularize((points, cells), target=-points)
    missing = points.copy()
    missing[0] = np.nan
    with pytest.raises(hc.MeshError, match="NaN or infinite"):
        hc.regularize((points, cells), target=missing)


def test_all_nodes_fixed_is_a_result():
    points, cells = jittered_box(3)
    result = hc.regularize((points, cells), fixed=np.ones(len(points), dtype=bool))
    assert np.array_equal(result.points, points)
    assert result.converged


def test_a_free_boundary_needs_no_pins_with_the_barrier():
    points, cells = jittered_box(4)
    result = hc.regularize((points, cells), boundary="free", gradient_tolerance=1e-8)
    assert result.report.after.scaled_jacobian.min > 0.999999


@pytest.mark.parametrize("layout", ["float32", "readonly", "fortran", "strided"])
def test_any_array_is_taken_and_none_is_changed(layout):
    points, cells = jittered_box(3)
    if layout == "float32":
        points, cells = points.astype(np.float32), cells.astype(np.int32)
    elif layout == "readonly":
        points.setflags(write=False)
        cells.setflags(write=False)
    elif layout == "fortran":
        points, cells = np.asfortranarray(points), np.asfortranarray(cells)
    else:
        points, cells = np.repeat(points, 2, axis=0)[::2], np.repeat(cells, 2, axis=1)[:, ::2]
    before = points.copy(), cells.copy()
    result = hc.regularize((points, cells), boundary="fixed")
    assert np.array_equal(points, before[0])
    assert np.array_equal(cells, before[1])
    plain = hc.regularize(
        (np.array(before[0], float, order="C"), np.array(before[1], int, order="C")), boundary="fixed"
    )
    assert np.array_equal(result.points, plain.points)


def test_unreferenced_points_and_several_components_are_kept():
    points, cells = jittered_box(3)
    lone = np.array([[50.0, 0.0, 0.0]])
    two = np.vstack([points, lone, points + [5.0, 0.0, 0.0]])
    result = hc.regularize((two, np.vstack([cells, cells + len(points) + 1])), gradient_tolerance=1e-10)
    assert np.array_equal(result.points[len(points)], lone[0])
    assert np.abs(result.points[len(points) + 1 :] - [5.0, 0.0, 0.0] - result.points[: len(points)]).max() < 1e-12


def test_constant_normals_make_the_step_a_componentwise_harmonic_map():
    # A cube stretched along its axes has constant normals; only inner nodes are disturbed, along the axes.
    from hexconformal.energy.distortion_energy import Distortion

    points, cells = generate.box((5, 5, 5))
    energy = Distortion(cells, len(points))
    laplacian = energy.laplacian()
    surface = np.unique(boundary_quads(cells)[0])
    inner = np.setdiff1d(np.arange(len(points)), surface)
    field = np.zeros_like(points)
    field[inner] = np.random.default_rng(0).normal(size=(len(inner), 3))
    frozen = energy.frozen_product(points, field)
    assert np.abs(frozen - 8.0 * (laplacian @ field))[inner].max() < 1e-12


def test_emphasis_on_the_worst_raises_it_and_never_ends_below_the_input():
    points, cells = generate.cylinder()
    mesh = generate.jittered(points, cells, 0.3, seed=4)
    plain = hc.regularize(mesh, boundary="fixed", emphasis="mean").report
    raised = hc.regularize(mesh, boundary="fixed").report
    assert raised.after.scaled_jacobian.min > plain.after.scaled_jacobian.min + 0.01
    assert raised.after.scaled_jacobian.min >= raised.before.scaled_jacobian.min
    assert raised.after.scaled_jacobian.mean >= raised.before.scaled_jacobian.mean


def test_the_input_comes_back_if_the_surface_went_too_far_after_all(monkeypatch):
    points, cells = rough(CURVED["ball"])
    monkeypatch.setattr("hexconformal.geometry.DistanceBarrier.farthest", lambda barrier, points: 4.0)
    result = hc.regularize((points, cells))
    assert np.array_equal(result.points, points)
    assert "the surface would move by 0.02" in result.report.reason
    assert result.report.hausdorff == 0.0


def sphere(radius=1.0, center=(0.0, 0.0, 0.0)):
    import pyvista as pv

    return pv.Sphere(radius=radius, center=center, theta_resolution=60, phi_resolution=60)


def test_cells_too_coarse_to_follow_a_surface_are_told_with_the_distance_they_reach():
    # Eight cells around the equator: chords of 45 degrees stay 1 - cos(22.5 degrees) inside the sphere at best.
    mesh = generate.ball(2, 1)
    close = hc.regularize(mesh, surface=sphere(), hausdorff=0.005).report
    away = hc.regularize(mesh, surface=sphere(), max_iterations=0).report
    told = [note for note in close.notes if "not followed" in note]
    assert len(told) == 1
    assert f"within the bound of 0.005 diagonals, the largest distance is {close.hausdorff:.4g}" in told[0]
    assert 0.005 < close.hausdorff < away.hausdorff
    enough = hc.regularize(mesh, surface=sphere(), hausdorff=0.1).report
    assert enough.hausdorff <= 0.1
    assert not any("not followed" in note for note in enough.notes)


def test_the_distance_from_a_surface_is_measured_where_nothing_moved_too():
    points, cells = generate.ball(4, 2)
    report = hc.regularize((points, cells), surface=sphere(1.02), max_iterations=0).report
    assert report.largest_displacement == 0.0
    assert report.hausdorff * report.diagonal > 0.02 * 0.99


def test_to_come_to_another_surface_may_cost_quality_but_no_cell():
    points, cells = generate.box((6, 6, 6), (2.0, 2.0, 2.0))
    result = hc.regularize((points - 1.0, cells), surface=sphere(1.25), hausdorff=0.15)
    assert result.report.after.scaled_jacobian.min < 1.0
    assert result.report.after.invalid == 0
    assert result.report.hausdorff < 0.15
    assert np.linalg.norm(result.points, axis=1).max() < 3**0.5 - 0.1


@pytest.mark.parametrize(
    ("surface", "words"),
    [
        (sphere(1000.0), r"diagonal 3463, the mesh from .* a ratio of 1\.07e\+03; is it another unit of length"),
        (sphere(2.0), r"a ratio of 2\.14;"),
        (sphere(0.001), r"a ratio of 0\.00107;"),
        (sphere(center=(3.0, 0.0, 0.0)), r"it reaches from \(2, -0.9996, -1\) to \(4, 0.9996, 1\)"),
    ],
)
def test_a_surface_that_is_not_that_of_the_mesh_is_refused_with_figures(surface, words):
    with pytest.raises(hc.MeshError, match=words):
        hc.regularize(generate.ball(3, 2), surface=surface)


def test_the_docstring_names_every_option():
    from dataclasses import fields

    named = hc.regularize.__doc__.split("**options")[1].split("Returns")[0]
    assert [field.name for field in fields(hc.Options) if f"`{field.name}`" not in named] == []


UNTANGLED = ["xu_t5_bird", "xu_t5_block", "xu_t5_bone", "msq_1000hex_block_internal_bias", "hs_swivel2_7494"]


@pytest.mark.parametrize("name", UNTANGLED)
def test_real_meshes_with_fixed_boundary_stay_valid_and_get_no_worse(shared, name):
    report = hc.regularize(shared / "meshes" / "hex" / f"{name}_input.vtu", boundary="fixed").report
    assert report.before.invalid == report.after.invalid == 0
    assert report.after.scaled_jacobian.min > report.before.scaled_jacobian.min
    assert report.after.scaled_jacobian.mean > report.before.scaled_jacobian.mean
    assert report.boundary_moved == 0


def volumes(points, cells):
    return hc.quality((points, cells)).volume


def test_cells_resist_losing_and_gaining_volume_unless_their_sizes_are_free():
    # Rings of a ball are of very different thickness: regular cells would be of another size.
    points, cells = generate.jittered(*generate.ball(4, 2), 0.35, seed=1)
    ratios = {}
    for sizes in ("input", "free"):
        result = hc.regularize((points, cells), sizes=sizes)
        ratio = volumes(result.points, cells) / volumes(points, cells)
        ratios[sizes] = np.abs(np.log(ratio)).max()
        told = result.report.size_ratios
        assert told is None if sizes == "free" else told == pytest.approx((ratio.min(), ratio.max()))
        assert ("times what they should be" in str(result.report)) == (sizes == "input")
        assert result.report.after.invalid == 0
    assert ratios["input"] < 0.8 * ratios["free"]


@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_wanted_volumes_are_approached_in_every_unit(unit):
    points, cells = generate.box((6, 6, 6))
    wanted = np.where(points[cells].mean(axis=1)[:, 0] < 0.5, 0.5, 1.5) / 216.0
    result = hc.regularize((unit * points, cells), sizes=unit**3 * wanted)
    assert result.report.after.invalid == 0
    ratio = volumes(result.points, cells) / (unit**3 * wanted)
    assert result.report.size_ratios == pytest.approx((ratio.min(), ratio.max()))
    # They come in at 2/3 and 2; beside what is wanted there is the shape to pay for.
    assert 0.9 < ratio.min() < ratio.max() < 1.2
    mesh = hc.HexMesh(unit * points, cells, cell_data={"wanted": unit**3 * wanted})
    assert np.array_equal(hc.regularize(mesh, sizes="wanted").points, result.points)


def test_inverted_cells_have_no_size():
    points, cells = generate.jittered(*generate.ball(4, 2), 0.9, seed=1, valid=False)
    valid = hc.quality((points, cells)).valid
    assert 0 < valid.sum() < len(cells) - 10
    result = hc.regularize((points, cells))
    ratio = (volumes(result.points, cells) / volumes(points, cells))[valid]
    assert result.report.after.invalid == 0
    assert result.report.size_ratios == pytest.approx((ratio.min(), ratio.max()))


def test_the_distortion_alone_does_not_feel_sizes():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.3, seed=1)
    for options in ({"energy": "quaternionic", "boundary": "fixed"}, {"emphasis": "mean", "boundary": "fixed"}):
        one, other = (hc.regularize((points, cells), sizes=sizes, **options).points for sizes in ("input", "free"))
        assert np.array_equal(one, other)


@pytest.mark.parametrize(
    ("sizes", "words"),
    [
        ("large", "'input', 'free' or a cell array, not 'large'; there are: none"),
        (np.ones(3), "one volume for each of the 8 cells"),
        (np.arange(8.0), "finite and positive; those of cells 1 \\(ids 0"),
        (np.full(8, np.nan), "finite and positive"),
        ({"a": 1}, "'input', 'free', a cell array"),
    ],
)
def test_sizes_that_make_no_sense_are_refused(sizes, words):
    with pytest.raises(hc.OptionError, match=words):
        hc.regularize(generate.box((2, 2, 2)), sizes=sizes)
    with pytest.raises(hc.OptionError, match="wanted sizes must go with energy='barrier'"):
        hc.Options(sizes=sizes, energy="quaternionic")


def test_nothing_is_said_of_others_around_cells_that_cannot_move():
    points, cells = generate.jittered(*generate.ball(3, 2), amount=1.0, seed=1, valid=False)
    notes = hc.regularize((points, cells), fixed=range(len(points))).report.notes
    assert [note for note in notes if note.startswith("cells that cannot be unfolded")]
    assert not [note for note in notes if "others stay inverted" in note]


def rough_and_tangled(mesh, seed):
    """A tangled mesh with a rough surface."""
    points, cells = generate.jittered(*mesh, 2.2, seed=seed, valid=False)
    edge = np.linalg.norm(np.diff(mesh[0][cells[:, :2]], axis=1), axis=2).mean()
    return points + 0.2 * edge * np.random.default_rng(seed).normal(size=points.shape), cells


@pytest.mark.parametrize(("mesh", "seed"), [(generate.box((4, 4, 4)), 17), (generate.cylinder(3, 2, 3), 33)])
def test_what_does_not_unfold_within_the_bound_is_unfolded_from_farther_away(mesh, seed):
    result = hc.regularize(rough_and_tangled(mesh, seed), hausdorff=0.02)
    assert {"untangle with more room", "return to the surface"} <= {record.phase for record in result.history}
    assert result.report.before.inverted > 50
    assert result.report.after.inverted == result.report.after.invalid == 0
    assert 0.0 < result.report.hausdorff <= 0.02


def test_where_the_bound_is_too_narrow_the_report_tells_how_much_would_do():
    points, cells = rough_and_tangled(generate.box((4, 4, 4)), 17)
    result = hc.regularize((points, cells), hausdorff=0.005)
    report = result.report
    assert 0 < report.after.inverted < 0.5 * report.before.inverted
    assert report.hausdorff <= 0.005
    assert report.after.scaled_jacobian.min >= report.before.scaled_jacobian.min
    (note,) = [note for note in report.notes if "allow more" in note]
    needed = float(note.split("up to ")[1].split()[0])
    assert 0.005 < needed < 0.03
    assert hc.regularize((points, cells), hausdorff=1.5 * needed).report.after.invalid == 0


def test_messages_name_cells_and_nodes_by_their_ids_in_the_mesh():
    points, cells = generate.box((3, 3, 3))
    bad = points.copy()
    inner = np.setdiff1d(np.arange(len(points)), boundary_quads(cells)[0])
    bad[inner[0]] = bad[inner[-1]] + 0.2
    inverted = np.flatnonzero(hc.quality((bad, cells)).scaled_jacobian <= 0)
    with pytest.raises(hc.MeshError, match=rf"{len(inverted)} \((first )?ids {', '.join(map(str, inverted[:5]))}"):
        hc.regularize((points, cells), target=bad)
    bad = points.copy()
    bad[0] = bad[1]
    with pytest.raises(hc.MeshError, match=r"no length at nodes 1 \(ids 0\)"):
        hc.regularize((bad, cells), energy="quaternionic")
    sizes = np.full(len(cells), 1 / 27)
    sizes[[5, 7]] = -1.0
    with pytest.raises(hc.OptionError, match=r"2 \(ids 5, 7\)"):
        hc.regularize((points, cells), sizes=sizes)


def test_options_for_single_cells_and_nodes_hold_for_those_in_the_mesh():
    points, cells = generate.jittered(*generate.box((4, 4, 4)), 0.3, seed=5)
    rng = np.random.default_rng(3)
    nodes, order = rng.permutation(len(points)), rng.permutation(len(cells))
    shuffled = points[nodes], np.argsort(nodes)[cells[order]]
    held = rng.random(len(points)) < 0.2
    sizes = rng.uniform(0.5, 2.0, len(cells)) / len(cells)
    boxes = rng.uniform(0.5, 2.0, (len(cells), 3))
    reference = generate.jittered(*generate.box((4, 4, 4)), 0.3, seed=6)[0]
    for one, other in (
        ({"fixed": held}, {"fixed": held[nodes]}),
        ({"sizes": sizes}, {"sizes": sizes[order]}),
        ({"target": boxes}, {"target": boxes[order]}),
        ({"target": reference}, {"target": reference[nodes]}),
    ):
        plain, permuted = hc.regularize((points, cells), **one), hc.regularize(shuffled, **other)
        assert np.abs(plain.points - points).max() > 1e-2
        assert np.array_equal(permuted.points, plain.points[nodes])
    assert np.array_equal(hc.regularize((points, cells), fixed=held).points[held], points[held])
