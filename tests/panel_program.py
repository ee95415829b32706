"""The preview with its panel on a virtual screen, which tells where its parts are and what it has made."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from panel_scene import SIZE, TRANSFER, scene

import persp_sw as psw
from vr_plugin.panel.frontend import Panel
from vr_plugin.preview.in_window import run_window
from vr_plugin.preview.session import open_preview


class Telling(Panel):
    """A panel that prints its state, as one JSON value a line, whenever it has changed."""

    told: Any = None

    def __init__(self, window: Any, preview: Any, pictures: Any):
        super().__init__(window, preview, pictures)
        self._preview = preview

    def draw(self) -> None:
        """As a panel does, and says what it drew."""
        super().draw()
        desk = self.desk
        state = {
            "places": dict(self.places),
            "points": desk.edit.transfer.points,
            "shapes": desk.shapes.transfer.to_dict()["tf2d"],
            "counted": not self._sections.is_waiting,
            "crop": desk.crop,
            "clip": desk.regions.clip,
            "quality": desk.choices.quality,
            "camera": self._preview.wanted.camera.position.tolist(),
            "preset": desk.preset,
        }
        if state != self.told:
            self.told = state
            print(json.dumps(state), flush=True)


def main(folder: str, name: str, shown: str, transfer_file: str = "") -> None:
    """Show it until Escape; `shown`: "panel", or not at first; `name`: of its window."""
    transfer = psw.TransferFunction.load(transfer_file) if transfer_file else TRANSFER
    preview, pictures = open_preview(scene(transfer), psw.Settings(), size=SIZE, presets=("mri", "fog"))
    preview.choices.overlay = False
    preview.choices.panel = shown == "panel"
    run_window(
        preview, pictures, folder=Path(folder), name=name, warp="texture",
        open_panel=lambda window: Telling(window, preview, pictures),
    )  # fmt: skip


if __name__ == "__main__":
    main(*sys.argv[1:])
