"""The experiments of Schulze, Niemeier and Lang (2001), section 4, with this renderer.

What the paper prints and what was assumed is in `schulze2001_printed`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...geometry.view import Eye
from ...optics.transfer import TransferFunction
from ...renderer import Renderer
from ...settings import Settings
from ...volume import phantoms
from ...volume.files import load
from ...volume.grid import Volume
from ..cases import FRAMES, eye_path, find_volume, resampled
from ..cave import eye_pair, four_walls, placed
from ..truth import Truths
from . import schulze2001_printed as printed
from .painter import Frame, Painter, Row, Warp, measure

_PADDED, _SLICES = (256, 256, 128), 110  # the engine's file, and how many of its slices are the engine
_LONGEST = 2.0  # metres of the volume among the four walls: all of them show it


@dataclass(frozen=True)
class Sizes:
    """Edges in pixels; the paper's, or smaller ones for a quick look.

    Attributes
    ----------
    share
        Of the paper's sizes.
    curve
        Edges of the intermediate image in figure 5.
    output
        Edge of the picture in figure 5 and table 2.
    outputs
        Those of tables 3 and 4.
    intermediate
        Edge of the intermediate image there.
    wall
        Edge of a wall's picture in section 4.5, which the paper does not tell.
    """

    share: float
    curve: tuple[int, ...]
    output: int
    outputs: tuple[int, ...]
    intermediate: int
    wall: int


FULL = Sizes(1.0, (128, 256, 384, 512, 576, 768, 1024, 1088, 1280, 1536), 300, (256, 512), 1024, 1024)
QUICK = Sizes(0.25, (32, 64, 128, 144, 256), 75, (64, 128), 256, 256)


@dataclass
class Laboratory:
    """What all experiments need.

    Parameters
    ----------
    folder
        Of real volumes; what is not there is replaced by a made-up one of the same size.
    warps
        The texture warp, where there is OpenGL, and the software warp.
    missing
        Why there is no texture warp; its rows say so.
    seconds
        Timed for each row.
    threads
        In section 4.5; the others take one.
    """

    folder: Path | None
    warps: Sequence[Warp]
    missing: str
    truths: Truths
    sizes: Sizes = FULL
    seconds: float = 1.0
    threads: int = 1

    def __post_init__(self) -> None:
        engine, brainsmall = engine_volume(self.folder), brainsmall_volume(self.folder)
        self.volumes = {
            name: {"name": volume.name, "size": list(volume.size), "made_up": made_up}
            for name, (volume, made_up) in {"engine": engine, "brainsmall": brainsmall}.items()
        }
        self._engine, self._brainsmall = (self._renderer(volume) for volume, _ in (engine, brainsmall))

    def run(self, progress: Callable[[int, int, str], None] = lambda done, total, what: None) -> Row:
        """The rows of all experiments, by name, and the volumes they used."""
        result: Row = {"volumes": self.volumes}
        steps = [self.figure5, self.table2, self.table3, self.table4, self.cube]
        for number, step in enumerate(steps):
            progress(number, len(steps), "experiments")
            result[step.__name__] = step()
        progress(len(steps), len(steps), "experiments")
        return result

    def figure5(self) -> list[Row]:
        """Time against the edge of the intermediate image, section 4.1."""
        path = _path(self._engine.volume, self.sizes.output)
        cases = [(edge, warp, plain) for warp, plain in self._ways() for edge in self.sizes.curve]
        painters = [(self._settings(edge, plain=plain), warp, path) for edge, warp, plain in cases]
        rows = self._measure(self._engine, painters)
        return self._lacking([{}]) + [{"edge": case[0], **row} for case, row in zip(cases, rows, strict=True)]

    def table2(self) -> list[Row]:
        """Perspective over parallel projection, section 4.2: the ratio of whole frames, and both."""
        volume = self._engine.volume
        perspective = _path(volume, self.sizes.output)
        parallel = [from_infinity(frame, volume.centre) for frame in perspective]
        cases = [(warp, edge) for warp in self.warps for edge in (None, self.sizes.intermediate)]
        painters = [
            (self._settings(edge), warp, path) for warp, edge in cases for path in (perspective, parallel)
        ]
        measured = iter(self._measure(self._engine, painters))
        rows = self._lacking([{"edge": edge} for edge in (None, self.sizes.intermediate)])
        for warp, edge in cases:
            one, other = next(measured), next(measured)
            ratio = one["ms"] / other["ms"]
            rows.append(
                {"warp": warp.name, "edge": edge, "ratio": ratio, "perspective": one, "parallel": other}
            )
        return [{**row, "paper": printed.TABLE2["ratio"]} for row in rows]

    def table3(self) -> list[Row]:
        """Milliseconds of both warps, section 4.3."""
        return self._warps(self._engine, printed.TABLE3["ms"])

    def table4(self) -> list[Row]:
        """Compositing over warp, section 4.4."""
        rows = self._warps(self._brainsmall, printed.TABLE4["ratio"])
        for row in rows:
            if "missing" not in row:
                row["ratio"] = row["composite_ms"] / row["warp_ms"]
        return rows

    def cube(self) -> list[Row]:
        """Frames a second on four walls, for an eye pair, section 4.5."""
        renderer = self._renderer(placed(self._engine.volume, _LONGEST))
        walls = four_walls(self.sizes.wall)
        path = [[(eye, walls) for eye in eye_pair(frame)] for frame in range(FRAMES + 1)]
        cases = [(edge, *way) for way in self._ways() for edge in (None, self.sizes.intermediate)]
        painters = [
            (self._settings(edge, self.threads, plain=plain), warp, path) for edge, warp, plain in cases
        ]
        rows = self._measure(renderer, painters)
        rows = [
            {"edge": case[0], "rate_hz": 1e3 / row["ms"], **row}
            for case, row in zip(cases, rows, strict=True)
        ]
        lacking = self._lacking([{"edge": edge} for edge in (None, self.sizes.intermediate)])
        return [{**row, "paper": printed.CUBE["rate_hz"]} for row in lacking + rows]

    def _warps(self, renderer: Renderer, figures: dict[tuple[str, int], dict[str, float]]) -> list[Row]:
        """A row for each of the paper's, in its order, timed in turn for each size of the picture."""
        made: dict[tuple[str, int], Row] = {}
        settings = self._settings(self.sizes.intermediate)
        sizes = list(dict.fromkeys(size for _, size in figures))
        for size, output in zip(sizes, self.sizes.outputs, strict=True):
            path = _path(renderer.volume, output)
            for row in self._measure(renderer, [(settings, warp, path) for warp in self.warps]):
                made[row["warp"], size] = {"output": output, **row}
            for row in self._lacking([{"output": output}]):
                made[row["warp"], size] = row
        return [{**made[key], "paper": figure} for key, figure in figures.items()]

    def _measure(
        self, renderer: Renderer, painters: Sequence[tuple[Settings, Warp, Sequence[Frame]]]
    ) -> list[Row]:
        return measure([Painter(renderer, *painter) for painter in painters], self.truths, self.seconds)

    def _lacking(self, rows: Sequence[Row]) -> list[Row]:
        """The texture warp's rows, where there is none."""
        if any(warp.name == "texture" for warp in self.warps):
            return []
        return [{**row, "warp": "texture", "missing": self.missing} for row in rows]

    def _renderer(self, volume: Volume) -> Renderer:
        return Renderer(volume, linear_ramp(volume), self._settings())

    def _ways(self) -> list[tuple[Warp, bool]]:
        """Each warp with the paper's one sample a slice; the last also sampled as this renderer chooses."""
        return [*((warp, True) for warp in self.warps), (self.warps[-1], False)]

    def _settings(self, edge: int | None = None, threads: int = 1, plain: bool = True) -> Settings:
        return Settings(samples_per_interval=1 if plain else None, intermediate_size=edge, threads=threads)


