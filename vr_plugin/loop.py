"""The frame loop's state: from what trackers say to the eye images of one moment. No window, no pixels.

Live and offscreen runs differ in the clock alone: `now` is `time.monotonic` or a counted time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from time import monotonic
from types import MappingProxyType

import numpy as np

import persp_sw as psw

from .eyes import eyes_of_head
from .frame import Frame, FrameMaker
from .moment import Moment
from .placement import room_from_world
from .rig import Rig
from .steady import Steady
from .stereo import Stereo
from .trackers import HeadFilter, NoTracker, OutsideWatch, Sample, Tracker, Wand, wand_sensor


class Loop:
    """One rig, one scene, one viewer.

    Parameters
    ----------
    rig
        Walls of this machine, eyes, tracker.
    renderer
        What is shown.
    tracker
        As `open_tracker` makes it of the rig's, samples in room space; None: nothing tracks.
    controller
        Chooses each frame's quality; None: the renderer's settings always.

    Attributes
    ----------
    maker
        Makes the frames; its `room_from_world` is where the volume stands now.
    wand
        None where the rig has none.
    stereo
        By wall name: how each wall shows the eyes now.
    outside
        Counts frames with an eye outside the walls.
    steady
        Composites the moments.
    regions
        What part of the volume is shown now: the scene's, and the wand's clip planes.
    frames, edge_on
        Frames asked for, and in how many of those shown an eye lay in the plane of a wall.
    """

    def __init__(
        self,
        rig: Rig,
        renderer: psw.Renderer,
        tracker: Tracker | None = None,
        controller: psw.FrameTimeController | None = None,
    ):
        self.rig, self.renderer = rig, renderer
        self.tracker = tracker or NoTracker()
        matrix = room_from_world(rig, renderer.volume)
        self.maker = FrameMaker(renderer, rig.walls, matrix)
        self.head = HeadFilter(rig.eyes.rest_pose, rig.tracker.head)
        sensor, volume = wand_sensor(rig.tracker), renderer.volume
        middle = volume.world_from_object @ (*((np.array(volume.size) - 1) / 2), 1)
        self.wand = None if sensor is None else Wand(matrix, sensor, middle[:3])
        self.stereo = {wall.name: Stereo(wall.stereo) for wall in rig.walls}
        corners = rig.corners[[wall.fixed_to == "room" for wall in rig.walls]]
        self.outside = OutsideWatch(corners) if len(corners) else None
        self.frames = self.edge_on = 0
        self.regions = self._regions = renderer.regions
        self.steady = Steady(self.maker, controller)

    def frame(self, now: float, shown_at: float | None = None) -> Frame:
        """The frame of the moment `shown_at` (seconds of the same clock; None: `now`), composited now.

        One head pose is taken, once: no frame mixes two.
        """
        begun_s = monotonic()
        self.poll(now)
        moment = self.moment(now if shown_at is None else shown_at)
        self.look(moment)
        return self.steady.make(moment, begun_s=begun_s)

    def poll(self, now: float) -> None:
        """Take what the tracker and the wand say; once a frame of the display."""
        self.frames += 1
        samples = self.tracker.poll(now)
        self.head.add(self._heads(samples))
        if self.wand is not None and self.wand.update(samples, now):
            self.maker.room_from_world = self.wand.room_from_world
            clip = (*self._regions.clip, *self.wand.clip_planes)
            self.regions = replace(self._regions, clip=clip)

    def moment(
        self,
        shown_at: float,
        margins: Mapping[str, float] = MappingProxyType({}),
        stereo: Mapping[str, Stereo] | None = None,
    ) -> Moment:
        """What the eyes see at a time that may lie ahead: the head goes on as it moves.

        `margins`: see `FrameMaker.moment`. `stereo`: where walls do not show the eyes as they are to now.
        """
        stereo = self.stereo if stereo is None else stereo
        head = self.head.pose_at(shown_at)
        return self.maker.moment(
            head,
            eyes_of_head(head, self.rig.eyes),
            self.rig.eyes.near,
            {name: wall.shown_mode for name, wall in stereo.items()},
            margins,
            regions=self.regions,
            stereo=stereo,
            stamp=self.head.stamp,
        )

    def look(self, moment: Moment) -> None:
        """Count what is wrong with a moment that is shown: eyes outside the walls or in a wall's plane."""
        if self.outside is not None:
            self.outside.look(moment.eyes)
        self.edge_on += bool(moment.edge_on)

    @property
    def modes(self) -> Mapping[str, str]:
        """Stereo modes by wall name, as shown now."""
        return {name: stereo.shown_mode for name, stereo in self.stereo.items()}

    def swap_eyes(self) -> None:
        """Left and right change places on all walls."""
        self.stereo = {name: stereo.swap() for name, stereo in self.stereo.items()}

    def toggle_mono(self) -> None:
        """All walls to mono, or back to their stereo modes."""
        self.stereo = {name: stereo.flatten() for name, stereo in self.stereo.items()}

    def put_back(self) -> None:
        """The volume to where it stood at first, with no clip plane but the scene's."""
        if self.wand is not None:
            self.wand.reset()
        self.maker.room_from_world = room_from_world(self.rig, self.renderer.volume)
        self.regions = self._regions

    def close(self) -> None:
        """Let go of the tracker."""
        self.tracker.close()

    def _heads(self, samples: Iterable[Sample]) -> list[Sample]:
        """Poses of the tracked body as poses of the head on it."""
        place = self.rig.tracker
        return [
            replace(sample, pose=sample.pose @ place.sensor_from_head)
            if sample.sensor == place.head and sample.pose is not None
            else sample
            for sample in samples
        ]
