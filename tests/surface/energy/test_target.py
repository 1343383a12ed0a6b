"""What cells of a surface should be conformal to: angles that suit the valences, shapes from angles, and refusals."""

import numpy as np
import pytest
from meshes.surfaces import icosphere, no_cells

from hexconformal.common.errors import OptionError
from hexconformal.geometry import Faces, corner_angles, face_areas
from surface.energy.target import flat_angles, target_shapes, triangle_from_angles


@pytest.mark.parametrize("valence", [3, 4, 5, 6, 7, 8, 16])
def test_flat_angles_are_positive_for_every_valence(valence):
    ring = np.arange(1, valence + 1)
    cells = Faces(np.stack([np.zeros(valence, int), ring, np.roll(ring, -1)], axis=1), no_cells(4))
    angles = flat_angles(cells, valence + 1)
    assert (angles > 0.05).all()
    assert angles.sum(axis=1) == pytest.approx(np.pi)
    closed = flat_angles(icosphere(1)[1], 42)
    assert (closed > 0.05).all()


def test_triangles_from_angles_have_these_angles_and_one_area():
    angles = np.array([[0.5, 1.0, np.pi - 1.5], [np.pi / 3] * 3])
    shapes = triangle_from_angles(angles)
    flat = np.concatenate([shapes, np.zeros((2, 3, 1))], axis=2).reshape(-1, 3)
    cells = Faces(np.arange(6).reshape(2, 3), no_cells(4))
    assert face_areas(flat, cells) == pytest.approx(np.sqrt(3) / 4)
    assert corner_angles(flat, cells.triangles) == pytest.approx(angles)


def test_target_shapes_are_checked():
    points, cells = icosphere(1)
    with pytest.raises(OptionError, match="target mesh"):
        target_shapes(np.zeros((3, 3)), points, cells)
    with pytest.raises(OptionError, match="flat"):
        target_shapes("round", points, cells)
    with pytest.raises(OptionError, match="must have an area"):
        target_shapes((np.zeros((80, 3, 2)), np.zeros((0, 4, 2))), points, cells)
