"""Schedules: their numbers are checked and documented, and docs/mathematics.md says what they are."""

import importlib
import math
import pkgutil
import re
from dataclasses import fields, is_dataclass

import pytest
from paths import ROOT

import hexconformal
import surface
from hexconformal.common import OptionError, Schedule
from hexconformal.energy.convex_frames import JACOBIAN_WEIGHT, STEEP
from hexconformal.formulation import Schedules
from hexconformal.geometry import CreaseSchedule
from surface.energy import TurnedCellsSchedule
from surface.flow import FlowSchedule

WORDS = {1.0: "one", 0.5: "half", 0.25: "quarter", 0.2: "fifth", 0.1: "tenth", 0.05: "twentieth", 0.02: "fiftieth"}


def every_schedule():
    """All schedules there are, of either package."""
    for package in (hexconformal, surface):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith(("__main__", "plugin")):
                importlib.import_module(module.name)
    return sorted(
        (one for one in Schedule.__subclasses__() if one.__module__.startswith(("hexconformal.", "surface."))),
        key=lambda one: one.__name__,
    )


SCHEDULES = every_schedule()


def numbers(schedule):
    return [number for number in fields(schedule) if not is_dataclass(number.default)]


@pytest.mark.parametrize("schedule", SCHEDULES, ids=lambda one: one.__name__)
def test_every_number_is_documented_and_has_a_range(schedule):
    assert "\n    Attributes\n" in schedule.__doc__
    listed = re.findall(r"^    (\w.*)$", schedule.__doc__.partition("----------\n")[2], re.MULTILINE)
    named = {name for line in listed for name in line.split(", ")}
    assert named == {number.name for number in numbers(schedule)}
    for number in numbers(schedule):
        low, high = number.metadata["range"]
        values = number.default if isinstance(number.default, tuple) else (number.default,)
        assert all(low <= value <= high for value in values)


@pytest.mark.parametrize(
    ("schedule", "number"),
    [pytest.param(one, number, id=f"{one.__name__}.{number.name}") for one in SCHEDULES for number in numbers(one)],
)
def test_numbers_out_of_their_range_are_refused(schedule, number):
    low, high = number.metadata["range"]
    for wrong in (low - 1e-6, float("nan"), *([high + 1e-6] if high < float("inf") else [float("inf")])):
        with pytest.raises(OptionError, match=rf"{schedule.__name__}: {number.name} must lie in"):
            schedule(**{number.name: (wrong,) if isinstance(number.default, tuple) else wrong})


def test_every_stage_of_a_run_is_in_the_schedules_of_all():
    assert {type(getattr(Schedules(), stage.name)) for stage in fields(Schedules)} <= set(SCHEDULES)


def share(number):
    return f"a {WORDS[number]}"


def stated():
    """What docs/mathematics.md says of numbers, as they are."""
    all_of = Schedules()
    barrier, newton, low, worst = all_of.barrier, all_of.newton, all_of.minimization, all_of.worst_cells
    yield rf"$$ {barrier.attraction:g}\, t^2 + k\, "
    k = barrier.steepness * (barrier.wall - barrier.onset)
    yield rf"k = {k:g}, \quad t_0 = {barrier.onset:g}, \quad t_1 = {barrier.wall:g} \tag{{14}}"
    yield rf"$\varepsilon = b^2 / {2 * barrier.attraction:g}$"
    yield rf"at {share(barrier.curve_bound)} of the bound, with ${barrier.curve_attraction:g}\, t^2$"
    yield f"$t_0 = {barrier.curve_onset:g}$"
    yield f"by more than {share(barrier.tolerance)} of the bound"
    assert all_of.untangling.first_eps[0] == 1.0
    yield r"$\varepsilon$ begins at the size of the smallest determinant"
    yield f"or {all_of.untangling.least_sigma:g} if that is less"
    bounds = [share(bound) for bound in all_of.unfolding.wider_bounds]
    yield f"a bound of {bounds[0]} of the diagonal, or {bounds[1]}, or {bounds[2]}"
    yield f"{all_of.returning.steeper:g} times as steep whenever samples stay outside"
    weights = low.volume_weight, low.sizes_weight, low.target_sizes_factor
    yield "weight of {:g} ({:g} beside the distortion alone), or {:g} times that".format(*weights)
    yield f"solved to {share(newton.tolerance)} only"
    mesh, patch = (f"$2^{{{math.log2(number):g}}}$" for number in (newton.mesh_rounding, newton.patch_rounding))
    yield f"about {mesh} of the shortest edge there (in patches {patch}"
    yield f"with a part of the whole distortion beside ({worst.distortion_share:g})"
    yield rf"\quad c = {JACOBIAN_WEIGHT:g}, \qquad"
    yield f"with $t$ = {worst.stiffness:g} over the worst density"
    yield rf"$$ {low.proportion_weight:g} \left(x^2 + {STEEP:g} x^4\right)"
    yield rf"$\rho$ is {low.slender:g}, or what the cell has"
    yield f"how thin they are meant to be, and it is {low.slenderest:g}"
    yield rf"at most ${low.slenderest:g}$ over the ratio of the longest to the shortest edge"
    yield f"not below ${low.least_slender:g}$"
    yield f"Worst cells that stall below {worst.reopened:g}, and"
    yield f"by (9), up to a fullness of {worst.opened:g}, from"
    yield f"the worst cells are raised again, up to {worst.reopenings} times"
    yield f"raised as long as they are below {worst.poor:g}"
    flat = round(math.log10(all_of.untangling.flat))
    yield rf"is below $10^{{{flat}}}$, $F = J W^{{-1}}$, has next to no volume"
    yield f"a fullness below {all_of.thin.thin:g} are thickened together"
    assert all_of.thin.eps == 1.0
    yield "as large as the median of their determinants"
    yield f"below a fullness of {all_of.thin.steep:g}, by L-BFGS"
    yield f"at {all_of.thin.steep_eps:g} of the median of all determinants"
    assert barrier.thin == 1.5
    yield "thinner than two thirds of the bound"
    yield f"stronger, up to {barrier.most:g} times"
    assert 0.5**all_of.search.patience == 0.125
    yield "an eighth of it still does"
    yield f"it is a {WORDS[all_of.search.held_back[0]]} as long at these"
    yield f"and {share(TurnedCellsSchedule().tilt_stiffness)} of the stiffness against tilt"
    yield f"differ by more than {surface.Options().feature_angle:g} degrees"
    yield f"confirms it within {CreaseSchedule().alike:g} degrees"
    power = round(math.log10(surface.Options().eps))
    yield rf"$\hat\varepsilon = 10^{{{power}}}$ by default"
    yield f"no node goes farther than {WORDS[FlowSchedule().largest_displacement]} a mean edge"


@pytest.mark.parametrize("text", list(stated()))
def test_the_page_on_mathematics_says_what_the_numbers_are(text):
    page = " ".join((ROOT / "docs" / "mathematics.md").read_text(encoding="utf-8").split())
    assert text in page
