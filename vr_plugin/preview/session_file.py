"""Sessions: a scene file of what a preview shows now."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import persp_sw as psw

from .controller import Preview
from .pictures import PreviewPictures
from .saved_view import SavedView, camera_keys


def session_of(scene: psw.Scene, preview: Preview, pictures: PreviewPictures) -> psw.Scene:
    """The scene as it is shown now; all its other keys stay.

    Camera and window size take the place of the scene's own, so that `persp-sw render` gives the same
    picture; transfer function, regions and look do where they are others than the scene's; the rest is the
    table `view`, which `persp-sw view` restores.
    """
    view = SavedView.of(preview, held=preview.choices.quality is not None)
    keys: dict[str, Any] = {
        **camera_keys(preview.inside.camera),
        "parallel_height": None,
        "size": list(preview.size),
        "view": view.model_dump(mode="json", exclude_none=True),
    }
    edited = [make(scene, preview, pictures) for make in (_transfer, _regions, _look)]
    return scene.with_keys(**keys, **edited[0], **edited[1], **edited[2])


def save_session(
    folder: str | Path, name: str, scene: psw.Scene, preview: Preview, pictures: PreviewPictures
) -> Path:
    """Write it as NAME-001.session.toml, or the next number that is free; SceneError where that cannot be."""
    number = 1
    while (path := Path(folder) / f"{name}-{number:03d}.session.toml").exists():
        number += 1
    session_of(scene, preview, pictures).save(path)
    return path


def _transfer(scene: psw.Scene, preview: Preview, pictures: PreviewPictures) -> dict[str, Any]:
    own, name = scene.preset.name if scene.preset else None, preview.choices.preset
    shown = preview.choices.edits.transfer
    if shown is None:
        if name != own:
            return {"tf": name, "tf2d": None, "window": None, "opacity_unit": None}
        shown = pictures.renderer.transfer
        if shown is scene.transfer or not pictures.shows_preset(name):
            return {"tf": name} if name is not None else {}
    unit = shown.opacity_unit or min(pictures.renderer.volume.spacing)
    keys = {"tf": None, "tf2d": None, "window": None, **shown.to_dict()}
    return {**keys, "opacity_unit": float(unit)}


def _look(scene: psw.Scene, preview: Preview, pictures: PreviewPictures) -> dict[str, Any]:
    look = preview.choices.edits.look or pictures.renderer.look
    return {} if look == scene.look else psw.Scene.keys_of_look(look)


def _regions(scene: psw.Scene, preview: Preview, pictures: PreviewPictures) -> dict[str, Any]:
    regions = preview.choices.edits.regions or pictures.renderer.regions
    if regions is scene.regions:
        return {}
    return {
        "crop": None if regions.crop is None else list(regions.crop),
        "crop_flags": regions.crop_flags if regions.crop is not None else "subvolume",
        "clip": [list(plane) for plane in regions.clip],
        "cut": [asdict(slab) for slab in regions.cut],
    }
