"""Runs that conserve the enclosed volume."""

import numpy as np
import pytest
from corner_problems import formulation_of
from meshes.hexahedra import jittered_ball

import hexconformal as hc
from hexconformal import generate
from hexconformal.geometry import enclosed_volume
from hexconformal.geometry.closest_point import SurfaceLocator
from hexconformal.geometry.distance_barrier import DistanceBarrier
from hexconformal.mesh.topology import boundary_quads
from hexconformal.regularization.volume_restoration import restore_volumes


def cylinder():
    points, cells = generate.jittered(*generate.cylinder(4, 3, 6), 0.3, seed=2)
    height = points[:, 2]
    mantle = np.isclose(np.hypot(*points[:, :2].T), 1.0) & (height > height.min()) & (height < height.max())
    points[mantle] += 0.02 * np.random.default_rng(2).normal(size=(mantle.sum(), 3))
    return points, cells


@pytest.mark.parametrize("make", [jittered_ball, cylinder])
def test_a_run_conserves_the_volume_if_asked_to(make):
    points, cells = make()
    plain = hc.regularize((points, cells)).report
    result = hc.regularize((points, cells), conserve_volume=True)
    report = result.report
    assert abs(plain.volume_change) > 1e-5
    assert abs(report.volume_change) < 1e-13
    assert enclosed_volume(result.points, boundary_quads(cells)[0]) == pytest.approx(
        enclosed_volume(points, boundary_quads(cells)[0]), rel=1e-12
    )
    assert report.after.invalid == 0
    assert report.hausdorff <= 0.005
    assert report.after.scaled_jacobian.min > plain.after.scaled_jacobian.min - 0.01
    assert report.after.scaled_jacobian.mean > plain.after.scaled_jacobian.mean - 0.01
    assert any(note.startswith("volume: a change of") for note in report.notes)


def test_flat_faces_stay_flat_while_the_volume_is_made_up_for():
    points, cells = cylinder()
    result = hc.regularize((points, cells), conserve_volume=True)
    for end in (points[:, 2].min(), points[:, 2].max()):
        assert (result.points[points[:, 2] == end, 2] == end).all()
    held = points[:, 0] > 0.3
    result = hc.regularize((points, cells), conserve_volume=True, fixed=held)
    assert np.array_equal(result.points[held], points[held])
    assert abs(result.report.volume_change) < 1e-13


def test_a_tangled_mesh_gets_the_volume_that_its_surface_encloses():
    points, cells = jittered_ball(0.9, valid=False)
    report = hc.regularize((points, cells), conserve_volume=True).report
    assert report.before.inverted > 10
    assert report.after.inverted == report.after.invalid == 0
    assert abs(report.volume_change) < 1e-13
    assert report.hausdorff <= 0.005


@pytest.mark.parametrize(("size", "shift"), [(1e-6, 0.0), (1e6, 0.0), (1.0, 1e4)])
def test_volume_is_conserved_in_every_unit_and_far_away(size, shift):
    points, cells = jittered_ball()
    report = hc.regularize((size * points + shift, cells), conserve_volume=True).report
    assert report.largest_displacement > 0.01 * size
    assert abs(report.volume_change) < 1e-12


@pytest.mark.parametrize("options", [{"boundary": "fixed"}, {"hausdorff": 0.0}])
def test_where_the_volume_cannot_change_nothing_is_done(options):
    mesh = jittered_ball()
    plain = hc.regularize(mesh, **options)
    same = hc.regularize(mesh, conserve_volume=True, **options)
    assert np.array_equal(plain.points, same.points)
    assert same.report.notes == plain.report.notes


def test_a_run_that_is_left_early_conserves_the_volume_too():
    run = hc.Regularization(jittered_ball(), hc.Options(conserve_volume=True))
    for record in run:
        if record.iteration == 4:
            break
    report = run.result().report
    assert report.reason == "interrupted"
    assert report.largest_displacement > 0
    assert abs(report.volume_change) < 1e-13


def test_left_before_it_is_unfolded_a_mesh_says_that_its_volume_differs():
    mesh = generate.jittered(*generate.ball(4, 2), 0.9, valid=False, keep_boundary=False)
    run = hc.Regularization(mesh, hc.Options(conserve_volume=True))
    for record in run:
        # The first steps move nodes inside alone; after them the boundary gives way too.
        if record.iteration > 1 and record.inverted < run.history[1].inverted:
            break
    report = run.result().report
    assert 0 < report.after.inverted < report.before.inverted
    assert abs(report.volume_change) > 1e-6
    assert any(f"differs by {report.volume_change:+.1e}: the run was left" in note for note in report.notes)


def test_what_the_band_has_no_room_for_is_approached():
    points, cells = generate.ball(4, 2)
    quads = boundary_quads(cells)[0]
    bound = 0.01
    barrier = DistanceBarrier.around(SurfaceLocator(points, quads), bound)
    formulation = formulation_of(points, cells, barrier=barrier)
    before = enclosed_volume(points, quads)
    swollen = restore_volumes(formulation, points, [quads], np.array([1.2 * before]))
    assert barrier.relative_distance(swollen) <= 1.0
    assert hc.quality((swollen, cells)).valid.all()
    # All of the surface has gone outwards by half the bound at least.
    assert 0.5 * bound * 4 * np.pi < enclosed_volume(swollen, quads) - before < 1.1 * bound * 4 * np.pi
    little = restore_volumes(formulation, points, [quads], np.array([1.01 * before]))
    assert enclosed_volume(little, quads) == pytest.approx(1.01 * before, rel=1e-13)
    assert enclosed_volume(restore_volumes(formulation, little, [quads], np.array([before])), quads) == pytest.approx(
        before, rel=1e-13
    )


@pytest.mark.parametrize("options", [{"boundary": "free"}, {"surface": "part.stl"}])
def test_what_contradicts_it_is_refused(options):
    with pytest.raises(hc.OptionError, match="conserve_volume must go with boundary='slide'"):
        hc.Options(conserve_volume=True, **options)


# name: published minimum of the scaled Jacobian (Xu, Gao & Chen 2018)
@pytest.mark.long
@pytest.mark.parametrize(("name", "least"), [("xu_t5_bone", 0.207), ("xu_t3_fandisk", 0.752)])
def test_real_meshes_keep_their_volume_and_are_as_good_as_published(shared, name, least):
    report = hc.regularize(shared / "meshes" / "hex" / f"{name}_input.vtu", conserve_volume=True).report
    assert abs(report.volume_change) < 1e-13
    assert report.after.invalid == 0
    assert report.after.scaled_jacobian.min >= least
    assert report.hausdorff <= 0.005
