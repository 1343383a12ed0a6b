"""Sets of a deck, by their names: of nodes, of cells, of their sides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ....common import ReadError
from .members import Cells, Member
from .statements import (
    SURFACE,
    LabelIndex,
    SetKey,
    SetMember,
    WorkLimit,
    resolve,
    sides_of,
)

__all__ = ["NamedSets"]

Ints = NDArray[np.int64]


class NamedSets:
    """The sets of all members; one of an instance is called by its own name if no other has it."""

    def __init__(self, members: list[Member], nodes: list[LabelIndex], cells: Cells, limit: WorkLimit) -> None:
        self._nodes, self._cells, self._limit = nodes, cells, limit
        self._by_name = {member.name.upper(): number for number, member in enumerate(members) if member.name}
        self._members: dict[SetKey, list[SetMember]] = {}
        self._names: dict[SetKey, str] = {}
        for number, member in enumerate(members):
            for scope in member.scopes:
                for (kind, key), listed in scope.sets.items():
                    self._members.setdefault((number, kind, key), []).extend(listed)
                    self._names[number, kind, key] = scope.set_names[kind, key]
        for place, lists in self._members.items():
            if place[1].startswith(SURFACE):
                self._members[place] = [replace(one, names=self._known(place[0], one)) for one in lists]
        self._sections = [
            (number, "ELSET", name.upper())
            for number, member in enumerate(members)
            for scope in member.scopes
            for name in scope.sections
        ]
        self._owner_names = [member.name for member in members]
        self._rows = resolve(self._members, self._references, self._combine)

    def named(self, kind: str) -> dict[str, Ints]:
        """Rows of the sets of a kind, by name."""
        return {name: self._rows[key] for key, name in self._full_names(kind).items()}

    def of_sections(self) -> tuple[str, ...]:
        """Names of the sets that sections give a material, each once."""
        names = self._full_names("ELSET")
        return tuple(names[key] for key in dict.fromkeys(self._sections) if key in names)

    def _full_names(self, kind: str) -> dict[SetKey, str]:
        keys = [key for key in self._members if key[1] == kind]
        uses: dict[str, int] = {}
        for _, _, name in keys:
            uses[name] = uses.get(name, 0) + 1
        result = {}
        for key in keys:
            number, _, name = key
            owner = self._owner_names[number]
            result[key] = f"{owner}.{self._names[key]}" if owner and uses[name] > 1 else self._names[key]
        return result

    def faces(self) -> dict[str, Ints]:
        """Faces of the surfaces, by name."""
        found: dict[str, list[Ints]] = {}
        for kind in dict.fromkeys(key[1] for key in self._members if key[1].startswith(SURFACE)):
            for name, rows in self.named(kind).items():
                sides = sides_of(self._cells.nodes, self._cells.by_type(rows), kind.removeprefix(SURFACE))
                found.setdefault(name, []).append(sides)
        return {name: np.concatenate(parts) for name, parts in found.items()}

    def _known(self, number: int, member: SetMember) -> tuple[str, ...]:
        """The names in a surface that mean something: others, such as those of rigid surfaces, do not matter here."""

        def is_known(name: str) -> bool:
            try:
                self._key(number, "ELSET", name, member)
            except ReadError:
                return False
            return True

        return tuple(filter(is_known, member.names))

    def single(self, number: int, name: str) -> int | None:
        """The node of a set of it alone, by its name in a member; None if there is none."""
        instance, dot, rest = name.rpartition(".")
        place = self._by_name.get(instance.upper()) if dot else number
        rows = self._rows.get((number if place is None else place, "NSET", (rest if dot else name).upper()))
        return int(rows[0]) if rows is not None and len(rows) == 1 else None

    def _places(self, number: int, member: SetMember) -> list[int]:
        """Numbers of the members in which names are looked for."""
        if not member.instance:
            return [number]
        if member.instance.upper() not in self._by_name:
            raise ReadError(f"a set is of the instance {member.instance!r}, which is not there")
        return [self._by_name[member.instance.upper()], number]

    def _key(self, number: int, kind: str, name: str, member: SetMember) -> SetKey | None:
        """The set that a name in another set means; None if it means a label."""
        instance, dot, rest = name.partition(".")
        places = self._places(number, member)
        if dot and instance.upper() in self._by_name:
            if rest.isdecimal():
                return None
            places, name = [self._by_name[instance.upper()]], rest
        for place in places:
            if (place, kind, name.upper()) in self._members:
                return (place, kind, name.upper())
        raise ReadError(f"a set refers to {name!r}, which is not a set")

    def _references(self, key: SetKey) -> list[SetKey]:
        number, kind, _ = key
        found = []
        for member in self._members[key]:
            found += [self._key(number, _listed(kind), name, member) for name in member.names]
            if member.elements:
                found.append(self._key(number, "ELSET", member.elements, member))
        return [other for other in dict.fromkeys(found) if other is not None]

    def _combine(self, key: SetKey, others: list[Ints]) -> Ints:
        number, kind, _ = key
        indices = self._nodes if kind == "NSET" else self._cells.indices
        parts = [np.empty(0, dtype=np.int64)]
        for other, rows in zip(self._references(key), others, strict=True):
            parts.append(self._cells.nodes_of(rows) if other[1] != _listed(kind) else rows)
        for member in self._members[key]:
            index = indices[self._places(number, member)[0]]
            parts += [index.of_present(member.labels), index.of_ranges(member.ranges, self._limit)]
            for name in member.names:
                if self._key(number, _listed(kind), name, member) is None:
                    instance, _, label = name.partition(".")
                    parts.append(indices[self._by_name[instance.upper()]].of_present(np.array([int(label)])))
        self._limit.spend(sum(len(part) for part in parts))
        return np.unique(np.concatenate(parts))


def _listed(kind: str) -> str:
    """The kind of sets that one of a kind may list."""
    return "ELSET" if kind.startswith(SURFACE) else kind
