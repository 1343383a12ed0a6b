"""Runs from end to end: records, reasons, messages, arrays and meshes of any layout."""

import numpy as np
import pytest
from meshes.hexahedra import jittered_box, with_rough_surface

import hexconformal as hc
from hexconformal import generate
from hexconformal.energy import DistortionTerm
from hexconformal.mesh.topology import boundary_quads

CURVED = {"cylinder": generate.cylinder(4, 3, 6), "ball": generate.ball(3, 2)}


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
    points, cells = with_rough_surface(CURVED["cylinder"])
    result = hc.regularize((points, cells), target="cube")
    assert {record.phase for record in result.history} >= {"input", "distortion", "angles", "stiffen", "worst cells"}
    measure = DistortionTerm(cells, len(points), eps=0.0, quadrature="corners")
    for x, energy in ((points, result.report.energy_before), (result.points, result.report.energy_after)):
        assert energy == pytest.approx(measure.cell_energies(x).sum(), rel=1e-10)
    assert result.report.energy_after < 0.7 * result.report.energy_before
    longest = max(record.energy for record in result.history)
    assert longest == pytest.approx(result.report.energy_before, rel=1e-12)


def test_a_limit_on_iterations_is_a_result_with_a_reason():
    result = hc.regularize(generate.twisted_cube(6, 60), boundary="fixed", max_iterations=2)
    assert not result.converged
    assert result.report.reason == "reached max_iterations = 2"
    assert len(result.history) == 3
    untouched = hc.regularize(generate.twisted_cube(6, 60), max_iterations=0)
    assert untouched.report.largest_displacement == 0.0


def test_mirrored_meshes_are_refused_with_the_remedy():
    points, cells = generate.box((3, 3, 3))
    with pytest.raises(hc.MeshError, match=r"orient"):
        hc.regularize((points, cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]))


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


UNTANGLED = ["xu_t5_bird", "xu_t5_block", "xu_t5_bone", "msq_1000hex_block_internal_bias", "hs_swivel2_7494"]


@pytest.mark.long
@pytest.mark.parametrize("name", UNTANGLED)
def test_real_meshes_with_fixed_boundary_stay_valid_and_get_no_worse(shared, name):
    report = hc.regularize(shared / "meshes" / "hex" / f"{name}_input.vtu", boundary="fixed").report
    assert report.before.invalid == report.after.invalid == 0
    assert report.after.scaled_jacobian.min > report.before.scaled_jacobian.min
    assert report.after.scaled_jacobian.mean > report.before.scaled_jacobian.mean
    assert report.boundary_moved == 0


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
        hc.regularize((bad, cells), hausdorff=0.0)
    sizes = np.full(len(cells), 1 / 27)
    sizes[[5, 7]] = -1.0
    with pytest.raises(hc.OptionError, match=r"2 \(ids 5, 7\)"):
        hc.regularize((points, cells), sizes=sizes)


def test_the_barrier_has_no_energy_while_corners_are_inverted():
    points, cells = generate.box((2, 2, 2))
    points[13] += [0.45, 0.45, 0.1]  # through the planes of corners, while the Gauss points stay on their side
    run = hc.Regularization((points, cells), hc.Options(quadrature="gauss"))
    assert np.isfinite(DistortionTerm(cells, len(points), eps=0.0, quadrature="gauss").cell_energies(points)).all()
    first, *others = run
    assert first.inverted > 0
    assert all(np.isnan(record.energy) == (record.inverted > 0) for record in [first, *others])
    assert others[-1].inverted == 0
    told = hc.regularize((points, cells), boundary="fixed", energy="quaternionic").history[0]
    assert told.inverted > 0
    assert np.isfinite(told.energy)
