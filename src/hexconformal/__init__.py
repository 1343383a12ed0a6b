"""Regular hexahedral and surface meshes by minimizing quaternionic conformal distortion.

The main job is one call::

    import hexconformal as hc

    result = hc.regularize("part.vtu")
    print(result.report)
    hc.write("better.vtu", result.mesh)
"""

from typing import TYPE_CHECKING

from . import current_folder as current_folder  # before all others
from .common import MeshError, OptionError, ReadError, WriteError, loaded_later
from .io import as_hex_mesh, as_volume_mesh, elevated, read, write
from .kernel import use_threads
from .mesh import HexMesh, MixedMesh
from .quality import MixedQuality, Quality, check, orient, quality
from .version import __version__

if TYPE_CHECKING:
    from . import generate
    from .motion import MeshMotion, MotionReport, MotionStep
    from .regularization import Curved, Options, Record, Regularization, Report, Result, curved, regularize
    from .runs import Series
else:
    __getattr__ = loaded_later(
        __name__,
        generate="",
        motion="MeshMotion MotionReport MotionStep",
        regularization="Curved Options Record Regularization Report Result curved regularize",
        runs="Series",
    )

__all__ = [
    "Curved",
    "HexMesh",
    "MeshError",
    "MeshMotion",
    "MixedMesh",
    "MixedQuality",
    "MotionReport",
    "MotionStep",
    "OptionError",
    "Options",
    "Quality",
    "ReadError",
    "Record",
    "Regularization",
    "Report",
    "Result",
    "Series",
    "WriteError",
    "__version__",
    "as_hex_mesh",
    "as_volume_mesh",
    "check",
    "curved",
    "elevated",
    "generate",
    "orient",
    "quality",
    "read",
    "regularize",
    "use_threads",
    "write",
]


def __dir__() -> list[str]:
    # What the Tab key offers: not the modules that all this is made of.
    return __all__
