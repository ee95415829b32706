"""Numbers, words and motions in the files people write, checked."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Discriminator, Field, StringConstraints, Tag, model_validator

from ..pose import Pose
from .similarity import AXES, flaw_of, similarity

Number = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-1e9, le=1e9)]
Positive = Annotated[Number, Field(gt=0)]
Count = Annotated[int, Field(strict=True, ge=0, le=10**6)]
Whole = Annotated[int, Field(strict=True, ge=-(10**6), le=10**6)]
Pixels = Annotated[int, Field(strict=True, ge=1, le=16384)]
Flag = Annotated[bool, Field(strict=True)]
Text = Annotated[str, StringConstraints(min_length=1)]
Vector3 = tuple[Number, Number, Number]
Axis = Literal[AXES]
Row = tuple[Number, Number, Number, Number]

UNION_TAGS = ("table", "rows")
POINT = "[x, y, z] in metres"


class Table(BaseModel):
    """A table without other keys than its own."""

    model_config = ConfigDict(extra="forbid")


class SimilarityKeys(Table):
    """Shift, names of axes, turn and scale; see `similarity.similarity`."""

    position: Vector3 = Field((0.0, 0.0, 0.0), description="[x, y, z] of the source's origin, in metres")
    axes: tuple[Axis, Axis, Axis] = Field(("x", "y", "z"), description='three axes such as ["x", "z", "-y"]')
    turn: Number = Field(0.0, description="degrees about the vertical, seen from above to the left")
    scale: Positive = Field(1.0, description="metres in a unit, such as 0.001 for mm")

    @model_validator(mode="after")
    def _makes_one(self) -> SimilarityKeys:
        checked_similarity(self.matrix)
        return self

    @property
    def matrix(self) -> np.ndarray:
        """(4, 4)."""
        return similarity(self.position, self.axes, self.turn, self.scale)


Rows = tuple[Row, Row, Row, Row]
Similarity = Annotated[
    Annotated[SimilarityKeys, Tag("table")] | Annotated[Rows, Tag("rows")],
    Discriminator(lambda value: "table" if isinstance(value, dict | SimilarityKeys) else "rows"),
]


class RigidKeys(Table):
    """A turn and a shift without a scale."""

    position: Vector3 = Field((0.0, 0.0, 0.0), description=POINT)
    axes: tuple[Axis, Axis, Axis] = Field(("x", "y", "z"), description='three axes such as ["x", "z", "-y"]')
    turn: Number = Field(0.0, description="degrees about the sensor's y axis")
    orientation: Row | None = Field(None, description="a quaternion [x, y, z, w]")

    @model_validator(mode="after")
    def _makes_one(self) -> RigidKeys:
        if self.orientation is not None and {"axes", "turn"} & self.model_fields_set:
            raise ValueError("give orientation, or axes and turn, not both")
        checked_similarity(similarity(axes=self.axes))
        checked_quaternion(self.orientation)
        return self

    @property
    def pose(self) -> Pose:
        """The motion."""
        if self.orientation is not None:
            return Pose(self.position, self.orientation)
        return Pose.from_matrix(similarity(self.position, self.axes, self.turn))


def matrix_of(given: SimilarityKeys | Rows) -> np.ndarray:
    """(4, 4) of a checked similarity, however it was written."""
    return given.matrix if isinstance(given, SimilarityKeys) else np.array(given, np.float64)


def checked_similarity(matrix: np.ndarray) -> None:
    """ValueError where a matrix is none."""
    flaw = flaw_of(matrix)
    if flaw:
        raise ValueError(flaw)


def checked_quaternion(quaternion: Row | None) -> None:
    """ValueError where a quaternion is all zeros."""
    if quaternion is not None and not np.linalg.norm(quaternion) > 1e-9:
        raise ValueError("a quaternion [x, y, z, w] is not all zeros; [0, 0, 0, 1] turns nothing")
