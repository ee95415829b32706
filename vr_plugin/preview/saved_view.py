"""What a preview adds to a scene file, so that it is restored as it was: the table `[view]` of a session."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, create_model

import persp_sw as psw
from persp_sw.errors import SceneError

from ..cameras import Camera
from ..pose import Pose
from ..rig import STEREO_MODES
from ..stereo import Stereo
from .choices import QUALITIES, SEPARATIONS
from .navigation import SPEEDS, STYLES

if TYPE_CHECKING:
    from .controller import Preview

_SAME = 1e-9  # of a camera's numbers, which have gone through text and back
Number = Annotated[float, Field(allow_inf_nan=False)]


class SavedCamera(BaseModel):
    """A camera bit by bit; a scene's eye, centre, up and fovy give it to rounding only."""

    model_config = ConfigDict(extra="forbid")
    position: tuple[Number, Number, Number]
    orientation: tuple[Number, Number, Number, Number]  # quaternion x, y, z, w
    distance: Annotated[Number, Field(gt=0)]
    fovy: Annotated[Number, Field(gt=0, lt=np.pi)]  # radians

    @classmethod
    def of(cls, camera: Camera) -> SavedCamera:
        """Of a camera."""
        pose = camera.pose
        return cls(
            position=pose.position.tolist(),
            orientation=pose.orientation.tolist(),
            distance=camera.distance,
            fovy=camera.fovy,
        )

    @property
    def camera(self) -> Camera:
        """The same camera."""
        return Camera(Pose(self.position, self.orientation), self.distance, self.fovy)


# The marks that are shown: what `psw.marks.MarkChoice` says, checked.
SavedMarks = create_model(
    "SavedMarks",
    __config__=ConfigDict(extra="forbid", allow_inf_nan=False),
    **{
        field.name: (get_type_hints(psw.marks.MarkChoice)[field.name], field.default)
        for field in fields(psw.marks.MarkChoice)
    },
)


class SavedView(BaseModel):
    """The keys of `[view]`; all may be missing."""

    model_config = ConfigDict(extra="forbid")
    camera: SavedCamera | None = None
    outside: bool = False
    style: Literal[STYLES] = STYLES[0]
    speed: Annotated[Number, Field(ge=SPEEDS[0], le=SPEEDS[1])] | None = None
    stereo: Literal[tuple(STEREO_MODES)] | None = None
    swapped: bool = False
    flat: bool = False
    separation: Annotated[Number, Field(ge=SEPARATIONS[0], le=SEPARATIONS[1])] | None = None
    quality: Annotated[Number, Field(ge=QUALITIES[0], le=QUALITIES[1])] | None = None  # where it is held
    overlay: bool = True
    volume_outside: bool = True
    marks: SavedMarks | None = None

    @classmethod
    def of(cls, preview: Preview, *, held: bool) -> SavedView:
        """Of a preview as it is now; `held`: its quality is the user's."""
        choices, inside = preview.choices, preview.inside
        return cls(
            camera=SavedCamera.of(inside.camera),
            outside=preview.is_outside,
            style=inside.style,
            speed=inside.speed,
            stereo=choices.stereo.mode,
            swapped=choices.stereo.swapped,
            flat=choices.stereo.flat,
            separation=choices.separation,
            quality=choices.quality if held else None,
            overlay=choices.overlay,
            volume_outside=choices.volume_outside,
            marks=SavedMarks(**asdict(preview.marking.choice)) if preview.marking.choice else None,
        )

    @classmethod
    def of_scene(cls, scene: psw.Scene) -> SavedView:
        """What a scene file says of it. SceneError with all that is wrong with it."""
        try:
            return cls.model_validate(scene.keys.view)
        except ValidationError as error:
            problems = [f"view.{'.'.join(map(str, p['loc']))}: {p['msg'].lower()}" for p in error.errors()]
            raise SceneError("\n  - ".join([f"the session {scene.name} has problems:", *problems])) from None

    def camera_of(self, scene: psw.Scene) -> Camera:
        """The camera to start with: the saved one, unless the scene's own keys say another since."""
        if self.camera is not None and _agrees(camera_keys(self.camera.camera), scene):
            return self.camera.camera
        return Camera.of_view(scene.view(0))

    def restore(self, preview: Preview, *, stereo: bool = True) -> None:
        """Make a preview what it was, but for its camera and its held quality, which it is made with.

        stereo: its stereo mode, too.
        """
        choices = preview.choices
        if self.style != preview.inside.style:
            preview.inside.style = self.style
        preview.inside.speed = self.speed or preview.inside.speed
        if stereo and self.stereo is not None:
            choices.stereo = Stereo(self.stereo, self.swapped, self.flat)
        choices.separation = self.separation or choices.separation
        choices.overlay, choices.volume_outside = self.overlay, self.volume_outside
        if self.marks is not None and not preview.marking.choice:  # the command line's come first
            preview.marking.choice = psw.marks.MarkChoice(**self.marks.model_dump())
        if self.outside and not preview.is_outside:
            preview.key("TAB", True)
            preview.key("TAB", False)


def camera_keys(camera: Camera) -> dict[str, Any]:
    """A camera as keys of a scene file."""
    return {
        "eye": camera.position.tolist(),
        "centre": camera.pivot.tolist(),
        "up": camera.axes[1].tolist(),
        "fovy": float(np.degrees(camera.fovy)),
    }


def _agrees(keys: dict[str, Any], scene: psw.Scene) -> bool:
    given = [getattr(scene.keys, name) for name in keys]
    if None in given or scene.keys.parallel_height is not None:
        return False
    wanted, given = (np.hstack(list(values)) for values in (keys.values(), given))
    return bool(np.abs(wanted - given).max() <= _SAME * max(np.abs(wanted).max(), 1.0))
