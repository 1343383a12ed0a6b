"""Small faults in kernels, the certificate of validity, the line search and constraints: do the tests notice?

    python benchmarks/mutants.py              # all of them, as a table; some minutes
    python benchmarks/mutants.py --only hexconformal.elements.validity

Each mutant is one change of one line in a copy of the project; the tests of its module run on it until one fails. The
exit code is 1 if a mutant survives.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LIMIT = 300.0  # seconds; a mutant that never ends is noticed too

# Module: the tests that are about it, and what is changed into what (the first place it is found).
MUTANTS: dict[str, tuple[tuple[str, ...], list[tuple[str, str]]]] = {
    "hexconformal.kernel.quaternion": (
        ("kernel/test_distortion.py",),
        [
            ("a[1] * b[2] - a[2] * b[1], a[2] * b[0]", "a[1] * b[2] + a[2] * b[1], a[2] * b[0]"),
            ("length == 0.0", "length < 0.0"),
            ("return (-dot(a, b), c[0]", "return (dot(a, b), c[0]"),
            ("- a[2] * b[2] - a[3] * b[3]", "- a[2] * b[2] + a[3] * b[3]"),
            ("(a[0], -a[1], -a[2], -a[3])", "(a[0], -a[1], -a[2], a[3])"),
            ("a[2] * a[2] + a[3] * a[3]", "a[2] * a[2] - a[3] * a[3]"),
        ],
    ),
    "hexconformal.kernel.distortion": (
        ("kernel/test_distortion.py",),
        [
            ("return 2.0 * norm2((-n_f1[0]", "return 1.0 * norm2((-n_f1[0]"),
            ("norm2((-n_f1[0], f2[0] - n_f1[1]", "norm2((0.0 * n_f1[0], f2[0] - n_f1[1]"),
            ("subtract(f1, cross(f2, n))", "subtract(f1, cross(n, f2))"),
            ("combine(inverse, dc, -inverse * dot(n, dc), n)", "combine(inverse, dc, 0.0, n)"),
            ("combine(1.0, h2, -4.0, cross(dn, f1))", "combine(1.0, h2, -2.0, cross(dn, f1))"),
            ("add(a0, b0), add(a1, c1), add(b2, c2))", "add(a0, b0), add(a1, c1), add(b2, c1))"),
            ("0.25 * eps * eps", "0.5 * eps * eps"),
            ("positive = d > 0.0", "positive = d < 0.0"),
            ("14.0 / 81.0", "0.0 / 81.0"),
            ("along_da = ds * a_d, ds * g_d", "along_da = ds * a_d, 0.5 * ds * g_d"),
        ],
    ),
    "hexconformal.energy.quadrature_kernels": (
        ("energy/test_distortion_term.py",),
        [
            ("forces[c, 3, k] = factor * (y0 - x1 - z2)", "forces[c, 3, k] = factor * (y0 + x1 - z2)"),
            ("z0, z1 = _edge(field, cells, c, 0, 4)", "z0, z1 = _edge(field, cells, c, 1, 4)"),
            ("factor = scales[c] if len(scales) > 1", "factor = scales[0] if len(scales) > 1"),
            ("if eps == FROZEN:", "if eps == QUATERNIONIC:"),
        ],
    ),
    "hexconformal.energy.corner_kernels": (
        ("energy/test_corner_term.py",),
        [
            ("there, sign = cells[c, corners[q, i]], corners[q, 3 + i]", "there, sign = cells[c, corners[q, i]], 1"),
            ("margin = 1.0 - stiffness * density", "margin = 1.0 + stiffness * density"),
            ("weight = scales[c] if len(scales) > 0 else 1.0", "weight = 1.0"),
            ("s[MARGIN, q] = d if eps == 0.0 else 1.0", "s[MARGIN, q] = 1.0 if eps == 0.0 else 1.0"),
        ],
    ),
    "hexconformal.energy.convex_frames": (
        ("energy/test_corner_term.py", "energy/test_convex_blocks.py", "energy/test_proportions.py"),
        [
            ("max(curvature, 2.0 * slope * slope / factor)", "max(curvature, 1.0 * slope * slope / factor)"),
            ("s[MARGIN, q] = d if eps == 0.0 else 1.0", "s[MARGIN, q] = 1.0 if eps == 0.0 else 1.0"),
            ("-r[1] * dot(v[1], u[1])", "-r[1] * dot(v[1], u[0])"),
            ("slope = weight * over * (2.0 + 4.0", "slope = weight * over * (2.0 + 2.0"),
            ("bend = weight * (2.0 + 12.0", "bend = weight * (2.0 + 4.0"),
            ("if widest > slender * slender:", "if widest > slender:"),
            ("second = 2.0 * stiffness * first / margin", "second = 1.0 * stiffness * first / margin"),
            ("across = plus(times(weight * slope, g), ", "across = plus(times(0.0 * slope, g), "),
            ("store(times(weight, g), s, COLUMN, q)", "store(g, s, COLUMN, q)"),
            ("    k = 4.0 * weight\n", "    k = 2.0 * weight\n"),
            ("(cross_matrix(k, plane_normal(f[0], f[2])), s", "(cross_matrix(-k, plane_normal(f[0], f[2])), s"),
        ],
    ),
    "hexconformal.energy.quadrature_blocks": (
        ("energy/test_convex_blocks.py",),
        [
            ("matrix_product(transpose(frame_at(s, INVERSE, q))", "matrix_product((frame_at(s, INVERSE, q))"),
            ("entry = 3 * r + k if i <= j else 3 * k + r", "entry = 3 * r + k"),
            ("for a in range(1, 8):", "for a in range(1, 7):"),
            ("scale = scales[c] if len(scales) > 1", "scale = scales[0] if len(scales) > 1"),
            ("if not (s[MARGIN, q] > 0.0 and", "if not ("),
            ("total += weights[q] * s[DENSITY, q]", "total += s[DENSITY, q]"),
            ("for row in range(COLUMN, BLOCKS + 54):", "for row in range(COLUMN, BLOCKS + 45):"),
            ("            pull_back(s, EIGHT)", "            pass"),
        ],
    ),
    "hexconformal.energy.distortion_term": (
        ("energy/test_convex_blocks.py", "energy/test_distortion_term.py"),
        [
            ("cells=patch.local[part.cells]", "cells=part.cells"),
            ("scales = self.scales if self.scales is None", "scales = None if self.scales is not None"),
            ("len(self.inverses) == 1 else self.inverses[cells]", "len(self.inverses) == 1 else self.inverses[:1]"),
            ("variation, kernels.FROZEN)", "variation, self._kind)"),
        ],
    ),
    "hexconformal.energy.term": (
        ("energy/test_convex_blocks.py", "energy/test_objective.py"),
        [
            ("step = _DIFFERENCE / largest", "step = _DIFFERENCE"),
            ("(ahead - behind) / (2.0 * step)", "(ahead - behind) / step"),
            ("for sign in (1.0, -1.0)", "for sign in (1.0, 0.0)"),
            ("if largest == 0.0:", "if largest < 0.0:"),
            ("moving[cells].any(axis=1)", "moving[cells].all(axis=1)"),
        ],
    ),
    "hexconformal.energy.objective": (
        ("energy/test_objective.py",),
        [
            ("if not np.isfinite(total):", "if False:"),
            ("gradient += force", "gradient = force"),
            ("assembly.clear()", "pass"),
            ("terms.append(seen)", "terms.append(term)"),
            ("term.restricted(patch) for", "term for"),
            ("return self if same else Objective(terms)", "return Objective(terms)"),
            ("one is other for one", "one is not None for one"),
        ],
    ),
    "hexconformal.energy.block_matrix": (
        ("energy/test_block_matrix.py",),
        [
            ("place if indices[place] == column else -1", "place"),
            ("joined = cells if diagonals else", "joined = cells if not diagonals else"),
            ("if free[row]:", "if row >= 0:"),
            ("& free[indices] & free[rows]", "& free[indices]"),
        ],
    ),
    "hexconformal.energy.quadratic.kernel": (
        ("energy/test_quadratic_term.py",),
        [
            ("x / boxes[c, i] if", "x * boxes[c, i] if"),
            ("along / boxes[c, i] if", "along if"),
            ("rest -= force", "rest += force"),
            ("(below - above / positive**2)", "(below - above / positive)"),
            ("_POSITIVE, q] - above) ** 2 / (", "_POSITIVE, q] - above) ** 2 * ("),
            ("margin = 1.0 - stiffness * e", "margin = 1.0 - 0.5 * stiffness * e"),
            ("steep = share / (margin * margin)", "steep = share / margin"),
            ("combine(steep * factor, g[1], steep * density * slope", "combine(steep * factor, g[1], density * slope"),
            ("if determinant(f) > 0.0 else np.inf", "if determinant(f) < np.inf else np.inf"),
            ("total, share = 0.0, angle / count", "total, share = 0.0, angle"),
        ],
    ),
    "hexconformal.energy.quadratic.term": (
        ("energy/test_quadratic_term.py",),
        [
            ("if total < _FOLDED else", "if total < np.inf else"),
            ("boxes**-2.0, optimize", "boxes**-1.0, optimize"),
            (".sum(axis=2).mean(axis=1)", ".sum(axis=2).max(axis=1)"),
            ("patch.local[self.cells[patch.cells]]", "self.cells[patch.cells]"),
            ("self.boxes[patch.cells]", "self.boxes"),
            (".min(axis=1), -1.0, 1.0)", ".max(axis=1), -1.0, 1.0)"),
            ('"iaq,ij->jaq", _edges', '"iaq,ji->jaq", _edges'),
            ("size * weights.angle", "weights.angle"),
            ("matrices *= self.cell_type.volume", "matrices *= 1.0"),
        ],
    ),
    "hexconformal.energy.corner_blocks": (
        ("energy/test_corner_term.py", "energy/test_block_matrix.py"),
        [
            ("store(times(-1.0, m0), s, _MIXED, q)", "store(times(1.0, m0), s, _MIXED, q)"),
            ("local[pair, c, r] += s[row + 3 * r + c, q]", "local[pair, r, c] += s[row + 3 * r + c, q]"),
            ("forces[cells[c, q], k] -= force", "forces[cells[c, q], k] += force"),
            ("if cells[c, a] >= cells[c, b]:", "if cells[c, a] <= cells[c, b]:"),
        ],
    ),
    "hexconformal.kernel.simd_frames": (
        ("energy/test_distortion_term.py",),
        [
            ("target = c if len(inverses) > 1 else 0", "target = 0 if len(inverses) > 1 else 0"),
            ("step = 1 if inverses.shape[1] > 1 else 0", "step = 0 if inverses.shape[1] > 1 else 0"),
        ],
    ),
    "hexconformal.elements.validity": (
        ("elements/test_validity.py",),
        [
            ("ROUNDING = 16 *", "ROUNDING = 0 *"),
            ("weight = 0.5 if z == 1 else 1.0", "weight = 1.0 if z == 1 else 1.0"),
            ("(0.5 if x != kx else 1.0)", "(0.5 if x == kx else 1.0)"),
            ("if not lower > 0.0:\n            found[0] = True", "if lower < 0.0:\n            found[0] = True"),
        ],
    ),
    "hexconformal.elements.bernstein": (
        ("elements/test_validity.py",),
        [
            ("elif level == 3 * depth:", "elif level == depth:"),
            ("if first > 0.0 or not upper > 0.0:", "if first > -1e-3 or not upper > 0.0:"),
            ("0.5 * (block[p - stride] + block[p])", "0.5 * (block[p] + block[p])"),
            ("last - row * stride]", "last]"),
            ("block[p + 2 * third]", "block[p + third]"),
            ("for p in corners:", "for p in corners[:7]:"),
            ("lower = min(lower, bound)", "lower = max(lower, bound)"),
            ("stack[count], size ** (level % 3), size", "stack[count], 1, size"),
        ],
    ),
    "hexconformal.elements.quadratic.validity": (
        ("elements/test_quadratic_validity.py",),
        [
            (" + 0.0 * total", ""),
            ("range(131)", "range(130)"),
            ("range(33)", "range(32)"),
            ("return rounding * scale", "return 0.0 * scale"),
            ("1.0 / np.kron(_ROW", "0.9 / np.kron(_ROW"),
        ],
    ),
    "hexconformal.elements.quadratic.cell_types": (
        ("elements/test_quadratic_measures.py", "elements/test_quadratic_validity.py"),
        [
            ("matrix[node, list(among)] = -0.25", "matrix[node, list(among)] = -0.5"),
            ("(1.0 + len(among) / 4.0) / len(middles)", "2.0 / len(middles)"),
            ("if ends <= set(among)", "if ends & set(among)"),
            ("(2, 6), (3, 7)]", "(3, 7), (2, 6)]"),
            ("among.index(frozenset(linear.mirrored[a] for a in one))", "among.index(one)"),
        ],
    ),
    "hexconformal.elements.quadratic.places": (
        ("elements/test_quadratic_measures.py", "energy/test_quadratic_term.py"),
        [
            ("around = np.roll(triangle, -corner, axis=0)", "around = triangle"),
            ("((1 / 3, 1 / 3), 3 / 20)", "((1 / 3, 1 / 3), 1 / 20)"),
            ("corners.append(corner)", "corners.append(0)"),
            ("factorial(5 - k + m)", "factorial(5 - k)"),
            ("near.max(axis=1, keepdims=True) - 1e-9", "near.max(axis=1, keepdims=True) - 1.0"),
            ("else pattern[corner - 4]", "else 0"),
            ("edges[corners].transpose(0, 2, 1)", "edges[0 * corners].transpose(0, 2, 1)"),
        ],
    ),
    "hexconformal.elements.quadratic.shape_functions": (
        ("elements/test_quadratic_measures.py",),
        [
            ("4.0 * t - 3.0, 4.0 - 8.0 * t", "4.0 * t - 3.0, 4.0 - 4.0 * t"),
            ("t * (2.0 * t - 1.0)", "t * (2.0 * t + 1.0)"),
            ("np.where(axis, slopes, values)", "np.where(axis, values, slopes)"),
            ("degree = 1 if i == axis else 2", "degree = 2 if i == axis else 1"),
            ("np.linalg.inv(shape_gradients", "np.array(shape_gradients"),
        ],
    ),
    "hexconformal.elements.quadratic.control_vectors": (
        ("elements/test_quadratic_validity.py",),
        [
            ("comb(1 if axis == i else 2, k)", "comb(2, k)"),
            ("float(roundings * np.finfo(np.float64).eps)", "float(0 * roundings)"),
            ("1.0 / self.binomials**2", "1.0 / self.binomials"),
            ("every[some[:, 1]] - every", "every[some[:, 1]] + every"),
            ("if not sums.any():", "if sums.any():"),
            ("(others[a] == others[b]).all()", "(others[a] == others[b]).any()"),
        ],
    ),
    "hexconformal.elements.quadratic.parts": (
        ("regularization/quadratic/test_cut_mesh.py",),
        [
            ("(4, 9, 8, 5)", "(4, 9, 5, 8)"),
            ("(9, 12, 11, 10, 13)", "(9, 10, 11, 12, 13)"),
            ("((_LOW, _MIDDLE), (_MIDDLE, _HIGH))", "((_LOW, _MIDDLE), (_LOW, _HIGH))"),
            ("[*face, face[-1]][:4]", "[*face, face[0]][:4]"),
            ("(0.5 * (corner - corners[0])", "(1.0 * (corner - corners[0])"),
            ("step / n * (last - first)", "step / n * (first - last)"),
        ],
    ),
    "hexconformal.elements.quadratic.measures": (
        ("elements/test_quadratic_measures.py",),
        [
            ("_SAMPLES = 9", "_SAMPLES = 8"),
            ("(3.0 - 4.0 * t) * first", "(1.0 - 4.0 * t) * first"),
            ("volume += stack[0, p] / shares[p]", "volume += stack[0, p] / 216.0"),
            ("largest = max(largest, abs(stack[0, p]))", "largest = max(largest, stack[0, p])"),
            ("(f[2] * g[0] - f[0] * g[2]) * h[1]", "(f[2] * g[0] + f[0] * g[2]) * h[1]"),
            ("shape = min(shape,", "shape = max(shape,"),
            ("1.0 - area / norm if", "1.0 - 0.9 * area / norm if"),
            ("scaled = min(scaled,", "scaled = max(-scaled,"),
        ],
    ),
    "hexconformal.elements.table_measures": (
        ("elements/test_validity.py", "elements/test_collapsed.py"),
        [
            ("(points, cells)[0] > 0", "(points, cells)[1] > 0"),
            ("cells = cells[among]", "cells = cells[among[:1]]"),
            ("one.own_nodes(cells), one.cell_type)", "cells[one.rows], HEXAHEDRON)"),
            ('worst_corners(points, nodes, name == "shape")', 'worst_corners(points, nodes, name != "shape")'),
            ("[MEASURES.index(name)]", "[0]"),
            ("return bool(is_valid(points, cells).all())", "return bool(is_valid(points, cells).any())"),
        ],
    ),
    "hexconformal.elements.collapsed": (
        ("elements/test_collapsed.py",),
        [
            ("(ordered[:, 1:] != ordered[:, :-1]).all(axis=1)", "True"),
            ("left = left[~fits]", "left = left[fits]"),
            ("cells[:, 6] == cells[:, 7]", "cells[:, 4] == cells[:, 5]"),
            ("others * (1 + (cells[:, 2] == cells[:, 3])", "others * (1 + (cells[:, 1] == cells[:, 2])"),
            ("slice(int(rows[0]), int(rows[-1]) + 1)", "slice(int(rows[0]), int(rows[-1]))"),
            ("together = rows[-1] - rows[0] == len(rows) - 1", "together = True"),
            ("(0, 3, 7, 4, 1, 2, 6, 5)", "(1, 2, 3, 0, 5, 6, 7, 4)"),
        ],
    ),
    "hexconformal.mesh.topology": (
        ("mesh/test_mixed_mesh.py", "mesh/test_collapsed_topology.py"),
        [
            ("after = np.where(after == one[:, 0], other[rows, (place + 2) % 4], after)", "pass"),
            ("pointed & triangles, pointed, others", "pointed & ~triangles, pointed, others"),
            ("[3.0, 1.5, 3.0, 2.0]", "[3.0, 1.5, 3.0, 1.0]"),
            ("order = triangles_first(quads)", "order = np.arange(len(quads))"),
            ("if b == c or c == d:", "if b == c:"),
        ],
    ),
    "hexconformal.mesh.face_rows": (
        ("mesh/test_collapsed_topology.py", "mesh/test_mixed_mesh.py"),
        [
            ("faces[:, [0, 2, 1, 1]]", "faces[:, [0, 1, 2, 2]]"),
            ("return faces[:, [0, 2, 1]]", "return faces[:, [1, 2, 0]]"),
            ('faces[:, 2] != faces[:, 3], kind="stable"', 'faces[:, 2] == faces[:, 3], kind="stable"'),
        ],
    ),
    "hexconformal.mesh.mixed_mesh": (
        ("mesh/test_mixed_mesh.py", "mesh/test_collapsed_topology.py"),
        [
            ("2 * wedges.sum() <= len(wedges) or", "2 * wedges.sum() < 0 or"),
            ("table[block.places] =", "table[np.sort(block.places)] ="),
            ("out[block.places[mine] - first]", "out[: mine.sum()]"),
            ("starts = np.cumsum(sizes) - sizes", "starts = np.cumsum(sizes)"),
        ],
    ),
    "hexconformal.geometry.features.crack_fronts": (
        ("geometry/test_crack_fronts.py", "mesh/test_collapsed_topology.py"),
        [
            ("inside > 360.0 - opening", "inside > 180.0"),
            ("inside += np.bincount", "inside = np.bincount"),
            ("sum(axis=1) >= 2", "sum(axis=1) >= 3"),
            ("out[edge, 1 if ahead else 0]", "out[edge, 0 if ahead else 1]"),
        ],
    ),
    "hexconformal.quality.mixed_checks": (
        ("quality/test_mixed.py", "mesh/test_mixed_mesh.py"),
        [
            ("(known[0] & known[2]) |", "(known[0] & known[1]) |"),
            ("np.abs(np.linalg.det(edges)) <= _FLAT", "np.linalg.det(edges) <= _FLAT"),
            ("found += [*_check_order(mesh, faces), *check_pieces(mesh, table)]", "found += check_pieces(mesh, table)"),
        ],
    ),
    "hexconformal.quality.face_checks": (
        ("quality/test_mixed.py", "quality/test_checks.py"),
        [
            ("np.flatnonzero(faces.counts > 2)", "np.flatnonzero(faces.counts > 3)"),
            ("if count == 1:", "if count <= 2:"),
            ("nodes[: 3 + int(nodes[2] != nodes[3])]", "nodes[:4]"),
            ("if (faces.counts > 1).all():", "if False:"),
            ("faces.quads[faces.counts == 1]", "faces.quads[faces.counts == 2]"),
            ("(quads[owner[hit]] != found[:, None]).all(axis=1)", "found >= 0"),
        ],
    ),
    "hexconformal.untangling.untangle_interior": (
        ("untangling/test_untangle_interior.py", "regularization/test_mixed.py"),
        [
            ("np.arange(6), np.arange(3, 9)", "np.arange(6), np.arange(6)"),
            ("first += size * len(own)", "first += size"),
            ("0.5 * (below + above)", "0.4 * below + 0.6 * above"),
        ],
    ),
    "hexconformal.energy.corner_term": (
        ("energy/test_corner_term.py", "energy/test_other_types.py", "regularization/test_mixed.py"),
        [
            ("8.0 * cell_type.volume / len(table)", "1.0"),
            ("w.proportion if part.corners is _HEXAHEDRON else 0.0", "w.proportion"),
            ("largest[one.rows] = 1.0 / stiffness", "largest[:] = 1.0 / stiffness"),
            ("inverses_of(self.inverses, one, len(self.cells))", "np.empty((0, 1, 3, 3))"),
            ("places[a] * (places[a] + 1) // 2 + places[b]", "a * (a + 1) // 2 + b"),
            ("inverses = self.inverses[patch.cells] if", "inverses = self.inverses if"),
            ("out[:, part.rows] = columns", "out[:, : columns.shape[1]] = columns"),
        ],
    ),
    "hexconformal.solver.problem": (
        ("solver/test_line_search.py",),
        [
            ("<= current.energy + search.enough * step * slope", "<= current.energy - search.enough * step * slope"),
            ("(enough or flat) and problem.space.everywhere(problem.acceptable(trial.points))", "(enough or flat)"),
            ("if np.isfinite(trial.energy) and (", "if ("),
            ("(not with_gradient or trial.has_finite_gradient)", "True"),
            ("        step *= 0.5\n", "        step *= 1.0\n"),
            ("return replace(current, step=0.0, decrease=0.0)", "return replace(trial, step=0.0)"),
            ("direction)) <= -search.flatter * slope", "direction)) >= -search.flatter * slope"),
            ("np.where(nodes[:, None], share * shorter, shorter), held | nodes", "share * shorter, held | nodes"),
            ("if halving == search.patience and", "if halving == 39 and"),
            ("if not 0 < count <= max(8.0, problem.search.few * whole)", "if not 0 < count"),
        ],
    ),
    "hexconformal.solver.lbfgs": (
        ("solver/test_line_search.py", "solver/test_lbfgs.py"),
        [
            ("_LEAST_CURVATURE = 1e-10", "_LEAST_CURVATURE = -1e10"),
            ("accumulate(q, -factors[-1], y)", "accumulate(q, factors[-1], y)"),
            ("reversed(factors)", "factors"),
        ],
    ),
    "hexconformal.solver.newton": (
        ("solver/test_newton.py",),
        [
            ("else max(low, self.added / factor)", "else max(low, self.added)"),
            ("min(high, factor * self.added)", "factor * self.added"),
            ("direction = current.problem.project(rounded)", "direction = rounded"),
            ("if self.rounding > 0.0:", "if self.rounding > 1.0:"),
        ],
    ),
    "hexconformal.solver.block_sweeps": (
        ("solver/test_block_solver.py",),
        [
            ("t[r, c] += data[k, r, a] * projectors[j, a, c]", "t[r, c] += data[k, r, a] * projectors[i, a, c]"),
            ("(1.0 if r == c else 0.0) - projectors[i, r, c]", "(1.0 if r == c else 0.0)"),
            ("data[k, r, r] += shift * trace + 1e-30", "data[k, r, r] += 1e-30"),
            ("b[j, 0] -= data[k, 0, 0] * x0 + data[k, 1, 0]", "b[j, 0] -= data[k, 0, 0] * x0 + data[k, 0, 1]"),
            ("a1 = p[i, 1] - left[i, 1] - added[i]", "a1 = p[i, 1] - left[i, 1] + added[i]"),
            ("a0 += data[k, 0, 0] * t[j, 0] + data[k, 0, 1]", "a0 += data[k, 0, 0] * t[j, 0] + data[k, 1, 0]"),
            ("added[i] += 0.5 * block_norm(data, places[n])", "added[i] += 0.0"),
            ("out[i, c] = t[i, c] + left[i, c]", "out[i, c] = 0.5 * t[i, c] + left[i, c]"),
            ("self.backward(self.scaled(self.forward(gradient)))", "self.backward(self.forward(gradient))"),
        ],
    ),
    "hexconformal.solver.row_parts": (
        ("solver/test_block_solver.py",),
        [
            ("and indices[k] < bounds[part]:", "and indices[k] < bounds[first]:"),
            ("rows[ends[j]], places[ends[j]] = i, k", "rows[ends[j]], places[ends[j]] = j, k"),
            ("offsets[indices[k] + 1] += 1", "offsets[indices[k]] += 1"),
        ],
    ),
    "hexconformal.mesh.space": (
        ("solver/test_space.py", "solver/test_block_solver.py"),
        [("sums[block] += a[i, k] * b[i, k]", "sums[block] += a[i, k] * b[i, 0]")],
    ),
    "hexconformal.kernel.cell_chunks": (
        ("kernel/test_cell_chunks.py",),
        [
            ("mask |= taken[cells[c, a]]", "mask = taken[cells[c, a]]"),
            ("taken[cells[c, a]] |= np.uint64(1) << np.uint64(best)", "taken[cells[c, a]] = np.uint64(1)"),
            ("return float(sums.sum())", "return float(sums[1:].sum())"),
            ("self.order[first:last]", "self.order[: last - first]"),
        ],
    ),
    "hexconformal.kernel.threads": (
        ("kernel/test_threads.py", "kernel/test_cell_chunks.py"),
        [
            ("return -(-int(quota) // int(period))", "return int(quota) // int(period)"),
            ("function(0, bounds[1], *arguments)", "function(0, bounds[0], *arguments)"),
            ("job.result()", "pass"),
        ],
    ),
    "hexconformal.regularization.return_to_surface": (
        ("regularization/test_return_to_surface.py",),
        [
            ("left = left | still", "left = left"),
            ("left = left | still", "left = still"),
            ("space.anywhere(not is_valid(trial, cells)[valid].all())", "False"),
            ("min(1.0, 2.0 * (1.0 - ring / rings))", "1.0"),
            ("if not barrier.exceeded(trial) and", "if"),
        ],
    ),
    "hexconformal.solver.conjugate_gradients": (
        ("solver/test_block_solver.py", "solver/test_multigrid.py"),
        [
            ("p *= rz / old", "p *= 0.0"),
            ("if rz <= tolerance**2 * first:", "if rz <= tolerance * first:"),
            ("accumulate(r, -alpha, hp)", "accumulate(r, -0.5 * alpha, hp)"),
        ],
    ),
    "hexconformal.solver.multigrid": (
        ("solver/test_multigrid.py",),
        [
            ("out[row] = damping / total", "out[row] = 1.5 * damping / total"),
            ('"filter_entries": True', '"filter_entries": False'),
            ('"weighting": "local"', '"weighting": "diagonal"'),
            ("{\"theta\": schedule.strong}", '{"theta": 0.0}'),
            ("linalg.pinvh(", "linalg.inv("),
            ("return level.matrix.smooth(first, level.matrix.smooth(second, x, b), b)", "return x"),
            ("1.0 / (middle - half * np.sqrt(0.5))", "1.0 / (middle - 0.8 * half)"),
            ("out[place] = number[indices[k]], data[k]", "out[place] = number[indices[k]], data[place]"),
            ("first[:, None] * b, b)", "0.5 * first[:, None] * b, b)"),
            ("update(self._cycle(coarse, depth + 1), x, 1.0)", "update(self._cycle(coarse, depth + 1), x, -1.0)"),
        ],
    ),
    "hexconformal.regularization.quadratic.cut_mesh": (
        ("regularization/quadratic/test_cut_mesh.py",),
        [
            ("size + np.arange(len(further))", "np.arange(len(further))"),
            ("np.where(first < size, first, 0)", "np.where(first < size, 0, first)"),
            ("[ends[-1] :]", "[ends[-1] - 1 : -1]"),
            ('side="right"', 'side="left"'),
            ("_CONTINUED @ nodes", "0.5 * _CONTINUED @ nodes"),
            ("np.where(grid < 0, -1, ids", "np.where(grid < 0, 0, ids"),
            ("len(boundary_quads(mesh.table)[0]) * parts**2", "len(boundary_quads(self.cells)[0])"),
            ("out[some] = self.matrix(some) @ points", "out[some] = 0.0"),
        ],
    ),
    "hexconformal.regularization.quadratic.following": (
        ("regularization/quadratic/test_curving.py", "regularization/quadratic/test_following.py"),
        [
            ("weights = 1.0 / (", "weights = 1.0 + 0.0 * ("),
            ("held = along[:, :, None] * along[:, None, :]", "held = 0.0 * along[:, :, None] * along[:, None, :]"),
            ("np.add.at(held", "(lambda *_: None)(held"),
            ("-(basis.T @ (laplacian @ given))", "(basis.T @ (laplacian @ given))"),
            ("for k in (0, 1)", "for k in (0,)"),
            ("(given + basis @ moved)", "(given + 0.5 * basis @ moved)"),
            ("_AFLOAT = 1e-9", "_AFLOAT = 1e-2"),
            ("_RANK = 1e-6", "_RANK = 0.5"),
        ],
    ),
    "hexconformal.regularization.quadratic.straight_start": (
        ("regularization/quadratic/test_unfolding.py",),
        [
            ("np.where(inner[:, None], straight + bends, points)", "straight + bends"),
            ("np.where(inner[:, None], straight + bends, points)", "np.where(inner[:, None], straight, points)"),
            ("placed = _with_corners_unfolded(setting, points, inner)", "placed = points"),
            ("    for iterate in convex_newton(patch, local, CornerWeights()):", "    for iterate in []:"),
            ("if boxes is not None:", "if boxes is None:"),
        ],
    ),
    "hexconformal.regularization.quadratic.unfolding": (
        ("regularization/quadratic/test_unfolding.py", "regularization/quadratic/test_quadratic.py"),
        [
            ("(lambda _, there: there, straight_start)", "(lambda _, there: there,)"),
            ("part = setting.within(moving)", "part = setting"),
            ("    for region in regions:", "    for region in [moving]:"),
            ("        if folded < fewest:", "        if folded > fewest:"),
            ("return unmoved if folded(unmoved) <= folded(fewest) else fewest", "return unmoved"),
            ("setting.nodes_of(folded | all_move)", "setting.nodes_of(folded | True)"),
        ],
    ),
    "hexconformal.regularization.quadratic.sliding": (
        ("regularization/quadratic/test_sliding.py",),
        [
            ("_CORRECTIONS = 3", "_CORRECTIONS = 0"),
            ("uv[:, :size] += np", "uv[:, :size] -= np"),
            ("0.5 * np.maximum(uv.sum(axis=1) - 1.0, 0.0)", "0.0 * uv.sum(axis=1)"),
            ("    np.clip(uv, 0.0, 1.0, out=uv)\n    beyond", "    beyond"),
            ("free[ends[own]] > 2", "free[ends[own]] > 3"),
            ("taken[count:], taken[curves.corners] = True, True", "taken[curves.corners] = True"),
            ("curves.nodes[at_nodes, 0]] > 1", "curves.nodes[at_nodes, 0]] > 2"),
            ("self._start[kind.nodes]).any(axis=1)", "self._start[kind.nodes]).all(axis=1)"),
            ("sums[kind.nodes] += normals", "sums[kind.nodes] += 0.0 * normals"),
            ("sums[self._held] = np.eye(3)", "sums[self._held] += 0.0"),
            ("np.union1d(self._held, nodes)", "self._held"),
            ('np.einsum("ki,kir->kr", du, across), np', '-np.einsum("ki,kir->kr", du, across), np'),
            ("rows[:, :, None]).argmax(axis=2)", "rows[:, ::-1, None]).argmax(axis=2)"),
        ],
    ),
    "hexconformal.regularization.quadratic.curving": (
        ("regularization/quadratic/test_curving.py",),
        [
            ("<= schedule.reach * sides.lengths[moved]", "<= 10.0 * schedule.reach * sides.lengths[moved]"),
            ("closest = pieces.closest(own, near)", "closest = whole.closest(own)"),
            ("            for side in turns:", "            for side in turns[:1]:"),
            ("lost = first.valid & poor", "lost = first.valid & ~now.valid"),
            ("start = _at(straight.points, goal,", "start = _at(straight.points, straight.points,"),
            ("goals.append(behind())", "goals.append(goal)"),
            ("np.maximum.at(tried, cells, tries[:, None])", "tried[cells] = tries[:, None]"),
            ("> self._schedule.looks]", "> -1.0]"),
            ("beside[some] = goal[some] - along[some]", "beside[some] = 0.0"),
            ("off > max(schedule.told * before, there.rounding)", "off > schedule.told * before"),
            ("out[block.cells[:, node]] = 2.0 *", "out[block.cells[:, node]] = 1.0 *"),
        ],
    ),
    "hexconformal.regularization.quadratic.curved_surface": (
        ("regularization/quadratic/test_curved_surface.py",),
        [
            ("return 0.5 * sum(", "return 0.25 * sum("),
            ("(grids, grids.swapaxes(1, 2), ", "(grids, grids, "),
            ("bend > tolerance * parts**2", "bend > tolerance * parts"),
            ("8 * cells * parts**3 <= _MOST", "cells * parts**3 <= _MOST"),
            (".any(axis=1)]", ".all(axis=1)]"),
            ("np.repeat(sheets, quads.each)", "np.tile(sheets, quads.each)"),
            ("np.searchsorted(order, own))", "own)"),
            ("for points in (after, before)", "for points in (before, before)"),
            ("block.cells[np.isin(block.places, own)]", "block.cells[: len(own)]"),
        ],
    ),
    "hexconformal.regularization.quadratic.curved_boundary": (
        ("regularization/quadratic/test_curved_boundary.py", "regularization/quadratic/test_curved_surface.py"),
        [
            ("near = bound - bend / parts**2", "near = bound"),
            ("bound = near\n", "bound = bound\n"),
            ("fixed[:count] = fixed_components(", "fixed[:count] |= 0 * fixed_components("),
            ("(self._surface, self._inside) if len(self.sheets) else (self._surface,)", "(self._surface,)"),
            ("for one in surfaces) / self.diagonal", "for one in surfaces[1:]) / self.diagonal"),
            ("(samples.weights.max(axis=1) == 1.0) & (nodes[:, 0] >= count)", "samples.weights.max(axis=1) == 1.0"),
            ("_EXACT = 0.02", "_EXACT = 0.2"),
            ("attraction=np.zeros(len(samples))", "attraction=samples.attraction"),
            ("else self.sliding.with_held(np.flatnonzero(nodes))", "else self.sliding"),
            ("regions.labels[self.cut.owners]", "regions.labels[np.sort(self.cut.owners)[::-1]]"),
            ("row.quads // self.parts**2", "row.quads // self.parts"),
            ("np.repeat(kept.kinds, quads.each)", "np.tile(kept.kinds, quads.each)"),
            ("skin.matching(normalized.quads) // skin.each", "skin.matching(normalized.quads) % len(corners.quads)"),
        ],
    ),
    "hexconformal.regularization.quadratic.setting": (
        ("regularization/quadratic/test_setting.py", "regularization/quadratic/test_quadratic.py"),
        [
            ("left_out=self.left_out | cells)", "left_out=cells)"),
            ("= ~moving[block.cells].any(axis=1)", "= ~moving[block.cells].all(axis=1)"),
            ("self.boundary.with_held(~moving)", "self.boundary"),
            ("range(rings + 1)", "range(max(rings, 1))"),
            ("nodes = self.boundary.admissible.coupled.closed(self.nodes_of(cells))", "nodes = self.nodes_of(cells)"),
            ("inner[admissible.nodes] = False", "pass"),
            ("inner[admissible.coupled.nodes] = False", "pass"),
            ("if weights.angle == 0.0 else self", "if weights.angle >= 0.0 else self"),
            ("return not (kept & ~self.valid(points)).any()", "return True"),
            (" | (self._valid_at_first & ~self.valid(points)), depths", ", depths"),
            ("return min(float(term.determinants(points)", "return max(float(term.determinants(points)"),
            ("self._terms(np.ones(len(self.left_out), dtype=bool)", "self._terms(~self.left_out"),
            ("determinant_bounds(points, block.cells", "determinant_bounds(self.mesh.points, block.cells"),
        ],
    ),
    "hexconformal.regularization.quadratic.stages": (
        ("regularization/quadratic/test_stages.py",),
        [
            ("current.gradient_norm <= tolerance * first", "current.gradient_norm < 0.0"),
            ("first, before = first or current.gradient_norm", "first, before = current.gradient_norm"),
            ("schedule.stall if setting.options.raises_worst", "schedule.stall if not setting.options.raises_worst"),
            ("min(most, limit - taken)", "most"),
            ("            if relative <= tolerance:", "            if relative < 0.0:"),
            ("problem(CornerWeights(), points, kept)", "problem(CornerWeights(), points)"),
            ("problem(weights, points, kept)", "problem(weights, points)"),
            ("schedule.stiffness / max(", "0.5 * schedule.stiffness / max("),
            ("schedule.stiffness / max(", "1.2 * schedule.stiffness / max("),
            ("stiffness if number > 0 else 0.0", "0.0"),
            ("slow + 1 if number > 0 and worst", "slow + 1 if worst"),
            ("if slow == 2:", "if slow == 1:"),
            ("(1.0 - schedule.least_gain) * before", "schedule.least_gain * before"),
        ],
    ),
    "hexconformal.regularization.quadratic.run": (
        ("regularization/quadratic/test_run.py", "regularization/quadratic/test_quadratic.py"),
        [
            ("if not (self._valid & ~valid).any() and invalid", "if invalid"),
            ("kept &= record.min_scaled_jacobian >= floor - LEVEL", "pass"),
            ("kept = not self._valid.all() or no_worse_than(record, self.history[0])", "kept = True"),
            ("if self._spoiled(other) < spoiled else points", "if self._spoiled(other) > spoiled else points"),
            ('self.options.boundary == "slide" and distance > bound', "distance > np.inf"),
            (" and not self._is_worse(found.quality, before)", ""),
            ("(worst < first - LEVEL).any() or gain < -_ROUNDING", "gain < -_ROUNDING"),
            ("(worst < first - LEVEL).any() or gain < -_ROUNDING", "(worst < first - LEVEL).any()"),
            ("worst > their_worst - LEVEL and mean > their_mean", "mean > their_mean"),
            ("if (worse := self._worse_types(points)).any():", "if False:"),
            ("for candidate in (self._points, self._before_raising)", "for candidate in (self._points,)"),
            ("        if setting.folded_cells(points).any():", "        if False:"),
            ("if taken == options.max_iterations and relative", "if relative"),
            ("if (before.valid & ~after.valid).any():", "if False:"),
            ("same, gain = (after.valid == before.valid).all(), ", "same, gain = True, "),
        ],
    ),
    "hexconformal.io.raised_cells": (
        ("io/test_elevation.py",),
        [
            ("nodes[self._kept[nodes].all(axis=1)]", "nodes"),
            ("self._kept[block.nodes] = False", "self._kept[block.nodes] = True"),
            ("np.cumsum(self._kept) - 1", "np.cumsum(self._kept)"),
            ("(both >= 0).all(axis=1)", "(both >= -1).all(axis=1)"),
            ("whole = (quadratic >= 0).all(axis=1)", "whole = (quadratic >= -1).all(axis=1)"),
            ("outer[self._first_nodes] = False", "outer[self._first_nodes] = True"),
            ("if fewer > 0:", "if fewer > 99:"),
            ("labels.max(initial=0) + 1 + np", "labels.max(initial=0) + np"),
            ("block.rows[whole])", "block.rows[~whole])"),
        ],
    ),
    "hexconformal.regularization.minimize": (
        (
            "regularization/test_minimization.py",
            "regularization/test_option_effects.py",
            "untangling/test_thin_cells.py",
        ),
        [
            ("if norm <= tolerance * first:", "if norm >= tolerance * first:"),
            ("slow + 1 if at.energy - following.energy < self", "slow + 1 if at.energy - following.energy > self"),
            ("** (-2.0 / 3.0)", "** (2.0 / 3.0)"),
            ("volumes / mean if mean > 0.0", "volumes * mean if mean > 0.0"),
            ("taken == schedule.handover", "taken == 0"),
            ("phases = (method,) if method != \"auto\" else", "phases ="),
            ("deepcopy(equation.assembly.matrix)", "equation.assembly.matrix"),
            ("_at_corners = distortion.quadrature == \"corners\" and", "_at_corners ="),
            ("if phase == \"lbfgs\":", "if phase == \"newton\":"),
            ("if thinnest >= schedule.steep:\n            return", "if True:\n            return"),
        ],
    ),
    "hexconformal.formulation.formulation": (
        (
            "formulation/test_formulation.py",
            "regularization/test_minimization.py",
            "energy/test_volume_term.py",
            "energy/test_corner_term.py",
            "regularization/test_mixed.py",
        ),
        [
            ("below = (quality > 0.0) & (quality < self.least)", "below = np.zeros(len(quality), dtype=bool)"),
            ("< self.least - LEVEL).any()", "< -2.0).any()"),
            ("None if self._valid.all() else np.flatnonzero(self._valid)", "np.flatnonzero(~self._valid)"),
            ("self._valid |= is_valid(points, self._cells)", "pass"),
            ("volume * self.volume_factor", "volume"),
            ("if volume > 0.0 and len(self.target_volumes):", "if len(self.target_volumes):"),
            ("coupled.closed(moving & self.free)", "coupled.closed(self.free)"),
        ],
    ),
    "hexconformal.solver.admissible": (
        ("solver/test_admissible.py",),
        [
            ("says = length > 1e-3 * area", "says = length > 0.0"),
            ("rank < forbidden[:, None]", "rank <= forbidden[:, None]"),
            ("np.argsort(np.argsort(share, axis=1", "np.argsort(np.argsort(-share, axis=1"),
            ("sums = sums.copy()", "sums = sums"),
            ("projectors[np.abs(projectors) < 1e-9] = 0.0", "pass"),
            ("held | (mask if", "held & (mask if"),
            ("projectors[np.searchsorted(ids, held)] = 0.0", "pass"),
            ("self.projectors.any(axis=(1, 2))", "self.projectors.all(axis=(1, 2))"),
            ("own.with_held(np.flatnonzero(~moving[patch.nodes]))", "own"),
        ],
    ),
    "hexconformal.geometry.closest_point": (
        ("geometry/test_closest_point.py",),
        [
            ("0] = pairs[:, :, 0].min(axis=1)", "0] = pairs[:, :, 0].max(axis=1)"),
            ("+ 1) + self.curves[:, None]", "+ 1)"),
            ("wanted[~np.isin(wanted, self.curves)]", "wanted[wanted > self.curves.max()]"),
        ],
    ),
    "hexconformal.geometry.closest_point_kernels": (
        ("geometry/test_closest_point.py",),
        [
            ("0.25 * (total + points[faces[f, 3], r])", "0.25 * (total + points[faces[f, 2], r])"),
            ("_SLIVER = 1e-10", "_SLIVER = 0.0"),
            ("v = d1 / (d1 - d3)", "v = d1 / (d1 + d3)"),
            ("if d6 >= 0.0 and d5 <= d6:", "if d6 >= 0.0:"),
            ("weights[k, (t + 1) % 4] += found[2]", "weights[k, (t + 1) % 4] += found[1]"),
            ("if face == here:", "if face != here:"),
            ("if not bounds[size] < best:", "if bounds[size] < 0.5 * best:"),
        ],
    ),
    "hexconformal.geometry.distance_barrier": (
        ("geometry/test_distance_barrier.py", "geometry/test_barrier_state.py"),
        [
            ("(samples.attraction > 0.0) | (most >= onset)", "(samples.attraction > 0.0) & (most >= onset)"),
            ("worst = max(worst, float(found.distances.max(", "worst = (float(found.distances.max("),
            ("measured_at=x, wall=wall", "wall=wall"),
            ("np.concatenate([points, self.beside]) if", "points if"),
            ("spacing=max(0.5 * self.spacing", "spacing=max(self.spacing"),
            ("if (last := self._last) and np.array_equal(last[0][0], points):", "if last := self._last:"),
            ("if everywhere and (found.distances > far).any():", "if False:"),
        ],
    ),
    "hexconformal.geometry.barrier_schedule": (
        ("geometry/test_distance_barrier.py", "geometry/test_barrier_state.py", "regularization/test_faithful.py"),
        [
            ("1.0, self.most)", "1.0, 1.0)"),
            ("1.0 / np.maximum(self.thin * depths", "1.0 * np.maximum(self.thin * depths"),
            ("2.0 * (k * (over > 0) * r * (1.0 + over * r) ** 2", "2.0 * (k * (over > 0) * r * (1.0 + over * r)"),
            ("schedule.wall if worst < schedule.wall else", "schedule.wall if worst < schedule.room else"),
        ],
    ),
    "hexconformal.formulation.compatible_constraint": (
        ("formulation/test_compatible_constraint.py",),
        [
            ("middle = 0.5 * (self.start", "middle = 0.0 * (self.start"),
            ("np.unique(quads * count + patches[:, None]", "np.unique(quads * count + 0 * patches[:, None]"),
            ("0.5 * self._along(points) ** 2", "1.0 * self._along(points) ** 2"),
            ("matrix.indptr[nodes[there] + 1] - 1", "matrix.indptr[nodes[there] + 1] - 2"),
        ],
    ),
    "hexconformal.geometry.distance_samples": (
        ("geometry/test_distance_barrier.py", "geometry/test_barrier_state.py"),
        [
            ("self.distances + moved[self.carriers]", "self.distances"),
            ("distances, 1e-9 * bound, *where", "distances, 1e9 * bound, *where"),
            ("inside = (weights.min(axis=1) > 0.0)", "inside = (weights.min(axis=1) > -1.0)"),
            ("near, distances = self.near.copy(), most.copy()", "near, distances = self.near, most.copy()"),
            ("np.flatnonzero(touched[faces].any(axis=1))", "np.flatnonzero(movable)"),
            ("keep, inside = patch.moving[self.nodes].any(", "keep, inside = patch.moving[self.nodes].all("),
        ],
    ),
    "hexconformal.geometry.sample_sums": (
        ("geometry/test_distance_barrier.py", "geometry/test_barrier_state.py"),
        [
            ("if b > a or share", "if b >= a or share"),
            ("out[k, r] += weights[k, i] * points", "out[k, r] += weights[k, 0] * points"),
            ("gradient[a, r] += w * slopes[k]", "gradient[a, r] += slopes[k]"),
            ("if a < first or a >= last or w == 0.0:", "if a < first or w == 0.0:"),
        ],
    ),
    "surface.energy.barrier": (
        ("surface/energy/test_barrier.py", "surface/energy/test_distortion_energy.py"),
        [
            ("* (1 + np.minimum(relative", "/ (1 + np.minimum(relative"),
            ("self._weights / (1 + relative / self.cap)", "self._weights / (1 + self.cap / relative)"),
            ("float(self.continuation * self._m)", "float(self._m)"),
        ],
    ),
    "surface.energy.barrier_kernels": (
        ("surface/energy/test_barrier.py", "surface/energy/test_distortion_energy.py"),
        [
            ("2.0 * c * e - 1.0 / (m * root**3)", "2.0 * c * e + 1.0 / (m * root**3)"),
            ("combine(u, na, -v, nb)", "combine(u, na, v, nb)"),
            ("largest = 0.5 * (x + z + np.hypot(x - z, 2.0 * y))", "largest = 0.5 * (x + z + np.hypot(x - z, y))"),
            ("0.5 * (1.0 + area / max(root, _TINY))", "0.5 * (1.0 - area / max(root, _TINY))"),
            ("max(bend, 0.0) * (8.0 *", "max(bend, 0.0) * (4.0 *"),
        ],
    ),
    "surface.constraint.saddle_point": (
        ("surface/energy/test_distortion_energy.py", "surface/constraint/test_saddle_point.py"),
        [
            ("nodal_areas(points, cells) / eps", "nodal_areas(points, cells) * eps"),
            ("points + v / 2, features", "points, features"),
            ("self._data[diagonal] +=", "self._data[diagonal] -="),
            ("(np.eye(3) - held)", "held"),
            ("self._projectors * moving[:, None, None]", "self._projectors * ~moving[:, None, None]"),
            ("> _DIRECT:", "< _DIRECT:"),
            ("(moving & (np.diff(indptr) > 0))", "(np.diff(indptr) > 0)"),
        ],
    ),
    "surface.flow.step": (
        ("surface/flow/test_step.py", "surface/flow/test_evolve.py", "surface/flow/test_flows.py"),
        [
            ("np.where(fixed[:, None], 0.0, -gradient)", "-gradient"),
            ("loads = loads * free[:, None]", "loads = loads * 1.0"),
            ("coupling = free_nodes @ surface.stiffness", "coupling = 1.0 * surface.stiffness"),
            ("smoothing_length**2 *", "0.0 *"),
            ("multipliers = multipliers - change", "multipliers = multipliers - 0.5 * change"),
            ("if conserved.error(new) <= 1e-11 else None", "if conserved.error(new) <= np.inf else None"),
            ("1.0 / np.broadcast_to(bending,", "1.0 * np.broadcast_to(bending,"),
        ],
    ),
    "hexconformal.formulation.work": (
        ("formulation/test_work.py",),
        [
            ("part.left -= cells + self.step", "part.left -= cells"),
            ("or (self.whole is not None and self.whole.is_done)", "or self.whole is None"),
            ("return Work(share * self.left, self.step, self)", "return Work(share * self.left, self.step)"),
        ],
    ),
    "hexconformal.untangling.thin_cells": (
        ("untangling/test_thin_cells.py",),
        [
            ("points[nodes] = local", "points[nodes] = points[nodes]"),
            ("if not thin.any():", "if thin.any():"),
            ("if since == schedule.patience:", "if since == 0:"),
        ],
    ),
    "hexconformal.regularization.worst_cells": (
        ("regularization/test_worst_cells.py", "regularization/test_acceptance.py"),
        [
            ("after < before + schedule.worth", "after > before + schedule.worth"),
            ("if after >= schedule.poor:", "if after >= 0.0:"),
            ("stalled |= space.at_smallest(quality, aside)", "stalled |= False"),
            ("schedule.stiffness / max(", "0.1 * schedule.stiffness / max("),
        ],
    ),
    "hexconformal.regularization.acceptance": (
        ("regularization/test_faithful.py", "regularization/test_acceptance.py"),
        [
            ("return tangled < before", "return tangled > before"),
            ("(record.inverted, record.flat)", "(record.inverted, first.flat)"),
            ("_SHAPE_LOSS * min(first.min_shape, _POOR_SHAPE)", "min(first.min_shape, _POOR_SHAPE)"),
            ("abs(after - before) > formulation", "abs(after - before) < formulation"),
        ],
    ),
    "hexconformal.plots.drawn_faces": (
        ("plots/test_drawn_faces.py",),
        [
            ("_MOST_PIECES = 12", "_MOST_PIECES = 1"),
            ("reference_corners[corners], cell_type", "reference_corners[corners[[0, 1, 3, 2]]], cell_type"),
            ("max(initial=0.0) / 2 for", "max(initial=0.0) / 8 for"),
            ("differs = of_pairs !=", "differs = of_pairs =="),
            ("np.flatnonzero(kept)[owners]", "owners"),
        ],
    ),
}  # fmt: skip


def survives(folder: Path, environment: dict[str, str], tests: tuple[str, ...]) -> bool:
    """Whether the tests pass."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-x",
        "-q",
        "-p",
        "no:cacheprovider",
        "-m",
        "",  # those that take long, too
        *(f"tests/{name}" for name in tests),
    ]
    try:
        code = subprocess.run(command, cwd=folder, env=environment, capture_output=True, timeout=LIMIT).returncode
    except subprocess.TimeoutExpired:
        return False
    return code == 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=list(MUTANTS), metavar="MODULE", help="these modules")
    arguments = parser.parse_args()
    rows, survivors, began = [], [], time.perf_counter()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made) / "project"
        # The parent of the copy is empty: tests on the reference meshes are skipped.
        shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns(".git", "__pycache__", "*.nb?", ".*_cache", "site"))
        environment = {**os.environ, "PYTHONPATH": str(folder / "src"), "NUMBA_CACHE_DIR": str(Path(made) / "numba")}
        for module, (tests, changes) in MUTANTS.items():
            if module not in arguments.only:
                continue
            path = (folder / "src").joinpath(*module.split(".")).with_suffix(".py")
            sound = path.read_text(encoding="utf-8")
            if not survives(folder, environment, tests):
                raise SystemExit(f"{module}: the tests fail without a change")
            killed = 0
            for old, new in changes:
                if sound.count(old) < 1:
                    raise SystemExit(f"{module}: there is no {old!r} any more")
                path.write_text(sound.replace(old, new, 1), encoding="utf-8")
                if survives(folder, environment, tests):
                    survivors.append(f"{module}: {old!r} -> {new!r}")
                    print(survivors[-1], flush=True)
                else:
                    killed += 1
            path.write_text(sound, encoding="utf-8")
            rows.append(f"| {module} | {', '.join(tests)} | {len(changes)} | {killed} |")
            print(rows[-1], flush=True)
    print("\n| module | tests | mutants | killed |\n|---|---|--:|--:|")
    print("\n".join(rows))
    print(f"\n{time.perf_counter() - began:.0f} s; survivors: {len(survivors)}")
    return int(bool(survivors))


if __name__ == "__main__":
    sys.exit(main())
