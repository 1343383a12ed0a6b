"""Decks of a unit cube, for tests of Abaqus and CalculiX files."""

import numpy as np

import hexconformal as hc

UNIT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float)
CUBE = "".join(f"{label}, {x}, {y}, {z}\n" for label, (x, y, z) in enumerate(UNIT.tolist(), 1))
BRICK = "*ELEMENT, TYPE=C3D8, ELSET=ALL\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"


def read(folder, text, **options):
    """The mesh of a deck, written to a.inp in a folder."""
    (folder / "a.inp").write_bytes(text if isinstance(text, bytes) else text.encode())
    return hc.read(folder / "a.inp", **options)
