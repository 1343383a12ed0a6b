"""Compiled loops that look for closest points on triangles and edges.

:mod:`hexconformal.geometry.closest_point` calls them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kernel import algebra, combine, cross, dot, loop, strict_loop, subtract

__all__ = ["closest_on_segment", "closest_on_triangle", "closest_range", "face_range", "segment_range"]
__all__ += ["boxes_range", "triangles_range", "walk", "walk_parts_range", "walk_range"]

# Steps of a walk: more than any mesh is wide between two positions of a point.
_MOST_STEPS = 1000
# Squared sine below which rounding spoils what is computed from the area of a triangle.
_SLIVER = 1e-10
# A walk goes on to a face at less than this share of the squared distance, less this share of the squared size of the
# face it is on: where two faces meet in the closest point, rounding must not choose. Nor between triangles of a face.
_IMPROVEMENT, _TOUCHING = 1.0 - 1e-9, 1e-20


@algebra
def closest_on_segment(p: Any, a: Any, b: Any) -> Any:
    """Weight of b in the point of segment ab that is closest to p."""
    along = subtract(b, a)
    length = dot(along, along)
    share = dot(subtract(p, a), along)
    return min(max(share / length, 0.0), 1.0) if length > 0.0 else 0.0


@algebra
def closest_on_triangle(p: Any, a: Any, b: Any, c: Any) -> Any:
    """Weights of a, b, c in the point of their triangle that is closest to p.

    After Ericson, Real-Time Collision Detection, section 5.1.5; a triangle without area is its three edges.
    """
    ab, ac, ap = subtract(b, a), subtract(c, a), subtract(p, a)
    bp, cp = subtract(p, b), subtract(p, c)
    normal = cross(ab, ac)
    if dot(normal, normal) <= _SLIVER * dot(ab, ab) * dot(ac, ac):
        u, v, w = closest_on_segment(p, a, b), closest_on_segment(p, b, c), closest_on_segment(p, c, a)
        on_ab, on_bc, on_ca = combine(1.0 - u, ap, u, bp), combine(1.0 - v, bp, v, cp), combine(1.0 - w, cp, w, ap)
        one, two, three = dot(on_ab, on_ab), dot(on_bc, on_bc), dot(on_ca, on_ca)
        if one <= two and one <= three:
            return 1.0 - u, u, 0.0
        return (0.0, 1.0 - v, v) if two <= three else (w, 0.0, 1.0 - w)
    d1, d2, d3, d4, d5, d6 = dot(ab, ap), dot(ac, ap), dot(ab, bp), dot(ac, bp), dot(ab, cp), dot(ac, cp)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - w, w
    total = va + vb + vc
    return va / total, vb / total, vc / total


@loop
def _closer_face(p, triangles, face, best, found):  # type: ignore[no-untyped-def]
    """Squared distance of a face if it is below `best`; then triangle and weights go to `found`."""
    enough = best
    for t in range(triangles.shape[1]):
        x = triangles[face, t]
        a, b, c = (x[0, 0], x[0, 1], x[0, 2]), (x[1, 0], x[1, 1], x[1, 2]), (x[2, 0], x[2, 1], x[2, 2])
        u, v, w = closest_on_triangle(p, a, b, c)
        # From the differences, so that nothing is lost far away from the origin.
        r = combine(1.0, combine(u, subtract(a, p), v, subtract(b, p)), w, subtract(c, p))
        d = dot(r, r)
        if d < enough:
            best, enough = d, _IMPROVEMENT * d
            found[0], found[1], found[2], found[3] = t, u, v, w
    return best


@loop
def _box_distance(p, box):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(3):
        outside = max(box[0, i] - p[i], p[i] - box[1, i], 0.0)
        total += outside * outside
    return total


@loop
def _box_size(box):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(3):
        total += (box[1, i] - box[0, i]) ** 2
    return total


@loop
def walk(p, start, triangles, boxes, offsets, ids, found):  # type: ignore[no-untyped-def]
    """Walk of :meth:`SurfaceLocator.closest_by_walk` from one place p, a tuple, for use in compiled loops.

    Returns the squared distance and the face; `found` (4,) takes the triangle of that face and the weights of
    its corners.
    """
    found[0], found[1], found[2], found[3] = 0.0, 1.0, 0.0, 0.0
    face = start
    best = _closer_face(p, triangles, face, np.inf, found)
    for _ in range(_MOST_STEPS):
        here = face
        touching = _TOUCHING * _box_size(boxes[here])
        for i in range(offsets[here], offsets[here + 1]):
            other = ids[i]
            enough = _IMPROVEMENT * best - touching
            if other != here and _box_distance(p, boxes[other]) < enough:
                d = _closer_face(p, triangles, other, enough, found)
                if d < enough:
                    best, face = d, other
        if face == here:
            break
    return best, face


@loop
def _store(k, face, best, found, triangles, positions, distances, faces, weights):  # type: ignore[no-untyped-def]
    t, size = int(found[0]), weights.shape[1]
    x = triangles[face, t]
    for i in range(3):
        positions[k, i] = found[1] * x[0, i] + found[2] * x[1, i] + found[3] * x[2, i]
    distances[k], faces[k] = np.sqrt(best), face
    if size == 3:
        weights[k, 0], weights[k, 1], weights[k, 2] = found[1], found[2], found[3]
    else:
        weights[k, :] = 0.25 * found[3]
        weights[k, t] += found[1]
        weights[k, (t + 1) % 4] += found[2]


@loop
def walk_range(  # type: ignore[no-untyped-def]
    first, last, places, start, triangles, boxes, offsets, ids, positions, distances, faces, weights
):
    found = np.empty(4)
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        best, face = walk(p, start[k], triangles, boxes, offsets, ids, found)
        _store(k, face, best, found, triangles, positions, distances, faces, weights)


@loop
def walk_parts_range(  # type: ignore[no-untyped-def]
    first, last, places, start, triangles, boxes, quad_boxes, parts, parents, offsets, ids,
    positions, distances, faces, weights,
):  # fmt: skip
    # A walk over quads, from `start`, that are made of the faces from parts[quad] up to parts[quad + 1].
    found = np.empty(4)
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        found[0], found[1], found[2], found[3] = 0.0, 1.0, 0.0, 0.0
        face = parts[start[k]]
        best = _closer_face(p, triangles, face, np.inf, found)
        for _ in range(_MOST_STEPS):
            here = face
            touching = _TOUCHING * _box_size(boxes[here])
            for i in range(offsets[parents[here]], offsets[parents[here] + 1]):
                quad = ids[i]
                if _box_distance(p, quad_boxes[quad]) < _IMPROVEMENT * best - touching:
                    for other in range(parts[quad], parts[quad + 1]):
                        enough = _IMPROVEMENT * best - touching
                        if other != here and _box_distance(p, boxes[other]) < enough:
                            d = _closer_face(p, triangles, other, enough, found)
                            if d < enough:
                                best, face = d, other
            if face == here:
                break
        _store(k, face, best, found, triangles, positions, distances, faces, weights)


@loop
def closest_range(  # type: ignore[no-untyped-def]
    first, last, places, start, triangles, sheets, order, tree, positions, distances, faces, weights
):
    # Only faces of the sheet of the face from which it starts count.
    leaves = len(tree) // 2
    found, nodes, bounds = np.empty(4), np.empty(64, np.int64), np.empty(64)
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        found[0], found[1], found[2], found[3] = 0.0, 1.0, 0.0, 0.0
        face = start[k]
        best = _closer_face(p, triangles, face, np.inf, found)
        nodes[0], bounds[0] = 1, 0.0
        size = 1
        while size > 0:
            size -= 1
            node = nodes[size]
            if not bounds[size] < best:
                continue
            if node >= leaves:
                other = order[node - leaves]
                if sheets[other] == sheets[start[k]]:
                    d = _closer_face(p, triangles, other, best, found)
                    if d < best:
                        best, face = d, other
                continue
            one, two = _box_distance(p, tree[2 * node]), _box_distance(p, tree[2 * node + 1])
            # The nearer child comes off the stack first.
            swap = int(one < two)
            nodes[size], bounds[size] = 2 * node + swap, two if swap else one
            nodes[size + 1], bounds[size + 1] = 2 * node + 1 - swap, one if swap else two
            size += 2
        _store(k, face, best, found, triangles, positions, distances, faces, weights)


@loop
def face_range(first, last, places, faces, triangles, distances):  # type: ignore[no-untyped-def]
    found = np.empty(4)
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        distances[k] = np.sqrt(_closer_face(p, triangles, faces[k], np.inf, found))


@loop
def segment_range(  # type: ignore[no-untyped-def]
    first, last, places, start, segments, offsets, ids, rows, positions, distances, edges, weights
):
    # rows names the list of edges to look through; where it is -1 the list is that of the edge one is on.
    for k in range(first, last):
        p = (places[k, 0], places[k, 1], places[k, 2])
        edge = start[k]
        best, share = np.inf, 0.0
        for _ in range(_MOST_STEPS):
            here = edge
            row = rows[k] if rows[k] >= 0 else here
            for i in range(offsets[row], offsets[row + 1]):
                x = segments[ids[i]]
                a, b = (x[0, 0], x[0, 1], x[0, 2]), (x[1, 0], x[1, 1], x[1, 2])
                s = closest_on_segment(p, a, b)
                r = combine(1.0 - s, subtract(a, p), s, subtract(b, p))
                if dot(r, r) < best:
                    best, share, edge = dot(r, r), s, ids[i]
            if edge == here or rows[k] >= 0:
                break
        x = segments[edge]
        for i in range(3):
            positions[k, i] = (1.0 - share) * x[0, i] + share * x[1, i]
        distances[k], edges[k], weights[k, 0], weights[k, 1] = np.sqrt(best), edge, 1.0 - share, share


@strict_loop
def triangles_range(first, last, points, faces, out):  # type: ignore[no-untyped-def]
    """Corners (f, t, 3, 3) of the one or four triangles of each face, and of these the mean of the nodes the last."""
    corners = faces.shape[1]
    for f in range(first, last):
        for t in range(out.shape[1]):
            a, b = faces[f, t], faces[f, (t + 1) % corners]
            for r in range(3):
                out[f, t, 0, r], out[f, t, 1, r] = points[a, r], points[b, r]
                if corners == 3:
                    out[f, t, 2, r] = points[faces[f, 2], r]
                else:
                    total = points[faces[f, 0], r] + points[faces[f, 1], r] + points[faces[f, 2], r]
                    out[f, t, 2, r] = 0.25 * (total + points[faces[f, 3], r])


@loop
def boxes_range(first, last, points, faces, out):  # type: ignore[no-untyped-def]
    """Lower and upper corners (f, 2, 3) of the boxes around faces."""
    for f in range(first, last):
        for r in range(3):
            low = high = points[faces[f, 0], r]
            for a in range(1, faces.shape[1]):
                x = points[faces[f, a], r]
                low, high = min(low, x), max(high, x)
            out[f, 0, r], out[f, 1, r] = low, high
