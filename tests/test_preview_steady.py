"""The preview keeps to its frame rate, refines at rest, and answers hands; costs are simulated, no clock."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from samples import fails, result_of

import persp_sw as psw
from persp_sw.quality.ladder import Point, Rung
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.preview.choices import QUALITY_STEP
from vr_plugin.preview.figures import Rate, figures, quality_line
from vr_plugin.preview.in_window import PreviewLoop
from vr_plugin.preview.recorder import Recorder, recorder_to
from vr_plugin.preview.run import Screenshots
from vr_plugin.preview.session import open_preview, press
from vr_plugin.rig import QualityAim

SIZE = (160, 120)
LIMITS = QualityAim()
# A second a frame: the milliseconds that planning really takes are nothing beside it.
TARGET_HZ, TARGET_MS = 1.0, 1000.0
WITHIN = 0.1  # of the target, which the controller's band is well inside of
SAMPLES = 1e5  # of an eye image of quality 1; small real ones come in stairs of whole packets
FALL = 0.75  # largest change of ln(quality) when motion ends refinement
WAIT = 60.0


@pytest.fixture(scope="module")
def scene() -> psw.Scene:
    return psw.Scene.of_volume(synthetic_ct(48), size=SIZE)


def _inside(machine: Machine) -> Any:
    return machine.pictures._steadies[machine.pictures._window]


class Machine:
    """Takes the place of the screen and of the clock.

    Attributes
    ----------
    frame_ms, drawing_s, swap_s
        What compositing an eye image of quality 1, drawing, and waiting for the display take.
    shown
        What was drawn, frame by frame: (wanted, done).
    """

    def __init__(
        self,
        scene: psw.Scene,
        *,
        quality: float = 1.0,
        samples_per_interval: int | None = None,
        trace: Any = None,
        **options: Any,
    ):
        settings = psw.Settings(quality=quality, samples_per_interval=samples_per_interval)
        self.preview, self.pictures = open_preview(
            scene, settings, size=SIZE, **{"target_hz": TARGET_HZ, **options}
        )
        self.frame_ms = self.drawing_s = self.swap_s = self.clock_s = 0.0
        for steady in self.pictures._steadies.values():
            steady.maker.composite = self._with_its_time(steady.maker.composite)
        self.shown: list[tuple[Any, Any]] = []
        self.now = 0.0
        window = SimpleNamespace(
            name="body", is_drawn=True, first_row=0, make_current=lambda: None, set_title=lambda title: None
        )
        windows = SimpleNamespace(swap=lambda: self.pass_time(self.swap_s))
        shots = Screenshots(self.preview, self.pictures, Path(), "body")
        self.loop = PreviewLoop(self.preview, self.pictures, self, windows, window, shots, Recorder(trace))

    def _with_its_time(self, composite: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            frame = composite(*arguments)
            part = self.pictures.renderer.settings.quality**2
            spent = {"composite_ms": part * self.frame_ms, "samples": part * SAMPLES}
            spent |= {"encode_ms": 0.0, "compile_ms": 0.0}
            statistics = {eye: {**s, **spent} for eye, s in frame.statistics.items()}
            return replace(frame, statistics=statistics)

        return timed

    def draw(self, wanted: Any, done: Any, texts: Any, first_row: int) -> dict[str, Any]:
        """As a `PreviewScreen` does."""
        self.shown.append((wanted, done))
        self.pass_time(self.drawing_s)
        return {**done.statistics, "upload_ms": 0.0, "warp_ms": 0.0, "warp": "none"}

    def finish(self) -> None:
        """As a `PreviewScreen` does."""

    def pass_time(self, seconds: float) -> None:
        """Of the clock."""
        self.clock_s += seconds

    def turn(self, count: int = 1, orbit: float = 0.0) -> None:
        """So many turns of the loop, a refiner's picture waited for."""
        for _ in range(count):
            self.now += 0.02
            if orbit:
                self.preview.orbit(orbit)
            self.loop.turn(self.preview.advance(self.now))
            assert self.loop.background.wait(WAIT)

    def press(self, keys: str) -> None:
        """Keys, and what follows of them at once."""
        press(self.preview, keys)
        self.turn()

    @property
    def last(self) -> dict[str, Any]:
        """Figures of the last frame."""
        return self.shown[-1][1].statistics

    def qualities(self, start: int = 0) -> list[float]:
        """Of the frames shown from that one on."""
        return [done.statistics["quality"] for _, done in self.shown[start:]]

    def close(self) -> None:
        self.loop.background.give_up()


