"""How docs/aorta/flight.csv was found: down the aorta of the demo's scan, through the stent, into its leg.

    python benchmarks/aorta_flight.py docs/aorta/flight.csv

In each slice, from the top, the middle of the lumen (where contrast agent is: brighter than tissue, darker
than metal, of voxels smoothed a little) is the place farthest from its wall, near that of the slice before.
At the bifurcation the patient's right leg is taken. The way is smoothed, and walked with the eye on a place
ahead.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import persp_sw as psw
from vr_plugin.cameras import Camera
from vr_plugin.film.flight import Flight, KeyView
from vr_plugin.film.flight_file import save_flight

LUMEN = (220, 600)  # values
# Places x, y, z, looked up in slices: where it begins, the leg at its beginning, the last slice.
START, LEG, END = (56, 95, 252), (64, 45.5, 112), 54
REACH = 3.0  # voxels sideways from slice to slice
SMOOTH = 5.0  # slices: standard deviation
AHEAD, SPEED, FOVY = 16.0, 18.0, 85.0  # voxels, voxels a second, degrees
KEY_EVERY = 8.0  # voxels
ANTERIOR = (0.0, -1.0, 0.0)  # upwards in the picture, for who looks down


def lumen_of(volume: psw.Volume) -> np.ndarray:
    """Which voxels [z, y, x] are lumen."""
    values = volume.data.astype(np.float32)
    for axis in range(3):
        values = (np.roll(values, 1, axis) + 2 * values + np.roll(values, -1, axis)) / 4
    return (values > LUMEN[0]) & (values < LUMEN[1])


def middle(lumen: np.ndarray, near: np.ndarray) -> np.ndarray:
    """The place within reach in a slice [y, x] that is farthest from all that is no lumen."""
    grid = np.arange(-REACH, REACH + 0.5, 0.5)
    offsets = np.stack(np.meshgrid(grid, grid), -1).reshape(-1, 2)
    places = near + offsets[np.hypot(*offsets.T) <= REACH]
    walls = np.argwhere(~lumen)[:, ::-1]
    room = np.array([np.hypot(*(walls - place).T).min() for place in places])
    return places[room >= room.max() - 0.6].mean(0)


def way_of(lumen: np.ndarray, start: tuple, end: int, leg: tuple | None = None) -> np.ndarray:
    """(n, 3) places, one a slice, downwards from `start` to the slice `end`; in `leg`'s on from there."""
    place, places = np.array(start[:2], np.float64), []
    for z in range(start[2], end - 1, -1):
        if leg is not None and z == leg[2]:
            place = np.array(leg[:2], np.float64)
        place = middle(lumen[z], place)
        places.append((*place, z))
    way, reach = np.array(places), int(3 * SMOOTH)
    # Ends go on as they came, so that smoothing does not shorten them.
    ends = [2 * way[0] - way[reach:0:-1], way, 2 * way[-1] - way[-2 : -reach - 2 : -1]]
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / SMOOTH) ** 2)
    extended, weights = np.concatenate(ends), weights / weights.sum()
    return np.stack([np.convolve(column, weights, "valid") for column in extended.T], -1)


def flight_along(way: np.ndarray) -> Flight:
    """Key views along a way, each with a place ahead in the middle, at one speed."""
    lengths = np.append(0.0, np.linalg.norm(np.diff(way, axis=0), axis=-1).cumsum())
    at = lambda length: np.array([np.interp(length, lengths, column) for column in way.T])  # noqa: E731
    keys = []
    for length in np.arange(0.0, lengths[-1] - AHEAD, KEY_EVERY):
        camera = Camera.look_at(at(length), at(length + AHEAD), ANTERIOR, np.radians(FOVY))
        keys.append(KeyView(round(length / SPEED, 6), camera))
    return Flight(keys)


def main() -> None:
    """Write the flight to the file that is named, rounded to what matters."""
    volume = psw.load("stent.demo")
    flight = flight_along(way_of(lumen_of(volume), START, END, LEG))
    path = save_flight(Path(sys.argv[1]), flight)
    header, *rows = path.read_text().splitlines()
    rounded = [",".join(f"{float(cell):.4f}" for cell in row.split(",")) for row in rows]
    path.write_text("\n".join([header, *rounded, ""]))
    print(f"{path}: {len(flight.keys)} key views, {flight.duration:.1f} s, {flight.eye_way:.0f} voxels")


if __name__ == "__main__":
    main()
