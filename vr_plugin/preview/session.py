"""A preview of one scene: its controller and its pictures put together, from what a user gives."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

import persp_sw as psw
from persp_sw.errors import PerspSWError

from ..film.flight import Flight
from ..formats.opening import open_rig
from ..marks.marking import Marking
from ..placement import corners_in_room, room_from_world
from ..pose import Pose
from ..rig import Rig
from ..room.outside import room_camera
from ..room.rooms import four_walls
from .choices import Choices
from .controller import Preview
from .keys import KEYS
from .pictures import PreviewPictures
from .saved_view import SavedView

SIZE = (960, 720)
TARGETS_HZ = (1.0, 1000.0)
UP = (0.0, 0.0, 1.0)  # of a volume's world, where a scene has none: towards a patient's head


class PreviewError(PerspSWError):
    """A preview that cannot be as it was asked for."""


def open_preview(
    scene: psw.Scene,
    settings: psw.Settings,
    *,
    size: tuple[int, int] | None = None,
    stereo: str | None = None,
    rig_file: str | Path | None = None,
    recording: str | Path | None = None,
    presets: tuple[str, ...] = (),
    target_hz: float = 0.0,
    held: bool = False,
    flight: Flight | None = None,
    marks: psw.marks.MarkChoice | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> tuple[Preview, PreviewPictures]:
    """A preview of a scene, and what makes its pictures; that of a session as it was saved.

    Parameters
    ----------
    size
        Of the window, pixels. None: a session's, or 960 × 720.
    stereo
        Mode to start with. None: a session's, or mono.
    rig_file
        The room of the outside view, in any format that `open_rig` reads; None: `rooms.four_walls`.
    recording
        A recorded head path, placed as the rig says.
    presets
        Names that the preset keys go through.
    target_hz
        The frame rate that quality follows, from that of the settings on; 0: none, it stays as set.
    held
        It stays as set until the user lets it go; a session's that was held does so, too.
    flight
        One that the camera follows at the start.
    marks
        To start with.

    Raises
    ------
    PerspSWError
        Of any kind: whatever of these cannot be read or shown.
    """
    saved = SavedView.of_scene(scene)
    size = size or (scene.size if saved.camera else SIZE)
    if not all(16 <= n <= 16384 for n in size):
        raise PreviewError(f"a window is 16 … 16384 pixels wide and high; given {size[0]} × {size[1]}")
    if target_hz and not TARGETS_HZ[0] <= target_hz <= TARGETS_HZ[1]:
        low, high = TARGETS_HZ
        raise PreviewError(
            f"--target is {low:g} … {high:g} frames a second, or 0 for none; given {target_hz:g}"
        )
    rig = four_walls() if rig_file is None else open_rig(rig_file)
    head_at = None if recording is None else recorded_head(rig, recording)
    volume, view = scene.volume, scene.view(0)

    def relay(done: int, total: int, what: str) -> None:
        pictures.progress(done, total, what)  # whoever shows it at the time

    renderer = psw.Renderer(volume, scene.transfer, settings, scene.regions, relay, scene.look)
    place = room_from_world(rig, volume)
    preset = scene.preset.name if scene.preset else None

    def transfer_of(name: str | None) -> psw.TransferFunction:
        return scene.transfer if name == preset else psw.Scene.of_volume(volume, tf=name).transfer

    pictures = PreviewPictures(
        renderer,
        transfer_of,
        rig=rig,
        room_from_world=place,
        background=scene.background,
        near=view.eye.near,
        preset=preset,
        target_hz=target_hz,
    )
    pictures.progress = progress or pictures.progress
    follows = pictures.target_hz > 0
    corners = corners_in_room(np.eye(4), volume)  # in its own world
    quality = settings.quality
    if saved.quality is not None and not held:
        quality, held = saved.quality, True
    preview = Preview(
        saved.camera_of(scene),
        up=scene.keys.up or UP,
        extent=float(np.ptp(corners, axis=0).max()) or 1.0,
        size=size,
        rig=rig,
        outside_home=room_camera(rig, size),
        head_at=head_at,
        choices=Choices(presets, preset, quality, stereo or "mono", follows=follows, held=held),
        flight=flight,
        marking=Marking(marks, volume, lambda: psw.Probe.of(renderer), lambda: renderer.transfer),
    )
    saved.restore(preview, stereo=stereo is None)
    return preview, pictures


def recorded_head(rig: Rig, recording: str | Path) -> Callable[[float], Pose]:
    """The head's pose in the room at so many seconds of a recording, which starts again at its end."""
    from ..trackers.recording import Recording

    place, path = rig.tracker_for(recording), Recording.load(recording)
    return lambda seconds: place.room_from_head(path.at(seconds))


def press(preview: Preview, keys: str) -> None:
    """Press and release keys, named and parted by spaces; PreviewError where one of them is none."""
    names = keys.upper().split()
    unknown = sorted(set(names) - KEYS)
    if unknown:
        raise PreviewError(f"there are no keys {', '.join(unknown)}; known are {', '.join(sorted(KEYS))}")
    for name in names:
        preview.key(name, True)
        preview.key(name, False)
