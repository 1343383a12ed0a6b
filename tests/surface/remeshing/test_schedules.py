"""The tuned numbers of remeshing: told, checked, and passed through."""

from dataclasses import fields, replace

import numpy as np
import pytest
from meshes.surfaces import icosphere, shaken

import surface
from hexconformal.common import OptionError
from surface.remeshing.schedules import AcceptanceSchedule, RestartSchedule, Schedules, StepSchedule


def test_every_number_is_told_and_has_a_range():
    for part in fields(Schedules):
        schedule = getattr(Schedules(), part.name)
        for number in fields(schedule):
            assert number.name in type(schedule).__doc__
            assert "range" in number.metadata


def test_a_number_out_of_its_range_is_refused():
    with pytest.raises(OptionError, match=r"StepSchedule: damping_growth must lie in \[1, inf\], not 0.5"):
        StepSchedule(damping_growth=0.5)


@pytest.mark.parametrize(("restarts", "expected"), [(0, (np.inf,)), (1, (10, np.inf)), (3, (10, 1, 1, np.inf))])
def test_the_last_descent_has_all_patience(restarts, expected):
    assert RestartSchedule(restarts=restarts).patiences == expected


def test_a_run_takes_other_numbers():
    points, cells = shaken(icosphere(2), 0.05)
    mesh, choosy = (points, cells.triangles), replace(Schedules(), acceptance=AcceptanceSchedule(large_gain=0.99))
    for schedules, moved in ((None, True), (choosy, False)):
        run = surface.Remeshing(mesh, schedules=schedules)
        for _ in run:
            pass
        assert np.array_equal(run.result().points, points) is not moved
