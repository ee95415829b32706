"""The scene file: a volume, how it looks, and where it is looked at from."""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .errors import PerspSWError, SceneError
from .geometry.framing import framed_view
from .geometry.regions import Regions
from .geometry.view import View
from .optics import presets
from .optics.look import Look
from .optics.transfer import TransferFunction
from .optics.transfer2d import TransferFunction2D
from .optics.window_level import window_level
from .volume.examples import example_name

if TYPE_CHECKING:
    from .scene_schema import SceneKeys
    from .volume.grid import Volume

Progress = Callable[[int, int, str], None]

_SELECTION = ("component", "series", "shape", "dtype", "byte_order", "header_bytes")


class Scene:
    """A scene, all of whose keys have been checked; the volume is read when it is first asked for.

    Made by `Scene.load` (a JSON or TOML file), `Scene.of_file` (any volume file) or `Scene.of_volume` (a
    volume in memory). The keys are those of the scene file.

    Parameters
    ----------
    keys
        The scene file's keys, not checked yet. numpy arrays are taken for lists.
    folder
        What paths among the keys are relative to.
    volume
        Used instead of reading `keys["volume"]`, which then is only a name.
    source
        Named in error messages.
    progress
        Called with (done, total, what) while the volume is read.

    Raises
    ------
    SceneError
        With every problem of the keys at once.
    """

    def __init__(
        self,
        keys: Mapping[str, Any],
        folder: str | Path = ".",
        *,
        volume: Volume | None = None,
        source: str = "the scene",
        progress: Progress | None = None,
    ):
        # pydantic takes 0.1 s, which `import persp_sw` need not
        from .scene_look import look_problems
        from .scene_schema import check

        self.folder = Path(folder)
        self._given = dict(keys)
        self._volume = volume
        self._progress = progress
        checked, problems = check(keys)
        if checked is not None:
            problems = [*look_problems(checked), *self._cross_check(checked)]
        if problems:
            count = f"{len(problems)} problems" if len(problems) > 1 else "a problem"
            raise SceneError("\n  - ".join([f"{source} has {count}:", *problems]))
        self.keys: SceneKeys = checked
        self.name: str = checked.name or Path(checked.volume).name.split(".")[0]

    @classmethod
    def load(cls, path: str | Path, *, progress: Progress | None = None, **overrides: Any) -> Scene:
        """Read a JSON file, or a TOML one by its suffix; `overrides` replace or add keys.

        Raises
        ------
        SceneError
            The file cannot be read or parsed, or has problems: all of them are listed.
        """
        from .scene_schema import read_text

        path = Path(path)
        keys = {**read_text(path), **overrides}
        keys.setdefault("name", path.stem)
        return cls(keys, path.parent, source=f"scene {path}", progress=progress)

    @classmethod
    def of_file(cls, path: str | Path, *, progress: Progress | None = None, **keys: Any) -> Scene:
        """A scene that shows the volume file `path`, with the other keys given or chosen."""
        path = Path(path)
        return cls(
            {"volume": path.name, **keys}, path.parent, source=f"the scene of {path}", progress=progress
        )

    @classmethod
    def of_volume(cls, volume: Volume, **keys: Any) -> Scene:
        """A scene that shows `volume`; it cannot be saved, having no file to name."""
        return cls({"volume": volume.name or "volume", **keys}, volume=volume)

    @cached_property
    def volume(self) -> Volume:
        """The volume; read now if it has not been. FileError or VolumeError where that fails."""
        volume, spacing = self._volume, self.keys.spacing
        if volume is None:
            from .volume.files import load

            options = {name: getattr(self.keys, name) for name in _SELECTION}
            volume = load(
                self._path(self.keys.volume),
                frame=self.keys.time_frame,
                spacing=spacing,
                progress=self._progress,
                **options,
            )
        if spacing is None or np.array_equal(volume.world_from_object, np.diag([*spacing, 1.0])):
            return volume
        return volume.with_spacing(spacing)

    @cached_property
    def preset(self) -> presets.Preset | None:
        """The preset that makes the transfer function, or None where the scene has one of its own."""
        tf = self.keys.tf
        if self.keys.tf2d is not None or self.keys.window is not None:
            return None
        if tf is None:
            return presets.choose(self.volume)
        return presets.make(tf, self.volume) if isinstance(tf, str) and tf in presets.NAMES else None

    @cached_property
    def transfer(self) -> TransferFunction | TransferFunction2D:
        """The transfer function, with the scene's `opacity_unit` where it states one."""
        tf, unit = self.keys.tf, self.keys.opacity_unit
        if self.keys.tf2d is not None:
            return TransferFunction2D.from_rows(self.keys.tf2d, unit or 1.0)
        if self.keys.window is not None:
            return window_level(*self.keys.window, opacity_unit=unit)
        if self.preset:
            transfer = self.preset.transfer
        elif isinstance(tf, str):
            transfer = TransferFunction.load(self._path(tf))
        else:
            return TransferFunction.from_rows(tf, unit or 1.0)
        return TransferFunction(transfer.points, unit) if unit else transfer

    @cached_property
    def look(self) -> Look:
        """Lights and modulation; plain where the scene has neither."""
        from .scene_look import look_of

        return look_of(self.keys)

    @staticmethod
    def keys_of_look(look: Look) -> dict[str, Any]:
        """Keys for `with_keys` that ask for a look, and take back what others asked for."""
        from .scene_look import keys_of_look

        return keys_of_look(look)

    @cached_property
    def regions(self) -> Regions:
        """Crop, clip planes and slabs."""
        return Regions(self.keys.crop, self.keys.clip, self.keys.cut, self.keys.crop_flags)

    @property
    def background(self) -> NDArray[np.float64]:
        """(3,) linear colour behind the picture."""
        return np.array(self.keys.background)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, pixels."""
        return self.keys.size

    @property
    def frames(self) -> int:
        """Number of timed frames, ≥ 1; frame 0 comes before them and warms up."""
        return self.keys.frames

    @property
    def animated(self) -> bool:
        """Whether the eye moves from frame to frame."""
        return self.keys.eye_step is not None and any(self.keys.eye_step)

    @property
    def max_seconds(self) -> float | None:
        """Seconds after which timing may stop early, or None."""
        return self.keys.max_seconds

    @property
    def step(self) -> float | None:
        """The sample distance wanted, in voxels, or None: a hint."""
        return self.keys.step

    @property
    def samples_per_interval(self) -> int | None:
        """What `step` asks of `Settings.samples_per_interval`; None (automatic) where it asks for few."""
        step = self.keys.step or 1.0
        return None if step > 0.5 else 2 if step > 0.25 else 4

    def view(self, index: int = 0) -> View:
        """The view of frame `index`: the eye has moved by `index` · `eye_step`, the centre stays."""
        keys = self.keys
        return framed_view(
            self.volume,
            self.regions,
            eye=keys.eye,
            centre=keys.centre,
            up=keys.up,
            fovy=keys.fovy,
            parallel_height=keys.parallel_height,
            size=keys.size,
            eye_offset=index * np.array(keys.eye_step or (0.0, 0.0, 0.0)),
        )

    def views(self) -> list[View]:
        """The warm-up's view, then those of the timed frames 1 … `frames`."""
        return [self.view(index) for index in range(self.frames + 1)]

    def with_keys(self, **keys: Any) -> Scene:
        """The same scene with some keys replaced; SceneError where that makes no scene."""
        return Scene({**self._given, **keys}, self.folder, volume=self._volume, progress=self._progress)

    def save(self, path: str | Path) -> None:
        """Write the keys that were given, as JSON, or as TOML where `path` ends in .toml.

        Paths are rewritten relative to the new file. SceneError for a volume that is only in memory.
        """
        path = Path(path)
        if self._volume is not None:
            raise SceneError(
                f"the volume {self._volume.name or 'of this scene'} is only in memory: write it to a file, "
                "then make the scene with Scene.of_file"
            )
        keys = self.keys.model_dump(mode="json", exclude_unset=True, exclude_none=True)
        keys["volume"] = os.path.relpath(self._path(self.keys.volume), path.parent)
        if isinstance(self.keys.tf, str) and self.keys.tf not in presets.NAMES:
            keys["tf"] = os.path.relpath(self._path(self.keys.tf), path.parent)
        text = _toml(keys) if path.suffix.lower() == ".toml" else _json(keys)
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise SceneError(f"cannot write the scene {path}: {error.strerror}") from None

    def __repr__(self) -> str:
        return f"<Scene {self.name}: {self.keys.volume}, {self.frames} frames of {self.size}>"

    def _path(self, name: str) -> Path:
        return self.folder / Path(name).expanduser()

    def _cross_check(self, keys: SceneKeys) -> list[str]:
        """What one key alone cannot tell: files that are not there, and views that are none."""
        problems = []
        here = self._path(keys.volume)
        if self._volume is None and not here.exists() and not example_name(here):
            problems.append(f"volume: there is no file or folder {here}; check the path")
        if isinstance(keys.tf, str) and keys.tf not in presets.NAMES and not self._path(keys.tf).is_file():
            near = difflib.get_close_matches(keys.tf.lower(), presets.NAMES, 1, 0.5)
            advice = f"did you mean {near[0]}?" if near else f"the presets are {', '.join(presets.NAMES)}"
            problems.append(f"tf: {keys.tf!r} is neither a preset nor a file {self._path(keys.tf)}; {advice}")
        try:
            Regions(keys.crop, crop_flags=keys.crop_flags)
        except PerspSWError as error:
            problems.append(f"crop_flags: {error}")
        if keys.fovy and keys.parallel_height:
            problems.append("fovy: a parallel view has parallel_height instead; give one of the two")
        if keys.eye and keys.centre:
            for frame in sorted({0, keys.frames if keys.eye_step else 0}):
                eye = np.array(keys.eye) + frame * np.array(keys.eye_step or (0, 0, 0))
                up = keys.up or (0.3, 0.5, 0.8)  # any: the default avoids the line of sight
                try:
                    View.look_at(eye, keys.centre, up, keys.fovy or 30, keys.size)
                except PerspSWError as error:
                    problems.append(f"eye (frame {frame}): {error}")
        return problems


def _json(keys: Mapping[str, Any]) -> str:
    """One key a line, so that the file is easy to edit."""
    lines = [f"  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in keys.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _toml(keys: Mapping[str, Any]) -> str:
    """The same in TOML; mappings are tables of their own, which TOML wants last."""
    tables = {key: value for key, value in keys.items() if isinstance(value, Mapping)}
    text = _toml_lines({key: value for key, value in keys.items() if key not in tables})
    return text + "".join(f"\n[{key}]\n{_toml_lines(table)}" for key, table in tables.items())


def _toml_lines(keys: Mapping[str, Any]) -> str:
    return "".join(f"{key} = {_toml_value(value)}\n" for key, value in keys.items() if value is not None)


def _toml_value(value: Any) -> str:
    """Texts, numbers and booleans are written as JSON's; tables inline."""
    if isinstance(value, Mapping):
        pairs = (f"{name} = {_toml_value(item)}" for name, item in value.items() if item is not None)
        return "{" + ", ".join(pairs) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
