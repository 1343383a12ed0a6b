"""Paths along the edges of a mesh's skin that follow the feature curves of another surface.

Corners are matched with nodes, and curves with paths between these, at the least cost: the distance, and how far the
number of cells around an edge is from that which the angle of the curve has room for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from ...elements import EDGES
from ...mesh import unique_edges
from ..closest_point import CurveLocator
from ..edges import edge_table
from .pieces import Piece
from .schedule import MatchingSchedule

__all__ = ["Path", "Skin", "find_paths"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Path:
    """A piece of a curve, and the nodes (k,) of a skin that are matched with it, in the same order."""

    piece: Piece
    nodes: Ints


@dataclass(frozen=True, eq=False)
class Skin:
    """The skin of a mesh.

    Attributes
    ----------
    points
        (n, 3) coordinates.
    quads
        (q, 4) boundary quads.
    cells
        (m, 8) cells.
    tags
        (q,) of the quads; None where there are none.
    """

    points: Floats
    quads: Ints
    cells: Ints
    tags: Ints | None = None

    @cached_property
    def nodes(self) -> Ints:
        """(s,) nodes of the skin, ascending."""
        return np.unique(self.quads)

    @cached_property
    def edges(self) -> Ints:
        """(e, 2) edges of the skin."""
        pairs = np.stack([self.quads, np.roll(self.quads, -1, axis=1)], axis=2).reshape(-1, 2)
        return unique_edges(pairs).nodes

    @cached_property
    def sectors(self) -> Ints:
        """(e,) number of cells around each edge."""
        every = unique_edges(self.cells[:, EDGES].reshape(-1, 2))
        width = len(self.points)
        return np.asarray(every.counts[np.searchsorted(every.nodes @ [width, 1], self.edges @ [width, 1])])

    def between(self, tags: tuple[int, int] | None) -> Mask:
        """(e,) the edges between quads with two tags, the lower one first; none for no tags."""
        if tags is None or self.tags is None:
            return np.zeros(len(self.edges), dtype=bool)
        return np.asarray((self._tags_beside == tags).all(axis=1))

    @cached_property
    def _tags_beside(self) -> Ints:
        table = edge_table(self.quads)
        beside = np.full((len(table.nodes), 2), -1)
        beside[table.manifold] = np.sort(np.asarray(self.tags)[table.sides], axis=1)
        return beside

    @cached_property
    def lengths(self) -> Floats:
        """(e,) lengths of the edges."""
        return np.linalg.norm(self.points[self.edges[:, 1]] - self.points[self.edges[:, 0]], axis=1)

    @cached_property
    def sizes(self) -> Floats:
        """(n,) mean length of the edges at each node, at least a quarter of the median."""
        sums = np.bincount(self.edges.ravel(), np.repeat(self.lengths, 2), len(self.points))
        counts = np.bincount(self.edges.ravel(), minlength=len(self.points))
        return np.maximum(sums / np.maximum(counts, 1), 0.25 * np.median(self.lengths))


def find_paths(skin: Skin, points: Floats, pieces: list[Piece], schedule: MatchingSchedule) -> list[Path]:
    """Find paths along a skin that follow pieces of curves: they meet in their ends, and nowhere else.

    Parameters
    ----------
    skin
        The skin.
    points
        (r, 3) coordinates of the nodes of the pieces.
    pieces
        What is to be followed.
    schedule
        What costs how much.

    Returns
    -------
    The paths, of those pieces for which there is one that is near enough.
    """
    ends = sorted({end for piece in pieces for end in piece.ends})
    candidates, distances = _candidates(skin, points, ends, pieces, schedule)
    place = {end: i for i, end in enumerate(ends)}
    graphs = [_graph(skin, points, piece, schedule) for piece in pieces]
    tables = []
    for piece, graph in zip(pieces, graphs, strict=True):
        one, other = (candidates[place[end]] for end in piece.ends)
        tables.append(graph.costs(one, other))
    links = [(place[piece.ends[0]], place[piece.ends[1]]) for piece in pieces]
    chosen = _choose(candidates, distances, links, tables, schedule)
    taken = np.zeros(len(skin.points), dtype=bool)
    taken[chosen[chosen >= 0]] = True
    order = np.argsort([_cost(table, candidates, chosen, link) for table, link in zip(tables, links, strict=True)])
    paths = []
    used: set[tuple[int, int]] = set()
    for i in order.tolist():
        one, other = (int(chosen[end]) for end in links[i])
        nodes = graphs[i].path(one, other, taken, used) if min(one, other) >= 0 else None
        if nodes is not None:
            taken[nodes] = True
            used |= {(min(pair), max(pair)) for pair in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True)}
            paths.append(Path(pieces[i], nodes))
    return paths


def _candidates(
    skin: Skin, points: Floats, ends: list[int], pieces: list[Piece], schedule: MatchingSchedule
) -> tuple[Ints, Floats]:
    """(k, c) nodes of the skin near some ends, the nearest first, and what each costs (k, c).

    That is the square of its distance, and how far the number of cells around it is from the octants of the solid
    there. Where tags tell which nodes are on all the curves that meet there, these alone come into question.
    """
    # A quarter of a second, that only this needs.
    from scipy.spatial import cKDTree

    count = min(schedule.candidates, len(skin.nodes))
    found = cKDTree(skin.points[skin.nodes]).query(points[ends], k=np.arange(1, count + 1))
    distances, nodes = np.asarray(found[0]), skin.nodes[found[1]]
    # Angles of a polygon on the unit sphere tell its area.
    octants = np.full(len(ends), 4.0)
    for i, end in enumerate(ends):
        here = [piece for piece in pieces if end in piece.ends]
        octants[i] += sum(piece.sectors - 2.0 for piece in here)
        lines = [skin.edges[between] for between in map(skin.between, {p.tags for p in here}) if between.any()]
        tagged = skin.nodes[np.all([np.isin(skin.nodes, line) for line in lines], axis=0)] if lines else skin.nodes[:0]
        if len(tagged):
            away = np.linalg.norm(skin.points[tagged] - points[end], axis=1)
            # Where there are fewer the last one comes again.
            order = np.argsort(away, kind="stable")[np.minimum(np.arange(count), len(tagged) - 1)]
            nodes[i], distances[i] = tagged[order], away[order]
    misfit = np.abs(np.bincount(skin.cells.ravel(), minlength=len(skin.points))[nodes] - octants[:, None])
    return nodes, (distances / skin.sizes[nodes]) ** 2 + schedule.misfit * misfit


@dataclass(frozen=True, eq=False)
class _Graph:
    """Edges (e, 2) of a skin near a piece of a curve, their costs (e,), and the nodes (k,) that they number."""

    nodes: Ints
    edges: Ints
    costs_of_edges: Floats
    dearest: float

    def _matrix(self, keep: Mask) -> scipy.sparse.csr_array:
        edges, costs = self.edges[keep], self.costs_of_edges[keep]
        size = len(self.nodes)
        return scipy.sparse.csr_array(
            (np.append(costs, costs), (edges.T.ravel(), edges[:, ::-1].T.ravel())), shape=(size, size)
        )

    def _local(self, nodes: Ints) -> Ints:
        at = np.minimum(np.searchsorted(self.nodes, nodes), len(self.nodes) - 1)
        return np.where(self.nodes[at] == nodes, at, -1)

    def costs(self, one: Ints, other: Ints) -> Floats:
        """(k, l) costs of the ways from some nodes (k,) to others (l,); infinite where there is none."""
        from scipy.sparse.csgraph import dijkstra

        table = np.full((len(one), len(other)), np.inf)
        if len(self.edges) == 0:
            return table
        a, b = self._local(one), self._local(other)
        matrix = self._matrix(np.ones(len(self.edges), dtype=bool))
        found = dijkstra(matrix, indices=a[a >= 0])
        table[np.ix_(a >= 0, b >= 0)] = found[:, b[b >= 0]]
        table[one[:, None] == other] = np.inf
        return table

    def path(self, one: int, other: int, taken: Mask, used: set[tuple[int, int]]) -> Ints | None:
        """The cheapest way between two nodes past nodes that are taken and edges that are used; None for none."""
        from scipy.sparse.csgraph import dijkstra

        a, b = self._local(np.array([one, other])).tolist()
        if min(a, b) < 0:
            return None
        free = ~taken[self.nodes]
        free[[a, b]] = True
        unused = np.array([(min(p), max(p)) not in used for p in self.nodes[self.edges].tolist()])
        keep = np.asarray(free[self.edges].all(axis=1) & unused)
        costs, before = dijkstra(self._matrix(keep), indices=a, return_predecessors=True)
        if not np.isfinite(costs[b]):
            return None
        way = [b]
        while way[-1] != a:
            way.append(int(before[way[-1]]))
        nodes = self.nodes[way[::-1]]
        return nodes if costs[b] <= self.dearest * (len(nodes) - 1) else None


def _graph(skin: Skin, points: Floats, piece: Piece, schedule: MatchingSchedule) -> _Graph:
    """The edges of a skin near a piece of a curve, and what it costs to follow it along each."""
    chain = points[piece.nodes]
    low, high = chain.min(axis=0), chain.max(axis=0)
    x, size = skin.points, skin.sizes[:, None]
    near = ((x > low - schedule.reach * size) & (x < high + schedule.reach * size)).all(axis=1)
    between = skin.between(piece.tags)
    which = np.flatnonzero(near[skin.edges].all(axis=1) | between)
    edges = skin.edges[which]
    count = len(piece.nodes) - 1
    links = np.column_stack([np.arange(count), np.arange(1, count + 1)])
    curve = CurveLocator(chain, links, np.zeros(count, dtype=np.int64))
    nodes, local = np.unique(edges, return_inverse=True)
    local = local.reshape(-1, 2)
    at_nodes = curve.closest(x[nodes], np.zeros(len(nodes), dtype=np.int64)).distances
    middle = curve.closest(x[edges].mean(axis=1), np.zeros(len(edges), dtype=np.int64)).distances
    sizes = skin.sizes[edges].mean(axis=1)
    apart = (at_nodes[local] ** 2).sum(axis=1) + middle**2
    misfit = np.abs(skin.sectors[which] - piece.sectors)
    costs = schedule.step + apart / (3.0 * sizes**2) + schedule.misfit * misfit
    if between.any():
        # Tags tell which edges these are, wherever they lie.
        costs = np.where(between[which], schedule.step, costs + schedule.untagged)
    costs *= np.maximum(skin.lengths[which] / sizes, 0.25)
    dearest = schedule.step + schedule.farthest**2 + schedule.misfit * (1.0 + abs(piece.sectors - 2.0))
    return _Graph(nodes, local, costs, dearest)


def _cost(table: Floats, candidates: Ints, chosen: Ints, link: tuple[int, int]) -> float:
    """Cost of the way between the nodes that are chosen for two ends."""
    rows = [np.flatnonzero(candidates[end] == chosen[end]) for end in link]
    return float(table[rows[0][0], rows[1][0]]) if min(map(len, rows)) else np.inf


class _Choice:
    """The choice of a node for each end, every one another, such that they and the ways between them cost little."""

    def __init__(self, candidates: Ints, distances: Floats, links: list[tuple[int, int]], tables: list[Floats]) -> None:
        self.candidates, self.distances = candidates, distances
        self.picks = np.full(len(candidates), -1)
        self.owner: dict[int, int] = {}
        self.around: list[list[tuple[int, Floats]]] = [[] for _ in candidates]
        for (one, other), table in zip(links, tables, strict=True):
            self.around[one].append((other, table))
            self.around[other].append((one, table.T))

    def costs(self, end: int, without: int = -1) -> Floats:
        """(c,) costs of the candidates of an end, with the ways to what is chosen for others, but one of them."""
        costs = self.distances[end].copy()
        for other, table in self.around[end]:
            if other != without:
                pick = self.picks[other]
                costs += table.min(axis=1) if pick < 0 else table[:, pick]
        free = [self.owner.get(node, end) in (end, without) for node in self.candidates[end].tolist()]
        costs[~np.array(free)] = np.inf
        return costs

    def alone(self, end: int) -> bool:
        """Choose anew for one end; True where that is another node."""
        costs = self.costs(end)
        best = int(np.argmin(costs))
        return bool(np.isfinite(costs[best])) and self._take([end], [best])

    def together(self, one: int, other: int, table: Floats) -> bool:
        """Choose anew for both ends of a piece; True where one of them is another node."""
        both = self.costs(one, other)[:, None] + self.costs(other, one) + table
        both[self.candidates[one][:, None] == self.candidates[other]] = np.inf
        best = np.unravel_index(np.argmin(both), both.shape)
        return bool(np.isfinite(both[best])) and self._take([one, other], [int(i) for i in best])

    def _take(self, ends: list[int], places: list[int]) -> bool:
        changed = [end for end, place in zip(ends, places, strict=True) if self.picks[end] != place]
        for end in changed:
            if self.picks[end] >= 0:
                self.owner.pop(int(self.candidates[end, self.picks[end]]))
        for end, place in zip(ends, places, strict=True):
            self.picks[end], self.owner[int(self.candidates[end, place])] = place, end
        return bool(changed)


def _choose(
    candidates: Ints, distances: Floats, links: list[tuple[int, int]], tables: list[Floats], schedule: MatchingSchedule
) -> Ints:
    """(k,) the node of each end; -1 for none."""
    # A way that there is not is dear, not forbidden: others may be better for it.
    tables = [np.where(np.isfinite(table), table, schedule.none) for table in tables]
    choice = _Choice(candidates, distances, links, tables)
    nearest = np.argsort(distances[:, 0], kind="stable").tolist()
    for _ in range(schedule.rounds):
        changed = [choice.alone(end) for end in nearest]
        # Where a curve has settled a row of edges too far, its ends must move at once.
        changed += [choice.together(*link, table) for link, table in zip(links, tables, strict=True)]
        if not any(changed):
            break
    return np.where(choice.picks >= 0, candidates[np.arange(len(candidates)), choice.picks], -1)
