"""The keys of a rig file, checked: every problem of a file is found before any is reported."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from ..pose import Pose, quaternion_of
from ..rig import FIXED_TO, STEREO_MODES, TRACKER_KINDS, Eyes, TrackerPlace
from .schema_types import (
    POINT,
    Count,
    Flag,
    Number,
    Pixels,
    Positive,
    RigidKeys,
    Row,
    Similarity,
    SimilarityKeys,
    Table,
    Text,
    Vector3,
    Whole,
    checked_quaternion,
    checked_similarity,
    matrix_of,
)

_SIMILARITY = "four rows of four numbers, or {{ position, axes, turn, scale }}, {}"


class WindowKeys(Table):
    """Where a wall's window goes."""

    monitor: Count | None = Field(None, description="a number from 0")
    position: tuple[Whole, Whole] | None = Field(None, description="[x, y] on the desktop")
    size: tuple[Pixels, Pixels] | None = Field(None, description="[width, height], screen coordinates")
    fullscreen: Flag = Field(False, description="true or false")

    @model_validator(mode="after")
    def _one_way(self) -> WindowKeys:
        both = [key for key in ("position", "size") if getattr(self, key) is not None]
        if self.fullscreen and both:
            raise ValueError(
                f"fullscreen covers a whole monitor, so {' and '.join(both)} cannot hold; remove one"
            )
        return self


class WallKeys(Table):
    """One flat display."""

    name: Text = Field(description="a name of its own")
    lower_left: Vector3 = Field(description=POINT)
    lower_right: Vector3 = Field(description=POINT)
    upper_left: Vector3 = Field(description=POINT)
    pixels: tuple[Pixels, Pixels] = Field(description="[width, height] of one eye's picture, 1 … 16384")
    stereo: Literal[STEREO_MODES] = Field("mono", description="a stereo mode")
    fixed_to: Literal[FIXED_TO] = Field("room", description='"room" or "head"')
    machine: str = Field("", description="the name of the machine that shows it, or nothing")
    window: WindowKeys = Field(
        default_factory=WindowKeys, description="{ monitor, position, size, fullscreen }"
    )


class RestPoseKeys(Table):
    """Where the head is when nothing tracks it, and how it is turned."""

    position: Vector3 = Field((0.0, 1.7, 0.0), description=POINT)
    orientation: Row | None = Field(None, description="a quaternion [x, y, z, w]")
    look: Vector3 | None = Field(None, description="[x, y, z], the direction it looks in")
    up: Vector3 = Field((0.0, 1.0, 0.0), description="[x, y, z], what is up for it")

    @model_validator(mode="after")
    def _one_turn(self) -> RestPoseKeys:
        if self.orientation is not None and {"look", "up"} & self.model_fields_set:
            raise ValueError("give orientation, or look and up, not both")
        checked_quaternion(self.orientation)
        if np.linalg.norm(np.cross(self._look, self.up)) < 1e-6 * np.linalg.norm(self.up) + 1e-300:
            raise ValueError(
                f"look {list(self._look)} and up {list(self.up)} are parallel; choose another up"
            )
        return self

    @property
    def _look(self) -> np.ndarray:
        look = np.array((0.0, 0.0, -1.0) if self.look is None else self.look)
        length = np.linalg.norm(look)
        if length == 0:
            raise ValueError("look is a direction, so not [0, 0, 0]; [0, 0, -1] looks ahead")
        return look / length

    @property
    def pose(self) -> Pose:
        """room_from_head."""
        if self.orientation is not None:
            return Pose(self.position, self.orientation)
        right = np.cross(self._look, self.up)
        right /= np.linalg.norm(right)
        return Pose(
            self.position, quaternion_of(np.column_stack([right, np.cross(right, self._look), -self._look]))
        )


class EyesKeys(Table):
    """Where eyes are on a tracked head."""

    separation: Number = Field(Eyes.separation, description="metres, about 0.064")
    offset: Vector3 = Field((0.0, 0.0, 0.0), description=POINT)
    rest_pose: RestPoseKeys = Field(
        default_factory=RestPoseKeys, description="{ position, look } or { position, orientation }"
    )
    near: Annotated[Number, Field(ge=0)] = Field(0.0, description="metres")

    @field_validator("separation")
    @classmethod
    def _metres(cls, value: float) -> float:
        if abs(value) > 0.2:
            raise ValueError(f"eyes are 0.05 … 0.08 metres apart; given {value:g}: is that in another unit?")
        return value


