"""Curvature flows of surfaces, with remeshing.

One loop::

    import surface

    flow = surface.Willmore("cube.ply", conserve=("area", "volume"))
    for moment in surface.evolve(flow, steps=200, remesh=True):
        print(moment.record.energy)

Imports `hexconformal.common`, `hexconformal.geometry`, `hexconformal.page`, `hexconformal.runs`,
`mesh`, `io`, `page`, `quality`, `constraint` and `remeshing`.
"""

from .checkpoint import FlowRun, load, save
from .evolve import Evolution, evolve
from .flow_page import flow_page
from .flows import Flow, Helfrich, MeanCurvature, PWillmore, Willmore
from .moment import Moment
from .options import Record as FlowRecord
from .options import Stepping
from .schedule import FlowSchedule
from .terms import Bending, Membrane, Tension, Term

__all__ = [
    "Bending",
    "Evolution",
    "Flow",
    "FlowRecord",
    "FlowRun",
    "FlowSchedule",
    "Helfrich",
    "MeanCurvature",
    "Membrane",
    "Moment",
    "PWillmore",
    "Stepping",
    "Tension",
    "Term",
    "Willmore",
    "evolve",
    "flow_page",
    "load",
    "save",
]
