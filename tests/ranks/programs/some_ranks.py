"""A motion of the first ranks alone, into the file that is named: the last rank has nothing to do with it."""

import sys

import numpy as np
from motion_cases import TIGHT, lid
from mpi4py import MPI

from hexconformal import MeshMotion
from hexconformal.ranks import MeshPiece

world = MPI.COMM_WORLD
works = world.rank < world.size - 1
comm = world.Split(int(works))
if works:
    mesh, moves, _, ways = lid()
    mine = np.arange(len(mesh.cells))[comm.rank :: comm.size]
    nodes, local = np.unique(mesh.cells[mine], return_inverse=True)
    piece = MeshPiece(mesh.points[nodes], local.reshape(-1, 8), node_ids=nodes, cell_ids=mine)
    moving = np.flatnonzero(moves[nodes])
    step = MeshMotion(piece, moving, comm=comm, **TIGHT).step(ways[0][nodes[moving]])
    found = comm.gather((nodes, step.points))
    points = np.empty_like(mesh.points)
    for ids, rows in found or ():
        points[ids] = rows
    if comm.rank == 0:
        np.savez(sys.argv[1], points=points)
comm.Free()
world.Barrier()
