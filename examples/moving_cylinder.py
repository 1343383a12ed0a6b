"""Flow around a moving cylinder: Navier-Stokes on hexahedra that follow it (ALE), and a cylinder on a spring.

    python examples/moving_cylinder.py forced            # the cylinder oscillates as prescribed
    python examples/moving_cylinder.py spring            # its motion is computed: fluid-structure interaction

Needs scikit-fem. Writes run.pvd and history.csv into a folder and a picture beside them. One layer of cells in z,
velocity in the plane, diameter, density and inflow 1, Reynolds number 100. The mesh velocity comes from MeshMotion.

A step from the mesh X0 to X1 = X0 + dt w solves, on test functions that move with the mesh,

    int_X1 u1 phi - int_X0 u0 phi = dt mean over the times g of int_Xg phi (u1 div w - ((u0 - w) . grad) u1) - ...

and the stresses. Along straight paths the volume of a cell is cubic in time at most, so the two Gauss times g
integrate its rate exactly, with whatever quadrature in space: a uniform velocity stays uniform to round-off (geometric
conservation law; Lesoinne & Farhat, Comput. Methods Appl. Mech. Eng. 134 (1996)). Velocity and pressure are
trilinear, stabilised along streamlines and by a pressure Laplacian (Tezduyar, Adv. Appl. Mech. 28 (1991)).
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

import hexconformal as hc

Field = NDArray[np.float64]

RADIUS = 0.5
BOX = (-4.0, 10.0, -4.0, 4.0)
TO_SKFEM = [0, 4, 3, 1, 7, 5, 2, 6]  # scikit-fem's order of a cell's nodes from VTK's
GAUSS = (0.5 - 0.5 / np.sqrt(3), 0.5 + 0.5 / np.sqrt(3))


def o_grid(around: int = 14, layers: int = 22, first: float = 0.012, depth: float = 0.25) -> tuple[Field, NDArray]:
    """A box around a cylinder, one layer of cells in z: (points, cells), thinnest at the cylinder.

    Parameters
    ----------
    around, layers
        Cells along a quarter of the circle, and from the circle to the box.
    first
        Height of the cells at the cylinder, over the distance to the box.
    depth
        Size in z.
    """
    x0, x1, y0, y1 = BOX
    corners = np.array([[x1, y0], [x1, y1], [x0, y1], [x0, y0]])
    s = np.arange(around) / around
    angles = np.concatenate([-np.pi / 4 + np.pi / 2 * (side + s) for side in range(4)])
    ends = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    outer = np.concatenate([a + s[:, None] * (b - a) for a, b in ends])
    circle = RADIUS * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    low, high = 1.0, 2.0
    for _ in range(80):  # growth of the layers, by bisection
        growth = (low + high) / 2
        low, high = (growth, high) if first * (growth ** np.arange(layers)).sum() < 1 else (low, growth)
    heights = np.r_[0.0, np.cumsum(growth ** np.arange(layers))]
    heights /= heights[-1]
    plane = circle + heights[:, None, None] * (outer - circle)
    n = 4 * around
    flat = np.concatenate([plane.reshape(-1, 2)] * 2)
    points = np.column_stack([flat, np.repeat([0.0, depth], len(flat) // 2)])
    ids = np.arange((layers + 1) * n).reshape(layers + 1, n)
    a, b = ids[:-1], ids[1:]
    quads = np.stack([a, b, np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)], axis=-1).reshape(-1, 4)
    return points, np.hstack([quads, quads + ids.size])


class Flow:
    """Incompressible flow on a moving mesh of one layer of cells, the same at its bottom and its top.

    Parameters
    ----------
    points, cells
        The mesh at the start.
    given
        Nodes whose velocity is given.
    viscosity
        Kinematic.
    """

    def __init__(self, points: Field, cells: NDArray, given: NDArray, viscosity: float) -> None:
        self.points, self._viscosity = points, viscosity
        self._half = len(points) // 2
        self._given = np.unique(given % self._half)
        self._t = np.ascontiguousarray(cells[:, TO_SKFEM].T)
        self.velocity, self.pressure = np.zeros((len(points), 2)), np.zeros(len(points))
        self._mass = self._matrices(points, None, None, 1.0)["mass"]

    def step(self, points: Field, dt: float, values: Field) -> Field:
        """Go on to a mesh, with velocities (n, 2) at the given nodes; the force (n / 2, 2) of fluid on nodes in z."""
        n = self._half
        w = (points - self.points) / dt
        rate, gradients = 0.0, [0.0, 0.0]
        for share in GAUSS:
            at = self._matrices(self.points + share * dt * w, w, self.velocity, dt)
            rate = rate + 0.5 * at["rate"]
            gradients = [g + 0.5 * at[name] for g, name in zip(gradients, ("px", "py"), strict=True)]
        end = self._matrices(points, None, None, dt)
        momentum = end["mass"] / dt + rate
        zero = sparse.csr_matrix((n, n))
        matrix = sparse.bmat(
            [
                [momentum, zero, -gradients[0]],
                [zero, momentum, -gradients[1]],
                [end["px"].T, end["py"].T, end["pressure"]],
            ],
            format="csc",
        )
        old = np.asarray(self._mass @ self.velocity[:n]) / dt
        rhs = np.concatenate([old[:, 0], old[:, 1], np.zeros(n)])
        known = np.concatenate([self._given, n + self._given])
        free = np.setdiff1d(np.arange(3 * n), known)
        x = np.zeros(3 * n)
        x[known] = values[self._given].T.ravel()
        x[free] = splu(matrix[free][:, free]).solve(rhs[free] - matrix[free][:, known] @ x[known])
        residual = (matrix @ x - rhs)[: 2 * n].reshape(2, n).T
        self.points, self._mass = points, end["mass"]
        self.velocity = np.tile(x[: 2 * n].reshape(2, n).T, (2, 1))
        self.pressure = np.tile(x[2 * n :], 2)
        # What the fluid lacks at a node is what holds it there; the body feels the opposite.
        return -residual

    def _matrices(self, points: Field, w: Field | None, u: Field | None, dt: float) -> dict[str, Any]:
        import skfem as sk
        from skfem.helpers import dot, grad

        mesh = sk.MeshHex(np.ascontiguousarray(points.T), self._t, validate=False, sort_t=False)
        basis = sk.Basis(mesh, sk.ElementHex1(), intorder=2)
        nu = self._viscosity

        @sk.BilinearForm
        def mass(a, b, _):
            return a * b

        if w is None:

            @sk.BilinearForm
            def pressure(p, q, v):
                # The size of a cell in the plane, in which all gradients lie.
                return dot(grad(p), grad(q)) / (2.0 / dt + 12.0 * nu / v.size)

            size = np.abs(np.asarray(basis.dx).sum(axis=1)) / np.ptp(points[:, 2])
            size = np.repeat(size[:, None], basis.dx.shape[1], axis=1)
            parts = {"mass": mass.assemble(basis), "pressure": pressure.assemble(basis, size=size)}
        else:
            wind = [basis.interpolate(u[:, k]) for k in range(2)]
            drift = [basis.interpolate(w[:, k]) for k in range(3)]

            @sk.BilinearForm
            def rate(a, b, v):
                cx, cy = v.u0 - v.w0, v.u1 - v.w1
                along = cx * a.grad[0] + cy * a.grad[1] - v.w2 * a.grad[2]
                test = cx * b.grad[0] + cy * b.grad[1] - v.w2 * b.grad[2]
                divergence = v.w0.grad[0] + v.w1.grad[1] + v.w2.grad[2]
                speed = np.sqrt(cx**2 + cy**2 + 1e-30)
                tau = 1.0 / np.sqrt((2 / dt) ** 2 + 4 * speed**2 / v.size + (12 * nu / v.size) ** 2)
                return b * (along - a * divergence) + nu * dot(grad(a), grad(b)) + tau * along * test

            size = np.abs(np.asarray(basis.dx).sum(axis=1)) / np.ptp(points[:, 2])
            size = np.repeat(size[:, None], basis.dx.shape[1], axis=1)
            fields = {"u0": wind[0], "u1": wind[1], "w0": drift[0], "w1": drift[1], "w2": drift[2], "size": size}
            parts = {"rate": rate.assemble(basis, **fields)}

        for k, name in enumerate(("px", "py")):

            @sk.BilinearForm
            def gradient(p, b, _, k=k):
                return p * b.grad[k]

            parts[name] = gradient.assemble(basis)
        tie = sparse.vstack([sparse.eye(self._half)] * 2, format="csr")
        return {name: tie.T @ part @ tie for name, part in parts.items()}


class Tunnel:
    """A cylinder in a stream, moved across it: the mesh motion, the flow, and the force on the cylinder."""

    def __init__(self, reynolds: float = 100.0, inflow: tuple[float, float] = (1.0, 0.0), **grid: Any) -> None:
        points, cells = o_grid(**grid)
        x, y = points[:, 0], points[:, 1]
        x0, x1, y0, y1 = BOX
        wall = (x == x0) | (x == x1) | (y == y0) | (y == y1)
        self.cells = cells
        self.body = np.flatnonzero(np.hypot(x, y) < RADIUS * 1.0001)
        self.motion = hc.MeshMotion((points, cells), moving=self.body, fixed=np.flatnonzero(wall))
        # Outflow: whatever comes through the side x1.
        given = np.concatenate([self.body, np.flatnonzero(wall & (x < x1))])
        self._inflow, self._depth = np.asarray(inflow), np.ptp(points[:, 2])
        self._begin = lambda at: Flow(at, cells, given, 1.0 / reynolds)
        self.begin(np.zeros(2))

    def begin(self, way: Field) -> None:
        """Put the cylinder somewhere, into a uniform stream."""
        start = self.motion.step(np.tile([*way, 0.0], (len(self.body), 1)))
        self.flow = self._begin(start.points)
        self.flow.velocity[:] = self._inflow

    def step(self, way: Field, dt: float, body_velocity: Field) -> tuple[Field, hc.MotionStep]:
        """Put the cylinder (2,) away from its first place; force on it per depth, and how the mesh moved."""
        taken = self.motion.step(np.tile([*way, 0.0], (len(self.body), 1)), dt=dt)
        if taken.report.refused:
            raise SystemExit(f"the mesh could not follow: {taken.report.reason}")
        values = np.tile(self._inflow, (len(taken.points), 1))
        values[self.body] = body_velocity
        force = self.flow.step(taken.points, dt, values)
        return force[self.body[: len(self.body) // 2]].sum(axis=0) / self._depth, taken

    def frame(self, taken: hc.MotionStep) -> hc.HexMesh:
        """The mesh with its fields."""
        velocity = np.column_stack([self.flow.velocity, np.zeros(len(taken.points))])
        data = {"velocity": velocity, "pressure": self.flow.pressure, "mesh_velocity": taken.velocity}
        return hc.HexMesh(taken.points, self.cells, data)


def uniform_deviation(steps: int = 100, dt: float = 0.05, **grid: Any) -> float:
    """Largest deviation of a uniform velocity from itself, on a mesh in motion."""
    stream = (1.0, 0.5)
    tunnel = Tunnel(inflow=stream, **grid)
    worst = 0.0
    for k in range(1, steps + 1):
        t = k * dt
        tunnel.step(np.array([0.2 * np.sin(2 * t), 0.4 * np.sin(3 * t)]), dt, np.asarray(stream))
        worst = max(worst, float(np.abs(tunnel.flow.velocity - stream).max()))
    return worst


def forced(t: float, amplitude: float = 0.4, period: float = 5.0) -> tuple[float, float]:
    """Place and speed of a cylinder that begins smoothly to oscillate."""
    rate = 2 * np.pi / period
    start, faster = 1 - np.exp(-t), np.exp(-t)
    return amplitude * start * np.sin(rate * t), amplitude * (
        faster * np.sin(rate * t) + start * rate * np.cos(rate * t)
    )


class Spring:
    """m y'' + k y = F by the average-acceleration method; the flow gives F, one exchange and one correction a step.

    Parameters
    ----------
    mass_ratio
        Mass of the cylinder over that of the fluid it displaces.
    period
        Of its oscillation in a vacuum.
    place
        Where it is let go.
    """

    def __init__(self, mass_ratio: float = 10.0, period: float = 5.0, place: float = 0.4) -> None:
        self.mass = mass_ratio * np.pi * RADIUS**2
        self.stiffness = self.mass * (2 * np.pi / period) ** 2
        self.y, self.v, self.force = place, 0.0, 0.0

    def predicted(self, force: float, dt: float) -> tuple[float, float]:
        """Place and speed after a step with that force at its end."""
        a0 = (self.force - self.stiffness * self.y) / self.mass
        y = self.y + dt * self.v + 0.25 * dt**2 * (a0 + force / self.mass)
        y /= 1 + 0.25 * dt**2 * self.stiffness / self.mass
        a1 = (force - self.stiffness * y) / self.mass
        return y, self.v + 0.5 * dt * (a0 + a1)


def simulated(kind: str, folder: Path, t_end: float, dt: float, tolerance: float = 1e-4) -> list[dict[str, float]]:
    """Run one of the two, writing frames and a history; the rows of that."""
    tunnel, spring = Tunnel(), Spring()
    folder.mkdir(parents=True, exist_ok=True)
    rows, force, before = [], np.zeros(2), None
    if kind == "spring":
        tunnel.begin(np.array([0.0, spring.y]))
    with hc.Series(folder / "run.pvd") as series:
        for k in range(1, round(t_end / dt) + 1):
            t = k * dt
            if kind == "forced":
                y, v = forced(t)
                force, taken = tunnel.step(np.array([0.0, y]), dt, np.array([0.0, v]))
                rounds = 1
            else:
                # Partitioned coupling: mesh and flow go back to the start of the step until the force has settled.
                rounds, state, flow = 0, tunnel.motion.state(), dict(vars(tunnel.flow))
                guess = force[1] if before is None else 2 * force[1] - before
                while (rounds := rounds + 1) <= 10:
                    tunnel.motion.resume(state)
                    vars(tunnel.flow).update(flow)
                    y, v = spring.predicted(guess, dt)
                    found, taken = tunnel.step(np.array([0.0, y]), dt, np.array([0.0, v]))
                    if abs(found[1] - guess) <= tolerance * max(1.0, abs(found[1])):
                        break
                    guess += 0.8 * (found[1] - guess)
                before, force = force[1], found
                spring.y, spring.v, spring.force = y, v, guess
            quality = taken.report.min_scaled_jacobian
            rows.append(
                {"time": t, "y": y, "drag": 2 * force[0], "lift": 2 * force[1], "rounds": rounds, "min_sj": quality}
            )
            if k % 4 == 0:
                series.add(t, tunnel.frame(taken))
            if k % 20 == 0:
                print({name: round(float(value), 4) for name, value in rows[-1].items()}, flush=True)
    with open(folder / "history.csv", "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    picture(folder / f"moving_{kind}.png", tunnel.frame(taken), rows)
    return rows


def picture(path: Path, mesh: hc.HexMesh, rows: list[dict[str, float]]) -> None:
    """The mesh around the cylinder coloured by speed, and the history."""
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 4.2), facecolor="white", layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.6, 1))
    quads = mesh.cells[:, :4]
    speed = np.linalg.norm(mesh.point_data["velocity"], axis=1)[quads].mean(axis=1)
    drawn = PolyCollection(
        list(mesh.points[quads][:, :, :2]), array=speed, cmap="viridis", edgecolor="#00000060", lw=0.3
    )
    left.add_collection(drawn)
    left.set(xlim=(-2, 6), ylim=(-2.4, 2.4), aspect="equal", title=f"speed at t = {rows[-1]['time']:g}")
    figure.colorbar(drawn, ax=left, shrink=0.8)
    time = [row["time"] for row in rows]
    for name, label in (("y", "place y / D"), ("lift", "lift coefficient")):
        right.plot(time, [row[name] for row in rows], label=label)
    # The first steps, from a stream that does not know of the cylinder, are out of scale.
    top = 1.1 * max(max(abs(row["lift"]), abs(row["y"])) for row in rows[len(rows) // 10 :])
    right.set(xlabel="time", title="history", ylim=(-top, top))
    right.grid(alpha=0.3)
    right.legend()
    figure.savefig(path, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", choices=("forced", "spring", "uniform"))
    parser.add_argument("--folder", type=Path, help="where to write (default moving-KIND)")
    parser.add_argument("--t-end", type=float, default=20.0)
    parser.add_argument("--dt", type=float, default=0.1)
    asked = parser.parse_args()
    if asked.kind == "uniform":
        print(f"largest deviation of a uniform velocity: {uniform_deviation():.1e}")
    else:
        simulated(asked.kind, asked.folder or Path(f"moving-{asked.kind}"), asked.t_end, asked.dt)


if __name__ == "__main__":
    main()
