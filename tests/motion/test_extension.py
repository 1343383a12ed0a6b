"""Displacements of the boundary carried into the mesh: linear fields, similarities."""

import numpy as np
import pytest
from meshes.hexahedra import turned

from hexconformal.generate import box
from hexconformal.motion.mesh_motion import MeshMotion


def test_harmonic_extension_of_a_linear_field_is_that_field():
    points, cells = box((5, 4, 3), (5.0, 4.0, 3.0))
    matrix = np.array([[0.1, 0.2, 0.0], [0.0, -0.1, 0.3], [0.05, 0.0, 0.1]])
    low, high = points.min(axis=0), points.max(axis=0)
    boundary = np.flatnonzero(((points == low) | (points == high)).any(axis=1))
    for operator in ("harmonic", "elastic"):
        motion = MeshMotion((points, cells), boundary, operator=operator)
        assert motion.step(points[boundary] @ matrix).points == pytest.approx(points + points @ matrix, abs=1e-8)


def test_conformal_motion_of_a_similarity_is_that_similarity():
    points, cells = box((4, 4, 4), (4.0, 4.0, 4.0))
    points = points + 0.1 * np.sin(3 * points[:, [1, 2, 0]])
    low, high = points.min(axis=0), points.max(axis=0)
    _, counts = np.unique(cells, return_counts=True)
    boundary = np.flatnonzero(counts < 8)
    assert (low < high).all()
    displacement = turned(1.3 * points, [1, 2, 3], 40) + 0.3 * points + [1, 2, 3]
    motion = MeshMotion((points, cells), boundary, energy_tolerance=1e-12)
    assert motion.step(displacement[boundary]).points == pytest.approx(points + displacement, abs=1e-5)
