"""Every motion on ranks, and what is refused, into the file that is named."""

import numpy as np
from final_points import write
from motion_cases import CASES, TIGHT, lid
from mpi4py import MPI

from hexconformal import HexMesh, MeshError, MeshMotion, OptionError
from hexconformal.ranks import MeshPiece, petsc

comm = MPI.COMM_WORLD


def dealt_out(mesh, ranks=comm.size):
    """A piece that has nothing to do with where cells are, with the nodes in an order of their own."""
    mine = np.random.default_rng(0).permutation(len(mesh.cells))[comm.rank :: ranks]
    nodes = np.random.default_rng(comm.rank).permutation(np.unique(mesh.cells[mine]))
    place = np.zeros(len(mesh.points), dtype=np.int64)
    place[nodes] = np.arange(len(nodes))
    data = {name: rows[nodes] for name, rows in mesh.point_data.items()}
    cell_data = {name: rows[mine] for name, rows in mesh.cell_data.items()}
    return MeshPiece(mesh.points[nodes], place[mesh.cells[mine]], data, cell_data, node_ids=nodes, cell_ids=mine)


def named_once(nodes):
    """The nodes (k,), of the lowest rank that has them."""
    others = np.concatenate([np.empty(0, np.int64), *comm.allgather(nodes)[: comm.rank]])
    return ~np.isin(nodes, others)


def whole(nodes, rows, count):
    """Rows of all ranks at all nodes."""
    out = np.full((count, *rows.shape[1:]), np.nan)
    for ids, values in comm.allgather((nodes, rows)):
        out[ids] = values
    return out


def motion_of(mesh, moves, options):
    piece = dealt_out(mesh)
    options = {key: x[piece.node_ids] if isinstance(x, np.ndarray) else x for key, x in options.items()}
    moving = np.random.default_rng(7).permutation(np.flatnonzero(moves[piece.node_ids] & named_once(piece.node_ids)))
    return piece.node_ids, moving, MeshMotion(piece, moving, comm=comm, **TIGHT, **options)


saved = {}
for name, make in CASES.items():
    mesh, moves, options, ways = make()
    nodes, moving, motion = motion_of(mesh, moves, options)
    again = motion_of(mesh, moves, options)[2]
    points, velocities, reports, apart = [], [], [], []
    for way in ways:
        again.resume(motion.state())
        step = motion.step(way[nodes[moving]], dt=0.5)
        apart.append(np.abs(again.step(way[nodes[moving]]).points - step.points).max(initial=0.0))
        points.append(whole(nodes, step.points, len(mesh.points)))
        velocities.append(whole(nodes, step.velocity, len(mesh.points)))
        told = step.report
        figures = [told.reached, told.min_scaled_jacobian, told.mean_scaled_jacobian, *told.types.values()]
        reports.append(figures)
        alike = comm.allgather((figures, told.blocked.tolist(), told.reason, told.substeps, told.iterations))
        assert all(one == alike[0] for one in alike)
    held, carried = np.zeros((len(mesh.points), 3)), np.zeros(len(mesh.points))
    np.fmax.at(held, nodes, motion.held)
    np.fmax.at(carried, nodes[motion.carried], 1.0)
    saved[f"{name}: apart"] = comm.allgather(apart)
    normalized = motion._normalized
    own = normalized.space.own(np.isin(np.arange(len(normalized.points)), motion._moving))
    saved[name], saved[f"{name}: velocity"], saved[f"{name}: figures"] = points, velocities, reports
    saved[f"{name}: blocked"], saved[f"{name}: said"] = told.blocked, np.array([told.reason, *motion.notes])
    saved[f"{name}: held"] = comm.allreduce(held) > 0
    saved[f"{name}: carried"] = comm.allreduce(carried) > 0
    saved[f"{name}: shares"] = np.array([comm.allgather(len(normalized.cells)), comm.allgather(int(own.sum()))])


def said(act):
    """What every rank is told where something makes no sense."""
    told = ""
    try:
        act()
    except (MeshError, OptionError) as problem:
        told = f"{type(problem).__name__}: {problem}"
    return np.array(comm.allgather(told))


mesh, moves, options, ways = lid()
piece, last = dealt_out(mesh), comm.rank == comm.size - 1
moving = np.flatnonzero(moves[piece.node_ids])
motion = MeshMotion(piece, moving, comm=comm)
way = ways[0][piece.node_ids[moving]]
folded = piece.replaced(points=piece.points * np.where(piece.points < 0.3, 3.0, 1.0))
odd = np.where(np.arange(len(moving))[:, None] == 0, np.nan, way) if last else way
wrong = {
    "nothing moves": lambda: MeshMotion(piece, [], comm=comm),
    "outside": lambda: MeshMotion(piece, [10_000] if last else [0], comm=comm),
    "no piece": lambda: MeshMotion(mesh, moving, comm=comm),
    "invalid": lambda: MeshMotion(folded, moving, comm=comm),
    "shape": lambda: motion.step(way[1:] if last else way),
    "copies": lambda: motion.step(way + 0.01 * comm.rank),
    "not finite": lambda: motion.step(odd),
    "target": lambda: MeshMotion(piece, moving, target="current" if last else "input", comm=comm),
    "operator": lambda: MeshMotion(piece, moving, operator="elastic" if last else "conformal", comm=comm),
    "interfaces": lambda: MeshMotion(piece, moving, interfaces="auto" if last else "ignore", comm=comm),
    "schedule": lambda: MeshMotion(piece, moving, schedule=TIGHT["schedule"] if last else None, comm=comm),
    "dt": lambda: motion.step(way, dt=0.1 if last else 0.2),
    "ids": lambda: MeshPiece(piece.points, piece.cells, node_ids=piece.node_ids + 0.5, cell_ids=piece.cell_ids),
    "state": lambda: motion.resume({**motion.state(), "prescribed": way[int(last) :]}),
    "other state": lambda: motion.resume({**motion.state(), "ids": piece.node_ids + 1000}),
}
for name, act in wrong.items():
    saved[f"refused: {name}"] = said(act)
# After all that was refused it goes on as if nothing had been.
saved["at last"] = whole(piece.node_ids, motion.step(way).points, len(mesh.points))
# A rank that has nothing at all knows no names; others do.
named = HexMesh(mesh.points, mesh.cells, {"top": moves, "floor": mesh.points[:, 2] == 0.0})
part = dealt_out(named, max(comm.size - 1, 1)) if not last or comm.size == 1 else MeshPiece.nothing()
one = MeshMotion(part, "top", fixed="floor", comm=comm, **TIGHT)
step = one.step(ways[0][part.node_ids[one.moving]])
saved["by name"] = whole(part.node_ids, step.points, len(mesh.points))
# What is set while the multigrid is set up is nobody else's business.
saved["options"] = np.array(comm.allgather(petsc().Options().hasName("mat_product_clear")))
write(saved)
