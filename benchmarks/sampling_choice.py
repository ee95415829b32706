"""Where a plain sample does and where a pre-integrated one is needed: error and samples of each.

    python benchmarks/sampling_choice.py VOLUME_FOLDER [--only engine]

Of each volume and function, by the optical depth of the densest value in the longest slice interval, which is
what `persp_sw/sampling.py` decides by: the rms error of the rays of all faces, from outside and from near by,
with one plain sample an interval, one pre-integrated one and two plain ones, and the samples they took. No
ray ends early and no level of detail is used; the truth is the float64 reference on the same rays.
"""

import argparse
from pathlib import Path

import numpy as np

import persp_sw as psw
from persp_sw import reference
from persp_sw.measure.atlas.compositing import composite, faces_of, rms, view_towards
from persp_sw.measure.atlas.looks import LOOKS
from persp_sw.optics import presets
from persp_sw.optics.classification import Classification
from persp_sw.volume.phantoms import synthetic_ct

FILES = ("engine", "bonsai", "mni152_nilearn", "heptane")
MODES = {"plain": (1, False), "pre-integrated": (1, True), "two plain": (2, False)}
# Direction of the eye, its distance in longest edges, and the view's angle.
EYES = (((0.42, 0.27, 0.87), 1.7, 45.0), ((0.58, 0.35, -0.6), 0.45, 70.0))
PIXELS = 40


def functions(volume: psw.Volume) -> dict[str, psw.TransferFunction]:
    """The atlas's two looks, over the volume's values, and all presets; a star marks the one it gets."""
    low, high = volume.value_range
    found = {
        name: psw.TransferFunction([(low + (high - low) * v / 255, c, a) for v, c, a in look.points])
        for name, look in LOOKS.items()
    }
    chosen = presets.choose(volume).name
    for name in presets.NAMES:
        label = f"preset {name}" + ("*" if name == chosen else "")
        found[label] = presets.make(name, volume).transfer
    return found


def errors(volume: psw.Volume, transfer: psw.TransferFunction) -> dict[str, tuple[float, int]]:
    """Of each mode: rms error and samples."""
    views = [
        view_towards(volume, towards, (64, 64), distance, fovy_deg) for towards, distance, fovy_deg in EYES
    ]
    truths, result = None, {}
    for mode, (samples, preintegrated) in MODES.items():
        images = [
            composite(
                volume, transfer, view, intermediate_size=PIXELS, level_of_detail=False,
                samples_per_interval=samples, preintegrated=preintegrated,
            )
            for view in views
        ]  # fmt: skip
        faces = [face for image in images for face in faces_of(image)]
        truths = truths or [reference.render(volume, transfer, rays) for _, rays in faces]
        off = [(pixels - truth).ravel() for (pixels, _), truth in zip(faces, truths, strict=True)]
        result[mode] = rms(np.concatenate(off)), sum(image.samples for image in images)
    return result


def main() -> None:
    """Print a line for each volume and function, by depth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only")
    given = parser.parse_args()
    volumes = {"synthetic_ct": lambda: synthetic_ct(64)} | {
        name: lambda name=name: psw.load(given.folder / f"{name}.nrrd") for name in FILES
    }
    rows = []
    for name, load in volumes.items():
        if given.only not in (None, name):
            continue
        volume = load()
        for label, transfer in functions(volume).items():
            classification = Classification.of(transfer, volume)
            depth = classification.largest_extinction * max(volume.spacing)
            rows.append((depth, name, label, errors(volume, transfer)))
    print(f"{'depth':>6} {'volume':14} {'function':18} " + " ".join(f"{mode:>24}" for mode in MODES))
    for depth, name, label, found in sorted(rows, key=lambda row: row[0]):
        cells = " ".join(f"{error:12.5f} {samples:11,}" for error, samples in found.values())
        print(f"{depth:6.3f} {name:14} {label:18} {cells}")


if __name__ == "__main__":
    main()
