"""The entities of the geometry that a file of Gmsh names: their physical groups, and what partitions them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .sections import Encoding, Numbers

__all__ = ["Entities", "Entity", "read_entities", "read_partitioned_entities", "read_physical_names"]


@dataclass(frozen=True)
class Entity:
    """Physical groups of a point, curve, surface or volume of the geometry, and what bounds it.

    Of part of one that is partitioned, `parent` is the dimension and tag of the whole, `partition` the first of its
    partitions (0: it is not partitioned).
    """

    physical: tuple[int, ...]
    bounding: Any
    parent: tuple[int, int] | None = None
    partition: int = 0


Entities = dict[tuple[int, int], Entity]  # by dimension and tag


def read_physical_names(body: bytes) -> dict[str, tuple[int, int]]:
    """Number and dimension of each physical group that has a name.

    >>> read_physical_names(b'1\\n3 7 "left half"\\n')
    {'left half': (7, 3)}
    """
    found = {}
    for line in body.decode("utf-8", "surrogateescape").splitlines()[1:]:
        dimension, number, name = line.split(maxsplit=2)
        found[name.strip().strip('"')] = int(number), int(dimension)
    return found


def read_entities(body: bytes, encoding: Encoding) -> Entities:
    """The body of $Entities."""
    numbers = Numbers(body, encoding, "Entities")
    found: Entities = {}
    for dimension, count in enumerate(numbers.take("size", 4).tolist()):
        for _ in range(count):
            tag = numbers.one("int")
            found[dimension, tag] = Entity(*_rest(numbers, dimension))
    return found


def read_partitioned_entities(body: bytes, encoding: Encoding) -> Entities:
    """The body of $PartitionedEntities."""
    numbers = Numbers(body, encoding, "PartitionedEntities")
    numbers.one("size")
    numbers.take("int", 2 * numbers.one("size"))  # ghosts are entities of cells that are there besides
    found: Entities = {}
    for dimension, count in enumerate(numbers.take("size", 4).tolist()):
        for _ in range(count):
            tag, *parent = numbers.take("int", 3).tolist()
            partitions = numbers.take("int", numbers.one("size"))
            rest = _rest(numbers, dimension)
            found[dimension, tag] = Entity(*rest, (parent[0], parent[1]), int(partitions[0]) if len(partitions) else 0)
    return found


def _rest(numbers: Numbers, dimension: int) -> tuple[tuple[int, ...], Any]:
    numbers.take("double", 3 if dimension == 0 else 6)  # the box around it
    physical = tuple(numbers.take("int", numbers.one("size")).tolist())
    return physical, numbers.take("int", numbers.one("size")) if dimension else None
