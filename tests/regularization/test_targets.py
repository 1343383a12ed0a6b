"""The shapes that cells are to have: cubes, boxes, those of the input."""

import numpy as np
import pytest
from meshes.hexahedra import jittered_box

import hexconformal as hc
from hexconformal import generate
from hexconformal.elements.lengths_volumes import cell_volumes
from hexconformal.regularization import Regularization


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


def test_cells_with_stretched_targets_may_get_only_a_little_thinner_than_these():
    points, cells = generate.boundary_layer((4, 4, 8), aspect=10.0)
    edges = np.ptp(points[cells], axis=1)
    stretch = edges.max(axis=1) / edges.min(axis=1)
    assert stretch.max() > 9.0
    assert stretch.min() < 2.0
    run = Regularization((points, cells), hc.Options(target=edges))
    slender = run._setting.formulation(run._boundary).slender
    expected = np.clip(12.0 / stretch, 2.0, 6.0)[run._normalized.cell_ids]
    assert np.abs(slender / expected - 1.0).max() < 1e-12
    cubes = Regularization((points, cells), hc.Options(target="cube"))
    assert cubes._setting.formulation(cubes._boundary).slender.min() == 6.0


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


def test_a_target_mesh_must_be_valid():
    points, cells = generate.box((3, 3, 3))
    with pytest.raises(hc.MeshError, match=r"inverted or flat cells: 27 \(first ids 0, 1, 2, 3, 4\)"):
        hc.regularize((points, cells), target=-points)
    missing = points.copy()
    missing[0] = np.nan
    with pytest.raises(hc.MeshError, match="NaN or infinite"):
        hc.regularize((points, cells), target=missing)