@pytest.fixture
def machine(scene: psw.Scene, monkeypatch: pytest.MonkeyPatch):
    made: list[Machine] = []

    def make(**options: Any) -> Machine:
        made.append(Machine(scene, **options))
        for clock in ("in_window.monotonic", "pictures.perf_counter"):
            monkeypatch.setattr(f"vr_plugin.preview.{clock}", lambda: made[-1].clock_s)
        return made[-1]

    yield make
    for each in made:
        each.close()


# --- in motion ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("keys", "eyes"), [("", 1), ("8", 2), ("TAB V", 1), ("TAB", 2), ("TAB 8", 3)])
def test_quality_falls_and_rises_until_frames_take_the_target(
    machine: Callable[..., Machine], keys: str, eyes: int
):
    """Mono and stereo, from inside and from outside, where the visitor's eye counts, too."""
    m = machine()
    press(m.preview, keys)
    for load in (3.0, 0.6):
        m.frame_ms = load * TARGET_MS / eyes
        m.turn(25, orbit=0.005)
        assert m.last["composite_ms"] == pytest.approx(TARGET_MS, rel=WITHIN)
        assert m.last["quality"] == pytest.approx(load**-0.5, rel=WITHIN)
    steps = np.abs(np.diff(np.log(m.qualities())))
    assert steps.max() <= 0.25 + 1e-9


def test_quality_makes_room_for_drawing_and_not_for_the_wait_for_the_display(
    machine: Callable[..., Machine],
):
    m = machine()
    m.frame_ms = 2.0 * TARGET_MS
    m.drawing_s, m.swap_s = 0.5e-3 * TARGET_MS, 7e-3 * TARGET_MS
    m.turn(60, orbit=0.005)
    assert m.last["composite_ms"] == pytest.approx(0.5 * TARGET_MS, rel=WITHIN)


def test_quality_stays_within_the_rig_s_limits(machine: Callable[..., Machine]):
    m = machine()
    m.frame_ms = 100.0 * TARGET_MS
    m.turn(20, orbit=0.005)
    assert m.last["quality"] == LIMITS.min_quality
    m.frame_ms = 0.01 * TARGET_MS
    m.turn(30, orbit=0.005)
    assert m.last["quality"] == LIMITS.max_quality


# --- at rest -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("keys", ["", "TAB"])
def test_at_rest_it_refines_to_full_quality_and_then_does_nothing(machine: Callable[..., Machine], keys: str):
    m = machine(quality=0.5)
    press(m.preview, keys)
    m.frame_ms = 4.0 * TARGET_MS
    m.turn(12, orbit=0.005)
    moving = len(m.shown)
    assert m.last["quality"] < 0.75
    m.turn(30)
    climb = m.qualities(moving - 1)
    assert climb[-1] == LIMITS.max_quality
    assert m.last["why"] == "refined"
    assert all(a < b for a, b in pairwise(climb))
    assert np.diff(np.log(climb)).max() <= 0.25 + 1e-9
    shown, at_rest = len(m.shown), m.pictures.renderer.last
    m.turn(10)
    assert len(m.shown) == shown
    assert m.pictures.renderer.last is at_rest  # nothing was composited
    assert m.loop.wait_s > 0.1
    assert m.loop.background.is_idle


