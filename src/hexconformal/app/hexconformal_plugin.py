"""ParaView filters: Regularize Hexahedra, Hexahedra Quality and Remesh Surface.

Load this file in ParaView (Tools > Manage Plugins > Load New); docs/paraview.md of the project tells how ParaView's
Python finds the library. The filters also work as vtkAlgorithms without ParaView.
"""

# ParaView makes a module of the name of this file: it must be unlike those of other plugins.

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
        """Takes the place of ParaView's decorators: what they decorate stays as it is."""

        def __getattr__(self, name: str) -> Any:
            return lambda *words, **named: lambda decorated: decorated

    smdomain = smhint = smproperty = smproxy = _Undecorated()

paraview_plugin_name = "hexconformal"

_MENU = '<ShowInMenu category="Hexconformal"/>'
_YES_OR_NO = '<BooleanDomain name="bool"/>'
_NOT_NEGATIVE = '<IntRangeDomain name="range" min="0"/>'


def _nested(text: str, domain: str = "") -> Any:
    """A decorator: what a property means, and which values it may have."""
    return smdomain.xml(f"<Documentation>{text}</Documentation>{domain}")


def _choices(*names: str) -> str:
    entries = "".join(f'<String value="{name}"/>' for name in names)
    return f'<StringListDomain name="list">{entries}</StringListDomain>'


class _Filter(VTKPythonAlgorithmBase):  # type: ignore[misc]
    """One dataset in, one of the same type out; what goes wrong is told as an error of VTK, the output is empty then.

    The library itself is imported when a filter runs: if it cannot be, that is told like all else.
    """

    label = ""

    def __init__(self, data_type: str, **options: Any) -> None:
        VTKPythonAlgorithmBase.__init__(self, nInputPorts=1, inputType=data_type, nOutputPorts=1, outputType=data_type)
        self.options = options

    def set_option(self, name: str, value: Any) -> None:
        """Set an option; the filter has to run again if that changes it."""
        if self.options[name] != value:
            self.options[name] = value
            self.Modified()

    def RequestData(self, request: Any, inputs: Any, outputs: Any) -> int:
        """Called by VTK."""
        source: Any = vtkDataObject.GetData(inputs[0])
        target: Any = vtkDataObject.GetData(outputs)
        try:
            # On a parallel server some have no part of the data.
            target.ShallowCopy(self.worked(source) if source.GetNumberOfCells() else source)
        except Exception as problem:
            target.Initialize()
            vtkOutputWindow.GetInstance().DisplayErrorText(f"{self.label}: {_in_words(problem)}\n")
        # Not 0, for which VTK adds a page of its own, and runs the filter again at every rendering.
        return 1

    def worked(self, source: Any) -> Any:
        """The dataset that comes out."""
        raise NotImplementedError

    def watched(self, run: Any, limit: int, told: Any) -> Any:
        """The result of a run, which can be aborted."""
        for record in run:
            self.SetProgressText(told(record))
            self.UpdateProgress(min(record.iteration / max(limit, 1), 1.0))
            if self.GetAbortExecute():
                break
        return run.result()


