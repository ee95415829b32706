"""The panel in a real window of a virtual screen, driven by real mouse and key events."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from panel_scene import SIZE, TRANSFER
from samples import ROOT
from tolerances import FLOAT32_PIXELS
from virtual_screen import SECONDS, Program, display, environment  # noqa: F401  (a fixture)

import persp_sw as psw
from persp_sw.volume.phantoms import synthetic_ct

pytest.importorskip("imgui_bundle")
pytestmark = pytest.mark.gl

PAUSE = ("sleep", 0.05)  # between events, as between a hand's


class Preview(Program):
    """The program in `panel_program`."""

    def __init__(self, display: str, folder: Path, shown: str, *more: object, name: str = "body"):  # noqa: F811
        self.display, self.title = display, f"{name}: persp-sw view"
        self._top = 0 if name == "body" else SIZE[1]
        self._process = subprocess.Popen(
            [sys.executable, "-W", "error", str(ROOT / "tests/panel_program.py"), str(folder), name, shown]
            + [str(word) for word in more],
            env=environment(display),
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.states: list[dict[str, Any]] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> Preview:
        self.hand("windowmove", self.window(self.title), 0, self._top)
        self.focus(self.title)
        return self

    def _read(self) -> None:
        for line in self._process.stdout:
            self.states.append(json.loads(line))

    def __exit__(self, *_: object) -> None:
        if self._process.poll() is None:
            self._process.kill()
        self._process.wait(SECONDS)
        self._reader.join(SECONDS)
        super().__exit__()

    def picture(self) -> np.ndarray:
        """(h, w, 3) uint8: what the window shows now."""
        return self.grab()[self._top : self._top + SIZE[1], : SIZE[0]]

    def until(self, what: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The state, once it is so."""
        end = time.monotonic() + SECONDS
        while time.monotonic() < end:
            assert self._process.poll() is None, self._process.stderr.read()
            if self.states and what(self.states[-1]):
                return self.states[-1]
            time.sleep(0.02)
        pytest.fail(f"the state never became so; it is {self.states[-1:]}")

    def at_rest(self) -> np.ndarray:
        """The picture, once it has not changed for a while and is no empty one."""
        end, before = time.monotonic() + SECONDS, None
        while time.monotonic() < end:
            picture = self.picture()
            if before is not None and (picture == before).all() and picture.max() > 60:
                return picture
            before = picture
            time.sleep(0.3)
        pytest.fail("the picture never came to rest")

    def until_shown(self, picture: np.ndarray) -> None:
        """Wait until the window's left columns are these, bit for bit."""
        end = time.monotonic() + SECONDS
        while not (self.picture()[:, : picture.shape[1]] == picture).all():
            assert time.monotonic() < end, "that picture never came"
            time.sleep(0.05)

    def until_other(self, picture: np.ndarray) -> np.ndarray:
        """The window's left columns, as many as here, once they are others than these and at rest."""
        end = time.monotonic() + SECONDS
        while (self.picture()[:, : picture.shape[1]] == picture).all():
            assert time.monotonic() < end, "no other picture came"
            time.sleep(0.05)
        return self.at_rest()[:, : picture.shape[1]]

    def drag(self, start: tuple[float, float], by: tuple[float, float], button: int = 1) -> None:
        """Press, move in steps, let go."""
        x, y = map(round, start)
        moves = [
            word
            for part in (0.3, 0.7, 1.0)
            for word in ("mousemove", round(x + part * by[0]), round(y + part * by[1]), *PAUSE)
        ]
        self.hand("mousemove", x, y, *PAUSE, "mousedown", button, *PAUSE, *moves, "mouseup", button, *PAUSE)

    def click(self, name: str, button: int = 1, times: int = 1) -> None:
        """On one of the panel's parts."""
        x, y = map(round, self.until(lambda state: name in state["places"])["places"][name])
        self.hand("mousemove", x, y, *PAUSE, "click", "--repeat", times, "--delay", 60, button, *PAUSE)

    def leave(self) -> None:
        """Escape ends it cleanly."""
        self.hand("key", "Escape")
        assert self._process.wait(SECONDS) == 0
        assert "Traceback" not in self._process.stderr.read()


def points_of(transfer: psw.TransferFunction) -> list:
    """As the program tells them."""
    return json.loads(json.dumps(transfer.points))


def is_about(transfer: psw.TransferFunction) -> Callable[[dict[str, Any]], bool]:
    return lambda state: state["points"] == points_of(transfer)