def test_motion_brings_quality_back_in_bounded_steps(machine: Callable[..., Machine]):
    m = machine()
    m.frame_ms = 4.0 * TARGET_MS
    m.turn(20, orbit=0.005)
    m.turn(30)
    assert m.last["quality"] == LIMITS.max_quality
    rest = len(m.shown)
    m.turn(20, orbit=0.005)
    falls = -np.diff(np.log(m.qualities(rest - 1)))
    assert falls.max() <= FALL + 1e-9
    assert m.qualities()[rest] < LIMITS.max_quality
    assert m.last["composite_ms"] == pytest.approx(TARGET_MS, rel=WITHIN)


def test_texts_over_a_refined_picture_leave_it_as_it_is(machine: Callable[..., Machine]):
    m = machine()
    m.turn(30)
    refined, composited = m.shown[-1], m.pictures.renderer.last
    for number, change in enumerate((lambda: press(m.preview, "O"), lambda: m.preview.say("a word")), 1):
        shown = len(m.shown)
        change()
        m.turn()
        assert len(m.shown) == shown + 1, number
        assert m.shown[-1][1] is refined[1]
    while m.preview.choices.message:
        m.turn()
    assert m.shown[-1][0].message == ""  # drawn without it
    assert m.shown[-1][1] is refined[1]
    assert m.pictures.renderer.last is composited


def test_a_hand_is_answered_while_a_picture_is_refined(machine: Callable[..., Machine]):
    m = machine()
    m.frame_ms = 4.0 * TARGET_MS
    m.turn(10, orbit=0.005)
    begun, cancels = threading.Event(), []
    make = _inside(m).make

    def endless(moment: Any, cancel: psw.Cancel | None = None, resting: bool = False) -> Any:
        if resting:
            cancels.append(cancel)
            begun.set()
            while not cancel.is_cancelled:
                time.sleep(1e-3)
            cancel.check()
        return make(moment, cancel, resting)

    _inside(m).make = endless
    shown = len(m.shown)
    m.loop.turn(m.preview.advance(m.now))
    assert begun.wait(WAIT)
    m.preview.say("while it is refined")
    m.now += 0.02
    m.loop.turn(m.preview.advance(m.now))  # is shown, and refinement goes on
    assert len(m.shown) == shown + 1
    assert not cancels[0].is_cancelled
    m.preview.orbit(0.1)
    m.now += 0.02
    m.loop.turn(m.preview.advance(m.now))
    assert cancels[0].is_cancelled
    assert len(m.shown) == shown + 2
    assert m.last["why"] not in ("refined", "")
    np.testing.assert_array_equal(m.shown[-1][0].camera.position, m.shown[-1][1].inside.head.position)


def test_the_last_and_best_picture_is_waited_for(machine: Callable[..., Machine]):
    m = machine()
    m.turn(3)
    go_on, make = threading.Event(), _inside(m).make

    def slow(moment: Any, cancel: psw.Cancel | None = None, resting: bool = False) -> Any:
        frame = make(moment, cancel, resting)
        assert not resting or frame.made.quality < LIMITS.max_quality or go_on.wait(WAIT)
        return frame

    _inside(m).make = slow
    for _ in range(2000):
        if m.pictures.is_refined(m.shown[-1][0]):
            break
        m.now += 0.02
        m.loop.turn(m.preview.advance(m.now))
    for _ in range(10):
        m.now += 0.02
        m.loop.turn(m.preview.advance(m.now))
    assert m.last["quality"] < LIMITS.max_quality
    go_on.set()
    m.turn(2)
    assert m.last["quality"] == LIMITS.max_quality


def test_a_head_that_moves_outside_is_seen_and_one_that_halts_lets_the_room_rest(
    machine: Callable[..., Machine], tmp_path: Path
):
    path = tmp_path / "head.csv"
    rows = [f"{n / 60},{0.1 * n},1.7,1,0,0,0,1" for n in range(600)]
    path.write_text("\n".join(["t,x,y,z,qx,qy,qz,qw", *rows]))
    m = machine(recording=path)
    press(m.preview, "TAB")
    m.turn(5)
    seen = [done.inside.head.position[0] for _, done in m.shown]
    assert np.diff(seen).min() > 0
    m.press("SPACE")
    m.turn(30)
    assert m.last["why"] == "refined"
    shown = len(m.shown)
    m.turn(5)
    assert len(m.shown) == shown


