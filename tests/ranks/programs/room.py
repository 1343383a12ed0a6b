"""A mesh whose folded cells are more than one rank may get: every rank is told so before the work."""

import sys
from dataclasses import replace

import numpy as np
from cases import folded_cube
from mpi4py import MPI

from hexconformal import OptionError, Regularization
from hexconformal.formulation import Schedules
from hexconformal.ranks import MeshPiece

comm = MPI.COMM_WORLD
points, cells = folded_cube()
mine = np.arange(comm.rank, len(cells), comm.size)
nodes, local = np.unique(cells[mine], return_inverse=True)
piece = MeshPiece(points[nodes], local.reshape(-1, 8), node_ids=nodes, cell_ids=mine)
little = Schedules(unfolding=replace(Schedules().unfolding, whole=10, gathered=20))
said = ""
try:
    Regularization(piece, None, little, comm=comm)
except OptionError as problem:
    said = str(problem)
said = comm.gather(said)
if comm.rank == 0:
    np.savez(sys.argv[1], said=np.array(said))
