"""ParaView filters: Regularize Hexahedra, Hexahedra Quality and Remesh Surface.

Load this file in ParaView (Tools > Manage Plugins > Load New); docs/paraview.md of the project says how ParaView's
Python finds the library. The filters also work as vtkAlgorithms without ParaView.
"""

# ParaView makes a module with the name of this file, which must differ from those of other plugins.

from __future__ import annotations

import sys
from typing import Any

from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkDataObject

try:
    from paraview.util.vtkAlgorithm import smdomain, smhint, smproperty, smproxy
except ImportError:

    class _Undecorated:
        """Stands in for ParaView's decorators and returns what they decorate unchanged."""

        def __getattr__(self, name: str) -> Any:
            return lambda *words, **named: lambda decorated: decorated

    smdomain = smhint = smproperty = smproxy = _Undecorated()

paraview_plugin_name = "hexconformal"

_MENU = '<ShowInMenu category="Hexconformal"/>'
_BOOLEAN = '<BooleanDomain name="bool"/>'
_NON_NEGATIVE = '<IntRangeDomain name="range" min="0"/>'


def _help(text: str, domain: str = "") -> Any:
    """A decorator with the documentation of a property and the domain of its values."""
    return smdomain.xml(f"<Documentation>{text}</Documentation>{domain}")


def _choices(*names: str) -> str:
    entries = "".join(f'<String value="{name}"/>' for name in names)
    return f'<StringListDomain name="list">{entries}</StringListDomain>'


