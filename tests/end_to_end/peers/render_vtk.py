"""VTK: by its glTF importer, or, with `merged`, as one mesh that never changes, the fastest that
it has."""

import sys

from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkAppendPolyData, vtkPolyDataNormals
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOImport import vtkGLTFImporter
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkLight,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 (what draws)

import rendering


class Vtk:
    """Renderer VTK without a window."""

    def __init__(self, merged: bool) -> None:
        self.merged = merged
        self.window = vtkRenderWindow()
        self.scene = vtkRenderer()

    def load(self, path: str, size: tuple[int, int], samples: int) -> None:
        self.window.SetOffScreenRendering(1)
        self.window.SetMultiSamples(0 if samples == 1 else samples)
        self.window.SetSize(*size)
        self.window.AddRenderer(self.scene)
        importer = vtkGLTFImporter()
        importer.SetFileName(path)
        importer.SetRenderWindow(self.window)
        importer.Update()
        self.scene = self.window.GetRenderers().GetFirstRenderer()
        if self.merged:
            self.merge()
        self.scene.SetBackground(0.8, 0.8, 0.8)
        self.scene.RemoveAllLights()
        self.scene.AutomaticLightCreationOff()
        light = vtkLight()
        light.SetLightTypeToSceneLight()
        light.SetPosition(*rendering.SUN_DIRECTION)
        light.SetFocalPoint(0, 0, 0)
        self.scene.AddLight(light)
        self.window.Render()

    def merge(self) -> None:
        """Merges the scene into one mesh, in the colour of its first material."""
        append = vtkAppendPolyData()
        actors = list(self.scene.GetActors())
        for actor in actors:
            transform = vtkTransform()
            transform.SetMatrix(actor.GetMatrix())
            moved = vtkTransformPolyDataFilter()
            moved.SetTransform(transform)
            moved.SetInputData(actor.GetMapper().GetInput())
            append.AddInputConnection(moved.GetOutputPort())
            self.scene.RemoveActor(actor)
        append.Update()
        mesh = append.GetOutput()
        if mesh.GetPointData().GetNormals() is None:
            normals = vtkPolyDataNormals()
            normals.SetInputData(mesh)
            normals.Update()
            mesh = normals.GetOutput()
        mapper = vtkPolyDataMapper()
        mapper.SetInputData(mesh)
        mapper.ScalarVisibilityOff()
        mapper.StaticOn()
        actor = vtkActor()
        actor.SetMapper(mapper)
        actor.GetProperty().BackfaceCullingOn()
        actor.GetProperty().SetColor(0.7, 0.7, 0.68)
        self.scene.AddActor(actor)

    def look(self, camera: rendering.Camera) -> None:
        active = self.scene.GetActiveCamera()
        active.SetPosition(*camera["eye"])
        active.SetFocalPoint(*camera["target"])
        active.SetViewUp(0, 1, 0)
        active.SetViewAngle(camera["fov_degrees"])
        self.scene.ResetCameraClippingRange()

    def draw(self) -> None:
        self.window.Render()
        self.window.WaitForCompletion()

    def write(self, path: str) -> None:
        image = vtkWindowToImageFilter()
        image.SetInput(self.window)
        image.ReadFrontBufferOff()
        writer = vtkPNGWriter()
        writer.SetFileName(path)
        writer.SetInputConnection(image.GetOutputPort())
        writer.Write()


rendering.serve(Vtk("merged" in sys.argv[1:]))
