"""What a deck says of its mesh: nodes, elements and sets, in parts, instances and the assembly."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .statements import Coupling, Placement, Section, SetMember, System

__all__ = ["Deck", "ElementBlock", "Instance", "NodeBlock", "Scope"]

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class NodeBlock:
    """Nodes of one section: their labels (n,), coordinates (n, 3) in their system, and the lines that they are on.

    Nodes that a section generates are on none of their own.
    """

    section: Section
    labels: Ints
    coordinates: NDArray[np.float64]
    system: System
    generated: bool = False


@dataclass(frozen=True, eq=False)
class ElementBlock:
    """Elements of one type: its name, the cells they are, their labels (k,) and the labels of their nodes (k, w)."""

    name: str
    cell_type: str
    labels: Ints
    nodes: Ints


@dataclass(eq=False)
class Scope:
    """Where labels and names of sets are unique: the deck itself, a part, an instance, the assembly.

    Attributes
    ----------
    name
        Of a part or an instance, otherwise "".
    section, end
        The keyword that a part or an instance begins with, and the line that a part ends before.
    nodes, elements
        In order.
    sets
        What sets list, by "NSET", "ELSET" or "SURFACE" with a side, and the name in capitals.
    set_names
        Their names as they are written.
    sections
        Names of the sets of elements that sections give a material.
    held
        Labels of nodes of elements that are set aside.
    couplings
        Equations and other couplings of nodes.
    frame
        The frame that *SYSTEM says for the nodes that follow.
    """

    name: str = ""
    section: Section | None = None
    end: int = 0
    nodes: list[NodeBlock] = field(default_factory=list)
    elements: list[ElementBlock] = field(default_factory=list)
    sets: dict[tuple[str, str], list[SetMember]] = field(default_factory=dict)
    set_names: dict[tuple[str, str], str] = field(default_factory=dict)
    sections: list[str] = field(default_factory=list)
    held: list[str] = field(default_factory=list)
    couplings: list[Coupling] = field(default_factory=list)
    frame: Placement = field(default_factory=Placement)

    def extend(self, kind: str, name: str | None, members: list[SetMember]) -> None:
        """Make a set, or let it grow if it is named again; names do not differ in case alone."""
        if name:
            self.set_names.setdefault((kind, name.upper()), name)
            self.sets.setdefault((kind, name.upper()), []).extend(members)


@dataclass(frozen=True, eq=False)
class Instance:
    """A part in its place, and what the instance adds to it."""

    part: Scope
    own: Scope
    place: Placement


@dataclass(eq=False)
class Deck:
    """All of it.

    Attributes
    ----------
    root, assembly
        What is in no part.
    parts
        By name in capitals.
    instances
        In order.
    set_aside
        How many elements there are of types that are not known.
    keywords
        How often keywords are there that are not about nodes, elements and sets.
    """

    root: Scope = field(default_factory=Scope)
    assembly: Scope = field(default_factory=Scope)
    parts: dict[str, Scope] = field(default_factory=dict)
    instances: list[Instance] = field(default_factory=list)
    set_aside: Counter[str] = field(default_factory=Counter)
    keywords: Counter[str] = field(default_factory=Counter)
