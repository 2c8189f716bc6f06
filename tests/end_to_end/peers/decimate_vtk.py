"""VTK's quadric decimation as a peer of the bench."""

import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkQuadricDecimation

import decimation


def prepare(points, faces):
    mesh = vtkPolyData()
    vertices = vtkPoints()
    vertices.SetData(numpy_to_vtk(points, deep=True))
    mesh.SetPoints(vertices)
    cells = vtkCellArray()
    offsets = numpy.arange(0, faces.size + 1, 3, dtype="int64")
    corners = faces.ravel().astype("int64")
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True), numpy_to_vtkIdTypeArray(corners, deep=True)
    )
    mesh.SetPolys(cells)
    return mesh


def simplify(mesh, triangles):
    decimate = vtkQuadricDecimation()
    decimate.SetInputData(mesh)
    decimate.VolumePreservationOn()
    decimate.SetTargetReduction(1 - triangles / mesh.GetNumberOfPolys())
    decimate.Update()
    return decimate.GetOutput()


def arrays(level):
    points = vtk_to_numpy(level.GetPoints().GetData())
    faces = vtk_to_numpy(level.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return points, faces


decimation.main(prepare, simplify, arrays)
