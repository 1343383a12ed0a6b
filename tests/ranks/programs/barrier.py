"""The distance barrier of a ball, and of faces inside, as all turns, then grows out of its bound: on ranks, or not."""

import sys
from dataclasses import replace

import numpy as np

from hexconformal import HexMesh, Options, Regularization, generate
from hexconformal.formulation import Schedules

TURNS = 6  # of 10 degrees: samples of the surface go from rank to rank
OPTIONS = Options(hausdorff=0.03)
SCHEDULES = Schedules(barrier=replace(Schedules().barrier, copied_rings=1))  # hardly more than a turn


def places(points, diagonal):
    """Where the points are, one after the other: turned, then outside, then within the bound again."""
    centre, shift = points.mean(axis=0), np.random.default_rng(1).normal(size=points.shape)
    for turn in range(TURNS):
        angle = np.radians(10.0 * turn)
        rotation = np.array(
            [[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
        )
        yield centre + (points - centre) @ rotation + 2e-4 * diagonal * shift
    for growth in (1.2, 1.002):
        yield centre + growth * (points - centre) @ rotation + 2e-4 * diagonal * shift


def found_by(run, points, ids, total, whole, every):
    """What a run's barrier finds at all places; ids of its nodes, sums, fields on all nodes, and what each rank has."""
    barrier, normalized = run._boundary.barrier, run._normalized
    found = {"values": [], "walls": [], "distances": [], "beyond": [], "samples": []}
    for number, x in enumerate(places(points, normalized.diagonal * normalized.unit)):
        here = normalized.from_user(x)[ids]
        value, gradient = barrier.value_gradient(here)
        found["values"].append(total(value))
        found[f"gradient {number}"] = whole(gradient)
        barrier = barrier.renewed(here)
        if number >= TURNS:
            found["beyond"].append(whole(barrier.nodes_beyond(here)))
            barrier = barrier.watching(here).renewed(here)
        walls = every(barrier.wall)
        found["walls"].append([min(walls), max(walls)])
        found["distances"].append([barrier.relative_distance(here), barrier.farthest(here), barrier.exceeded(here)])
        found["samples"].append([total(len(barrier.forward)), total(len(barrier.backward))])
    return {key: np.array(values) for key, values in found.items()}


def ball():
    return *generate.jittered(*generate.ball(4, 3), 0.2, seed=1), {}


def ball_in_a_ball():
    """A ball in a ball in another: three sheets."""
    points, cells = generate.ball(4, 3)
    shells = np.linalg.norm(points[cells].mean(axis=1), axis=1)
    return points, cells, {"part": np.searchsorted([0.6, 0.85], shells)}


MESHES = {"ball": ball, "ball in a ball": ball_in_a_ball}


def in_one_process(name):
    points, cells, data = MESHES[name]()
    run = Regularization(HexMesh(points, cells, cell_data=data), OPTIONS, SCHEDULES)
    ids = run._normalized.node_ids
    back = np.argsort(ids)
    return found_by(run, points, ids, float, lambda field: field[back], lambda value: [value])


def on_ranks(name, comm):
    from hexconformal.ranks import MeshPiece

    points, cells, data = MESHES[name]()
    mine = np.random.default_rng(0).permutation(len(cells))[comm.rank :: comm.size]
    nodes, local = np.unique(cells[mine], return_inverse=True)
    data = {key: values[mine] for key, values in data.items()}
    piece = MeshPiece(points[nodes], local.reshape(-1, 8), {}, data, node_ids=nodes, cell_ids=mine)
    run = Regularization(piece, OPTIONS, SCHEDULES, comm=comm)
    space, ids = run._normalized.space, run._normalized.mesh.node_ids

    def whole(field):
        field = space.joined(field) if field.dtype == bool else space.add(field)
        out = np.zeros((len(points), *field.shape[1:]), field.dtype)
        for names, rows in comm.allgather((space.own(ids), space.own(field))):
            out[names] = rows
        return out

    return found_by(run, points, ids, space.total, whole, comm.allgather)


if __name__ == "__main__":
    from mpi4py import MPI

    found = {f"{name}: {key}": values for name in MESHES for key, values in on_ranks(name, MPI.COMM_WORLD).items()}
    if MPI.COMM_WORLD.rank == 0:
        np.savez(sys.argv[1], **found)