def test_what_refining_raises_reaches_the_user(machine: Callable[..., Machine]):
    m = machine()
    m.turn(3)
    make, faults = _inside(m).make, [psw.PerspSWError("no room for it"), RuntimeError("a fault")]

    def failing(moment: Any, cancel: psw.Cancel | None = None, resting: bool = False) -> Any:
        if resting and faults:
            raise faults.pop(0)
        return make(moment, cancel, resting)

    _inside(m).make = failing
    m.turn(2)
    assert m.preview.choices.message == "no room for it"
    with pytest.raises(RuntimeError, match="a fault"):
        m.turn(3)


def test_another_preset_walks_its_own_ladder(machine: Callable[..., Machine], monkeypatch):
    ladders = []

    def ladder_for(renderer: psw.Renderer) -> psw.Ladder:
        ladders.append(renderer.transfer)
        return psw.Ladder.default()

    m = machine(presets=("fog", "simulation"))
    m.turn(3)
    monkeypatch.setattr(psw, "ladder_for", ladder_for)
    before = _inside(m).controller
    m.press(".")
    assert _inside(m).controller is not before
    assert ladders == [m.pictures.renderer.transfer]  # once, for both views


@pytest.mark.parametrize("own", [{}, {"samples_per_interval": 4}])
def test_a_preset_s_ladder_is_judged_by_the_user_s_settings(
    machine: Callable[..., Machine], monkeypatch, own: dict[str, int]
):
    """Not by what the last ladder's rung made of them: here rays sampled otherwise than usual."""
    points = (Point(0.25, 1.0), Point(2.0, 64.0))
    found = []

    def ladder_for(renderer: psw.Renderer) -> psw.Ladder:
        found.append(psw.Ladder((Rung(f"rung {len(found)}", {"samples_per_interval": 2}, points),)))
        return found[-1]

    monkeypatch.setattr(psw, "ladder_for", ladder_for)
    m = machine(presets=("fog", "simulation"), **own)
    m.turn(3, orbit=0.005)
    quality = m.last["quality"]
    m.press(".")
    assert [rung.name for rung in _inside(m).controller.ladder.rungs] == ["as set" if own else "rung 1"]
    assert m.last["quality"] == pytest.approx(quality, rel=0.3)  # it goes on from there
    assert len(found) == (0 if own else 2)
    assert m.pictures.renderer.settings.samples_per_interval == (4 if own else 2)


# --- by hand -----------------------------------------------------------------------------------------------


def test_keys_hold_quality_from_where_it_is_and_let_it_go(machine: Callable[..., Machine]):
    m = machine()
    m.frame_ms = 4.0 * TARGET_MS
    m.turn(20, orbit=0.005)
    free = m.last["quality"]
    m.press("+")
    assert m.last["quality"] == pytest.approx(free * QUALITY_STEP)
    assert m.last["why"] == "held"
    m.press("- -")
    assert m.last["quality"] == pytest.approx(free / QUALITY_STEP)
    m.turn(20, orbit=0.005)
    shown = len(m.shown)
    m.turn(20)
    assert m.last["quality"] == pytest.approx(free / QUALITY_STEP)  # at rest, too
    assert len(m.shown) == shown
    m.press("0")
    m.turn(20, orbit=0.005)
    assert m.last["composite_ms"] == pytest.approx(TARGET_MS, rel=WITHIN)
    m.turn(30)
    assert m.last["quality"] == LIMITS.max_quality


def test_without_a_target_quality_stays_and_0_brings_it_back(machine: Callable[..., Machine]):
    m = machine(quality=0.7, target_hz=0.0)
    m.frame_ms = 9.0 * TARGET_MS
    m.turn(10, orbit=0.005)
    m.turn(10)
    assert set(m.qualities()) == {0.7}
    m.press("+")
    assert m.last["quality"] == pytest.approx(0.7 * QUALITY_STEP)
    m.press("0")
    assert m.last["quality"] == 0.7


