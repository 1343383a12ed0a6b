"""Every case on ranks: final points, iterations and reports, into the file that is named."""

import json
import sys
from dataclasses import replace

import numpy as np
from cases import CASES, GOOD, OPENED
from mpi4py import MPI

from hexconformal import Regularization
from hexconformal.ranks import MeshPiece


def run_all(cases):
    """What ranks come to in some cases."""
    comm, saved = MPI.COMM_WORLD, {}
    for name, (make, options, *schedules) in cases.items():
        points, cells, *arrays = make()
        # Dealt out in a way that has nothing to do with where they are.
        mine = np.random.default_rng(0).permutation(len(cells))[comm.rank :: comm.size]
        nodes, local = np.unique(cells[mine], return_inverse=True)
        places = nodes, mine
        data = [{key: x[rows] for key, x in some.items()} for some, rows in zip(arrays, places, strict=False)]
        piece = MeshPiece(points[nodes], local.reshape(-1, 8), *data, node_ids=nodes, cell_ids=mine)
        if isinstance(options.interfaces, np.ndarray):
            options = replace(options, interfaces=options.interfaces[mine])
        run = Regularization(piece, options, *schedules, comm=comm)
        list(run)
        result = run.result()
        whole = np.full_like(points, np.nan)
        for ids, places in comm.allgather((nodes, result.points)):
            whole[ids] = places
        owned = comm.allgather(len(result.mesh.cells))
        normalized = run._normalized
        on = np.zeros(len(normalized.points), dtype=bool)
        on[normalized.quads] = True
        skin = comm.allgather(int(normalized.space.own(normalized.space.joined(on)).sum()))
        inner = comm.allgather(len(normalized.faces.between.quads))
        saved[name] = whole
        saved[f"{name}: shares"] = np.array([owned, skin, inner])
        saved[f"{name}: report"] = json.dumps(result.report.to_dict())
    return saved


def write(saved):
    """Rank 0 writes what is saved into the file that is named."""
    if MPI.COMM_WORLD.rank == 0:
        np.savez(sys.argv[1], **saved)


if __name__ == "__main__":
    write(run_all(CASES | GOOD | OPENED))
