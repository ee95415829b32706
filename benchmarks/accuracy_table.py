"""Error and time of `persp-sw render` on real volumes: three eyes, a smooth and an opaque function each.

    python benchmarks/accuracy_table.py VOLUME_FOLDER [-o DIR] [--size 512] [--quality 1] [--only engine]

Writes a scene file, the picture, the reference and the error map for every row to DIR, and prints a Markdown
table: PSNR of the whole picture and of the covered part, mean signed error, milliseconds, faces, samples,
bytes of the runs in use and of the dense volume. Every row is `persp-sw render SCENE --reference --json`.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

import persp_sw as psw

# Volume file, value at which things become visible, value that counts as a surface, brightest value.
VOLUMES = {
    "engine": (30, 90, 255),
    "bonsai": (25, 45, 255),
    "brainsmall_volpack": (10, 50, 255),
    "mni152_nilearn": (None, None, None),
    "stent": (-100, 150, 1500),
}
EYES = {"front": (0.42, 0.27, 0.87), "diagonal": (0.58, 0.55, 0.60), "side": (-0.93, 0.2, 0.3)}


def functions(first: float, surface: float, top: float) -> dict[str, list[list[float]]]:
    """A smooth function (at most 30 % opaque per voxel) and one that is opaque within a few values."""
    width = (top - first) * 0.08
    bottom = first - 1
    return {
        "smooth": [
            [bottom, 0.2, 0.3, 0.8, 0],
            [first, 0.2, 0.3, 0.8, 0],
            [(first + top) / 2, 0.9, 0.6, 0.3, 0.08],
            [top, 1, 1, 1, 0.3],
        ],
        "surface": [
            [bottom, 0.9, 0.7, 0.5, 0],
            [surface, 0.9, 0.7, 0.5, 0],
            [surface + width, 0.9, 0.7, 0.5, 1],
            [top, 1, 1, 1, 1],
        ],
    }


def scenes(path: Path, levels: tuple, size: int, folder: Path) -> list[Path]:
    """Write the scene files of one volume."""
    volume = psw.load(path)
    if levels[0] is None:
        low, high = volume.value_range
        levels = tuple(low + share * (high - low) for share in (0.12, 0.35, 0.9))
    written = []
    for kind, rows in functions(*levels).items():
        for name, towards in EYES.items():
            reach = 1.7 * max(volume.extent) * np.array(towards) / np.linalg.norm(towards)
            scene = {
                "name": f"{path.stem}-{kind}-{name}",
                "volume": str(path.resolve()),
                "tf": rows,
                "opacity_unit": min(volume.spacing),
                "eye": (volume.centre + reach).tolist(),
                "centre": volume.centre.tolist(),
                "up": [0, 1, 0],
                "fovy": 45,
                "size": [size, size],
                "frames": 7,
            }
            written.append(folder / f"{scene['name']}.json")
            written[-1].write_text(json.dumps(scene, indent=1))
    return written


def main() -> None:
    """Render every scene and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("volumes", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("accuracy"))
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--quality", default="1")
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    columns = ["scene", "PSNR dB", "covered dB", "SSIM", "mean signed", "ms", "faces", "image", "samples"]
    columns += ["runs / dense MB"]
    print(f"| {' | '.join(columns)} |\n{'|---' * len(columns)}|")
    for name, levels in VOLUMES.items():
        path = arguments.volumes / f"{name}.nrrd"
        if arguments.only not in name:
            continue
        dense = psw.load(path).data.nbytes
        for scene in scenes(path, levels, arguments.size, arguments.output):
            command = [sys.executable, "-m", "persp_sw", "render", str(scene), "--reference", "--json"]
            command += ["--quality", arguments.quality, "-o", str(scene.with_suffix(".png"))]
            r = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout)
            print(
                f"| {scene.stem} | {r['psnr']:.1f} | {r['psnr_covered']:.1f} | {r['ssim']:.4f} "
                f"| {r['mean_signed_error']:+.1e} | {r['ms']:.1f} | {r['faces']} "
                f"| {'×'.join(map(str, r['intermediate_size']))} | {r['samples']:,} "
                f"| {r['runs_bytes'] / 1e6:.2f} / {dense / 1e6:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