def test_a_quality_of_the_user_s_own_is_held_until_it_is_let_go(machine: Callable[..., Machine]):
    m = machine(quality=0.7, held=True)
    m.frame_ms = 9.0 * TARGET_MS
    m.turn(10, orbit=0.005)
    m.turn(10)
    assert set(m.qualities()) == {0.7}
    assert m.last["why"] == "held"
    m.press("0")
    m.turn(10, orbit=0.005)
    assert m.last["quality"] < 0.6


# --- what is said ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("quality", "why", "target_hz", "words"),
    [
        (0.712, "steady", 30.0, "0.71, follows 30 Hz"),
        (1.0, "first", 30.0, "1.0, follows 30 Hz"),
        (1.3, "falling", 60.0, "1.3, follows 60 Hz"),
        (1.0, "held", 30.0, "1.0, held"),
        (2.0, "refined", 30.0, "2.0, refined at rest"),
        (0.5, "", 0.0, "0.50"),
    ],
)
def test_the_overlay_says_why_quality_is_what_it_is(quality: float, why: str, target_hz: float, words: str):
    assert quality_line({"quality": quality, "why": why, "target_hz": target_hz}) == words


def test_the_figures_of_real_frames_say_it(machine: Callable[..., Machine]):
    m = machine()
    m.turn(1)
    said = lambda: figures(m.shown[-1][0], {**m.last, "warp_ms": 0.0, "warp": "none"}, Rate())  # noqa: E731
    assert "quality    1.0, follows 1 Hz" in said()
    m.turn(30)
    assert "quality    2.0, refined at rest" in said()
    m.press("-")
    assert "quality    1.4, held" in said()


def test_a_trace_has_every_frame(machine: Callable[..., Machine], tmp_path: Path):
    path = tmp_path / "t.jsonl.gz"
    with recorder_to(path, "body", psw.Settings(), TARGET_HZ, LIMITS) as recorder:
        m = machine()
        m.loop._recorder = recorder
        m.frame_ms = 2.0 * TARGET_MS
        m.turn(5, orbit=0.01)
        m.turn(30)
        m.press("O")
    trace = psw.read_trace(path)
    assert len(trace["frame"]) == len(m.shown)
    np.testing.assert_allclose(trace["quality"], m.qualities(), atol=1e-6)
    assert trace["refined"][:5].sum() == 0
    assert trace["refined"][5:-1].all()
    assert trace["compositings"][-1] == 0  # texts alone
    assert (trace["target_ms"] == TARGET_MS).all()
    place = np.array([wanted.camera.position for wanted, _ in m.shown])
    np.testing.assert_allclose(np.array(trace["head"].tolist())[:, :3], place, atol=1e-5)


# --- the command, without a screen -------------------------------------------------------------------------


def test_the_command_follows_a_target_without_a_screen_only_if_asked(ball_file: Path, tmp_path: Path):
    common = ("view", ball_file, "--offscreen", "--frames", 4, "--turn", 5, "--size", *SIZE, "-o", tmp_path)
    values = result_of(*common)
    assert (values["quality"], values["why"], values["target_hz"]) == (1.0, "", 0.0)
    assert result_of(*common, "--quality", 0.7)["quality"] == 0.7
    trace = tmp_path / "trace.jsonl"
    values = result_of(*common, "--target", 1, "--quality", 0.7, "--trace", trace)
    assert values["target_hz"] == 1.0
    assert values["quality"] > 0.7  # a second is more than enough
    recorded = psw.read_trace(trace)
    assert len(recorded["frame"]) == 4
    assert recorded["quality"][0] == pytest.approx(0.7)
    assert recorded["quality"][-1] == pytest.approx(values["quality"], abs=1e-6)


@pytest.mark.parametrize("target", [-1, 0.5, 2000, "nan"])
def test_a_rate_that_is_none_is_refused(ball_file: Path, tmp_path: Path, target: object):
    words = fails("view", ball_file, "--offscreen", "--target", target, "-o", tmp_path)
    assert "--target is 1 … 1000" in words


# --- edits in the panel ------------------------------------------------------------------------------------


