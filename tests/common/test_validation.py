"""Options of a wrong type are refused by name, wherever they are given; numbers may be numpy's."""

from dataclasses import fields

import numpy as np
import pytest

import hexconformal as hc
import surface
from hexconformal.common.errors import MeshError, OptionError
from hexconformal.generate import box
from surface.flow import Membrane, Tension

HEXAHEDRA = box((2, 2, 2), (1.0, 1.0, 1.0))
LID = np.flatnonzero(HEXAHEDRA[0][:, 2] == 1)
FAN = ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.3, 0.8, 0]], [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])


def names(kind):
    return [field.name for field in fields(kind)]


def motion(**options):
    return hc.MeshMotion(HEXAHEDRA, **{"moving": LID, **options})


def flow(**options):
    return list(surface.evolve(surface.MeanCurvature(FAN), **{"steps": 1, **options}))


CALLS = [
    *[(lambda **o: hc.regularize(HEXAHEDRA, **{"max_iterations": 1, **o}), name) for name in names(hc.Options)],
    *[(lambda **o: surface.remesh(FAN, **{"max_iterations": 1, **o}), name) for name in names(surface.Options)],
    *[(flow, name) for name in names(surface.Stepping)],
    *[(motion, name) for name in ("moving", "fixed", "target", "operator", "energy_tolerance", "interfaces")],
    (lambda displacement: motion().step(displacement), "displacement"),
    (lambda dt: motion().step(np.zeros((len(LID), 3)), dt), "dt"),
    *[(lambda **o: list(surface.evolve(surface.MeanCurvature(FAN, **o), steps=1)), n) for n in ("conserve", "fixed")],
    (lambda p: surface.PWillmore(FAN, p), "p"),
    *[(lambda **o: surface.Helfrich(FAN, **o), name) for name in ("kc", "c0", "gamma")],
    (lambda terms: surface.Flow(FAN, terms), "terms"),
]


@pytest.mark.parametrize(
    "odd", [object(), 1j, np.array(["a"]), [[1], [2, 3]], {"a": object()}], ids=lambda odd: type(odd).__name__
)
def test_nothing_else_is_raised_than_what_is_promised(odd):
    for call, name in CALLS:
        if name != "remesh_options" or not isinstance(odd, dict):
            with pytest.raises((OptionError, MeshError)):
                call(**{name: odd})


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        (hc.Options, {"gradient_tolerance": None}, "gradient_tolerance must be a number, not None"),
        (hc.Options, {"max_iterations": True}, "max_iterations must be a whole number, not True"),
        (hc.Options, {"max_iterations": float("nan")}, "max_iterations must be a whole number, not nan"),
        (hc.Options, {"max_iterations": 2.5}, "max_iterations must be a whole number, not 2.5"),
        (hc.Options, {"boundary": np.array([1, 2])}, "boundary must be 'slide', 'fixed' or 'free'"),
        (hc.Options, {"emphasis": True}, "emphasis must be 'auto', 'worst' or 'mean', not True"),
        (hc.Options, {"conserve_volume": "no"}, "conserve_volume must be True or False, not 'no'"),
        (surface.Options, {"project": "no"}, "project must be True or False, not 'no'"),
        (surface.Options, {"max_iterations": None}, "max_iterations must be a whole number, not None"),
        (surface.Options, {"feature_angle": True}, "feature_angle must be a number, not True"),
        (
            surface.Options,
            {"feature_edges": "sharp"},
            "feature_edges must be None or an array .k, 2. of edges",
        ),
        (surface.Stepping, {"steps": 2.5}, "steps must be a whole number, not 2.5"),
        (surface.Stepping, {"growth": None}, "growth must be a number, not None"),
        (surface.Stepping, {"remesh": "x"}, "remesh must be a boolean, or every how many steps, not 'x'"),
        (surface.Stepping, {"remesh": 0.5}, "remesh must be a boolean, or every how many steps, not 0.5"),
        (surface.Stepping, {"outputs": "12"}, "outputs must be an array of numbers, not '12'"),
        (surface.Stepping, {"outputs": 1.0}, "outputs must be positive times that grow"),
        (flow, {"remesh": True, "remesh_options": {"colour": 1}}, "unknown option 'colour'"),
        (Tension, {"tension": "x"}, "tension must be a number, not 'x'"),
        (Membrane, {"gamma": float("nan")}, "gamma must be finite, not nan"),
    ],
)
def test_the_message_names_option_and_value(kind, options, words):
    with pytest.raises(OptionError, match=words):
        kind(**options)


def test_numbers_of_numpy_are_numbers():
    angles = [surface.remesh(FAN, feature_angle=angle).report for angle in (50, np.int64(50), np.float32(50))]
    assert [report.to_dict()["options"]["feature_angle"] for report in angles] == [50, 50, 50]
    result = hc.regularize(HEXAHEDRA, gradient_tolerance=np.float32(0.5), max_iterations=np.int64(3))
    assert result.report.to_dict()["options"]["gradient_tolerance"] == 0.5
    moments = list(surface.evolve(surface.MeanCurvature(FAN), steps=np.int64(1), outputs=np.array([1.0, 2.0])))
    assert len(moments) == 2
    assert surface.Stepping(outputs=np.array([1, 2])).outputs == (1.0, 2.0)