@pytest.fixture
def preview(display: str, tmp_path: Path) -> Iterator[Preview]:  # noqa: F811
    with Preview(display, tmp_path, "panel") as shown:
        shown.until(is_about(TRANSFER))
        shown.at_rest()
        yield shown


def left_of_panel(state: dict[str, Any]) -> slice:
    return slice(0, round(state["places"]["plot's first pixel"][0]) - 80)


def test_a_dragged_point_is_where_the_pixels_say_and_the_picture_is_that_function_s(
    preview: Preview,
    display: str,  # noqa: F811
    tmp_path: Path,
):
    start = preview.until(lambda state: "point 1" in state["places"])
    home, places = preview.at_rest(), start["places"]
    by = (18, -30)
    preview.drag(places["point 1"], by)
    dragged = preview.until(lambda state: not is_about(TRANSFER)(state))
    edited = preview.at_rest()
    dragged = preview.states[-1]

    # As the axes have it: values in proportion to pixels across, positions of opacities to those upwards.
    (x0, _), (x1, _) = places["point 0"], places["point 2"]
    a_pixel = (TRANSFER.values[2] - TRANSFER.values[0]) / (x1 - x0)
    axis = psw.editing.LOGARITHMIC
    heights = axis.position(TRANSFER.opacities)
    up = (heights[2] - heights[0]) / (places["point 0"][1] - places["point 2"][1])
    value, colour, opacity = dragged["points"][1]
    assert value == pytest.approx(TRANSFER.values[1] + by[0] * a_pixel, abs=FLOAT32_PIXELS * a_pixel)
    assert axis.position(opacity) == pytest.approx(heights[1] - by[1] * up, abs=FLOAT32_PIXELS * up)
    assert colour == TRANSFER.colours[1].tolist()
    assert [dragged["points"][0], dragged["points"][2]] == [points_of(TRANSFER)[n] for n in (0, 2)]
    assert dragged["camera"] == start["camera"]

    # The picture is what a preview of that function shows without a panel, to the bit.
    columns = left_of_panel(dragged)
    assert (edited[:, columns] != home[:, columns]).any()
    function = psw.TransferFunction([(v, tuple(c), a) for v, c, a in dragged["points"]], 1.0)
    function.save(tmp_path / "edited.json")
    with Preview(display, tmp_path, "no panel", tmp_path / "edited.json", name="plain") as plain:
        without = plain.at_rest()
        plain.leave()
    assert (edited[:, columns] == without[:, columns]).all()
    preview.focus(preview.title)

    # Undo restores the bits of function and picture; redo, too.
    preview.hand("key", "ctrl+z", *PAUSE)
    preview.until(is_about(TRANSFER))
    preview.until_shown(home[:, columns])
    preview.hand("key", "ctrl+shift+z", *PAUSE)
    preview.until(lambda state: state["points"] == dragged["points"])
    preview.until_shown(edited[:, columns])
    preview.leave()


def test_a_hidden_panel_leaves_the_picture_as_it_was_without_one(display: str, tmp_path: Path):  # noqa: F811
    with Preview(display, tmp_path, "no panel") as shown:
        without = shown.at_rest()
        shown.hand("key", "F2", *PAUSE)
        shown.until_other(without)
        assert shown.states
        shown.hand("key", "F2", *PAUSE)
        shown.until_shown(without)
        shown.leave()


def test_points_are_added_and_deleted_and_presets_chosen_by_mouse(preview: Preview):
    places = preview.until(lambda state: "point 2" in state["places"])["places"]
    (x1, _), (x2, _), (_, y) = places["point 1"], places["point 2"], places["plot"]
    x, y = round((x1 + x2) / 2), round(y) - 20
    preview.hand("mousemove", x, y, *PAUSE, "click", "--repeat", 2, "--delay", 60, 1, *PAUSE)
    more = preview.until(lambda state: len(state["points"]) == 4)
    place = (x - x1) / (x2 - x1)
    value = TRANSFER.values[1] + place * (TRANSFER.values[2] - TRANSFER.values[1])
    a_pixel = (TRANSFER.values[2] - TRANSFER.values[1]) / (x2 - x1)
    assert more["points"][2][0] == pytest.approx(value, abs=2 * FLOAT32_PIXELS * a_pixel)
    added, _ = psw.editing.added(TRANSFER, more["points"][2][0])
    assert more["points"] == points_of(added)
    preview.click("point 2", button=3)
    preview.until(is_about(TRANSFER))
    preview.click("Undo")
    preview.until(is_about(added))
    preview.click("Undo")
    preview.until(is_about(TRANSFER))

    preview.click("Preset")
    preview.click("preset fog")
    preview.until(lambda state: state["preset"] == "fog" and not is_about(TRANSFER)(state))
    preview.click("Undo")
    preview.until(is_about(TRANSFER))
    preview.focus(preview.title)
    preview.hand("key", "period", *PAUSE)  # the key for presets is a step of the same history
    preview.until(lambda state: state["preset"] == "mri")
    preview.click("Undo")
    preview.until(is_about(TRANSFER))
    preview.leave()


