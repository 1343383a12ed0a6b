"""Types of cells by their meshio names: their numbers in VTK, and how many nodes they have."""

from __future__ import annotations

__all__ = ["MESHIO_TYPES", "NODE_COUNTS", "VTK_TYPES"]

# Those that meshio and VTK have alike, node by node. The wedge too: meshio itself turns it round for VTK,
# but VTK's positive wedge has the order of Gmsh, and pyvista leaves it so.
VTK_TYPES = {
    "vertex": 1,
    "line": 3,
    "triangle": 5,
    "polygon": 7,
    "quad": 9,
    "tetra": 10,
    "hexahedron": 12,
    "wedge": 13,
    "pyramid": 14,
    "line3": 21,
    "triangle6": 22,
    "quad8": 23,
    "tetra10": 24,
    "hexahedron20": 25,
    "wedge15": 26,
    "pyramid13": 27,
    "quad9": 28,
    "hexahedron27": 29,
    "wedge18": 32,
    "line4": 35,
    "VTK_LAGRANGE_CURVE": 68,
    "VTK_LAGRANGE_TRIANGLE": 69,
    "VTK_LAGRANGE_QUADRILATERAL": 70,
    "VTK_LAGRANGE_TETRAHEDRON": 71,
    "VTK_LAGRANGE_HEXAHEDRON": 72,
    "VTK_LAGRANGE_WEDGE": 73,
    "VTK_LAGRANGE_PYRAMID": 74,
}
MESHIO_TYPES = {code: name for name, code in VTK_TYPES.items()}
NODE_COUNTS = {
    "vertex": 1,
    "line": 2,
    "line3": 3,
    "triangle": 3,
    "triangle6": 6,
    "quad": 4,
    "quad8": 8,
    "quad9": 9,
    "tetra": 4,
    "tetra10": 10,
    "pyramid": 5,
    "pyramid13": 13,
    "pyramid14": 14,
    "wedge": 6,
    "wedge15": 15,
    "wedge18": 18,
    "hexahedron": 8,
    "hexahedron20": 20,
    "hexahedron27": 27,
}
