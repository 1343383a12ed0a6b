"""Datasets of VTK without pyvista around them, as ParaView hands them over."""

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkUnstructuredGrid


def plain(dataset):
    """A copy that is of VTK's own class."""
    result = vtkPolyData() if dataset.IsA("vtkPolyData") else vtkUnstructuredGrid()
    result.DeepCopy(dataset)
    return result


def array(attributes, name):
    """The array of that name."""
    return vtk_to_numpy(attributes.GetArray(name))
