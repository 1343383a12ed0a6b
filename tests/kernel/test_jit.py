"""Compiled loops do what they say: the same runs with the loops left to the interpreter come to the same points."""

import os
import shutil
import subprocess
import sys
from contextlib import ExitStack, contextmanager
from unittest import mock

import numpy as np
import pytest
from corner_problems import convex
from meshes.hexahedra import INVALID_INSIDE
from meshes.surfaces import icosphere, quad_cube, shaken
from paths import ROOT

import hexconformal as hc
import surface
from hexconformal.elements import minimum_jacobian
from hexconformal.elements.hexahedron import CORNERS
from hexconformal.energy import CornerTerm, CornerWeights, DistortionTerm
from hexconformal.generate import ball, box, jittered
from hexconformal.geometry.closest_point import CurveLocator
from hexconformal.kernel.jit import Loop
from hexconformal.solver.multigrid import Multigrid


@contextmanager
def interpreted():
    """Inside, every compiled loop of this project is the Python it was compiled from."""
    replaced = 0
    with ExitStack() as stack:
        for name, module in list(sys.modules.items()):
            if name.partition(".")[0] in ("hexconformal", "surface"):
                for key, value in list(vars(module).items()):
                    if isinstance(value, Loop):
                        stack.enter_context(mock.patch.object(module, key, value.py_func))
                        replaced += 1
        assert replaced > 40
        yield


def quadratic(points):
    return points + 0.1 * points[:, [1, 2, 0]] ** 2


def moved():
    points, cells = jittered(*box((2, 2, 2)), 0.2)
    top = np.flatnonzero(points[:, 2] == 1.0)
    for operator in ("harmonic", "elastic", "conformal"):
        motion = hc.MeshMotion((points, cells), moving=top, operator=operator)
        yield motion.step(np.tile([0.05, 0.0, 0.1], (len(top), 1))).points


def volumes(points_and_cells, **options):
    return hc.regularize(points_and_cells, **options).points


def products():
    """All second derivatives, with targets and without, and the convex blocks."""
    points, cells = SKEW
    field = np.random.default_rng(0).normal(size=points.shape)
    frames = np.linalg.inv(np.eye(3) + 0.2 * np.random.default_rng(1).normal(size=(len(cells), 1, 3, 3)))
    for eps, inverses in ((None, None), (None, frames), (0.1, frames)):
        term = DistortionTerm(cells, len(points), None, inverses, eps, "gauss")
        yield term.second_product(points, field)
        if eps is None:
            yield term.frozen_product(points, field)
        yield from convex(term, points, cells, diagonals=True)[1:]


def shaped():
    """Gradient and convex Hessian at the corners, with targets."""
    points, cells = SKEW
    frames = np.linalg.inv(np.eye(3) + 0.2 * np.random.default_rng(1).normal(size=(1, 1, 3, 3)))
    term = CornerTerm(cells, frames, CornerWeights(angle=1.0, stiffness=0.01, eps=0.1))
    return np.concatenate([part.ravel() for part in convex(term, points, cells)[1:]])


def cycle():
    """One multigrid cycle of two levels."""
    points, cells = box((7, 7, 7))
    matrix = DistortionTerm(cells, len(points)).laplacian()
    return Multigrid(matrix, points[:, 0] > 0)(quadratic(points))


def curve():
    line = CurveLocator(
        quadratic(np.linspace(0, 1, 30).reshape(10, 3)), [[k, k + 1] for k in range(9)], np.arange(9) // 5
    )
    return line.closest(np.random.default_rng(0).random((20, 3)), np.arange(20) % 2).positions


