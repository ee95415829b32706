"""The reference picture against VTK's volume mappers: evidence from a program that shares nothing with ours.

    pip install vtk
    python benchmarks/peer_vtk.py SCENE.json … [--mapper gpu] [--mapper fixed] [--step 0.1] [--size 256 256]

Measured with VTK 9.7 at a step of 0.1: GPU mapper 60 … 65 dB with fog, where 8 bits a channel are the limit,
and 45 … 60 dB with sharp transfer functions, where VTK's tables (1024 entries, looked up half an entry off)
are. What else differs is VTK's: Mesa's llvmpipe filters 8-bit volumes with 8 bits (`--float` hands VTK the
same voxels as float32); its crop planes are off by up to half a voxel; its fixed-point mapper's picture is
wider than the volume by half a pixel at any resolution (30 … 44 dB). Shading and background are left out.
"""

from __future__ import annotations

import argparse

import numpy as np
import vtkmodules.vtkRenderingOpenGL2
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401  (registers the factories)
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
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

from persp_sw import Scene, reference
from persp_sw.measure import metrics


def vtk_volume(scene, mapper):
    """The scene's volume as a VTK prop, drawn by `mapper`."""
    volume, transfer = scene.volume, scene.transfer.with_unit(min(scene.volume.spacing))
    image = vtkImageData()
    image.SetDimensions(*volume.size)
    image.SetSpacing(
        *volume.spacing
    )  # VTK measures opacity before the pose, which so keeps lengths (no shear)
    image.GetPointData().SetScalars(numpy_to_vtk(volume.data.ravel()))
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
    looks = vtkVolumeProperty()
    looks.SetColor(colour)
    looks.SetScalarOpacity(opacity)
    looks.SetScalarOpacityUnitDistance(transfer.opacity_unit)
    looks.SetInterpolationTypeToLinear()
    mapper.SetInputData(image)
    mapper.SetBlendModeToComposite()
    if scene.regions.crop is not None:
        mapper.SetCroppingRegionPlanes(*np.array(scene.regions.crop) * np.repeat(volume.spacing, 2))
        mapper.SetCroppingRegionFlags(scene.regions.crop_flags)
        mapper.CroppingOn()
    planes = list(scene.regions.clip)
    for cut in scene.regions.cut:
        if cut.show == "outside":
            raise SystemExit(f"{scene.name}: VTK cannot leave out a slab")
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


def vtk_picture(scene, view, kind, step):
    """(height, width, 4) in 256 levels, premultiplied, row 0 on top."""
    mapper = vtkFixedPointVolumeRayCastMapper() if kind == "fixed" else vtkGPUVolumeRayCastMapper()
    if kind == "gpu":
        mapper.UseJitteringOff()
        mapper.LockSampleDistanceToInputSpacingOff()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetImageSampleDistance(1.0)
    mapper.SetSampleDistance(step * min(scene.volume.spacing))
    renderer, window = vtkRenderer(), vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetAlphaBitPlanes(1)
    window.SetMultiSamples(0)
    window.SetSize(*view.size)
    window.AddRenderer(renderer)
    renderer.AddVolume(vtk_volume(scene, mapper))
    wall, camera = view.wall, renderer.GetActiveCamera()
    up, centre = wall.upper_left - wall.lower_left, (wall.lower_right + wall.upper_left) / 2
    camera.SetPosition(*view.eye.position)
    camera.SetFocalPoint(*centre)
    camera.SetViewUp(*up)
    distance = np.linalg.norm(centre - view.eye.position)
    camera.SetViewAngle(np.degrees(2 * np.arctan(np.linalg.norm(up) / 2 / distance)))
    renderer.ResetCameraClippingRange()
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.SetInputBufferTypeToRGBA()
    grab.ReadFrontBufferOff()
    grab.Update()
    scalars = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars())
    return scalars.reshape(view.size[1], view.size[0], 4)[::-1] / 255.0


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--mapper", choices=["gpu", "fixed"], action="append")
    parser.add_argument("--step", type=float, default=0.1, help="VTK's sample distance in voxels")
    parser.add_argument("--size", type=int, nargs=2, help="pixels; default: the scene's")
    parser.add_argument("--float", action="store_true", help="give VTK float32 voxels")
    options = parser.parse_args()
    print(f"{'scene':36} {'mapper':6}   psnr covered    bias     p99     max    ssim")
    for path in options.scenes:
        scene = Scene.load(path, **({"size": options.size} if options.size else {}))
        view = scene.views()[-1]
        truth = reference.render(scene.volume, scene.transfer, view, regions=scene.regions)
        if options.float:
            data, pose = scene.volume.data.astype(np.float32), scene.volume.world_from_object
            scene.volume = type(scene.volume)(data, world_from_object=pose)
        for kind in options.mapper or ["gpu"]:
            f = metrics.compare(vtk_picture(scene, view, kind, options.step), truth)
            print(
                f"{scene.name:36} {kind:6} {f['psnr']:6.2f}  {f['psnr_covered']:6.2f} "
                f"{f['mean_signed_error']:+.4f}  {f['p99_error']:.4f}  {f['max_error']:.4f}  {f['ssim']:.4f}"
            )


if __name__ == "__main__":
    main()
