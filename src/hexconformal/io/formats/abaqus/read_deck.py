"""Reads the statements of a deck."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from ...cell_types import NODE_COUNTS
from .deck import Deck, ElementBlock, Instance, NodeBlock, Scope
from .generation import Generator
from .statements import (
    SURFACE,
    Section,
    SetMember,
    System,
    cell_type_of,
    in_vtk_order,
    read_couplings,
    read_integers,
    read_members,
    read_nodes,
    read_placement,
    read_sides,
    read_system,
    sections,
    split_fields,
)

__all__ = ["read_deck"]

Ints = NDArray[np.int64]

_REFUSED = {
    "NMAP": "put the mapped coordinates into *NODE",
    "NFILL": "write the nodes out",
    "NCOPY": "write the nodes out",
    "ELCOPY": "write the elements out",
    "SYMMETRICMODELGENERATION": "write the mesh out",
}
_MESH_KEYWORDS = {"HEADING", "NODE", "ELEMENT", "NSET", "ELSET", "ENDPART", "ENDINSTANCE", "ENDASSEMBLY"}


def read_deck(lines: list[str]) -> Deck:
    """Read the lines of a deck.

    Raises
    ------
    ReadError
        If a statement changes the mesh and is not supported, or is malformed.
    """
    reader = _Reader()
    handlers = {
        "NODE": reader.node,
        "NGEN": reader.ngen,
        "ELEMENT": reader.element,
        "ELGEN": reader.elgen,
        "NSET": reader.node_or_element_set,
        "ELSET": reader.node_or_element_set,
        "SURFACE": reader.surface,
        "EQUATION": reader.couplings,
        "MPC": reader.couplings,
        "TIE": reader.couplings,
        "SYSTEM": reader.system,
        "PART": reader.part,
        "ENDPART": reader.end_part,
        "ASSEMBLY": reader.assembly,
        "ENDASSEMBLY": reader.end_assembly,
        "INSTANCE": reader.instance,
        "ENDINSTANCE": reader.end_instance,
    }
    for section in sections(lines):
        if section.keyword in _REFUSED:
            raise ReadError(f"*{section.title} is not supported: {_REFUSED[section.keyword]}")
        if section.keyword in handlers:
            handlers[section.keyword](section)
        elif section.keyword.endswith("SECTION") and section.options.get("ELSET"):
            reader.scope.sections.append(section.options["ELSET"])
        if section.keyword not in _MESH_KEYWORDS:
            reader.deck.keywords[section.title] += 1
    if reader.scope is not reader.deck.root:
        raise ReadError("a part, an instance or the assembly has no end: the file is truncated")
    return reader.deck


class _Reader:
    def __init__(self) -> None:
        self.deck = Deck()
        self.scope = self.deck.root
        self._generator = Generator()
        self._instances: set[str] = set()

    def node(self, section: Section) -> None:
        kind = section.options.get("SYSTEM", "R").upper()[:1]
        if kind not in ("R", "C", "S"):
            raise ReadError(f"*NODE with SYSTEM={section.options['SYSTEM']} is not supported: R, C and S are")
        labels, coordinates = read_nodes(section.data)
        self.scope.nodes.append(NodeBlock(section, labels, coordinates, System(kind, self.scope.frame)))  # type: ignore[arg-type]
        self.scope.extend("NSET", section.options.get("NSET"), [SetMember(labels)])

    def ngen(self, section: Section) -> None:
        block, members = self._generator.nodes(self.scope, section)
        self.scope.nodes.append(block)
        self.scope.extend("NSET", section.options.get("NSET"), [SetMember(members)])

    def element(self, section: Section) -> None:
        name = section.options.get("TYPE", "")
        cell_type = cell_type_of(name)
        # Elements of the assembly may have nodes of instances: 1, PART-1.5, PART-1.7.
        if cell_type is None or (self.scope is self.deck.assembly and any("." in line for line in section.data)):
            self._set_aside(section, name or "(none)")
            return
        width = 1 + NODE_COUNTS[cell_type]
        table = read_integers(section.data)
        if len(table) % width:
            raise ReadError(
                f"elements of type {name} have {width - 1} nodes each: one has too few or too many, "
                "or the file is truncated"
            )
        table = table.reshape(-1, width)
        labels, nodes = table[:, 0], in_vtk_order(cell_type, table[:, 1:])
        self.scope.elements.append(ElementBlock(name.upper(), cell_type, labels, nodes))
        self.scope.extend("ELSET", section.options.get("ELSET"), [SetMember(labels)])

    def _set_aside(self, section: Section, name: str) -> None:
        count, goes_on = 0, False
        for line in section.data:
            fields = [part for part in split_fields(line) if part]
            self.scope.held.extend(fields if goes_on else fields[1:])
            count += not goes_on
            goes_on = line.endswith(",")
        self.deck.set_aside[name] += count
        self.scope.extend("ELSET", section.options.get("ELSET"), [])

    def elgen(self, section: Section) -> None:
        blocks, members = self._generator.elements(self.scope, section)
        self.scope.elements.extend(blocks)
        self.scope.extend("ELSET", section.options.get("ELSET"), [SetMember(members)])

    def node_or_element_set(self, section: Section) -> None:
        self.scope.extend(section.keyword, section.options.get(section.keyword), [read_members(section)])

    def surface(self, section: Section) -> None:
        if section.options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            for side, member in read_sides(section):
                self.scope.extend(SURFACE + side, section.options.get("NAME"), [member])

    def couplings(self, section: Section) -> None:
        self.scope.couplings.extend(read_couplings(section))

    def system(self, section: Section) -> None:
        self.scope.frame = read_system(section.data)

    def part(self, section: Section) -> None:
        name = section.options.get("NAME", "")
        self._must_be_in(self.deck.root, section)
        if name.upper() in self.deck.parts:
            raise ReadError(f"there are two parts {name!r}")
        self.scope = self.deck.parts[name.upper()] = Scope(name, section)

    def end_part(self, section: Section) -> None:
        self._must_end("PART", section)
        self.scope.end = section.head + 1
        self.scope = self.deck.root

    def assembly(self, section: Section) -> None:
        self._must_be_in(self.deck.root, section)
        self.scope = self.deck.assembly

    def end_assembly(self, section: Section) -> None:
        self._must_be_in(self.deck.assembly, section)
        self.scope = self.deck.root

    def instance(self, section: Section) -> None:
        options = section.options
        if "INSTANCE" in options or "LIBRARY" in options:
            raise ReadError("*INSTANCE of a previous analysis is not supported: write its mesh into the deck")
        self._must_be_in(self.deck.assembly, section)
        name, part = options.get("NAME", ""), options.get("PART", "")
        if part.upper() not in self.deck.parts:
            raise ReadError(f"the instance {name!r} is of the part {part!r}, which is not there")
        if name.upper() in self._instances:
            raise ReadError(f"there are two instances {name!r}")
        self._instances.add(name.upper())
        self.scope = Scope(name, section)
        place = read_placement(section.data)
        self.deck.instances.append(Instance(self.deck.parts[part.upper()], self.scope, place))

    def end_instance(self, section: Section) -> None:
        self._must_end("INSTANCE", section)
        self.scope = self.deck.assembly

    def _must_end(self, keyword: str, section: Section) -> None:
        if self.scope.section is None or self.scope.section.keyword != keyword:
            raise ReadError(f"*{section.title} is out of place: there is nothing to end")

    def _must_be_in(self, scope: Scope, section: Section) -> None:
        if self.scope is not scope:
            raise ReadError(f"*{section.title} is out of place: what comes before it has no end")
