"""From samples of a head to where it is when the picture is shown."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..pose import Pose, TimedPose, between
from .sample import Sample

_log = logging.getLogger("persp_sw")


@dataclass(frozen=True)
class FilterSettings:
    """What a head can do, and what to do when nothing is known of it. Metres, radians, seconds.

    Attributes
    ----------
    look_ahead
        Motion is carried on for this long at most after the last sample; longer would overshoot.
    baseline
        Speed is measured over this time, or from one sample to the next if they are farther apart.
    max_speed, max_turn
        A head that moves or turns faster is an outlier, beyond `slack` and `slack_turn`, what noise may do.
    persist
        So many outliers in a row that agree with each other are where the head is.
    hold, fade
        With no samples the pose stays for `hold`, then goes to the rest pose within `fade`.
    back
        A head found again, or accepted elsewhere, is gone to within this time.
    """

    look_ahead: float = 0.1
    baseline: float = 0.03
    max_speed: float = 5.0
    max_turn: float = 20.0
    slack: float = 0.02
    slack_turn: float = 0.1
    persist: int = 5
    hold: float = 0.5
    fade: float = 1.5
    back: float = 0.3


STATES = ("waiting", "tracked", "held", "fading", "lost")
# A speed is not measured across a gap longer than this; a stamp older by more is a clock set back.
_GAP_S = 0.25
_SET_BACK_S = 1.0


class HeadFilter:
    """Follows one sensor.

    Parameters
    ----------
    rest_pose
        room_from_head before the first sample, and after a loss.
    sensor
        The head's number; samples of others are ignored.
    name
        For messages.

    Attributes
    ----------
    outliers, late, losses
        Samples that were not believed, samples older than one known already, and how often the head was lost.

    Accuracy: for a smooth motion the prediction errs by ½·a·L·(L + b) to first order, a its acceleration, L
    the time from the last sample, b the baseline: it falls with the square of the times.
    """

    def __init__(
        self, rest_pose: Pose, sensor: int = 0, settings: FilterSettings | None = None, name: str = "head"
    ):
        self.rest_pose, self.sensor, self.name = rest_pose, sensor, name
        self.settings = settings or FilterSettings()
        self.outliers = self.late = self.losses = 0
        self._track: deque[TimedPose] = deque(maxlen=256)
        self._strange: list[TimedPose] = []
        self._blend: TimedPose | None = None  # what was shown when the head was found elsewhere
        self._missed = False

    @property
    def stamp(self) -> float | None:
        """When the newest sample that is believed was taken; None before the first."""
        return self._track[-1].stamp if self._track else None

    def add(self, samples: Iterable[Sample]) -> None:
        """Take samples in room space; those of other sensors and kinds are ignored."""
        for sample in samples:
            if sample.sensor == self.sensor and sample.kind == "pose" and sample.pose is not None:
                self._add(TimedPose(sample.stamp, sample.pose))

    def pose_at(self, time: float) -> Pose:
        """room_from_head at a time, which may lie ahead: at best the moment when the picture is shown.

        Says once when the head is lost, and once when it is back.
        """
        state = self.state_at(time)
        missed = state in ("fading", "lost")
        if missed and not self._missed:
            self.losses += 1
            _log.warning("tracking of the %s is lost; the view goes to its rest pose", self.name)
        elif self._missed and not missed:
            _log.warning("tracking of the %s is back", self.name)
        self._missed = missed
        return self._shown(time)

    def state_at(self, time: float) -> str:
        """One of `STATES`."""
        if not self._track:
            return "waiting"
        s, age = self.settings, time - self._track[-1].stamp
        if age <= s.look_ahead:
            return "tracked"
        return "held" if age <= s.hold else "fading" if age < s.hold + s.fade else "lost"

    def _add(self, new: TimedPose) -> None:
        if not self._track:
            self._accept([new])
            return
        last = self._track[-1]
        if new.stamp < last.stamp - _SET_BACK_S:
            self._track.clear()
            self._blend = None
            self._accept([new])
        elif new.stamp <= last.stamp:
            self.late += 1
        elif self._plausible(last, new):
            self._strange.clear()
            self._accept([new])
        else:
            self.outliers += 1
            if self._strange and not self._plausible(self._strange[-1], new):
                self._strange.clear()
            self._strange.append(new)
            if len(self._strange) >= self.settings.persist:
                there, self._strange = self._strange, []
                self._accept(there, elsewhere=True)

    def _accept(self, news: list[TimedPose], elsewhere: bool = False) -> None:
        stamp = news[-1].stamp
        if self._track and (elsewhere or stamp - self._track[-1].stamp > self.settings.hold):
            self._blend = TimedPose(stamp, self._shown(stamp))
            self._track.clear()
        self._track.extend(news)

    def _plausible(self, before: TimedPose, after: TimedPose) -> bool:
        s, step = self.settings, after.stamp - before.stamp
        if step <= 0:
            return False
        way = np.linalg.norm(after.pose.position - before.pose.position)
        turn = _angle(before.pose, after.pose)
        return bool(way <= s.max_speed * step + s.slack and turn <= s.max_turn * step + s.slack_turn)

    def _shown(self, time: float) -> Pose:
        if not self._track:
            return self.rest_pose
        s, last = self.settings, self._track[-1]
        pose = self._moved(min(time, last.stamp + s.look_ahead))
        if self._blend is not None:
            share = (time - self._blend.stamp) / s.back
            pose = between(self._blend.pose, pose, _smooth(share))
        share = (time - last.stamp - s.hold) / s.fade
        return between(pose, self.rest_pose, _smooth(share)) if share > 0 else pose

    def _moved(self, time: float) -> Pose:
        """Between the samples around a time, or carried on from the last ones."""
        track = self._track
        if len(track) == 1:
            return track[0].pose
        after = len(track) - 1
        while after > 1 and track[after - 1].stamp >= time:
            after -= 1
        before = after - 1
        if after == len(track) - 1 and time > track[-1].stamp:
            # Two samples of a fast tracker differ by noise more than by motion: look farther back.
            while before > 0 and track[after].stamp - track[before].stamp < self.settings.baseline:
                before -= 1
        one, two = track[before], track[after]
        if time <= one.stamp:
            return one.pose
        if time > two.stamp and two.stamp - one.stamp > _GAP_S:
            return two.pose
        return between(one.pose, two.pose, (time - one.stamp) / (two.stamp - one.stamp))


def _angle(a: Pose, b: Pose) -> float:
    return float(2 * np.arccos(min(abs(a.orientation @ b.orientation), 1.0)))


def _smooth(share: float) -> float:
    """From 0 to 1 and no farther, without a jerk."""
    share = min(max(share, 0.0), 1.0)
    return share * share * (3 - 2 * share)
