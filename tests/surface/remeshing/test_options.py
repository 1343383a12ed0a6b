"""Options and surfaces that are refused, and nodes that are held by name."""

import numpy as np
import pytest
from meshes.surfaces import as_arrays, icosphere, shaken

import hexconformal as hc
import surface
from hexconformal.common.errors import MeshError, OptionError, ReadError, WriteError

STEPS = surface.Stepping(steps=1)


def test_nodes_are_held_by_the_name_of_a_point_array():
    points, cells = shaken(icosphere(2), 0.05)
    pole = points[:, 2] > 0.5
    mesh = surface.SurfaceMesh(points, cells, {"pole": np.where(pole, 2.0, 0.0), "axes": np.ones((len(points), 3))})
    named, given = (surface.remesh(mesh, fixed=fixed, max_iterations=3) for fixed in ("pole", pole))
    assert (named.points == given.points).all()
    assert (named.points[pole] == points[pole]).all()
    moment = list(surface.evolve(surface.MeanCurvature(mesh, fixed="pole"), steps=2))[-1]
    assert (moment.points[pole] == points[pole]).all()
    assert (moment.points[~pole] != points[~pole]).any()
    for call in (surface.remesh, lambda mesh, fixed: surface.Evolution(surface.Willmore(mesh, fixed=fixed), STEPS)):
        with pytest.raises(
            OptionError, match="'wall' names no point array or group of the file; there are: 'pole', 'axes'"
        ):
            call(mesh, fixed="wall")
        with pytest.raises(OptionError, match="fixed must have one boolean per point"):
            call(mesh, fixed="axes")


@pytest.mark.parametrize(
    ("points", "cells", "said"),
    [
        (np.full((3, 3), np.nan), [[0, 1, 2]], "NaN"),
        (np.eye(3), [[0, 1, 5]], "outside"),
        (np.eye(3), [[0, 1, 1]], "repeated"),
        (np.eye(3)[[0, 1, 1]], [[0, 1, 2]], "without area"),
        (np.random.default_rng(0).normal(size=(5, 3)), [[0, 1, 2], [1, 0, 3], [0, 1, 4]], "more than two"),
        (np.random.default_rng(0).normal(size=(4, 3)), [[0, 1, 2], [0, 1, 3]], "which side is out"),
        (np.eye(3), [[0, 1]], "array"),
    ],
)
def test_unsound_surfaces_are_refused(points, cells, said):
    with pytest.raises(MeshError, match=said):
        surface.remesh((points, np.array(cells)))


def test_a_moebius_strip_is_refused():
    n = 12
    a = np.arange(n)
    t = 2 * np.pi * a / n
    across = np.stack([np.cos(t / 2) * np.cos(t), np.cos(t / 2) * np.sin(t), np.sin(t / 2)], axis=1)
    circle = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    points = np.concatenate([circle - 0.3 * across, circle + 0.3 * across])
    quads = np.stack([a, a + 1, a + 1 + n, a + n], axis=1)
    quads[-1] = [n - 1, n, 0, 2 * n - 1]
    with pytest.raises(MeshError, match="which side is out"):
        surface.remesh((points, quads))


def test_numbers_are_no_text():
    for make in (
        lambda: hc.Options(hausdorff="0.1"),
        lambda: surface.Options(eps="small"),
        lambda: surface.Stepping(t_end="1"),
    ):
        with pytest.raises(OptionError, match="must be a number, not '"):
            make()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"max_iterations": -1}, "max_iterations must be 0 or more, not -1"),
        ({"energy_tolerance": 1.0}, r"energy_tolerance must lie in \[0, 1\), not 1\.0"),
        ({"feature_angle": 180}, "feature_angle must lie in .0, 180. degrees, not 180"),
        ({"feature_angle": "sharp"}, "feature_angle must be a number, not 'sharp'"),
        ({"feature_angle": 30.0, "feature_edges": [[0, 1]]}, "feature_angle must not be given with feature_edges"),
    ],
)
def test_options_out_of_range_are_refused(options, words):
    with pytest.raises(OptionError, match=words):
        surface.Options(**options)


def test_wrong_options_and_files_are_named(tmp_path):
    shape = as_arrays(icosphere(1))
    with pytest.raises(OptionError, match="unknown option 'colour'"):
        surface.remesh(shape, colour=1)
    with pytest.raises(OptionError, match="eps"):
        surface.remesh(shape, eps=0)
    with pytest.raises(OptionError, match="must be edges of the surface"):
        surface.remesh(shape, feature_edges=np.array([[0, 0]]))
    with pytest.raises(ReadError, match="does not exist"):
        surface.remesh(tmp_path / "nothing.ply")
    (tmp_path / "bad.ply").write_text("ply\n")
    with pytest.raises(ReadError):
        surface.remesh(tmp_path / "bad.ply")
    with pytest.raises(WriteError, match="unknown extension"):
        surface.write(tmp_path / "a.xyz", shape)