@smproxy.filter(name="RegularizeHexahedra", label="Regularize Hexahedra")
@smhint.xml(_MENU)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkUnstructuredGrid"])
class RegularizeHexahedra(_Filter):
    """Makes the cells of a hexahedral mesh regular; see :func:`hexconformal.regularize`."""

    label = "Regularize Hexahedra"

    def __init__(self) -> None:
        _Filter.__init__(
            self, "vtkUnstructuredGrid", boundary="slide", hausdorff=0.005, features="auto", target="auto",
            max_iterations=200, emphasis="auto", other_cells="refuse", linearise=False,
        )  # fmt: skip

    @smproperty.stringvector(name="Boundary", default_values="slide", number_of_elements=1)
    @_nested("Nodes of the boundary slide along the surface, stay, or are free.", _choices("slide", "fixed", "free"))
    def SetBoundary(self, value: str) -> None:
        self.set_option("boundary", value)

    @smproperty.doublevector(name="Hausdorff", default_values=0.005, number_of_elements=1)
    @_nested("How far a curved boundary may move, as a share of the diagonal of the bounding box.")
    def SetHausdorff(self, value: float) -> None:
        self.set_option("hausdorff", value)

    @smproperty.stringvector(name="Features", default_values="auto", number_of_elements=1)
    @_nested("Sharp edges: kept, rounded, or kept unless they are noise.", _choices("auto", "keep", "soft"))
    def SetFeatures(self, value: str) -> None:
        self.set_option("features", value)

    @smproperty.stringvector(name="Target", default_values="auto", number_of_elements=1)
    @_nested("The perfect cell: auto, cube, input (the cells' own shapes), or edge lengths such as 1:1:4.")
    def SetTarget(self, value: str) -> None:
        self.set_option("target", value)

    @smproperty.intvector(name="MaxIterations", default_values=200, number_of_elements=1)
    @_nested("Stop after so many iterations.", _NOT_NEGATIVE)
    def SetMaxIterations(self, value: int) -> None:
        self.set_option("max_iterations", value)

    @smproperty.stringvector(name="Emphasis", default_values="auto", number_of_elements=1)
    @_nested("Raise the worst cells once the distortion is low, or make the cells good on the whole.",
             _choices("auto", "worst", "mean"))  # fmt: skip
    def SetEmphasis(self, value: str) -> None:
        self.set_option("emphasis", value)

    @smproperty.stringvector(name="OtherCells", default_values="refuse", number_of_elements=1)
    @_nested("Meshes with tetrahedra, wedges, ... besides: refuse them, or keep those cells, which then stay where"
             " they are.", _choices("refuse", "keep"))  # fmt: skip
    def SetOtherCells(self, value: str) -> None:
        self.set_option("other_cells", value)

    @smproperty.intvector(name="Linearise", default_values=0, number_of_elements=1)
    @_nested("Take the corners of hexahedra with 20 or 27 nodes.", _YES_OR_NO)
    def SetLinearise(self, value: int) -> None:
        self.set_option("linearise", bool(value))

    def worked(self, source: Any) -> Any:
        from hexconformal import Options, Regularization
        from hexconformal.io import from_vtk

        options = dict(self.options)
        mesh = from_vtk(source, options.pop("other_cells"), options.pop("linearise"))
        run = Regularization(mesh, Options(**options))
        result = self.watched(
            run,
            options["max_iterations"],
            lambda at: f"iteration {at.iteration}, smallest scaled Jacobian {at.min_scaled_jacobian:.3f}",
        )
        return _with_report(result.mesh, result.report)


@smproxy.filter(name="HexahedraQuality", label="Hexahedra Quality")
@smhint.xml(_MENU)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkUnstructuredGrid"])
class HexahedraQuality(_Filter):
    """Measures every hexahedron; see :func:`hexconformal.quality`. Other cells get NaN."""

    label = "Hexahedra Quality"

    def __init__(self) -> None:
        _Filter.__init__(self, "vtkUnstructuredGrid", linearise=False)

    @smproperty.intvector(name="Linearise", default_values=0, number_of_elements=1)
    @_nested("Measure hexahedra with 20 or 27 nodes by their corners, and straighten them.", _YES_OR_NO)
    def SetLinearise(self, value: int) -> None:
        self.set_option("linearise", bool(value))

    def worked(self, source: Any) -> Any:
        from hexconformal import quality
        from hexconformal.io import from_vtk

        mesh = from_vtk(source, "keep", self.options["linearise"])
        measured = quality(mesh)
        return _with_report(mesh.replaced(cell_data=measured.arrays()).restored(), measured.summary())


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
    @_nested("Stop after so many iterations.", _NOT_NEGATIVE)
    def SetMaxIterations(self, value: int) -> None:
        self.set_option("max_iterations", value)

    @smproperty.stringvector(name="Target", default_values="equilateral", number_of_elements=1)
    @_nested("The perfect cell: equilateral triangles and squares, shapes as flat as the valences"
             " allow, or their own shapes.", _choices("equilateral", "flat", "input"))  # fmt: skip
    def SetTarget(self, value: str) -> None:
        self.set_option("target", value)

    @smproperty.doublevector(name="Hausdorff", default_values=0.01, number_of_elements=1)
    @_nested("How far the surface may move, as a share of the diagonal of the bounding box.")
    def SetHausdorff(self, value: float) -> None:
        self.set_option("hausdorff", value)

    def worked(self, source: Any) -> Any:
        from surface import Options, Remeshing
        from surface.io import from_vtk, to_vtk

        result = self.watched(
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


def _in_words(problem: Exception) -> str:
    """The problem in words for people who see neither code nor traceback."""
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
