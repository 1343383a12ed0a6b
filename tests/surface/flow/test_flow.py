"""Curvature flows: exact gradients, spheres, minimal surfaces, what is conserved, steps, checkpoints."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from surface_shapes import icosphere, mixed_sphere, none, quad_cube, quad_sphere, scattered_sphere, shaken

import surface
from hexconformal import MeshError, OptionError, ReadError
from surface.flow import (
    Bending,
    Evolution,
    Flow,
    Helfrich,
    MeanCurvature,
    Membrane,
    PWillmore,
    Stepping,
    Tension,
    Willmore,
    evolve,
    load,
    save,
)
from surface.flow.discrete import DiscreteSurface, Elements
from surface.flow.energy import energy, energy_gradient
from surface.flow.options import reduced_volume
from surface.mesh.geometry import Cells, cell_areas, enclosed_volume

SURFACES = {
    "triangles": lambda: shaken(icosphere(2), 0.03),
    "quads": lambda: shaken(quad_sphere(3), 0.03),
    "both": lambda: shaken(mixed_sphere(3), 0.03),
}
TERMS = {
    "area": [Tension(0.7)],
    "p1": [Bending(1)],
    "p2": [Bending(2)],
    "p3": [Bending(3)],
    "p4": [Bending(4)],
    "helfrich": [Membrane(2.0, 0.7, 0.3)],
    "sum": [Membrane(1.0, -0.5), Bending(3), Tension(2.0)],
}


def mesh(surface):
    points, cells = surface
    return points, cells.triangles, cells.quads


def torus(major, minor, n, m):
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    r = major + minor * np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), minor * np.sin(v)], axis=2).reshape(-1, 3)
    i = np.arange(n * m).reshape(n, m)
    a, b = i, np.roll(i, -1, axis=0)
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    return points, Cells(none(3), np.stack([a, b, c, d], axis=2).reshape(-1, 4))


@pytest.mark.parametrize("terms", TERMS.values(), ids=TERMS)
@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_the_gradient_is_that_of_the_discrete_energy(surface, terms):
    points, cells = surface()
    elements = Elements(cells, len(points))
    ways = np.random.default_rng(1).standard_normal((8, *points.shape))
    gradient = energy_gradient(DiscreteSurface(elements, points), terms)
    slopes = (gradient * ways).sum(axis=(1, 2))

    def difference(h):
        values = [[energy(DiscreteSurface(elements, points + s * h * way), terms) for s in (1, -1)] for way in ways]
        return np.linalg.norm(np.diff(values, axis=1).ravel() / (-2 * h) - slopes) / np.linalg.norm(slopes)

    errors = [difference(h) for h in (1e-3, 1e-4)]
    assert errors[1] < 1e-3
    assert np.log10(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("p", [1, 2, 3, 4])
@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_the_discrete_energy_is_homogeneous(surface, p):
    points, cells = surface()
    state = DiscreteSurface(Elements(cells, len(points)), points)
    value, terms = energy(state, [Bending(p)]), [Bending(p)]
    assert (energy_gradient(state, terms) * points).sum() == pytest.approx((2 - p) * value, abs=1e-12 * value)


@pytest.mark.parametrize("surface", SURFACES.values(), ids=SURFACES)
def test_the_area_gradient_is_the_stiffness_matrix_times_the_points(surface):
    points, cells = surface()
    state = DiscreteSurface(Elements(cells, len(points)), points)
    assert np.abs(state.stiffness @ points - state.area_gradient).max() < 1e-13
    assert state.mass_matrix.sum() == pytest.approx(state.area, rel=1e-13)


def test_willmore_energy_of_icospheres_is_as_published():
    excess = []
    for level in (2, 3, 4):
        points, cells = icosphere(level)
        excess.append(energy(DiscreteSurface(Elements(cells, len(points)), points), [Bending(2)]) - 16 * np.pi)
    assert excess == pytest.approx([0.2976, 0.07366, 0.01824], rel=1e-3)


@pytest.mark.parametrize(("major", "exact"), [(2**0.5, 8 * np.pi**2), (3.0, 4 * np.pi**2 * 9 / 8**0.5)])
def test_willmore_energy_of_tori_converges_with_order_two(major, exact):
    errors = []
    for n in (16, 32):
        points, cells = torus(major, 1.0, 3 * n, n)
        errors.append(energy(DiscreteSurface(Elements(cells, len(points)), points), [Bending(2)]) - exact)
    assert abs(errors[1]) < 0.01 * exact
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)


def radius(flow, t_end, steps):
    *_, moment = evolve(flow, t_end=t_end, tau=t_end / steps, growth=1.0, stall=0.0)
    assert moment.record.step == steps
    return np.linalg.norm(moment.points, axis=1).mean()


SPHERES = [(0, 0.1), (1, 0.1), (3, 0.02), (4, 0.005)]


@pytest.mark.parametrize(("p", "t"), SPHERES)
@pytest.mark.parametrize("sphere", [icosphere, lambda level: quad_sphere(2 ** (level + 1))], ids=["triangles", "quads"])
def test_spheres_follow_their_radius_with_order_h2_plus_tau(sphere, p, t):
    exact = (1 - 4 * t) ** 0.5 if p == 0 else (1 + (p + 2) * (p - 2) * 2**p * t) ** (1 / (p + 2))
    errors = [radius(PWillmore(mesh(sphere(level)), p), t, steps) - exact for level, steps in ((1, 4), (2, 16))]
    assert abs(errors[1]) < 0.01
    assert np.log2(abs(errors[0] / errors[1])) > 1.4


def test_a_sphere_stays_under_willmore_flow():
    assert radius(Willmore(mesh(icosphere(2))), 1.0, 10) == pytest.approx(1.0, abs=2e-3)


def test_a_membrane_sphere_follows_its_ordinary_differential_equation():
    kc, c0, gamma, t, steps = 0.5, 1.0, 0.4, 0.2, 40
    exact, n = 1.0, 4000
    for _ in range(n):
        exact += t / n * (kc * c0 * (2 - c0 * exact) - 2 * gamma * exact) / exact**2
    assert abs(exact - 1) > 0.05
    flow = Helfrich(mesh(icosphere(3)), kc, c0, gamma, conserve=())
    assert radius(flow, t, steps) == pytest.approx(exact, abs=3e-3)


def test_a_film_between_rings_becomes_a_catenoid():
    height, n, m = 1.0, 24, 9
    u, z = np.meshgrid(2 * np.pi * np.arange(n) / n, np.linspace(-0.5, 0.5, m) * height, indexing="ij")
    points = np.stack([np.cos(u), np.sin(u), z], axis=2).reshape(-1, 3)
    i = np.arange(n * m).reshape(n, m)
    a, b = i[:, :-1], np.roll(i, -1, axis=0)[:, :-1]
    quads = np.stack([a, b, b + 1, a + 1], axis=2).reshape(-1, 4)
    moments = list(evolve(MeanCurvature((points, quads)), steps=200, stall=1e-10))
    rings = np.tile(np.arange(m) % (m - 1) == 0, n)
    assert (moments[-1].points[rings] == points[rings]).all()
    c = brentq(lambda c: c * np.cosh(height / (2 * c)) - 1, 0.5, 2)
    waist = np.linalg.norm(moments[-1].points.reshape(n, m, 3)[:, m // 2, :2], axis=1)
    assert waist == pytest.approx(c, abs=5e-3)


@pytest.mark.parametrize("conserve", [("area",), ("volume",), ("area", "volume")])
@pytest.mark.parametrize("kind", ["mean curvature", "willmore"])
def test_what_is_conserved_stays_while_the_energy_falls(kind, conserve):
    if kind == "mean curvature" and "area" in conserve:
        pytest.skip("its energy is the area")
    points, cells = icosphere(2)
    start = (points * [1.0, 1.3, 1.8], cells.triangles)
    flow = Willmore(start, conserve) if kind == "willmore" else MeanCurvature(start, conserve)
    records = [moment.record for moment in evolve(flow, steps=25, stall=0.0)]
    assert max(record.conserved_error for record in records) < 1e-12
    assert (np.diff([record.energy for record in records]) < 0).all()
    for name in conserve:
        values = [getattr(record, name) for record in records]
        assert values == pytest.approx([values[0]] * len(values), rel=1e-10)


def test_an_ellipsoid_of_constant_volume_becomes_the_ball():
    points, cells = icosphere(2)
    flow = MeanCurvature((points * [1.0, 1.3, 1.8], cells.triangles), "volume")
    run = Evolution(flow, Stepping(steps=300, stall=1e-4))
    last = list(run)[-1]
    assert run.reason.startswith("the energy stalls")
    distance = np.linalg.norm(last.points - last.points.mean(axis=0), axis=1)
    assert np.ptp(distance) < 0.03
    assert last.record.reduced_volume > 0.985


def test_output_times_are_hit_whatever_the_steps_are():
    flow = MeanCurvature(mesh(icosphere(1)))
    times = [m.record.time for m in evolve(flow, t_end=0.1, tau=0.003, outputs=(0.01, 0.02, 0.0333))]
    assert {0.01, 0.02, 0.0333} <= set(times)
    assert times[-1] == 0.1
    assert (np.diff(times) > 0).all()


def test_a_sphere_that_vanishes_ends_the_run_with_its_place():
    points, cells = icosphere(2)
    run = Evolution(MeanCurvature((points + [5, 0, 0], cells.triangles)), Stepping(steps=2000, tau_max=2e-3))
    moments = list(run)
    assert run.reason.startswith("the surface vanishes, at (5")
    assert moments[-1].record.time == pytest.approx(0.25, abs=0.01)
    assert np.isfinite(moments[-1].points).all()


@pytest.mark.parametrize("stall", [0.0, 1e-5])
@pytest.mark.parametrize("remesh", [0, 1, 2])
def test_a_neck_that_pinches_ends_the_run_with_the_last_good_surface(stall, remesh):
    points, cells = icosphere(3)
    x = 4 * points[:, 0]
    shrink = np.where(np.abs(x) < 2.5, 0.12 + 0.88 * np.minimum(np.abs(x) / 2.5, 1) ** 2, 1.0)
    dumbbell = np.stack([x, *(points[:, 1:] * shrink[:, None]).T], axis=1)
    run = Evolution(MeanCurvature((dumbbell, cells.triangles)), Stepping(steps=400, stall=stall, remesh=remesh))
    last = list(run)[-1]
    assert "singularity" in run.reason
    assert (np.diff([record.time for record in run.history]) > 0).all()
    node = int(run.reason.split("node ")[1].split(",")[0])
    assert abs(last.points[node, 0]) < 0.5
    assert last.record.area > 0.5


def test_remeshing_keeps_angles_and_the_flow_falls():
    points, cells = quad_cube(6)
    flow = Willmore((points, cells.quads), ("area", "volume"))
    plain, remeshed = (
        [moment.record for moment in evolve(flow, steps=40, stall=0.0, remesh=remesh)] for remesh in (False, True)
    )
    assert remeshed[-1].mean_angle > plain[-1].mean_angle + 0.5
    assert max(record.conserved_error for record in remeshed) < 1e-12
    assert remeshed[-1].energy < 0.7 * remeshed[0].energy
    assert np.isfinite([record.remesh_jump for record in remeshed]).any()


def test_remeshing_gives_back_less_than_the_flow_took_since_it_last_did():
    points, cells = icosphere(2)
    flow = Willmore((points * [1.0, 1.0, 1.6], cells.triangles), ("area", "volume"))
    records = [moment.record for moment in evolve(flow, steps=40, stall=0.0, remesh=True)]
    earned, jumps = 0.0, []
    for before, record in zip(records[:-1], records[1:], strict=True):
        jump = np.nan_to_num(record.remesh_jump)
        jumps.append(record.remesh_jump)
        most = 0.05 * before.energy if before.step == 0 else max(0.95 * earned, 0.0)
        assert jump <= most + 1e-12
        if np.isfinite(record.remesh_jump):
            earned = min(earned - jump, 0.0)
        fall = before.energy + jump - record.energy
        assert fall >= -1e-12 * record.energy
        earned += fall
    assert max(jumps[1:]) > 0


def test_a_poor_mesh_is_good_after_ten_steps_and_the_energy_falls_nevertheless():
    points, triangles = scattered_sphere(400)
    bumps = 1 + 0.25 * np.sin(3 * points[:, :1] + 1) * np.cos(3 * points[:, 1:2])
    start = (points * bumps * [1.0, 1.2, 1.6], triangles)
    records = [m.record for m in evolve(Willmore(start), steps=30, remesh=True)]
    jumps = np.array([record.remesh_jump for record in records[1:11]])
    assert jumps.max() > 0
    assert jumps.sum() < 0.05 * records[0].energy
    assert records[0].min_angle < 2.0
    assert records[1].min_angle > records[0].min_angle + 1.0
    assert min(record.min_angle for record in records[10:]) > 25.0
    assert (np.diff([record.energy for record in records[1:]]) < 0).all()
    assert records[3].energy < records[0].energy


def test_area_and_volume_come_back_smoothly_after_remeshing():
    points, cells = shaken(icosphere(3), 0.03)
    start = (points * [1.0, 1.2, 1.6], cells.triangles)
    records = [m.record for m in evolve(Willmore(start, ("area", "volume")), steps=1, remesh=True)]
    assert records[1].remesh_jump < -0.1 * records[0].energy
    assert records[1].conserved_error < 1e-12


def spoiled(points, early):
    """In place of remeshing, after the beginning: every node aside along the surface, always the same way."""
    if early:
        return None
    aside = np.cross(points, np.random.default_rng(5).standard_normal(points.shape))
    return points + 0.03 * aside / np.linalg.norm(aside, axis=1, keepdims=True)


def test_a_remeshing_that_gives_back_too_much_is_taken_in_part_until_it_wears_out_the_mesh():
    points, cells = icosphere(2)
    flow = Willmore((points * [1.0, 1.0, 1.6], cells.triangles), ("area", "volume"))

    def run(steps, stall=1e-9, state=None):
        run = Evolution(flow, Stepping(steps=steps, stall=stall, remesh=True))
        run._remesher = spoiled
        if state is not None:
            run.resume(state)
        return run, list(run)

    whole, moments = run(60)
    jumps = np.array([moment.record.remesh_jump for moment in moments])
    assert (jumps > 0).any()
    assert whole.reason.startswith("the energy falls only by wearing out the mesh")
    assert 10 <= whole.step < 60
    assert moments[-1].record.energy < moments[0].record.energy
    resumed, _ = run(60, state=run(whole.step - 3)[0].state())
    assert (resumed.step, resumed.reason) == (whole.step, whole.reason)
    assert run(60, stall=0.0)[0].reason == "reached steps = 60"


def test_where_the_worst_cannot_be_raised_the_rest_still_is(monkeypatch):
    from surface.flow import remeshing

    asked = []

    class Remeshing(remeshing.Remeshing):
        def __init__(self, mesh, options):
            asked.append(options.emphasis)
            super().__init__(mesh, replace(options, iterations=0) if options.emphasis == "worst" else options)

    monkeypatch.setattr(remeshing, "Remeshing", Remeshing)
    records = [m.record for m in evolve(MeanCurvature(mesh(shaken(icosphere(2), 0.03))), steps=11, remesh=True)]
    assert asked == ["mean"] * 10 + ["worst", "mean"]
    assert np.isfinite(records[11].remesh_jump)


def test_a_resumed_run_equals_the_one_that_never_stopped(tmp_path):
    points, cells = icosphere(2)
    flow = Willmore((points * [1.0, 1.0, 1.6], cells.triangles), ("area", "volume"))

    def run(steps):
        return Evolution(flow, Stepping(steps=steps, stall=0.0, remesh=3))

    whole = [moment.points for moment in run(12)]
    first = run(7)
    list(first)
    save(tmp_path / "run.npz", first)
    second = run(12)
    load(tmp_path / "run.npz", second)
    rest = list(second)
    assert [moment.record.step for moment in rest] == [8, 9, 10, 11, 12]
    assert np.abs(rest[-1].points - whole[-1]).max() <= 1e-12


def test_checkpoints_of_other_runs_and_other_files_are_refused(tmp_path):
    one, other = (Evolution(Willmore(mesh(icosphere(level))), Stepping(steps=1)) for level in (1, 2))
    save(tmp_path / "run.npz", one)
    with pytest.raises(OptionError, match="another surface"):
        load(tmp_path / "run.npz", other)
    with pytest.raises(OptionError, match="another surface or another flow"):
        load(tmp_path / "run.npz", Evolution(MeanCurvature(mesh(icosphere(1))), Stepping(steps=1)))
    (tmp_path / "text.npz").write_text("nothing")
    with pytest.raises(ReadError, match="text"):
        load(tmp_path / "text.npz", one)
    with pytest.raises(ReadError, match="absent"):
        load(tmp_path / "absent.npz", one)


def test_moments_carry_curvature_in_the_type_that_came_in():
    import pyvista as pv

    sphere = pv.Icosphere(radius=2.0, nsub=3)
    sphere.point_data["mine"] = np.arange(sphere.n_points)
    moment = next(iter(evolve(MeanCurvature(sphere), steps=1)))
    out = moment.mesh
    assert isinstance(out, pv.PolyData)
    assert out.point_data["mean_curvature"] == pytest.approx(0.5, rel=1e-3)
    assert out.point_data["curvature"] == pytest.approx(1.0, rel=1e-3)
    assert (out.point_data["mine"] == np.arange(sphere.n_points)).all()


@pytest.mark.parametrize(
    ("make", "sizes", "rate"),
    [(icosphere, (2, 3, 4), 3.5), (quad_sphere, (4, 8, 16), 10), (mixed_sphere, (4, 8, 16), 2)],
)
def test_curvature_converges_at_every_node_of_a_sphere(make, sizes, rate):
    errors = []
    for size in sizes:
        points, cells = make(size)
        state = DiscreteSurface(Elements(cells, len(points)), points)
        assert state.dual_areas.sum() == pytest.approx(state.area, rel=1e-12)
        errors.append(np.abs(np.linalg.norm(state.nodal_curvature, axis=1) - 2).max())
    assert errors[0] > rate * errors[1] > rate**2 * errors[2]
    assert errors[2] < 1e-3


def test_curvature_stays_finite_where_triangles_are_obtuse():
    points, cells = shaken(icosphere(3), 0.05)
    state = DiscreteSurface(Elements(cells, len(points)), points)
    masses = np.asarray(state.mass_matrix.sum(axis=1)).ravel()
    assert (state.dual_areas >= 0.25 * masses).all()
    assert (state.dual_areas < 0.26 * masses).any()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda m: Flow(m, []), "at least one term"),
        (lambda m: Willmore(m, "length"), "not 'length'"),
        (lambda m: PWillmore(m, 0.5), "p must be at least 1"),
        (lambda m: Helfrich(m, kc=-1), "kc must be positive"),
        (lambda m: evolve(Willmore(m), stall=0.0), "nothing ends"),
        (lambda m: evolve(Willmore(m), speed=3), "unknown option 'speed'"),
        (lambda m: Stepping(steps=1, outputs=(0.2, 0.1)), "times that grow"),
        (lambda m: Stepping(steps=1, remesh_below=120), "remesh_below"),
        (lambda m: Stepping(steps=-1), "steps is not negative, not -1"),
        (lambda m: Stepping(steps=1, growth=0.9), r"growth must be at least 1, not 0\.9"),
        (lambda m: Stepping(steps=1, stall=1.0), r"stall must lie in \[0, 1\), not 1\.0"),
        (lambda m: Stepping(steps=1, remesh=-2), "remesh must be a boolean, or every how many steps, not -2"),
    ],
)
def test_what_makes_no_sense_is_refused(make, message):
    with pytest.raises(OptionError, match=message):
        make(mesh(icosphere(0)))


def test_open_surfaces_have_no_volume_to_keep():
    square = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    with pytest.raises(OptionError, match="encloses no volume"):
        evolve(MeanCurvature(square, "volume"), steps=1)
    with pytest.raises(MeshError):
        evolve(MeanCurvature(([[0, 0, 0], [1, 0, 0], [np.nan, 1, 0]], [[0, 1, 2]])), steps=1)


def cell(level, reduced=None):
    """The surface of a red blood cell, (2 cos p; (1 - 0.7 (cos^2 p - 1)^2) sin p), squeezed to a reduced volume."""
    points, cells = icosphere(level)
    height = 1 - 0.7 * (points[:, 0] ** 2 + points[:, 1] ** 2 - 1) ** 2
    points = np.stack([2 * points[:, 0], 2 * points[:, 1], height * points[:, 2]], axis=1)
    if reduced is not None:

        def excess(factor):
            moved = points * [1, 1, factor]
            return reduced_volume(cell_areas(moved, cells).sum(), enclosed_volume(moved, cells)) - reduced

        points = points * [1, 1, brentq(excess, 0.5, 1.5)]
    return points, cells.triangles


@pytest.mark.parametrize(
    ("reduced", "exact"), [(None, 22.94), (0.64, 1.85194 * 4 * np.pi), (0.723601, 1.63996 * 4 * np.pi)]
)
def test_membranes_reach_the_published_energies(reduced, exact):
    flow = Willmore(cell(3, reduced), ("area", "volume"))
    *_, moment = evolve(flow, steps=80, stall=1e-4, tau=1e-4)
    # int H^2 = int |Y|^2 / 4.
    assert moment.record.energy / 4 == pytest.approx(exact, rel=5e-3)
    assert moment.record.conserved_error < 1e-12


def test_a_perturbed_torus_becomes_that_of_clifford():
    points, cells = torus(1.8, 1.0, 32, 32)
    u = np.arctan2(points[:, 1], points[:, 0])
    ring = 1.8 * np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    v = np.arcsin(np.clip(points[:, 2], -1, 1))
    bumpy = points + (0.15 * np.sin(3 * u) * np.cos(2 * v + u))[:, None] * (points - ring)
    *_, moment = evolve(Willmore((bumpy, cells.quads)), steps=80)
    assert moment.record.energy / 4 == pytest.approx(2 * np.pi**2, rel=5e-3)


def test_a_cube_becomes_the_discoid_of_its_reduced_volume():
    points, cells = quad_cube(12)
    points = (points - points.mean(axis=0)) / np.ptp(points[:, 0])
    # A dent above and below: which way the symmetric shape is left is not for rounding to decide.
    points[:, 2] *= 1 - 0.002 * np.exp(-8 * (points[:, :2] ** 2).sum(axis=1))
    stepping = Stepping(steps=150, stall=1e-4, remesh=True)
    run = Evolution(Willmore((points, cells.quads), ("area", "volume")), stepping)
    last = list(run)[-1].record
    assert last.reduced_volume == pytest.approx(0.7236, abs=1e-3)
    assert last.energy / (16 * np.pi) == pytest.approx(1.63996, rel=1e-2)
    assert last.min_angle > 70


def test_a_mesh_is_no_flow():
    with pytest.raises(OptionError, match=r"MeanCurvature\(mesh\) or Willmore\(mesh\), not str"):
        surface.evolve("statue.ply", steps=1)
