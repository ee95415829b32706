"""The preview's pictures: what its controller wants, composited and, by the software warp, drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

import persp_sw as psw

from ..eyes import EyePair
from ..frame import Frame, FrameMaker, Picture
from ..moment import Moment
from ..pacing import controller_for
from ..placement import corners_in_room
from ..pose import Pose
from ..rig import QualityAim, Rig, RigWall
from ..room import outside
from ..room.painter import RoomPainter, encoded
from ..steady import Steady
from ..stereo import combine, eye_size
from .marked import PictureMarks
from .wanted import Wanted

WALL_PIXELS = 384  # of a wall's longer side in the view from outside
_VISITOR = "visitor"  # the eye that sees the room


@dataclass(frozen=True, eq=False)
class Composited:
    """The eye images of one moment, and what they cost.

    Attributes
    ----------
    inside
        Of the camera's eyes, for the window; of the head's eyes, for the walls, in the view from outside.
        Its images, statistics and cost are those of all eyes.
    outside
        Of the outside camera: the volume itself; None where it is not shown.
    statistics
        Of all of them together, as `figures.figures` needs them but for the warp.
    besides_ms
        What making them took besides planning and compositing.
    """

    inside: Frame
    outside: Picture | None
    statistics: Mapping[str, Any]
    besides_ms: float = 0.0


class PreviewPictures:
    """Makes what a preview wants of one volume.

    Parameters
    ----------
    renderer
        Its quality and transfer function follow what is wanted, its other settings stay.
    transfer_of
        The transfer function of a preset's name; of None, the scene's own.
    rig, room_from_world
        The room of the outside view, and where the volume stands in it.
    background
        (3,) linear, behind the volume.
    near
        World units before the camera's eyes in which nothing is shown.
    preset
        The name that the renderer's transfer function is of.
    target_hz
        The frame rate that quality follows, within the rig's limits; 0: none, it stays as it is.

    Attributes
    ----------
    target_hz
        0 also where the limits leave nothing to choose.
    progress
        Called with (done, total, what) while the volume is encoded.
    marks
        What the pictures show of marks.
    """

    def __init__(
        self,
        renderer: psw.Renderer,
        transfer_of: Callable[[str | None], psw.TransferFunction],
        *,
        rig: Rig | None = None,
        room_from_world: np.ndarray | None = None,
        background: np.ndarray = (0.0, 0.0, 0.0),
        near: float = 0.0,
        preset: str | None = None,
        target_hz: float = 0.0,
    ):
        self.renderer = renderer
        self.rig = rig
        self.background = np.asarray(background, np.float64)
        self.near = near
        self.progress: Callable[[int, int, str], None] = lambda done, total, what: None
        self._transfer_of, self._transfers = transfer_of, {preset: renderer.transfer}
        self._preset, self._regions, self._look = preset, renderer.regions, renderer.look
        self.marks = PictureMarks(renderer, psw.marks.Palette.over(self.background))
        self._canvases: dict[str, psw.Canvas] = {}
        self._base = renderer.settings
        self._window = FrameMaker(renderer, (), np.eye(4))
        self._makers = [self._window]
        if rig is not None:
            walls = [replace(wall, wall=_smaller(wall.wall)) for wall in rig.walls]
            self._room = FrameMaker(renderer, walls, room_from_world)
            self._visitor = FrameMaker(renderer, (), room_from_world)
            self._makers.append(self._room)
        self._steadies: dict[FrameMaker, Steady] = {}
        self._asked_hz = self._scene_hz = target_hz
        self._make_steady()

    def for_stills(self) -> PreviewPictures:
        """Of the same renderer, but for pictures that take as long as they take, at the settings' quality.

        One of the two at a time: it is one renderer.
        """
        stills = copy(self)
        stills._asked_hz = stills._scene_hz = 0.0
        stills._canvases, stills._steadies = {}, {}
        stills._make_steady()
        return stills

    def composite(
        self, wanted: Wanted, cancel: psw.Cancel | None = None, resting: bool = False
    ) -> Composited:
        """The eye images for what is wanted; may encode (a new preset) and compile (the first time).

        Parameters
        ----------
        resting
            Nothing moves: they may take longer than a frame, and become better from call to call.

        Raises
        ------
        Cancelled
            `cancel` was, meanwhile.
        """
        start = perf_counter()
        steady = self._set_up(wanted)
        frame = steady.make(self._moment(wanted), cancel, resting)
        walls = [picture for picture in frame.pictures if picture.eye != _VISITOR]
        visitor = next((picture for picture in frame.pictures if picture.eye == _VISITOR), None)
        made = frame.made
        figures = {"quality": made.quality, "why": made.choice.why if made.choice else ""}
        figures |= {"target_hz": self.target_hz, **_together(frame)}
        spent_ms = 1e3 * (perf_counter() - start) - made.cost.ms - made.cost.planning_ms
        return Composited(replace(frame, pictures=walls), visitor, figures, max(spent_ms, 0.0))

    def transfer_of(self, preset: str | None) -> psw.TransferFunction:
        """A preset's transfer function, always the same object; of None, the scene's own."""
        if preset not in self._transfers:
            self._transfers[preset] = self._transfer_of(preset)
        return self._transfers[preset]

    def is_known(self, preset: str | None) -> bool:
        """Whether a preset's transfer function has been made."""
        return preset in self._transfers

    @property
    def scene_regions(self) -> psw.Regions:
        """Which part is shown where nothing was edited."""
        return self._regions

    @property
    def scene_look(self) -> psw.Look:
        """How it is lit where nothing was edited."""
        return self._look

    def shows_preset(self, name: str | None) -> bool:
        """Whether the renderer's transfer function is the one of this name, or was changed from it."""
        return self._preset == name

    def drawn(self, wanted: Wanted, done: Composited, upload_ms: float = 0.0, warp_ms: float = 0.0) -> None:
        """What showing the eye images took, without the wait for the display: quality makes room for it."""
        self._steady(wanted).drawn(done.inside, upload_ms, warp_ms + done.besides_ms)

    def is_refined(self, wanted: Wanted) -> bool:
        """Whether eye images would be no better for more time than a frame has."""
        return self._steady(wanted).is_refined

    def draw(self, wanted: Wanted, done: Composited) -> tuple[dict[str, NDArray[np.float32]], float]:
        """Pictures by the names of eyes, as `Stereo.channels` has them, and the milliseconds that they took.

        (h, w, 4) float32, linear, premultiplied; of the outside view opaque, and the same one for all eyes.
        They are overwritten by the next call.
        """
        start = perf_counter()
        if wanted.outside:
            picture = self.draw_room(wanted, done)
            pictures = dict.fromkeys(("left", "middle", "right"), picture)
        else:
            pictures = {
                p.eye: self.marks.painted(self.warp(p.eye, p.image, p.view), wanted, p)
                for p in done.inside.pictures
            }
        return pictures, 1e3 * (perf_counter() - start)

    def draw_room(self, wanted: Wanted, done: Composited) -> NDArray[np.float32]:
        """The view from outside, (h, w, 4) float32, linear, opaque."""
        walls = {wall.name: self._wall_picture(wall.name, wanted, done) for wall in self._room.walls}
        volume = None
        if done.outside is not None:
            volume = self.warp(_VISITOR, done.outside.image, done.outside.view)
        painter = RoomPainter(wanted.camera, wanted.size, walls, volume)
        self.paint_room(painter, wanted, done)
        return painter.finished()

    def paint_room(self, painter: outside.Painter, wanted: Wanted, done: Composited) -> None:
        """The view from outside, whoever paints it."""
        frame = done.inside
        outside.paint_room(
            painter,
            wanted.camera.position,
            [wall.in_room(frame.head) for wall in self._room.walls],
            corners_in_room(self._room.room_from_world, self.renderer.volume),
            frame.head,
            frame.eyes,
            [getattr(frame.eyes, name) for name in dict.fromkeys(p.eye for p in frame.pictures)],
        )

    def window(self, wanted: Wanted, pictures: Mapping[str, NDArray[np.float32]]) -> NDArray[np.float32]:
        """What the window shows of the pictures of `draw`: (h, w, 4) float32, linear, opaque."""
        mode = "mono" if wanted.outside else wanted.stereo.shown_mode
        left, right = (pictures[name] for name in wanted.stereo.channels)
        return combine(left, right, mode, wanted.size, background=self.background)

    def _wall_picture(self, name: str, wanted: Wanted, done: Composited) -> NDArray[np.uint8]:
        """What a wall's window shows, (h, w, 3) sRGB."""
        mode = wanted.stereo.shown_mode
        own = {p.eye: p for p in done.inside.pictures if p.wall.name == name}
        drawn = {
            eye: self.marks.painted(self.warp(f"{name} {eye}", p.image, p.view), wanted, p)
            for eye, p in own.items()
        }
        if len(drawn) == 1:
            (only,) = drawn.values()
            return encoded(only[..., :3] + (1 - only[..., 3:]) * self.background)
        left, right = (drawn[eye] for eye in wanted.stereo.channels)
        return encoded(combine(left, right, mode, background=self.background)[..., :3])

    def warp(self, slot: str, image: psw.EyeImage, view: psw.View) -> NDArray[np.float32]:
        """The picture of a view by the software warp; the next one of the same slot overwrites it."""
        canvas = self._canvases.get(slot)
        if canvas is None or canvas.pixels.shape[1::-1] != view.size:
            canvas = self._canvases[slot] = psw.Canvas(*view.size)
        return self.renderer.warp(image, view, canvas)

    def _steady(self, wanted: Wanted) -> Steady:
        return self._steadies[self._room if wanted.outside else self._window]

    def _set_up(self, wanted: Wanted) -> Steady:
        edits, renderer = wanted.edits, self.renderer
        transfer = edits.transfer or self.transfer_of(wanted.preset)
        if transfer is not renderer.transfer:
            renderer.transfer = transfer
        regions = edits.regions or self._regions
        if regions is not renderer.regions:
            renderer.regions = regions
        renderer.look = edits.look or self._look
        target_hz = self._scene_hz if edits.target_hz is None else edits.target_hz
        # Another function, another ladder; but not while a hand changes it.
        if (wanted.preset, target_hz) != (self._preset, self._asked_hz):
            self._preset, self._asked_hz = wanted.preset, target_hz
            self._make_steady()
        steady = self._steady(wanted)
        steady.held = wanted.quality
        return steady

    def _make_steady(self) -> None:
        """Frames in their time, of either view, by the ladder of the transfer function that is."""
        aim = QualityAim() if self.rig is None else self.rig.quality
        # What the last ladder's rung changed is none of the user's choices.
        self.renderer.settings = replace(self._base, quality=self.renderer.settings.quality)
        rate_hz, ladder, steadies = self._asked_hz, None, {}
        for maker in self._makers:
            controller = controller_for(self.renderer, aim, rate_hz, ladder) if rate_hz else None
            steadies[maker] = steady = Steady(maker, controller)
            steady.base = self._base
            if controller is not None:
                ladder = controller.ladder
                steady.refinement = psw.Refinement(ladder)
        self._steadies = steadies  # at once: another thread may ask whether pictures are refined
        self.target_hz = rate_hz if steadies[self._window].controller else 0.0

    def _moment(self, wanted: Wanted) -> Moment:
        mode = wanted.stereo.shown_mode
        if not wanted.outside:
            wall = wanted.camera.wall(wanted.size)
            pixels = eye_size(mode, wanted.size)
            wall = psw.Wall(wall.lower_left, wall.lower_right, wall.upper_left, pixels, "view")
            maker = self._window
            maker.walls = (RigWall(wall, mode),)
            eyes = wanted.eyes
            if mode == "mono":
                eyes = _one_eye(wanted.camera.position)  # to the bit, whatever the separation
            return maker.moment(wanted.camera.pose, eyes, self.near)
        # A wall for one eye, as in a head-mounted display, stays that eye's.
        one_eye = {wall.name: wall.stereo for wall in self._room.walls if wall.stereo in ("left", "right")}
        modes = dict.fromkeys((wall.name for wall in self._room.walls), mode) | one_eye
        moment = self._room.moment(wanted.head, wanted.head_eyes, self.rig.eyes.near, modes)
        if not wanted.volume_outside:
            return moment
        self._visitor.walls = (RigWall(wanted.camera.wall(wanted.size)),)
        (seen,) = self._visitor.moment(Pose(), _one_eye(wanted.camera.position)).sights.values()
        return replace(moment, sights={**moment.sights, _VISITOR: seen})


def _one_eye(position: np.ndarray) -> EyePair:
    return EyePair(position, position)


def _smaller(wall: psw.Wall) -> psw.Wall:
    """The same wall with fewer pixels, for a picture of it."""
    share = min(1.0, WALL_PIXELS / max(wall.pixels))
    pixels = tuple(max(round(n * share), 1) for n in wall.pixels)
    return psw.Wall(wall.lower_left, wall.lower_right, wall.upper_left, pixels, wall.name)


def _together(frame: Frame) -> dict[str, Any]:
    """The figures of several eye images as one."""
    each = list(frame.statistics.values())
    sums = {key: sum(s[key] for s in each) for key in ("composite_ms", "encode_ms", "compile_ms", "samples")}
    largest = max((s["intermediate_size"] for s in each), key=lambda size: size[0] * size[1])
    return {
        **sums,
        "faces": max(s["faces"] for s in each),
        "intermediate_size": largest,
        "compositings": frame.compositings,
        "samples_per_interval": each[-1]["samples_per_interval"],
        "preintegrated": each[-1]["preintegrated"],
    }
