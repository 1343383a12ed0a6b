"""Figure 1 of Gruber & Aulisa: a statue under mean curvature flow of constant volume, remeshed on the way.

    python examples/statue.py                        # the statue in data/, a minute
    python examples/statue.py other.ply --up 0 1 0   # any closed surface

Leaves a picture: the flow without remeshing above, with it below, from the input to a round body.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pictures

import surface

DATA = Path(__file__).resolve().parent.parent / "data" / "statue.ply"


def main() -> None:
    """Follow both flows and draw them."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("mesh", type=Path, nargs="?", default=DATA)
    parser.add_argument("--steps", type=int, default=80)
    parser.add_argument("--picture", type=Path, default=Path("statue.png"))
    parser.add_argument("--view", type=float, nargs=3, default=(0.7, -1.0, 0.25), help="where the camera stands")
    parser.add_argument("--up", type=float, nargs=3, default=(0.0, 0.0, 1.0))
    arguments = parser.parse_args()
    rows = []
    for title, remesh in (("(a) without remeshing", False), ("(b) with remeshing", True)):
        flow = surface.MeanCurvature(arguments.mesh, conserve="volume")
        run = surface.Evolution(flow, surface.Stepping(steps=arguments.steps, remesh=remesh, stall=1e-4))
        moments = []
        for moment in run:
            moments.append(moment)
            record = moment.record
            if record.step in (0, 1, 2, 5) or record.step % 10 == 0:
                print(
                    f"{title}: step {record.step}, t = {record.time:.3g}, area {record.area:.5g}, volume "
                    f"{record.volume:.12g}, reduced volume {record.reduced_volume:.4f}, smallest angle "
                    f"{record.min_angle:.2f}, mean {record.mean_angle:.2f}", flush=True,
                )  # fmt: skip
        print(f"{title}: {run.reason}")
        area = np.array([moment.record.area for moment in moments])
        share = (area[0] - area) / (area[0] - area[-1])
        shown = [0, 1, *(int(np.searchsorted(share, goal)) for goal in (0.3, 0.7)), len(moments) - 1]
        rows.append((title, [pictures.Shot(moments[k].surface_mesh, f"step {moments[k].record.step}") for k in shown]))
    pictures.draw(arguments.picture, rows, arguments.view, arguments.up)
    print(f"wrote {arguments.picture}")


if __name__ == "__main__":
    main()
