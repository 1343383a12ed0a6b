"""A distance barrier is a function: what it is asked for does not change what it says."""

import numpy as np
import pytest
from corner_problems import convex

from hexconformal import generate
from hexconformal.energy import Assembly, Patch
from hexconformal.geometry.closest_point import SurfaceLocator
from hexconformal.geometry.distance_barrier import DistanceBarrier
from hexconformal.geometry.features import find_features
from hexconformal.kernel import threads
from hexconformal.mesh.topology import boundary_quads

POINTS, CELLS = generate.cylinder(4, 3, 6)
BOUND = 0.05
RNG = np.random.default_rng(5)
HERE, THERE = (POINTS + 0.002 * RNG.normal(size=POINTS.shape) for _ in range(2))
AFAR = POINTS + 0.08 * RNG.normal(size=POINTS.shape)


def quads():
    return boundary_quads(CELLS)[0]


def around(reference):
    """The barrier of the cylinder, or of one with a ball to slide on."""
    original = SurfaceLocator(POINTS, quads())
    if reference is None:
        return DistanceBarrier.around(original, BOUND, find_features(POINTS, quads()))
    return DistanceBarrier.around(original, BOUND, reference=SurfaceLocator(1.01 * POINTS, quads()))


def patch():
    moving = np.zeros(len(POINTS), dtype=bool)
    moving[quads()[5]] = True
    return Patch.around(moving, CELLS, HERE)


def assembled(barrier, points):
    return barrier.add_convex(points, np.zeros_like(points), Assembly.of_cells(CELLS, np.ones(len(points), dtype=bool)))


CALLS = {
    "value elsewhere": lambda barrier: barrier.value(THERE),
    "value far away": lambda barrier: barrier.value(AFAR),
    "gradient": lambda barrier: barrier.value_gradient(THERE),
    "convex part": lambda barrier: assembled(barrier, AFAR),
    "seen from elsewhere": lambda barrier: barrier.renewed(AFAR).value(AFAR),
    "seen from the patch": lambda barrier: barrier.restricted(patch()).renewed(THERE[patch().nodes]),
    "patch": lambda barrier: barrier.restricted(patch()).value_gradient(THERE[patch().nodes]),
    "watching": lambda barrier: barrier.watching(AFAR).renewed(AFAR),
    "second derivative": lambda barrier: barrier.second_product(THERE, AFAR - POINTS),
    "distances": lambda barrier: (
        barrier.relative_distance(AFAR),
        barrier.farthest(AFAR),
        barrier.exceeded(THERE),
    ),
}


def said(barrier):
    """All that a barrier says at a place."""
    value, gradient = barrier.value_gradient(HERE)
    cut = barrier.restricted(patch())
    inside = cut.value_gradient(HERE[patch().nodes])
    distance = barrier.relative_distance(HERE)
    return [barrier.value(HERE), value, gradient, *convex(barrier, HERE, CELLS), *inside, distance, barrier.wall]


@pytest.mark.long
@pytest.mark.parametrize("reference", [None, "another surface"])
@pytest.mark.parametrize("seen", [False, True], ids=["new", "seen from elsewhere"])
def test_no_call_changes_what_it_says(reference, seen):
    barrier = around(reference).renewed(THERE) if seen else around(reference)
    before = said(barrier)
    assert np.isfinite(before[0])
    for name, call in CALLS.items():
        call(barrier)
        for one, other in zip(before, said(barrier), strict=True):
            np.testing.assert_array_equal(one, other, err_msg=name)


def test_what_comes_of_it_is_another_one():
    barrier = around(None)
    wall, samples = barrier.wall, len(barrier.forward)
    _, seen = assembled(barrier, AFAR)
    assert seen.wall > wall == barrier.wall
    assert np.array_equal(seen.measured_at, AFAR)
    assert np.array_equal(barrier.measured_at, POINTS)
    watching = barrier.watching(AFAR)
    assert len(watching.forward) > samples == len(barrier.forward)
    assert watching.spacing == 0.5 * barrier.spacing
    with pytest.raises(AttributeError):
        barrier.wall = 1.0


def test_a_patch_has_the_value_and_gradient_of_the_whole_where_its_nodes_move():
    barrier = around(None).renewed(HERE)
    # One node on the rim of the cylinder and its neighbours inside: faces, curves and corners have their samples there.
    rim = np.flatnonzero(np.isclose(np.hypot(*POINTS[:, :2].T), 1.0) & (POINTS[:, 2] == POINTS[:, 2].max()))[0]
    moving = np.zeros(len(POINTS), dtype=bool)
    moving[rim] = True
    part = Patch.around(moving, CELLS, HERE)
    shift = np.zeros_like(POINTS)
    shift[rim] = [0.01, -0.007, 0.004]
    own = barrier.restricted(part)
    change = own.value((HERE + shift)[part.nodes]) - own.value(HERE[part.nodes])
    assert abs(change) > 1e-3
    assert change == pytest.approx(barrier.value(HERE + shift) - barrier.value(HERE), rel=1e-9)
    gradients = own.value_gradient((HERE + shift)[part.nodes])[1], barrier.value_gradient(HERE + shift)[1]
    np.testing.assert_allclose(gradients[0][part.local[rim]], gradients[1][rim], rtol=1e-9)


@pytest.mark.parametrize("reference", [None, "ball"])
def test_what_a_walk_has_found_is_for_those_points_alone(reference):
    barrier, points = around(reference), HERE.copy()
    barrier.value(points)
    points[:] = THERE
    assert barrier.value(points) == around(reference).value(THERE)
    # Where it has looked before it does what it would have done then: far samples are looked for everywhere.
    barrier.value(AFAR)
    one, other = (np.zeros_like(POINTS), np.zeros_like(POINTS))
    found = barrier.add_convex(AFAR, one, Assembly.of_cells(CELLS, np.ones(len(POINTS), dtype=bool)))[0]
    fresh = around(reference).add_convex(AFAR, other, Assembly.of_cells(CELLS, np.ones(len(POINTS), dtype=bool)))[0]
    assert found == fresh
    np.testing.assert_array_equal(one, other)


def test_samples_beyond_the_wall_are_looked_for_everywhere():
    barrier = around(None)
    seen = barrier.renewed(AFAR)
    places = np.einsum("sj,sji->si", seen.forward.weights, AFAR[quads()[seen.forward.faces]])
    exact = SurfaceLocator(POINTS, quads()).closest(places).distances
    far = seen.forward.distances > barrier.schedule.wall * BOUND
    assert far.sum() > 20
    np.testing.assert_allclose(seen.forward.distances[far], exact[far], rtol=1e-12)


def test_samples_add_up_to_the_same_bits_with_any_number_of_threads(monkeypatch):
    monkeypatch.setattr(threads, "_SMALLEST_RANGE", 1)
    found = []
    for count in (1, 2, 5):
        monkeypatch.setattr(threads, "thread_count", lambda count=count: count)
        assembly, gradient = Assembly.of_cells(CELLS, np.ones(len(POINTS), dtype=bool)), np.zeros_like(POINTS)
        value = around(None).add_convex(HERE, gradient, assembly)[0]
        found.append((value, gradient, assembly.matrix.data))
    for other in found[1:]:
        assert all(np.array_equal(one, same) for one, same in zip(found[0], other, strict=True))
