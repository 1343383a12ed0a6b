"""User interfaces: command line, pyvista accessor, ParaView plugin.

Belongs here: interfaces other than the Python API. The one room of `hexconformal` that knows `surface`; no room imports
it. Imports `common`, `kernel`, `elements`, `mesh`, `generate`, `io`, `quality`, `runs`, `surface.mesh`, `motion`,
`page`, `plots`, `ranks`, `regularization`, `surface.energy`, `surface.io`, `surface.constraint`, `surface.quality`,
`surface.page`, `surface.plots`, `surface.remeshing` and `surface.flow`.
"""

from .cli import main

__all__ = [
    "main",
]
