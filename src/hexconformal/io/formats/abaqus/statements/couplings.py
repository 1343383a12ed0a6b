"""Pairs of nodes that a deck couples: *EQUATION with u_a - u_b = 0 or u_reference, and *MPC of types TIE and PIN.

Further terms, of a reference, say how far the two are displaced from each other, which is no matter to a mesh.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .....mesh import NodePairs
from .lines import Section, split_fields
from .tables import read_real

__all__ = ["Coupling", "Term", "pairs_of", "read_couplings"]

Find = Callable[[str], int | None]  # the row of a node by its label or a set of it alone; None for others

_TOGETHER = ("TIE", "PIN")  # types of *MPC with equal displacements


@dataclass(frozen=True)
class Term:
    """A term of a linear equation: label of a node, or name of a set, degree of freedom, and coefficient."""

    node: str
    freedom: int
    factor: float


@dataclass(frozen=True)
class Coupling:
    """An equation, or one line of *MPC as three of them; without terms where it is not understood."""

    title: str
    equations: tuple[tuple[Term, ...], ...] = ()


def read_couplings(section: Section) -> list[Coupling]:
    """What a section *EQUATION, *MPC or *TIE couples.

    >>> section = Section("EQUATION", "EQUATION", {}, 0, 1, 3, [1, 2], ["2", "4, 1, 1., 2, 1, -1."])
    >>> read_couplings(section)[0].equations[0][1]
    Term(node='2', freedom=1, factor=-1.0)
    """
    try:
        if section.keyword == "MPC":
            return [_of_mpc(section.title, split_fields(line)) for line in section.data]
        if section.keyword == "EQUATION" and not section.options:
            return list(_equations(section))
    except (ValueError, IndexError):
        pass
    return [Coupling(section.title)]


def _of_mpc(title: str, fields: list[str]) -> Coupling:
    kind, *nodes = [field for field in fields if field]
    if kind.upper() not in _TOGETHER or len(nodes) != 2:
        return Coupling(title)
    return Coupling(title, tuple((Term(nodes[0], k, 1.0), Term(nodes[1], k, -1.0)) for k in (1, 2, 3)))


def _equations(section: Section) -> Iterable[Coupling]:
    lines = iter(section.data)
    for line in lines:
        count, fields = int(split_fields(line)[0]), list[str]()
        while len(fields) < 3 * count:
            found = split_fields(next(lines, ""))
            if not any(found):
                raise ValueError("fewer terms than announced")
            fields += found[:-1] if found[-1] == "" else found
        terms = [
            Term(node, int(freedom), read_real(factor))
            for node, freedom, factor in zip(fields[::3], fields[1::3], fields[2::3], strict=True)
        ]
        yield Coupling(section.title, (tuple(terms),))


def pairs_of(couplings: Iterable[tuple[Coupling, Find]], in_cells: NDArray[np.bool_]) -> tuple[NodePairs, ...]:
    """The pairs of nodes whose three displacements are coupled, and the count of what is not understood.

    Parameters
    ----------
    couplings
        Each with the rows of nodes by their names, where it stands.
    in_cells
        (n,) nodes of cells; others are references.
    """
    freedoms: dict[tuple[str, int, int], set[int]] = {}
    uses: Counter[tuple[str, int, int]] = Counter()
    others: Counter[str] = Counter()
    for coupling, find in couplings:
        pairs = [_pair(terms, find, in_cells) for terms in coupling.equations]
        if not pairs or None in pairs:
            others[coupling.title] += 1
            continue
        for first, second, freedom in (pair for pair in pairs if pair is not None):
            freedoms.setdefault((coupling.title, first, second), set()).add(freedom)
            uses[coupling.title, first, second] += 1
    for key, found in freedoms.items():
        if found != {1, 2, 3}:
            others[key[0]] += uses[key]
    left_out = ", ".join(f"{count} *{title}" for title, count in others.items())
    kept = [key for key, found in freedoms.items() if found == {1, 2, 3}]
    result = []
    for title in dict.fromkeys(title for title, _, _ in kept):
        nodes = np.array([pair for key, *pair in kept if key == title], dtype=np.int64)
        result.append(NodePairs(nodes, f"*{title}", several=True))
    if left_out:
        result.append(NodePairs(np.empty((0, 2), np.int64), "the deck", left_out=left_out))
    return tuple(result)


def _pair(terms: tuple[Term, ...], find: Find, in_cells: NDArray[np.bool_]) -> tuple[int, int, int] | None:
    """The two nodes of an equation, and the degree of freedom; None where it is of another kind."""
    found = [(find(term.node), term) for term in terms]
    own = [(row, term) for row, term in found if row is not None and in_cells[row]]
    if len(own) < 2 or any(row is None for row, _ in found):
        return None
    (first, one), (second, other) = own[:2]
    opposite = one.factor == -other.factor != 0.0 and one.freedom == other.freedom
    if first is None or second is None or first == second or not opposite or one.freedom not in (1, 2, 3):
        return None
    return first, second, one.freedom