class _Filter(VTKPythonAlgorithmBase):  # type: ignore[misc]
    """A filter from one dataset to another of the same type; on an error of VTK the output is empty.

    The library itself is imported when a filter runs, so that a failed import is an error like any other.
    """

    label = ""

    def __init__(self, data_type: str, **options: Any) -> None:
        VTKPythonAlgorithmBase.__init__(self, nInputPorts=1, inputType=data_type, nOutputPorts=1, outputType=data_type)
        self.options = options

    def set_option(self, name: str, value: Any) -> None:
        """Set an option; the filter runs again if that changes it."""
        if self.options[name] != value:
            self.options[name] = value
            self.Modified()

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Called by VTK."""
        source: Any = vtkDataObject.GetData(inputs[0])
        target: Any = vtkDataObject.GetData(outputs)
        try:
            # On a parallel server some processes have no part of the data.
            target.ShallowCopy(self.output_of(source) if source.GetNumberOfCells() else source)
        except Exception as problem:
            target.Initialize()
            vtkOutputWindow.GetInstance().DisplayErrorText(f"{self.label}: {_error_text(problem)}\n")
        # With 0 VTK would add a page of its own and run the filter again at every rendering.
        return 1

    def output_of(self, source: Any) -> Any:
        """The output for an input."""
        raise NotImplementedError

    def run_until_aborted(self, run: Any, limit: int, describe: Any) -> Any:
        """The result of a run, which the user can abort; `describe` gives the text of its progress."""
        for record in run:
            self.SetProgressText(describe(record))
            self.UpdateProgress(min(record.iteration / max(limit, 1), 1.0))
            if self.GetAbortExecute():
                break
        return run.result()


@smproxy.filter(name="RegularizeHexahedra", label="Regularize Hexahedra")
@smhint.xml(_MENU)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkUnstructuredGrid"])
class RegularizeHexahedra(_Filter):
    """Makes the cells of a hexahedral or mixed mesh regular; see :func:`hexconformal.regularize`."""

    label = "Regularize Hexahedra"

    def __init__(self) -> None:
        _Filter.__init__(
            self, "vtkUnstructuredGrid", boundary="slide", hausdorff=0.005, features="auto", target="auto",
            max_iterations=200, emphasis="auto", other_cells="refuse", linearize=False,
        )  # fmt: skip

    @smproperty.stringvector(name="Boundary", default_values="slide", number_of_elements=1)
    @_help("Nodes of the boundary slide along the surface, stay, or are free.", _choices("slide", "fixed", "free"))
    def SetBoundary(self, value: str) -> None:
        self.set_option("boundary", value)

    @smproperty.doublevector(name="Hausdorff", default_values=0.005, number_of_elements=1)
    @_help("How far a curved boundary may move, as a share of the diagonal of the bounding box.")
    def SetHausdorff(self, value: float) -> None:
        self.set_option("hausdorff", value)

    @smproperty.stringvector(name="Features", default_values="auto", number_of_elements=1)
    @_help("Sharp edges: kept, rounded, or kept unless they are noise.", _choices("auto", "keep", "soft"))
    def SetFeatures(self, value: str) -> None:
        self.set_option("features", value)

    @smproperty.stringvector(name="Target", default_values="auto", number_of_elements=1)
    @_help("The perfect cell: auto, cube, input (the cells' own shapes), or edge lengths such as 1:1:4.")
    def SetTarget(self, value: str) -> None:
        self.set_option("target", value)

    @smproperty.intvector(name="MaxIterations", default_values=200, number_of_elements=1)
    @_help("Stop after so many iterations.", _NON_NEGATIVE)
    def SetMaxIterations(self, value: int) -> None:
        self.set_option("max_iterations", value)

    @smproperty.stringvector(name="Emphasis", default_values="auto", number_of_elements=1)
    @_help("Raise the worst cells once the distortion is low, or make the cells good on the whole.",
             _choices("auto", "worst", "mean"))  # fmt: skip
    def SetEmphasis(self, value: str) -> None:
        self.set_option("emphasis", value)

    @smproperty.stringvector(name="OtherCells", default_values="refuse", number_of_elements=1)
    @_help("Work on all linear cells, and refuse others, or keep all but the hexahedra where they are.",
             _choices("refuse", "keep"))  # fmt: skip
    def SetOtherCells(self, value: str) -> None:
        self.set_option("other_cells", value)

    @smproperty.intvector(name="Linearize", default_values=0, number_of_elements=1)
    @_help("Take the corners of cells of second order.", _BOOLEAN)
    def SetLinearize(self, value: int) -> None:
        self.set_option("linearize", bool(value))

    def output_of(self, source: Any) -> Any:
        from hexconformal import Options
        from hexconformal.elements import SOLID_TYPES
        from hexconformal.io import HEXAHEDRA, from_vtk
        from hexconformal.regularization import run_on

        options = dict(self.options)
        other_cells = options.pop("other_cells")
        types = HEXAHEDRA if other_cells == "keep" else tuple(SOLID_TYPES)
        mesh = from_vtk(source, other_cells, options.pop("linearize"), types)
        run = run_on(mesh, Options(**options))
        result = self.run_until_aborted(
            run,
            options["max_iterations"],
            lambda at: f"iteration {at.iteration}, smallest scaled Jacobian {at.min_scaled_jacobian:.3f}",
        )
        return _with_report(result.mesh.to_source_type(), result.report)


@smproxy.filter(name="HexahedraQuality", label="Hexahedra Quality")
@smhint.xml(_MENU)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkUnstructuredGrid"])
class HexahedraQuality(_Filter):
    """Measures every hexahedron, linear or quadratic, wedge, pyramid, tetrahedron; see :func:`hexconformal.quality`.

    Others get NaN.
    """

    label = "Hexahedra Quality"

    def __init__(self) -> None:
        _Filter.__init__(self, "vtkUnstructuredGrid", linearize=False)

    @smproperty.intvector(name="Linearize", default_values=0, number_of_elements=1)
    @_help("Measure cells of second order by their corners, and straighten them.", _BOOLEAN)
    def SetLinearize(self, value: int) -> None:
        self.set_option("linearize", bool(value))

    def output_of(self, source: Any) -> Any:
        from hexconformal import quality
        from hexconformal.elements import SOLID_TYPES
        from hexconformal.io import from_vtk

        mesh = from_vtk(source, "keep", self.options["linearize"], tuple(SOLID_TYPES))
        measured = quality(mesh)
        return _with_report(mesh.replaced(cell_data=measured.arrays()).to_source_type(), measured.summary())


@smproxy.filter(name="RemeshSurface", label="Remesh Surface")
@smhint.xml(_MENU)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkPolyData"])
class RemeshSurface(_Filter):
    """Makes the cells of a triangle or quad surface regular; see :func:`surface.remesh`."""

    label = "Remesh Surface"

    def __init__(self) -> None:
        _Filter.__init__(self, "vtkPolyData", max_iterations=300, target="equilateral", hausdorff=0.01)

    @smproperty.intvector(name="MaxIterations", default_values=300, number_of_elements=1)
    @_help("Stop after so many iterations.", _NON_NEGATIVE)
    def SetMaxIterations(self, value: int) -> None:
        self.set_option("max_iterations", value)

    @smproperty.stringvector(name="Target", default_values="equilateral", number_of_elements=1)
    @_help("The perfect cell: equilateral triangles and squares, shapes as flat as the valences"
             " allow, or their own shapes.", _choices("equilateral", "flat", "input"))  # fmt: skip
    def SetTarget(self, value: str) -> None:
        self.set_option("target", value)

    @smproperty.doublevector(name="Hausdorff", default_values=0.01, number_of_elements=1)
    @_help("How far the surface may move, as a share of the diagonal of the bounding box.")
    def SetHausdorff(self, value: float) -> None:
        self.set_option("hausdorff", value)

    def output_of(self, source: Any) -> Any:
        from surface import Options, Remeshing
        from surface.io import from_vtk, to_vtk

        result = self.run_until_aborted(
            Remeshing(from_vtk(source), Options(**self.options)),
            self.options["max_iterations"],
            lambda at: f"iteration {at.iteration}, smallest angle {at.min_angle:.1f}",
        )
        return _with_report(to_vtk(source, result.mesh), result.report)


def _with_report(dataset: Any, report: Any) -> Any:
    """Put a report onto a dataset, line by line, where ParaView shows it as field data."""
    lines = vtkStringArray()
    lines.SetName("report")
    for line in str(report).splitlines():
        lines.InsertNextValue(line)
    dataset.GetFieldData().AddArray(lines)
    return dataset


def _error_text(problem: Exception) -> str:
    """The message of an error for people who see neither code nor traceback."""
    if isinstance(problem, ImportError):
        python = ".".join(map(str, sys.version_info[:2]))
        return (
            f"the library cannot be loaded into this Python {python} ({problem}); start ParaView with PYTHONPATH set to"
            " a folder that has hexconformal with numpy, scipy, numba, pyamg and threadpoolctl for that Python, but"
            " without vtk"
        )
    if isinstance(problem, MemoryError):
        return "not enough memory for this mesh"
    if isinstance(problem, ValueError):
        return str(problem)
    return f"unexpected {type(problem).__name__}: {problem}"
