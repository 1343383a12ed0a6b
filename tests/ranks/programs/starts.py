"""Runs on ranks that begin where others have come to, whatever each hands in; fingerprints, and what is refused."""

import sys
from itertools import islice

import numpy as np
from mpi4py import MPI

from hexconformal import MeshError, OptionError, Options, Regularization, generate
from hexconformal.ranks import MeshPiece
from hexconformal.regularization import Checkpoint

comm = MPI.COMM_WORLD
points, cells = generate.jittered(*generate.ball(3, 2), 0.2, seed=1)
options = Options()


def piece(points, cells, mine):
    """Some cells, with their nodes in a random order."""
    nodes = np.random.default_rng(comm.rank).permutation(np.unique(cells[mine]))
    place = np.argsort(nodes)
    local = place[np.searchsorted(nodes[place], cells[mine])]
    return MeshPiece(points[nodes], local.reshape(-1, 8), node_ids=nodes, cell_ids=mine)


def fingerprint(*mesh):
    return Checkpoint(f"{sys.argv[1]}.{len(found)}", piece(*mesh), options, comm).fingerprint


found = {}
numbers = np.arange(len(cells))
every = numbers[comm.rank :: comm.size]
found["dealt out"] = fingerprint(points, cells, every)
found["on the last"] = fingerprint(points, cells, numbers if comm.rank == comm.size - 1 else numbers[:0])
moved = points.copy()
moved[5, 0] = np.nextafter(moved[5, 0], 9.0)
found["moved"] = fingerprint(moved, cells, every)
found["turned"] = fingerprint(points, cells[:, [1, 2, 3, 0, 5, 6, 7, 4]], every)

mine = piece(points, cells, every)
run = Regularization(mine, options, comm=comm)
records = list(islice(run, 4))
for name, start in (("points", run.points), ("reached", run.reached())):
    again = Regularization(mine, options, comm=comm, start=start)
    begun = list(islice(again, 2))
    assert [record.phase for record in begun] == ["input", "start"]
    found[f"{name}, energy"] = begun[1].energy / records[-1].energy
    found[f"{name}, away"] = comm.allreduce(float(np.abs(again.points - run.points).max(initial=0.0)), MPI.MAX)


def refused(start, boundary):
    try:
        Regularization(mine, Options(boundary=boundary), comm=comm, start=start)
    except (MeshError, OptionError) as problem:
        return f"{type(problem).__name__}: {problem}"
    return ""


last = comm.rank == comm.size - 1
inner = int(np.argmin(np.linalg.norm(points, axis=1)))  # in a cell of each rank
outer = int(np.argmax(np.linalg.norm(points, axis=1)))
wrong = {
    "few": (mine.points[1:] if last else mine.points, "slide"),
    "held": (mine.points + 0.01 * (mine.node_ids == outer)[:, None], "fixed"),
    "turned": (mine.points * [1.0, 1.0, -1.0], "slide"),
    "far": (1.1 * mine.points, "slide"),
    "nan": (mine.points + np.where(mine.node_ids == 3, np.nan, 0.0)[:, None], "slide"),
    "not everywhere": (mine.points + np.where(last & (mine.node_ids == inner), np.nan, 0.0)[:, None], "slide"),
    "boundary": (mine.points, "fixed" if last else "slide"),
    "none on a rank": (mine.points if last else None, "slide"),
    "apart": (mine.points + 1e-9 * comm.rank * (mine.node_ids == inner)[:, None], "slide"),
}
found["outer"], found["inner"] = outer, inner
for name, start in wrong.items():
    said = comm.gather(refused(*start))
    if comm.rank == 0:
        found[f"refused: {name}"] = np.array(said)
if comm.rank == 0:
    np.savez(sys.argv[1], **found)
