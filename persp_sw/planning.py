"""What an eye will have composited, known before any pixel is; nothing of it depends on the quality."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .geometry.faces import Face, Need, faces_for, needs_of
from .geometry.parts import Part, shown_parts
from .geometry.regions import Regions
from .geometry.sight import EyeGeometry
from .geometry.view import Eye, View, Wall
from .settings import Settings
from .volume.runs import RunStore
from .volume.visibility import Visibility


@dataclass(frozen=True, eq=False)
class EyePlan:
    """What one eye sees through its walls and which faces show it; how finely, `faces` says of any quality.

    Attributes
    ----------
    eye, walls
        Whose plan it is.
    previous
        Faces of this eye's frame before: parallel rays keep their axis where it serves about as well.
    geometry
        The eye, its walls and the box of all that can be seen, object space.
    parts
        What is shown, front to back.
    needs
        What each face must cover.
    regions, visibility, single_face_tangent
        What it was planned for besides; see `fits`.
    """

    eye: Eye
    walls: tuple[Wall, ...]
    previous: tuple[Face, ...]
    geometry: EyeGeometry
    parts: tuple[Part, ...]
    needs: tuple[Need, ...]
    regions: Regions
    visibility: Visibility
    single_face_tangent: float

    def fits(self, store: RunStore, regions: Regions, settings: Settings) -> bool:
        """Whether all that it depends on, besides its eye and walls, is still the same object or number."""
        return (
            self.regions is regions
            and self.visibility is store.visibility
            and self.single_face_tangent == settings.single_face_tangent
        )

    @property
    def own_rays(self) -> bool:
        """Whether each face shows the rays along its own axis alone, of which none is steep."""
        return all(need.own_rays for need in self.needs)

    def faces(self, settings: Settings) -> list[Face]:
        """The faces at the settings' quality or size."""
        return faces_for(
            self.needs,
            quality=settings.quality,
            max_size=settings.max_intermediate,
            intermediate_size=settings.intermediate_size,
        )


def plan_eye(
    store: RunStore,
    regions: Regions,
    settings: Settings,
    eye: Eye,
    walls: Sequence[Wall],
    previous: Sequence[Face] = (),
) -> EyePlan:
    """Plan one eye; `store`: the runs of the finest level."""
    object_from_world = np.linalg.inv(store.volume.world_from_object)
    eye_object = object_from_world[:3] @ (*eye.position, eye.w)
    parts, low, high = _seen_parts(store, regions, eye_object, eye.w)
    views = [View(eye, wall) for wall in walls] if parts else []
    geometry = EyeGeometry(eye_object, low, high, views, object_from_world, eye.near, eye.is_at_infinity)
    limit = settings.single_face_tangent
    return EyePlan(
        eye,
        tuple(walls),
        tuple(previous),
        geometry,
        tuple(parts),
        tuple(needs_of(geometry, limit, previous)),
        regions,
        store.visibility,
        limit,
    )


def _seen_parts(
    store: RunStore, regions: Regions, eye_object: NDArray[np.float64], w: float
) -> tuple[list[Part], NDArray[np.float64], NDArray[np.float64]]:
    """The parts that are neither hidden nor transparent, front to back, and the object-space box of them."""
    parts = shown_parts(regions, store.volume, np.append(eye_object, w))
    visible = store.visible_box() if parts else None
    low, high = visible or (np.full(3, np.inf), np.full(3, -np.inf))
    parts = [part for part in parts if (part.low <= high).all() and (part.high >= low).all()]
    if parts:
        low = np.min([np.maximum(part.low, low) for part in parts], axis=0)
        high = np.max([np.minimum(part.high, high) for part in parts], axis=0)
    return parts, low, high
