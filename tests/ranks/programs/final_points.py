"""Every case on ranks: final points, iterations and reports, into the file that is named."""

import json
import sys

import numpy as np
from cases import CASES, GOOD
from mpi4py import MPI

from hexconformal import Regularization
from hexconformal.ranks import MeshPiece

comm = MPI.COMM_WORLD
saved = {}
for name, (make, options, *schedules) in (CASES | GOOD).items():
    points, cells, *arrays = make()
    data = arrays[0] if arrays else {}
    # Dealt out in a way that has nothing to do with where they are.
    mine = np.random.default_rng(0).permutation(len(cells))[comm.rank :: comm.size]
    nodes, local = np.unique(cells[mine], return_inverse=True)
    data = {key: values[nodes] for key, values in data.items()}
    piece = MeshPiece(points[nodes], local.reshape(-1, 8), data, node_ids=nodes, cell_ids=mine)
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
    saved[name] = whole
    saved[f"{name}: shares"] = np.array([owned, skin])
    saved[f"{name}: report"] = json.dumps(result.report.to_dict())
if comm.rank == 0:
    np.savez(sys.argv[1], **saved)