class RecordingKeys(Table):
    """How a recorded head path is placed in the room."""

    address: Text = Field(description="the recording's file name")
    room_from_tracker: Similarity = Field(
        default_factory=SimilarityKeys, description=_SIMILARITY.format("to metres of the room")
    )
    sensor_from_head: RigidKeys = Field(
        default_factory=RigidKeys, description="{ turn }, { axes } or { orientation }"
    )
    latency: Annotated[Number, Field(ge=0, le=1)] = Field(0.0, description="seconds, 0 … 1")

    def place(self, **others: Any) -> TrackerPlace:
        """The same for the rig."""
        return TrackerPlace(
            address=self.address,
            room_from_tracker=matrix_of(self.room_from_tracker),
            sensor_from_head=self.sensor_from_head.pose,
            latency=self.latency,
            **others,
        )

    @field_validator("room_from_tracker")
    @classmethod
    def _similarity(cls, value: Any) -> Any:
        checked_similarity(matrix_of(value))
        return value


_ADDRESSES = {
    "vrpn": '"Tracker0@host", or "Tracker0@host:3883"',
    "dtrack": '"udp://:5000", or "udp://address:port" of this machine',
    "path": "the name of the recording, a .csv or .csv.gz",
}


class TrackerKeys(RecordingKeys):
    """What tracks the head."""

    kind: Literal[TRACKER_KINDS] = Field("none", description="a kind of tracker")
    address: str = Field("", description="where it is")
    head: Count = Field(0, description="the number of the head's sensor or body")
    wand: Count | None = Field(None, description="the number of the wand's sensor or body")

    @model_validator(mode="after")
    def _reachable(self) -> TrackerKeys:
        if self.kind in _ADDRESSES and not self.address:
            raise ValueError(f'kind "{self.kind}" needs an address: {_ADDRESSES[self.kind]}')
        if self.wand is not None and self.wand == self.head and self.kind == "vrpn":
            raise ValueError(f"head and wand are the same sensor, {self.head}; give each its own")
        return self


class WorldKeys(Table):
    """Where and how large the volume stands in the room."""

    room_from_world: Similarity | None = Field(None, description=_SIMILARITY.format("world to room"))
    centre: Vector3 | None = Field(None, description=POINT)
    size: Positive = Field(1.0, description="metres, of the volume's longest edge")

    @model_validator(mode="after")
    def _one_way(self) -> WorldKeys:
        if self.room_from_world is not None:
            both = {"centre", "size"} & self.model_fields_set
            if both:
                raise ValueError(
                    f"room_from_world says it all, so {' and '.join(sorted(both))} cannot hold; remove one"
                )
            checked_similarity(matrix_of(self.room_from_world))
        return self


class QualityKeys(Table):
    """What the pictures should be like."""

    target_hz: Annotated[Number, Field(ge=1, le=1000)] = Field(60.0, description="frames a second")
    quality: Annotated[Number, Field(ge=0.05, le=8)] = Field(
        1.0, description="0.05 … 8; 1 is a pixel a voxel"
    )
    min: Annotated[Number, Field(ge=0.05, le=8)] = Field(0.25, description="0.05 … 8")
    max: Annotated[Number, Field(ge=0.05, le=8)] = Field(2.0, description="0.05 … 8")

    @model_validator(mode="after")
    def _in_order(self) -> QualityKeys:
        if not self.min <= self.quality <= self.max:
            raise ValueError(
                f"min ≤ quality ≤ max is wanted; given {self.min:g}, {self.quality:g}, {self.max:g}"
            )
        return self


class RigKeys(Table):
    """All keys a rig file may have."""

    name: str = Field("", description="text")
    wall: list[WallKeys] = Field(min_length=1, description="one [[wall]] for each display")
    eyes: EyesKeys = Field(default_factory=EyesKeys, description="the table [eyes]")
    tracker: TrackerKeys = Field(default_factory=TrackerKeys, description="the table [tracker]")
    recording: list[RecordingKeys] = Field([], description="[[recording]] tables")
    world: WorldKeys = Field(default_factory=WorldKeys, description="the table [world]")
    quality: QualityKeys = Field(default_factory=QualityKeys, description="the table [quality]")
