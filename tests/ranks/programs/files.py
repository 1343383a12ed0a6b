"""Read, share out, write and read again: a file on so many ranks; what arrives is saved in the order of its ids."""

import sys

import numpy as np
from mpi4py import MPI

from hexconformal.ranks import RankSpace, distributed, on_every_machine, read_piece, write_piece

comm = MPI.COMM_WORLD
FLAGS = np.array([True, False, True])
source, between, target = sys.argv[1:]


def whole(piece):
    """Points, cells and arrays of all ranks, in the order of their ids."""
    everything = comm.allgather(
        (piece.node_ids, piece.points, piece.cell_ids, piece.node_ids[piece.cells], piece.point_data, piece.cell_data)
    )
    nodes, first = np.unique(np.concatenate([one[0] for one in everything]), return_index=True)
    cells, order = np.unique(np.concatenate([one[2] for one in everything]), return_index=True)
    found = {"nodes": nodes, "points": np.concatenate([one[1] for one in everything])[first]}
    found |= {"cell ids": cells, "cells": np.concatenate([one[3] for one in everything])[order]}
    # A rank that has nothing need not have the arrays.
    for name in comm.bcast(list(piece.point_data)):
        found[f"at points: {name}"] = np.concatenate([one[4][name] for one in everything if name in one[4]])[first]
    for name in comm.bcast(list(piece.cell_data)):
        found[f"at cells: {name}"] = np.concatenate([one[5][name] for one in everything if name in one[5]])[order]
    assert sum(len(one[2]) for one in everything) == len(cells)
    return found


first = read_piece(source, comm)
shared = distributed(first, comm).piece
write_piece(between, shared, comm)
stages = {"read": first, "shared": shared, "again": read_piece(between, comm)}
found = {f"{stage}, {key}": value for stage, piece in stages.items() for key, value in whole(piece).items()}
values = np.random.default_rng(1).normal(size=(2, 101)) * [[1.0], [1e-300]]
space, mine = RankSpace.of_cells(comm), slice(comm.rank, None, comm.size)
found["values"], found["medians"] = values, np.array([space.median(row[mine]) for row in values])
found["percentiles"] = space.percentiles(values[:, mine], (1, 5, 25, 50, 75, 95, 99))
# Ranks of a machine have the same memory: what one writes there all see.
shared = on_every_machine(
    comm, {"empty": np.empty(0), "values": values, "pair": (3, FLAGS)} if comm.rank == 0 else None
)
found["shared"] = np.array(comm.allgather([shared["values"].sum(), len(shared["empty"]), shared["pair"][1].sum()]))
comm.Barrier()
if comm.rank == comm.size - 1:
    shared["values"][0, 0] = 17.0
comm.Barrier()
found["written"] = np.array(comm.allgather(shared["values"][0, 0]))
if comm.rank == 0:
    np.savez(target, **found)