def edit(m: Machine, opacity: float) -> psw.TransferFunction:
    """Another function, as the panel makes one."""
    choices = m.preview.choices
    transfer = psw.editing.with_opacity(m.pictures.transfer_of(None), 1, opacity)
    choices.edits = replace(choices.edits, transfer=transfer)
    return transfer


def test_edits_are_made_in_the_background_the_newest_next(machine: Callable[..., Machine]):
    m = machine(quality=0.5)
    m.preview.choices.panel = True
    m.loop._panel._opener = lambda window: SimpleNamespace(
        take=lambda events, wanted: events, tell=lambda *told: None, draw=lambda: None, wants_frame=True
    )
    m.turn(40)
    composite, threads, made, free = m.pictures.composite, [], [], threading.Event()

    def slow(wanted: Any, cancel: psw.Cancel | None = None, resting: bool = False) -> Any:
        threads.append(threading.current_thread())
        assert resting or free.wait(WAIT)
        done = composite(wanted, cancel, resting)
        if not resting:
            made.append(wanted.edits.transfer)
        return done

    m.pictures.composite = slow
    before = m.shown[-1][1]
    functions = []
    for opacity in (0.1, 0.2, 0.3):
        functions.append(edit(m, opacity))
        m.loop.turn(m.preview.advance(m.now))
        while not threads:  # the first one is under way before the next comes
            time.sleep(1e-3)
    # The loop has answered each, with the picture from before.
    assert [done is before for _, done in m.shown[-3:]] == [True] * 3
    free.set()
    m.turn(4)
    assert made == [functions[0], functions[2]]
    assert threading.main_thread() not in threads
    renderer = psw.Renderer(m.pictures.renderer.volume, functions[2], m.pictures.renderer.settings)
    (picture,) = m.shown[-1][1].inside.pictures
    expected = renderer.render(picture.view)
    np.testing.assert_array_equal(m.pictures.renderer.warp(picture.image, picture.view), expected)


def test_a_hand_on_the_view_ends_the_background_s_work_and_shows_the_edit(machine: Callable[..., Machine]):
    m = machine(quality=0.5)
    m.preview.choices.panel = True
    m.loop._panel._opener = lambda window: SimpleNamespace(
        take=lambda events, wanted: events, tell=lambda *told: None, draw=lambda: None, wants_frame=False
    )
    m.turn(40)
    transfer = edit(m, 0.3)
    m.loop.turn(m.preview.advance(m.now))
    assert not m.loop.background.is_idle
    m.preview.orbit(0.1)
    m.loop.turn(m.preview.advance(m.now))
    assert m.loop.background.is_idle
    assert m.pictures.renderer.transfer is transfer
    assert m.shown[-1][0].edits.transfer is transfer


def test_edits_of_regions_and_of_the_rate_reach_the_renderer_and_back(machine: Callable[..., Machine]):
    m = machine(quality=0.5)
    m.turn(5)
    choices, renderer = m.preview.choices, m.pictures.renderer
    own = renderer.regions
    half = psw.Regions(clip=[(1.0, 0.0, 0.0, -24.0)])
    choices.edits = replace(choices.edits, regions=half)
    m.turn()
    assert renderer.regions is half
    choices.edits = replace(choices.edits, regions=None)
    m.turn()
    assert renderer.regions is own
    choices.follow_rate(0.0)
    m.turn()
    assert m.last["target_hz"] == 0.0 and m.last["quality"] == 0.5
    choices.follow_rate(2.0)
    m.turn()
    assert m.last["target_hz"] == 2.0 and choices.quality is None
    choices.hold_quality(0.7)
    m.turn()
    assert m.last["quality"] == 0.7


def test_another_preset_ends_an_edit(machine: Callable[..., Machine]):
    m = machine(presets=("fog",))
    m.turn(3)
    edit(m, 0.3)
    m.turn(3)
    m.press(".")
    assert m.preview.choices.edits.transfer is None
    assert m.pictures.renderer.transfer is m.pictures.transfer_of("fog")
