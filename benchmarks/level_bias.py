"""Mean extinction of the levels of detail against that of the volume itself, for real volumes.

    python benchmarks/level_bias.py VOLUME_FOLDER [--only engine] [--levels 4]

Averaging values keeps the mean extinction only where extinction is linear in the value. Prints, for each
function and level, the mean of τ(value) over the volume's box divided by that of level 0, and the same of the
opacity of a step as long as the level's smallest voxel, 1 − exp(−τ·length), averaged for level 0 along the
step: what the eye sees of a level. Values are trilinear, at the same random places in every level.
"""

import argparse
from pathlib import Path

import numpy as np

import persp_sw as psw
from persp_sw.volume.mip import Level, Levels

# Volume file, value at which things become visible, value that counts as a surface.
VOLUMES = {"engine": (0, 90), "bonsai": (12, 45), "mni152_nilearn": (20, 100)}
PLACES = 60_000
STEPS = 4  # samples of level 0 along a step, for each of its voxels


def functions(first: float, surface: float) -> dict[str, psw.TransferFunction]:
    """Fog, ramp and surface, opacity per voxel."""
    white, top = (1, 1, 1), 255
    points = {
        "fog": [(first + 6, white, 0), (first + 40, white, 0.006), (top, white, 0.02)],
        "ramp": [(first, white, 0), (128, white, (128 - first) / (top - first)), (top, white, 1)],
        "surface": [(surface, white, 0), (surface + 20, white, 1), (top, white, 1)],
    }
    return {name: psw.TransferFunction(rows, opacity_unit=1.0) for name, rows in points.items()}


def values(level: Level, places: np.ndarray) -> np.ndarray:
    """Trilinear values at places (n, 3) in the finest level's voxel index."""
    index = places / level.factor
    corner = np.minimum(index.astype(int), np.array(level.size) - 2)
    x, y, z = corner.T
    cell = np.array([[[level.data[z + c, y + b, x + a] for a in (0, 1)] for b in (0, 1)] for c in (0, 1)])
    for weight in (index - corner).T[::-1]:  # z, y, x
        cell = cell[0] + weight * (cell[1].astype(float) - cell[0])
    return cell


def biases(levels: Levels, transfer: psw.TransferFunction, count: int) -> list[tuple[float, float]]:
    """(mean extinction, mean opacity of a step) of levels 1 … count, both over those of level 0."""
    rng = np.random.default_rng(1)
    finest = levels.level(0)
    result = []
    for number in range(1, count + 1):
        level = levels.level(number)
        length = int(level.factor.min())
        far = finest.far_corner - np.array([length, 0, 0])
        begin = rng.random((PLACES, 3)) * far
        means, opacities = [], []
        for one in (finest, level):
            depth = np.zeros(PLACES)
            for step in range(length * STEPS):
                at = begin + np.array([(step + 0.5) / STEPS, 0, 0])
                extinction = transfer.extinction(values(one, at))
                depth += extinction / STEPS
            means.append(depth.mean())
            opacities.append(-np.expm1(-depth).mean())
        result.append((means[1] / means[0], opacities[1] / opacities[0]))
    return result


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", choices=VOLUMES)
    parser.add_argument("--levels", type=int, default=4)
    arguments = parser.parse_args()
    print("| volume | function |", *(f"level {n} τ | opacity |" for n in range(1, arguments.levels + 1)))
    print("|---|---|" + "---|" * 2 * arguments.levels)
    for name in [arguments.only] if arguments.only else VOLUMES:
        levels = Levels(psw.load(arguments.folder / f"{name}.nrrd"))
        for kind, transfer in functions(*VOLUMES[name]).items():
            row = biases(levels, transfer, arguments.levels)
            print(f"| {name} | {kind} |", *(f"{tau:.3f} | {alpha:.3f} |" for tau, alpha in row), flush=True)


if __name__ == "__main__":
    main()