ONE = np.arange(8)[None]
SKEW = jittered(*box((2, 2, 3)), 0.35, keep_boundary=False)
ROUND = jittered(*ball(2, 1), 0.3)
TANGLED = jittered(*box((3, 2, 2)), 0.9, seed=5, valid=False)
RUNS = {
    "corners": lambda: volumes(SKEW, boundary="free", target="1:2:3", max_iterations=4),
    "volumes": lambda: volumes(SKEW, boundary="free", sizes=np.full(12, 0.1), max_iterations=3),
    "a reference mesh": lambda: volumes(
        SKEW, boundary="free", target=quadratic(box((2, 2, 3))[0]), emphasis="mean", max_iterations=4
    ),
    "gauss": lambda: volumes(SKEW, boundary="fixed", energy="quaternionic", method="newton", max_iterations=3),
    "frozen": lambda: volumes(
        SKEW, boundary="fixed", energy="quaternionic", method="majorize", target="input", max_iterations=2
    ),
    "a curved boundary": lambda: volumes(ROUND, hausdorff=0.02, max_iterations=6),
    "a curved boundary by a preconditioner of blocks": lambda: volumes(
        ROUND, hausdorff=0.02, method="lbfgs", quadrature="gauss", max_iterations=4
    ),
    "blocks of the quaternionic energy": lambda: volumes(
        ROUND, hausdorff=0.02, energy="quaternionic", target="1:1:2", max_iterations=3
    ),
    "tangled": lambda: volumes(TANGLED, max_iterations=4),
    "tangled boxes": lambda: volumes(TANGLED, target="1:1:2", max_iterations=2),
    "second derivatives": lambda: np.concatenate([product.ravel() for product in products()]),
    "corners with targets": shaped,
    "multigrid": cycle,
    "a curve": curve,
    "motion": lambda: np.concatenate(list(moved())),
    "triangles": lambda: (
        surface.remesh((shaken(icosphere(1), 0.08)[0], icosphere(1)[1].triangles), max_iterations=2).points
    ),
    "quadrilaterals": lambda: (
        surface.remesh((quadratic(quad_cube(2)[0]), quad_cube(2)[1].quads), feature_angle=None, max_iterations=1).points
    ),
    "quality": lambda: np.concatenate([v.ravel() for v in hc.Quality.arrays(hc.quality(TANGLED)).values()]),
    "bounds": lambda: np.concatenate(
        # The first two take bisections.
        [bound for x in (INVALID_INSIDE, 0.95 * INVALID_INSIDE + 0.05 * CORNERS) for bound in minimum_jacobian(x, ONE)]
        + [*minimum_jacobian(*TANGLED)]
    ),
}


@pytest.mark.long
@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS)
def test_compiled_loops_are_the_python_they_come_from(run):
    compiled = run()
    with interpreted():
        plain = run()
    np.testing.assert_allclose(compiled, plain, rtol=1e-6, atol=1e-8)


SOLVE = """
import numpy as np
from hexconformal.energy import BlockMatrix
from hexconformal.generate import box
from hexconformal.solver import solve_blocks
points, cells = box((4, 4, 4))
rng = np.random.default_rng(0)
matrix = BlockMatrix.of_cells(cells, np.ones(len(points), dtype=bool))
matrix.data[:] = rng.normal(size=matrix.data.shape)
last = matrix.indptr[1:] - 1
matrix.data[last] = np.eye(3) * 60 + matrix.data[last] + matrix.data[last].transpose(0, 2, 1)
found = solve_blocks(
    matrix, rng.normal(size=points.shape), np.tile(np.eye(3), (len(points), 1, 1)), 1e-8, 50, 1e-5
)
print(found.tobytes().hex())
"""


@pytest.mark.long
def test_the_run_that_compiles_and_one_that_loads_give_the_same_bits(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    first, second = (
        subprocess.run(
            [sys.executable, "-c", SOLVE], env=environment, capture_output=True, text=True, check=True
        ).stdout
        for _ in range(2)
    )
    assert list(tmp_path.rglob("block_sweeps._forward_between*.nbc"))
    assert first == second


HELPERS = """
from hexconformal.kernel import strict_loop
FACTOR = 10.0
@strict_loop
def shifted(x):
    return x + 1.0
"""
LOOP = """
from helpers import FACTOR, shifted
from hexconformal.kernel import dot, loop
@loop
def run(x):
    return FACTOR * shifted(dot((x, x, x), (1.0, 1.0, 1.0)))
print(run(2.0), sum(run.compiled.stats.cache_hits.values()))
"""


@pytest.mark.long
def test_a_loop_is_compiled_anew_when_what_it_takes_from_other_files_changes(tmp_path):
    shutil.copytree(ROOT / "src/hexconformal", tmp_path / "hexconformal", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "helpers.py").write_text(HELPERS)
    (tmp_path / "loops.py").write_text(LOOP)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(tmp_path)}
    environment |= {"PYTHONDONTWRITEBYTECODE": "1"}  # a change within one second would not be seen in bytecode

    def result_and_hits(file="", old="", new=""):
        if file:
            source = (tmp_path / file).read_text()
            assert old in source
            (tmp_path / file).write_text(source.replace(old, new))
        command = [sys.executable, str(tmp_path / "loops.py")]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()

    assert result_and_hits() == ["70.0", "0"]
    assert result_and_hits() == ["70.0", "1"]
    # An algebra function of the package, a loop that is called, a constant; and one change taken back.
    assert result_and_hits("hexconformal/kernel/quaternion.py", "+ a[2] * b[2]", "- a[2] * b[2]") == ["30.0", "0"]
    assert result_and_hits("helpers.py", "x + 1.0", "x + 2.0") == ["40.0", "0"]
    assert result_and_hits("helpers.py", "FACTOR = 10.0", "FACTOR = 100.0") == ["400.0", "0"]
    assert result_and_hits("hexconformal/energy/target.py", "_BRICK = 0.8", "_BRICK = 0.9") == ["400.0", "1"]
    assert result_and_hits("hexconformal/kernel/quaternion.py", "- a[2] * b[2]\n", "+ a[2] * b[2]\n") == ["800.0", "0"]
