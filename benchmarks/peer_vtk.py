"""The reference picture against VTK's volume mappers: evidence from a program that shares nothing with ours.

    pip install 'persp-sw[bench]'
    python benchmarks/peer_vtk.py SCENE.json … [--mapper gpu] [--mapper fixed] [--step 0.1] [--size 256 256]

Measured with VTK 9.7 at a step of 0.1: GPU mapper 60 … 65 dB with fog, where 8 bits a channel are the limit,
and 45 … 60 dB with sharp transfer functions, where VTK's tables are; the fixed-point mapper 30 … 44 dB. What
VTK does differently is told in `persp_sw/measure/vtk_scene.py`. `--float` hands it the voxels as float32,
since Mesa's llvmpipe filters 8-bit volumes with 8 bits. Times beside ours: `persp-sw bench --peer vtk`.
"""

from __future__ import annotations

import argparse
import os

import numpy as np

from persp_sw import Scene, reference
from persp_sw.measure import metrics
from persp_sw.measure.cases import Stage
from persp_sw.measure.vtk_scene import VtkScene


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
        volume, view = scene.volume, scene.views()[-1]
        truth = reference.render(volume, scene.transfer, view, regions=scene.regions)
        if options.float:
            volume = type(volume)(volume.data.astype(np.float32), world_from_object=volume.world_from_object)
        stage = Stage(volume, scene.transfer, [view], scene.regions)
        for kind in options.mapper or ["gpu"]:
            picture = VtkScene(stage, kind, os.cpu_count() or 1, options.step).picture(view)
            f = metrics.compare(picture, truth)
            print(
                f"{scene.name:36} {kind:6} {f['psnr']:6.2f}  {f['psnr_covered']:6.2f} "
                f"{f['mean_signed_error']:+.4f}  {f['p99_error']:.4f}  {f['max_error']:.4f}  {f['ssim']:.4f}"
            )


if __name__ == "__main__":
    main()
