"""What a session shows of results, and offers at the Tab key."""

import pyvista as pv

import hexconformal as hc
import surface
from hexconformal import generate


def test_what_a_session_shows_fits_its_screen():
    """The last value of a notebook's cell is shown by its repr: no wall of arrays."""
    result = hc.regularize(generate.sheared_cube(10), max_iterations=1)
    assert repr(result) == f"Result(1331 points, 1000 cells: {result.report.reason})"
    assert repr(hc.quality(result.mesh)) == "Quality(1000 cells, 0 inverted, 0 invalid)"
    assert repr(result.report) == str(result.report)
    sphere = surface.quality(pv.Icosphere(nsub=3))
    assert repr(sphere).startswith("Quality(1280 cells, smallest angle 5")
    remeshed = surface.remesh(pv.Icosphere(nsub=2), max_iterations=1)
    assert repr(remeshed) == f"Result(162 points, 320 cells: {remeshed.report.reason})"
    for told in (result.report.after, sphere.summary()):
        assert repr(told) == str(told)


def test_the_tab_key_offers_what_is_meant_for_use():
    for package in (hc, surface):
        assert dir(package) == sorted(package.__all__)
        assert all(hasattr(package, name) for name in package.__all__)