def _path(volume: Volume, size: int) -> list[Frame]:
    return [[(view.eye, [view.wall])] for view in eye_path(volume, "front", (size, size))]


def from_infinity(frame: Frame, centre: np.ndarray) -> Frame:
    """The same walls in parallel projection, along the line from each eye to `centre`, where they stand."""
    return [(Eye.at_infinity(eye.position - centre), walls) for eye, walls in frame]


def linear_ramp(volume: Volume) -> TransferFunction:
    """Opacity from 0 at the least to 1 at the largest value, per smallest spacing; in colour."""
    low, high = volume.value_range
    rows = [
        (low, (0.2, 0.3, 0.8), 0.0),
        ((low + high) / 2, (0.9, 0.6, 0.3), 0.5),
        (high, (1.0, 1.0, 1.0), 1.0),
    ]
    return TransferFunction(rows, opacity_unit=min(volume.spacing))


def engine_volume(folder: Path | None) -> tuple[Volume, bool]:
    """The engine of 64 × 64 × 27 voxels, and whether it is made up."""
    size = printed.FIGURE5["size"]
    path = find_volume(folder, "engine") if folder else None
    if path is None:
        return made_up(size), True
    volume = load(path)
    if volume.size == _PADDED:
        volume = Volume(volume.data[:_SLICES], world_from_object=volume.world_from_object, name=volume.name)
    return resampled(volume, size), False


def brainsmall_volume(folder: Path | None) -> tuple[Volume, bool]:
    """VolPack's small brain, and whether it is made up."""
    path = find_volume(folder, "brainsmall") if folder else None
    return (load(path), False) if path else (made_up(printed.BRAINSMALL_SIZE), True)


def made_up(size: tuple[int, int, int]) -> Volume:
    """A made-up body of so many voxels, whose slices are as far apart as its columns."""
    return resampled(phantoms.synthetic_ct(max(size)), size).with_spacing((1, 1, 1))
