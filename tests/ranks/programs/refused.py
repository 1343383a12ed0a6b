"""What is refused before the work: every rank is told so."""

import sys
from dataclasses import replace

import numpy as np
from cases import folded_cube, two_materials
from mpi4py import MPI

from hexconformal import OptionError, Options, Regularization
from hexconformal.formulation import Schedules
from hexconformal.ranks import MeshPiece

comm = MPI.COMM_WORLD


def said(mesh, options=None, schedules=None, values=None):
    """What each rank is told of a mesh, of which the last rank has no cells; values on cells may depend on ranks."""
    points, cells = mesh[:2]
    mine = np.arange(comm.rank, len(cells), comm.size - 1) if comm.rank < comm.size - 1 else np.empty(0, np.int64)
    nodes, local = np.unique(cells[mine], return_inverse=True)
    data = {} if values is None or len(mine) == 0 else {"kind": values[mine]}
    piece = MeshPiece(points[nodes], local.reshape(-1, 8), {}, data, node_ids=nodes, cell_ids=mine)
    if callable(options):
        options = options(mine)
    told = ""
    try:
        Regularization(piece, options, schedules, comm=comm)
    except OptionError as problem:
        told = str(problem)
    return np.array(comm.allgather(told))


mesh = two_materials()
kind = mesh[3]["material"].astype(float)
odd = np.where(np.arange(len(kind)) == 0, 0.5, kind)
little = Schedules(unfolding=replace(Schedules().unfolding, whole=10, gathered=20))
found = {
    "room": said(folded_cube(), None, little),
    "no such array": said(mesh, Options(interfaces="phase"), values=kind),
    "no integers on a rank": said(mesh, Options(interfaces="kind"), values=odd),
    "too few numbers on a rank": said(mesh, lambda mine: Options(interfaces=kind[mine][: 50 - 25 * comm.rank])),
    "named": said(mesh, Options(interfaces="kind"), values=kind),
}
if comm.rank == 0:
    np.savez(sys.argv[1], **found)
