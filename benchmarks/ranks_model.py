"""A model of runs on ranks, up to 10^8 cells: what `ranks.py` has counted on two ranks, and stated assumptions.

    python benchmarks/ranks_model.py figures.json       # the model from figures that ranks.py --figures has kept

What grows with the cells of a rank (work, memory) is taken from runs on one rank of two sizes, traffic from runs on two
ranks of the same sizes. How many copies a rank has, and how many ranks it exchanges with, is counted in the numbering
that the program uses, of a cube on 8, 64 and 512 ranks. A third size, on one rank and on two, is predicted beside what
was measured. Network and cores are those of `ASSUMED`.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

ASSUMED = {"message": 5e-6, "hop": 2e-6, "bandwidth": 0.4e9, "level": 6.0, "coarser": 27.0}
ASSUMPTIONS = """\
Assumed: a core as fast as one of this machine's while both work; 5 microseconds a message, 2 of the network and 3 of
Python; 2 microseconds times log2(ranks) a reduction; 0.4 GB/s a rank, which is 25 GB/s for 64 ranks of a node; nothing
is sent while a rank works, and none waits for another but for its share of the cells. Iterations grow with the
logarithm of the cells, from two sizes: this is the boldest part of it. The multigrid has a level more for each factor
of 27 in cells, with 6 messages more in a cycle to each rank beside. Set-up counts as work, as it was measured, not as
messages: of the multigrid it has some 400 reductions once. A fixed boundary needs nothing of rank 0; one that slides
does, and is not in this model. Memory is that of libraries and of own cells; besides, every rank has 2 kB times the
number of ranks for a moment, to share out nodes evenly."""
MANY = 10**5, 10**6, 10**7, 10**8
RANKS = 1, 10, 100, 1000, 10_000
LEAST = 10_000  # cells a rank, below which nothing is predicted: a rank waits more than it works there
CUBE, PARTS = 64, (8, 64, 512)  # cells along its edge, and ranks, of the cube in which copies are counted


@dataclass(frozen=True)
class Shares:
    """What ranks have of a cube, as the program numbers its nodes: the most of any of them.

    Attributes
    ----------
    copies
        Nodes of others that a rank has copies of, over the (2/3)rd power of its cells.
    beside
        Ranks that it has such copies of.
    uneven
        Cells over the mean.
    """

    copies: float
    beside: int
    uneven: float


def shares(size: int, ranks: int) -> Shares:
    """Count what ranks have of a cube of size^3 cells."""
    from hexconformal import generate
    from hexconformal.mesh import curve_positions

    points, cells = generate.box((size, size, size))
    keys, _ = curve_positions(points, 1.0)
    numbers = np.empty(len(points), dtype=np.int64)
    numbers[np.argsort(keys, kind="stable")] = np.arange(len(points))
    table = np.sort(numbers[cells], axis=1)
    owners = table * ranks // len(points)  # ranges of as many nodes each
    outside = owners != owners[:, :1]
    of, nodes = np.repeat(owners[:, 0], 8)[outside.ravel()], table[outside]
    pairs = np.unique(np.column_stack([of, nodes]), axis=0)
    copies = np.bincount(pairs[:, 0], minlength=ranks)
    met = np.unique(np.column_stack([pairs[:, 0], pairs[:, 1] * ranks // len(points)]), axis=0)
    counts = np.bincount(owners[:, 0], minlength=ranks)
    mean = len(cells) / ranks
    return Shares(
        float(copies.max() / mean ** (2 / 3)),
        int(np.bincount(met[:, 0], minlength=ranks).max()),
        float(counts.max() / mean),
    )


@dataclass(frozen=True)
class Model:
    """What a run costs; figures of two sizes, on one rank and on two, and shares on many ranks."""

    one: tuple[dict[str, Any], dict[str, Any]]
    two: tuple[dict[str, Any], dict[str, Any]]
    of_many: Shares

    def _grown(self, figures: tuple[dict[str, Any], dict[str, Any]], what: str, cells: float) -> float:
        """A figure that grows with the logarithm of the cells."""
        (a, b), (low, high) = ([one[key] for one in figures] for key in (what, "cells"))
        return float(a + (b - a) * np.log(cells / low) / np.log(high / low))

    def iterations(self, cells: float) -> float:
        """Iterations of a mesh of so many cells."""
        return self._grown(self.one, "iterations", cells)

    def share(self, ranks: int) -> Shares:
        """What the fullest of so many ranks has."""
        if ranks == 1:
            return Shares(0.0, 0, 1.0)
        if ranks == 2:
            two = self.two[1]
            return Shares(two["copies"] / (two["cells"] / 2) ** (2 / 3), 1, 1.0)
        return self.of_many

    def work(self, cells: float, ranks: int) -> float:
        """Seconds of the rank with the most cells: iterations, and what is done once."""
        larger = (self.two if ranks > 1 else self.one)[1]
        own = larger["cells"] / larger["ranks"]
        a_step = larger["iterated"] / larger["iterations"] / own
        once = (larger["work"] - larger["iterated"]) / own
        return (a_step * self.iterations(cells) + once) * cells / ranks * self.share(ranks).uneven

    def sent(self, cells: float, ranks: int) -> tuple[float, float, float]:
        """Bytes and messages that a rank sends in an iteration, and reductions."""
        share, two = self.share(ranks), self.two[1]
        copies = share.copies * (cells / ranks) ** (2 / 3)
        # Of two ranks one has the copies, and the other the nodes; of many each has both.
        a_copy = (two["bytes of all"] + two["multigrid bytes of all"]) / two["copies"]
        levels = max(np.log(cells / two["cells"]) / np.log(ASSUMED["coarser"]), 0.0)
        further = 2.0 * ASSUMED["level"] * two["cycles"] * levels  # there and back, as those of all are
        messages = two["messages of all"] + two["multigrid messages of all"] + further
        half = 0.5 if ranks == 2 else 1.0
        return half * a_copy * copies, half * messages * share.beside, two["reductions"] + two["multigrid reductions"]

    def seconds(self, cells: float, ranks: int) -> float:
        """Wall seconds of a run."""
        sent, messages, reductions = self.sent(cells, ranks)
        wait = messages * ASSUMED["message"] + sent / ASSUMED["bandwidth"]
        wait += reductions * ASSUMED["hop"] * np.log2(ranks)
        return float(self.work(cells, ranks) + self.iterations(cells) * wait)

    def memory(self, cells: float, ranks: int) -> float:
        """Peak GB of a rank."""
        small, large = self.one
        a_cell = (large["peak"] - small["peak"]) / (large["cells"] - small["cells"])
        return float(large["peak"] + a_cell * (cells / ranks * self.share(ranks).uneven - large["cells"]))


def lines(fitted: list[int], checked: list[int], known: dict[tuple[int, int], dict[str, Any]]) -> list[str]:
    """The model as Markdown: fitted to two sizes, checked with others."""
    first, last = fitted
    counted = [shares(CUBE, ranks) for ranks in PARTS]
    of_many = Shares(*(max(getattr(one, name) for one in counted) for name in ("copies", "beside", "uneven")))
    one, two = ((known[first, ranks], known[last, ranks]) for ranks in (1, 2))
    model = Model(one, two, of_many)
    text = [
        "",
        "## The model to 10^8 cells",
        "",
        ASSUMPTIONS,
        "",
        f"Fitted to {one[0]['cells']} and {one[1]['cells']} cells.",
        f"Of a cube of {CUBE}^3 cells, as the program numbers it, a rank has at most:",
        "",
        "| ranks | copies, over the (2/3)rd power of its cells | ranks that they are of | cells, over the mean |",
        "|" + "--:|" * 4,
        *(
            f"| {ranks} | {found.copies:.1f} | {found.beside} | {found.uneven:.2f} |"
            for ranks, found in zip(PARTS, counted, strict=True)
        ),
        "",
        "The largest of each is taken for ten ranks and more. Work is that of a rank of two: what it waits for in the",
        "multigrid counts as work there, so that the model is rather pessimistic where both processors had other work.",
        "",
        "What was measured, of sizes that it is not fitted to, and what it predicts:",
        "",
        "| cells | ranks | iterations | work s, most | peak GB, a rank | MB sent, a rank and iteration | messages | "
        "reductions |",
        "|" + "--:|" * 8,
    ]
    for size in checked:
        for ranks in (1, 2):
            if (size, ranks) in known:
                text.append(_beside(model, known[size, ranks]))
    head = " | ".join(f"{ranks} ranks" if ranks > 1 else "1 rank" for ranks in RANKS)
    text += [
        "",
        "Wall seconds (efficiency by them), GB a rank:",
        "",
        f"| cells | {head} |",
        "|" + "--:|" * (len(RANKS) + 1),
    ]
    for cells in MANY:
        cost = model.seconds(cells, 1)
        row = []
        for ranks in RANKS:
            if cells / ranks < LEAST:
                row.append("-")
                continue
            wall = model.seconds(cells, ranks)
            row.append(f"{wall:.3g} s ({cost / ranks / wall:.0%}), {model.memory(cells, ranks):.2f} GB")
        text.append(f"| {cells:.0e} | {' | '.join(row)} |".replace("e+0", "e"))
    most = 10**8, 1000
    sent, messages, reductions = model.sent(*most)
    text += [
        "",
        f"Of 10^8 cells a rank of a thousand sends {sent / 1e6:.2f} MB in {messages:.0f} messages an iteration, and",
        f"takes part in {reductions:.0f} reductions; in {model.iterations(most[0]):.0f} iterations",
        f"{model.work(*most):.1f} s of {model.seconds(*most):.1f} are work.",
    ]
    return text


def _beside(model: Model, found: dict[str, Any]) -> str:
    """Predicted figures beside measured ones: 'measured (predicted)'."""
    cells, ranks = found["cells"], found["ranks"]
    sent, messages, reductions = model.sent(cells, ranks)
    pairs = (
        (found["iterations"], model.iterations(cells), ".0f"),
        (found["work"], model.work(cells, ranks), ".2f"),
        (found["peak"], model.memory(cells, ranks), ".2f"),
        ((found["bytes"] + found["multigrid bytes"]) / 1e6, sent / 1e6, ".2f"),
        (found["messages"] + found["multigrid messages"], messages, ".0f"),
        (found["reductions"] + found["multigrid reductions"], reductions, ".0f"),
    )
    return f"| {cells} | {ranks} | " + " | ".join(f"{a:{form}} ({b:{form}})" for a, b, form in pairs) + " |"


if __name__ == "__main__":
    kept = json.loads(Path(sys.argv[1]).read_text())
    every = {(one["size"], one["ranks"]): one for one in kept["runs"]}
    print("\n".join(lines(kept["fitted"], kept["checked"], every)))
