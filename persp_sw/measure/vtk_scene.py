"""A scene in VTK, rendered off screen by one of its volume mappers. Needs the package vtk.

VTK's pictures are comparable with ours as far as VTK allows: shading by its headlight alone, no jitter, no
background, linear interpolation, a sample a voxel edge unless said, the same points of the transfer function.
What else differs is VTK's: 8 bits a channel; tables of 1024 entries, looked up half an entry off; Mesa's
llvmpipe filters 8-bit volumes with 8 bits; crop planes off by up to half a voxel; the fixed-point mapper's
picture is wider than the volume by half a pixel at any resolution.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np
import vtkmodules.vtkRenderingOpenGL2
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers the factories)
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkObject, vtkVersion
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction, vtkPlane
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkRenderingCore import (
    vtkColorTransferFunction,
    vtkRenderer,
    vtkRenderWindow,
    vtkVolume,
    vtkVolumeProperty,
    vtkWindowToImageFilter,
)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper, vtkGPUVolumeRayCastMapper

from ..errors import SettingsError
from ..geometry.view import View
from ..optics.look import Look
from ..optics.transfer import TransferFunction
from ..volume.grid import Volume
from .cases import Stage

VERSION = vtkVersion.GetVTKVersion()
_NEAR_TOLERANCE = 1e-4  # of the far plane; VTK's own would cut away what is near an eye inside the volume


class VtkScene:
    """One scene in an off-screen window.

    Parameters
    ----------
    mapper
        "fixed" (ray casting on the processor, fixed point) or "gpu" (OpenGL; Mesa's llvmpipe where there is
        no graphics card).
    threads
        Of the fixed mapper; llvmpipe has its own from LP_NUM_THREADS.
    step
        Sample distance in smallest voxel spacings.
    pixel_step
        Pixels from ray to ray, for the fixed mapper.
    """

    def __init__(
        self, stage: Stage, mapper: str, threads: int = 1, step: float = 1.0, pixel_step: float = 1.0
    ):
        vtkObject.GlobalWarningDisplayOff()
        self._mapper = _mapper(mapper, threads, step * min(stage.volume.spacing), pixel_step)
        self._renderer, self._window = vtkRenderer(), vtkRenderWindow()
        self._window.SetOffScreenRendering(1)
        self._window.SetAlphaBitPlanes(1)
        self._window.SetMultiSamples(0)
        self._window.AddRenderer(self._renderer)
        self._renderer.SetNearClippingPlaneTolerance(_NEAR_TOLERANCE)
        self._renderer.AddVolume(_prop(stage, self._mapper))

    def draw(self, view: View) -> float:
        """Render; wall milliseconds until the picture is complete, without reading it back."""
        start = perf_counter()
        if self._window.GetSize() != view.size:
            self._window.SetSize(*view.size)
        self._look(view)
        self._window.Render()
        self._window.WaitForCompletion()
        return 1e3 * (perf_counter() - start)

    def picture(self, view: View) -> NDArray[np.float64]:
        """(height, width, 4) in 256 levels, premultiplied, row 0 on top."""
        self.draw(view)
        grab = vtkWindowToImageFilter()
        grab.SetInput(self._window)
        grab.SetInputBufferTypeToRGBA()
        grab.ReadFrontBufferOff()
        grab.ShouldRerenderOff()
        grab.Update()
        scalars = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
        return scalars.reshape(view.size[1], view.size[0], 4)[::-1] / 255.0

    def _look(self, view: View) -> None:
        wall, camera = view.wall, self._renderer.GetActiveCamera()
        up, centre = wall.upper_left - wall.lower_left, (wall.lower_right + wall.upper_left) / 2
        camera.SetPosition(*view.eye.position)
        camera.SetFocalPoint(*centre)
        camera.SetViewUp(*up)
        distance = np.linalg.norm(centre - view.eye.position)
        camera.SetViewAngle(np.degrees(2 * np.arctan(np.linalg.norm(up) / 2 / distance)))
        self._renderer.ResetCameraClippingRange()


def _mapper(name, threads, distance, pixel_step):
    if name == "fixed":
        mapper = vtkFixedPointVolumeRayCastMapper()
        mapper.SetNumberOfThreads(threads)
        mapper.SetInteractiveSampleDistance(distance)
    else:
        mapper = vtkGPUVolumeRayCastMapper()
        mapper.UseJitteringOff()
        mapper.SetMaxMemoryInBytes(4 << 30)
        mapper.SetMaxMemoryFraction(1.0)
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetImageSampleDistance(pixel_step)
    mapper.SetSampleDistance(distance)
    mapper.SetBlendModeToComposite()
    return mapper


def _prop(stage: Stage, mapper) -> vtkVolume:
    """The volume as a VTK prop, drawn by `mapper`."""
    volume, regions = stage.volume, stage.regions
    if not isinstance(stage.transfer, TransferFunction):
        raise SettingsError("VTK is not compared on two-dimensional transfer functions")
    transfer = stage.transfer.with_unit(min(volume.spacing))
    image = vtkImageData()
    image.SetDimensions(*volume.size)
    # VTK measures opacity before the pose, which so keeps lengths (no shear).
    image.SetSpacing(*volume.spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(volume.data.ravel()))
    colour, opacity = _functions(volume, transfer)
    looks = vtkVolumeProperty()
    looks.SetColor(colour)
    looks.SetScalarOpacity(opacity)
    looks.SetScalarOpacityUnitDistance(transfer.opacity_unit)
    looks.SetInterpolationTypeToLinear()
    _shade(looks, stage.look)
    mapper.SetInputData(image)
    if regions.crop is not None:
        mapper.SetCroppingRegionPlanes(*np.array(regions.crop) * np.repeat(volume.spacing, 2))
        mapper.SetCroppingRegionFlags(regions.crop_flags)
        mapper.CroppingOn()
    planes = list(regions.clip)
    for cut in regions.cut:
        if cut.show == "outside":
            raise SettingsError("VTK cannot leave out a slab: take the scene's cut with show = outside away")
        plane, reach = np.array(cut.plane), cut.thickness / 2 * np.linalg.norm(cut.plane[:3])
        planes += [plane + (0, 0, 0, reach), (0, 0, 0, reach) - plane]
    for plane in planes:
        normal = np.array(plane[:3])
        clip = vtkPlane()
        clip.SetNormal(*normal)
        clip.SetOrigin(*(-plane[3] / (normal @ normal) * normal))
        mapper.AddClippingPlane(clip)
    prop, pose = vtkVolume(), vtkMatrix4x4()
    pose.DeepCopy((volume.world_from_object / [*volume.spacing, 1]).ravel())
    prop.SetUserMatrix(pose)
    prop.SetMapper(mapper)
    prop.SetProperty(looks)
    return prop


def _shade(looks: vtkVolumeProperty, look: Look) -> None:
    """Phong's model with VTK's own headlight, which shines along the camera's axis, not each ray's."""
    lighting = look.lighting
    if look.modulation or (lighting and (lighting.lights or lighting.model != "phong")):
        raise SettingsError(
            "VTK is compared by its headlight: take lights, modulation and Blinn's model away"
        )
    if lighting is None:
        return
    if not lighting.headlight[0] == lighting.headlight[1] == lighting.headlight[2]:
        raise SettingsError(f"VTK is compared by a white headlight; given {lighting.headlight}")
    looks.ShadeOn()
    looks.SetAmbient(lighting.ambient + lighting.emissive)
    looks.SetDiffuse(lighting.diffuse * lighting.headlight[0])
    looks.SetSpecular(lighting.specular * lighting.headlight[0])
    looks.SetSpecularPower(lighting.power)


def _functions(
    volume: Volume, transfer: TransferFunction
) -> tuple[vtkColorTransferFunction, vtkPiecewiseFunction]:
    colour, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    low, high = volume.value_range
    before = None
    for value, rgb, alpha in transfer.points:
        if (value, rgb, alpha) == before:
            continue
        if before and value == before[0]:
            value += (high - low) / 1024  # VTK keeps one point a value: a step becomes a steep ramp
        before = (value, rgb, alpha)
        colour.AddRGBPoint(value, *rgb)
        opacity.AddPoint(value, alpha)
    return colour, opacity
