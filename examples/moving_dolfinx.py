"""A mesh of DOLFINx follows its boundary, and an equation is solved on it at every step.

    python examples/moving_dolfinx.py

Needs DOLFINx; written for 0.5 (Debian 12: `apt install python3-dolfinx`, and an environment made with
`--system-site-packages`, in which `pip install . 'numpy<2'`). A box of hexahedra stands on a plate that bulges up to a
third of the box's height and back. The lid stays, the sides slide. At every step Laplace's equation is solved, with the
boundary values of a solution that is known, x^2 + y^2 - 2 z^2: its error says whether the mesh is any good.
"""

from __future__ import annotations

import numpy as np
from dolfinx import cpp, fem, mesh
from mpi4py import MPI
from petsc4py import PETSc
from ufl import TestFunction, TrialFunction, dx, grad, inner

import hexconformal as hc


def vtk_cells(domain: mesh.Mesh) -> np.ndarray:
    """(m, 8) nodes of the cells in VTK's order: DOLFINx has that of tensor products.

    They count the geometry's nodes, the rows of `domain.geometry.x`, not its vertices.
    """
    order = cpp.io.perm_vtk(mesh.CellType.hexahedron, 8)
    return domain.geometry.dofmap.array.reshape(-1, 8)[:, order]


def error_of_laplace(domain: mesh.Mesh) -> float:
    """L2 norm of the error of the solution on the mesh as it is."""
    space = fem.FunctionSpace(domain, ("Lagrange", 1))
    known = fem.Function(space)
    known.interpolate(lambda x: x[0] ** 2 + x[1] ** 2 - 2 * x[2] ** 2)
    domain.topology.create_connectivity(2, 3)
    nodes = fem.locate_dofs_topological(space, 2, mesh.exterior_facet_indices(domain.topology))
    u, v = TrialFunction(space), TestFunction(space)
    nothing = inner(fem.Constant(domain, PETSc.ScalarType(0)), v) * dx
    problem = fem.petsc.LinearProblem(inner(grad(u), grad(v)) * dx, nothing, bcs=[fem.dirichletbc(known, nodes)])
    difference = problem.solve() - known
    return float(np.sqrt(fem.assemble_scalar(fem.form(inner(difference, difference) * dx))))


def run(cells: int = 8, steps: int = 8) -> list[tuple[float, float, float, float]]:
    """Move the plate once up and down; rows of height, smallest scaled Jacobian, volume, and error.

    The whole mesh must be on one process: `MeshMotion` knows nothing of partitions.
    """
    domain = mesh.create_box(MPI.COMM_SELF, [[0, 0, 0], [1, 1, 1]], [cells] * 3, mesh.CellType.hexahedron)
    points, table = domain.geometry.x.copy(), vtk_cells(domain)
    plate, lid = (np.flatnonzero(np.isclose(points[:, 2], z)) for z in (0.0, 1.0))
    motion = hc.MeshMotion((points, table), moving=plate, fixed=lid)
    x, y = points[plate, 0], points[plate, 1]
    bulge = np.outer(np.sin(np.pi * x) * np.sin(np.pi * y), [0.0, 0.0, 1.0])
    volume = fem.form(fem.Constant(domain, PETSc.ScalarType(1)) * dx)
    rows = []
    for height in np.sin(np.linspace(0, np.pi, steps + 1)) / 3:
        step = motion.step(height * bulge, dt=1.0 / steps)
        if step.report.refused:
            raise SystemExit(step.report.reason)
        domain.geometry.x[:] = step.points  # step.velocity is that of the mesh, for a convective term
        worst = step.report.min_scaled_jacobian
        rows.append((float(height), worst, float(fem.assemble_scalar(volume)), error_of_laplace(domain)))
    return rows


if __name__ == "__main__":
    print("height  min scaled Jacobian  volume     error")
    for row in run():
        print("{:6.3f}  {:19.3f}  {:.6f}  {:.2e}".format(*row))