def test_what_is_typed_into_a_field_is_for_the_field(preview: Preview):
    state = preview.until(lambda state: "Value" in state["places"])
    preview.click("point 1")
    preview.click("Value", times=2)
    preview.hand("key", "ctrl+a", *PAUSE, "type", "--delay", 40, "90wasdfr")
    preview.hand("key", "Return", *PAUSE)
    typed = preview.until(lambda state: state["points"][1][0] == 90.0)
    assert typed["camera"] == state["camera"]
    # The view itself is moved by the same hand beside the panel.
    preview.drag((150, 300), (40, 10))
    preview.until(lambda now: now["camera"] != state["camera"])
    assert preview.states[-1]["points"] == typed["points"]
    preview.leave()


def test_a_side_of_the_box_follows_its_handle(preview: Preview):
    preview.click("Transfer function")  # closed, so that all of the next section is seen
    preview.click("Clipping and cropping")
    state = preview.until(lambda state: "crop 0" in state["places"])
    before, camera = state["places"]["crop 0"], state["camera"]
    toward = np.subtract(state["places"]["crop 1"], before)
    by = np.round(0.3 * toward)
    preview.drag(before, tuple(by))
    moved = preview.until(lambda now: now["crop"] != state["crop"])
    preview.at_rest()
    moved = preview.states[-1]
    assert moved["camera"] == camera
    assert [n for n in range(6) if moved["crop"][n] != state["crop"][n]] == [0]
    # As near to the pointer as its line leads.
    along = toward / np.linalg.norm(toward)
    gone = (np.subtract(moved["places"]["crop 0"], before) @ along, by @ along)
    assert gone[0] == pytest.approx(gone[1], abs=0.5)
    preview.click("Show all as at first")
    preview.until(lambda now: now["crop"] == state["crop"])
    preview.leave()


def test_without_its_package_the_preview_says_so_and_goes_on(display: str, tmp_path: Path):  # noqa: F811
    blocked = tmp_path / "blocked"
    blocked.mkdir()
    (blocked / "imgui_bundle.py").write_text("raise ImportError('not installed')\n")
    volume = tmp_path / "body.npy"
    np.save(volume, synthetic_ct(16).data)
    words = (str(volume), "--panel", "--frames", "3", "--json")
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "persp_sw", "view", *words],
        env=environment(display, PYTHONPATH=f"{blocked}{os.pathsep}{ROOT}"),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=SECONDS,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["frames"] == 3
    assert "pip install 'persp-sw[panel]'" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_shape_over_the_joint_histogram_is_dragged(preview: Preview):
    third = slice(0, SIZE[0] // 3)
    before = preview.at_rest()[:, third]
    preview.click("by value and gradient")
    state = preview.until(lambda now: "shape 0 middle" in now["places"] and now["counted"])
    places = state["places"]
    home = preview.until_other(before)  # kernels of gradients may have to be compiled
    by = (-40, -12)
    preview.drag(places["shape 0 middle"], by)
    moved = preview.until(lambda now: now["shapes"] != state["shapes"])
    preview.until_other(home)
    moved = preview.states[-1]
    (was,), (now,) = state["shapes"], moved["shapes"]
    across = places["shape 0 right"][0] - places["shape 0 left"][0]
    up = places["shape 0 low"][1] - places["shape 0 high"][1]
    for name, pixels, size in (("values", by[0], across), ("magnitudes", -by[1], up)):
        share = pixels / size
        extent = was[name][1] - was[name][0]
        expected = np.array(was[name]) + share * extent
        assert now[name] == pytest.approx(expected, abs=FLOAT32_PIXELS / size * extent)
    preview.click("Undo")
    preview.until(lambda now: now["shapes"] == state["shapes"])
    preview.until_shown(home)
    preview.leave()
