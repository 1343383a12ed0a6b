"""Random meshes with random options: what is promised holds (benchmarks/soak.py has many more of them)."""

import dataclasses

import numpy as np
import pytest
import soak
from hypothesis import given, settings
from hypothesis import strategies as st

SOME = settings(max_examples=15, deadline=None, derandomize=True, database=None)
FEW = settings(SOME, max_examples=4)  # what cannot be untangled is tried in many ways


@pytest.mark.long
@pytest.mark.parametrize("kind", soak.KINDS)
def test_promises_are_kept(kind):
    @(FEW if kind == "tangled" else SOME)
    @given(seed=st.integers(0, 2**32 - 1))
    def check(seed):
        what, case, said = soak.verdict(kind, seed)
        assert what in ("kept", "refused"), f"{case.traits}, {case.options}, left {case.leave}: {said}"

    check()


def test_a_broken_promise_is_noticed(monkeypatch):
    def spoiled(self, leave=None, meshes=None):
        """The input, but for the first cell turned inside out."""
        for _ in self:
            break
        result = self.result()
        points, cell = np.array(self.mesh.points), self.mesh.cells[0]
        points[cell[0]] += 2 * (points[cell[6]] - points[cell[0]])
        return dataclasses.replace(result, points=points)

    monkeypatch.setattr(soak, "_left", spoiled)
    broken = set()
    for seed in range(5):
        rng = np.random.default_rng(seed)
        case = soak.hexahedra(rng)
        case.options["boundary"] = "fixed"
        broken |= set(soak.judge_hexahedra(case, rng))
    assert {"valid cells stay valid", "what is held stays, bit for bit"} <= broken
