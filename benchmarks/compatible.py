"""The compatible constraint of Gruber & Aulisa on the boundary of volumes, beside the distance barrier.

    python benchmarks/compatible.py                       # writes docs/compatible.md
    python benchmarks/compatible.py bone.vtu bust.vtu     # meshes of your own, printed only

Each mesh is regularized for its mean cells (no worst ones are raised) with either energy, once kept by the barrier and
once by the constraint for several eps, within a bound that is wide enough to see where the surface goes by itself.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
from machine import described

import hexconformal as hc
from hexconformal.generate import ball, bent_bar, cylinder, jittered
from hexconformal.geometry import SurfaceLocator
from hexconformal.mesh.topology import boundary_quads

ROOT = Path(__file__).resolve().parents[1]
BOUND = 0.05  # diagonals
EPS = 1e-1, 1e-3, 1e-5, 1e-7
PAGE = """# The compatible constraint on volumes

Gruber & Aulisa keep a surface by a *compatible constraint*: displacements are orthogonal to the normal half-way, by a
multiplier that is relaxed by $\\varepsilon$. For volumes they leave a constraint of the boundary to future work. With
`constraint="compatible"` it is theirs, carried over patch by patch ([equations (14a) and
(14b)](mathematics.md#the-boundary)):

```python
import hexconformal as hc
from hexconformal.generate import ball, jittered

result = hc.regularize(
    jittered(*ball(4, 2), 0.3), energy="quaternionic", constraint="compatible", hausdorff=0.05
)
print(f"{{abs(result.report.volume_change):.0e}}")  # the volume drifts by a part in a million
```

The default, `constraint="barrier"`, is a penalty on the distance from the *input* that becomes infinite at
`hausdorff`. Which is better? Jittered meshes, their mean cells regularized (`emphasis="mean"`) within a bound of
{bound:g} diagonals, which is wide: one sees where the surface goes by itself. *H* is the Hausdorff distance and *mean*
the mean distance of the boundary nodes from the input, in diagonals; *distortion* the energy after over that before; SJ
the scaled Jacobian.

{tables}

What is to be seen:

- **The distance.** The barrier takes the room that it is given, as far as that lowers the distortion: its attraction
  is weak, $\\varepsilon = b^2 / 60$ with the bound $b$. The constraint with a small $\\varepsilon$ stays nearer by
  itself. With a large one it gives way step by step, each measured from the last, until the run ends at the bound.
- **The volume** drifts with $\\varepsilon$ to nothing: the middle normal makes the change of volume of a step third
  order in its length. The barrier has `conserve_volume` for that.
- **The distortion.** What is nearer to the input has less room: the sum is lowered less. The cells are as good.
- **Validity** is the same: it is kept by the line search.
- **The cost** is a few times more: every step begins anew with its normals, and the bound is measured at every trial.

So the barrier is the default, as it keeps a bound of the user's at any distance, where cells are unfolded and the worst
ones raised as well; the constraint with a small $\\varepsilon$ is what to take for the energy as it is published, and
where the surface and its volume matter more than the last bit of distortion.

{machine}
"""


def subjects() -> dict[str, Any]:
    """Generated meshes with curved boundaries: closed and smooth, with sharp edges, bent."""
    return {
        "ball": jittered(*ball(5, 3), 0.3, seed=2),
        "cylinder": jittered(*cylinder(4, 3, 6), 0.3, seed=2),
        "bent bar": jittered(*bent_bar((16, 4, 4), 120), 0.3, seed=2),
    }


def table(mesh: Any) -> list[str]:
    """Rows of a table: the barrier, then the constraint for every eps, for both energies."""
    given = hc.as_hex_mesh(mesh)
    quads = boundary_quads(given.cells)[0]
    locator, nodes = SurfaceLocator(given.points, quads), np.unique(quads)
    rows = [
        "| energy | constraint | eps | distortion | SJ min | SJ mean | invalid | volume | H | mean | steps | CPU s |",
        "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for energy in ("quaternionic", "barrier"):
        for constraint, eps in (("barrier", None), *(("compatible", eps) for eps in EPS)):
            options: dict[str, Any] = {} if eps is None else {"eps": eps}
            begun = time.process_time()
            result = hc.regularize(
                mesh,
                energy=energy,
                constraint=constraint,
                emphasis="mean",
                hausdorff=BOUND,
                max_iterations=2000,
                **options,
            )
            seconds, report = time.process_time() - begun, result.report
            after = report.after
            distances = locator.closest(result.points[nodes]).distances / report.diagonal
            rows.append(
                f"| {energy} | {constraint} | {'' if eps is None else f'{eps:g}'} "
                f"| {report.energy_after / report.energy_before:.4f} | {after.scaled_jacobian.min:.3f} "
                f"| {after.scaled_jacobian.mean:.4f} | {after.invalid} | {report.volume_change:+.1e} "
                f"| {report.hausdorff:.5f} | {distances.mean():.5f} | {report.iterations} | {seconds:.1f} |"
            )
            print(rows[-1], flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", help="hexahedral meshes of your own")
    arguments = parser.parse_args()
    if arguments.meshes:
        for path in arguments.meshes:
            print(f"\n{path}\n")
            table(path)
        return
    load, tables = os.getloadavg(), []
    for name, mesh in subjects().items():
        count = len(hc.as_hex_mesh(mesh).cells)
        tables.append("\n".join([f"## A {name}, {count} cells", "", *table(mesh)]))
    page = PAGE.format(tables="\n\n".join(tables), machine=described(load), bound=BOUND)
    (ROOT / "docs" / "compatible.md").write_text(page)


if __name__ == "__main__":
    main()
