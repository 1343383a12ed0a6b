"""L-BFGS on quadratic cells, and where it ends."""

from __future__ import annotations

from collections.abc import Iterator

from ...solver import Iterate, lbfgs
from .setting import QuadraticSetting

__all__ = ["descent"]


def descent(setting: QuadraticSetting, current: Iterate, settled: float | None = None) -> Iterator[Iterate]:
    """Iterates of L-BFGS, until none is lower or two in a row win less than a share of the energy."""
    settled, slow = setting.schedule.settled if settled is None else settled, 0
    for iterate in lbfgs(current, setting.preconditioner(current.points), scaled=True):
        if iterate.step == 0.0:
            return
        yield iterate
        slow = slow + 1 if iterate.decrease <= settled * abs(iterate.energy) else 0
        if slow == 2:
            return
