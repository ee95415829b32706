"""Edits of transfer functions: each against what it should do, and any sequence of them, there and back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import persp_sw as psw
from persp_sw.errors import TransferFunctionError
from persp_sw.optics.classification import Classification
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.panel.history import History
from vr_plugin.panel.tf_edit import TransferEdit

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
POINTS = [(10.0, RED, 0.0), (20.0, GREEN, 0.2), (20.0, RED, 0.6), (40.0, BLUE, 0.9)]
LIMITS = (0.0, 255.0)


def bits(transfer: psw.TransferFunction) -> tuple:
    return (
        transfer.values.tobytes(),
        transfer.colours.tobytes(),
        transfer.opacities.tobytes(),
        transfer.opacity_unit,
    )


@pytest.fixture
def transfer() -> psw.TransferFunction:
    return psw.TransferFunction(POINTS, 2.0)


# --- single edits ------------------------------------------------------------------------------------------


def test_a_point_moves_between_its_neighbours_and_no_further(transfer: psw.TransferFunction):
    assert psw.editing.moved(transfer, 3, 33.0, 0.5).points == [*POINTS[:3], (33.0, BLUE, 0.5)]
    pushed = psw.editing.moved(transfer, 3, -5.0)
    assert 20.0 < pushed.values[3] == np.nextafter(20.0, 21.0)
    assert pushed.opacities[3] == 0.9  # not named: not changed
    assert psw.editing.moved(transfer, 0, 99.0).values[0] == np.nextafter(20.0, 0.0)
    assert psw.editing.moved(transfer, 3, 99.0, within=(0.0, 50.0)).values[3] == 50.0
    assert psw.editing.moved(transfer, 3, 99.0).opacity_unit == 2.0
    assert transfer.points == POINTS


@pytest.mark.parametrize("index", [1, 2])
def test_both_points_of_a_step_move_and_each_keeps_its_opacity(transfer: psw.TransferFunction, index: int):
    edited = psw.editing.moved(transfer, index, 30.0, 0.5)
    assert edited.values.tolist() == [10.0, 30.0, 30.0, 40.0]
    opacities = [0.0, 0.2, 0.6, 0.9]
    opacities[index] = 0.5
    assert edited.opacities.tolist() == opacities
    assert psw.editing.moved(transfer, index, 99.0).values[1] == np.nextafter(40.0, 0.0)
    assert psw.editing.moved(transfer, index, 0.0).values[2] == np.nextafter(10.0, 11.0)


def test_a_point_between_neighbours_without_room_stays(transfer: psw.TransferFunction):
    points = [(1.0, RED, 0.1), (np.nextafter(1.0, 2.0), RED, 0.2), (np.nextafter(1.0, 2.0), RED, 0.3)]
    points.append((np.nextafter(points[-1][0], 2.0), RED, 0.4))
    tight = psw.TransferFunction(points)
    assert bits(psw.editing.moved(tight, 1, 7.0)) == bits(tight)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_a_point_on_the_curve_changes_no_entry_of_the_table(dtype: type, transfer: psw.TransferFunction):
    volume = psw.Volume(np.arange(64, dtype=dtype).reshape(4, 4, 4))
    table = Classification.of(transfer, volume).table
    for value in (10.5, 19.0, 20.0, 27.3, 39.999):
        edited, index = psw.editing.added(transfer, value)
        assert edited.values[index] == value
        assert (Classification.of(edited, volume).table == table).all()
        assert (Classification.of(psw.editing.deleted(edited, index), volume).table == table).all() == (
            value != 20.0  # that was a point before: the step's upper one
        )


def test_a_point_beyond_the_ends_goes_on_as_it_was(transfer: psw.TransferFunction):
    below, index = psw.editing.added(transfer, 3.0)
    assert (index, below.points[0]) == (0, (3.0, RED, 0.0))
    above, index = psw.editing.added(transfer, 77.0)
    assert (index, above.points[-1]) == (4, (77.0, BLUE, 0.9))
    opaque = psw.TransferFunction([(0.0, RED, 1.0), (1.0, RED, 1.0)])
    assert psw.editing.added(opaque, 0.5)[0].opacities.tolist() == [1.0, 1.0, 1.0]


def test_colour_and_opacity_of_one_point(transfer: psw.TransferFunction):
    assert psw.editing.coloured(transfer, 0, BLUE).points == [(10.0, BLUE, 0.0), *POINTS[1:]]
    assert psw.editing.with_opacity(transfer, 1, 0.3).points[1] == (20.0, GREEN, 0.3)


def test_what_cannot_be_done_is_refused(transfer: psw.TransferFunction):
    with pytest.raises(TransferFunctionError, match="control points 0 … 3; given 4"):
        psw.editing.deleted(transfer, 4)
    with pytest.raises(TransferFunctionError, match="the last one stays"):
        psw.editing.deleted(psw.TransferFunction([(0.0, RED, 0.5)]), 0)
    with pytest.raises(TransferFunctionError, match="between 0 and 1"):
        psw.editing.coloured(transfer, 0, (2.0, 0.0, 0.0))
    with pytest.raises(TransferFunctionError, match="between 0 and 1"):
        psw.editing.with_opacity(transfer, 0, 1.1)
    with pytest.raises(TransferFunctionError, match="value must be a number"):
        psw.editing.moved(transfer, 0, float("nan"))


def test_the_opacity_axis_has_both_ends_and_an_inverse():
    axis = psw.editing.LOGARITHMIC
    opacities = np.array([0.0, 1e-5, 1e-3, 0.03, 0.5, 1.0])
    positions = axis.position(opacities)
    assert positions[0] == 0.0 and positions[-1] == pytest.approx(1.0)
    assert (np.diff(positions) > 0).all()
    np.testing.assert_allclose([axis.opacity(p) for p in positions], opacities, rtol=1e-12)
    # A decade far above the knee takes the same room, wherever it is.
    decades = np.diff(psw.editing.OpacityAxis(1e-6).position(np.array([1e-3, 1e-2, 1e-1, 1.0])))
    np.testing.assert_allclose(decades, decades[0], rtol=1e-6)
    assert psw.editing.LINEAR.opacity(0.3) == 0.3
    assert axis.opacity(-1) == 0.0 and axis.opacity(2) == 1.0


# --- the editor --------------------------------------------------------------------------------------------

REACH = (2.0, 0.05)


def test_a_drag_is_one_step_and_keeps_the_distance_to_the_hand(transfer: psw.TransferFunction):
    edit = TransferEdit(transfer, LIMITS, psw.editing.LINEAR)
    assert edit.press(39.0, 0.88, REACH) == 3
    edit.drag(39.0, 0.88)
    assert edit.transfer is transfer  # where it was taken: no bit changes
    for step in range(1, 5):
        edit.drag(39.0 + step, 0.88 - 0.1 * step)
    edit.release()
    value, colour, opacity = edit.transfer.points[3]
    assert (value, colour) == (44.0, BLUE)
    assert opacity == pytest.approx(0.5)
    edit.undo()
    assert edit.transfer is transfer
    assert not edit.history.can_undo
    edit.redo()
    assert edit.transfer.points[3] == (value, colour, opacity)
    # A second drag is a second step.
    edit.press(*edit.place(0), REACH)
    edit.drag(12.0, 0.1)
    edit.release()
    edit.undo()
    assert edit.transfer.points[3] == (value, colour, opacity)


def test_the_hand_finds_the_point_on_top_and_nothing_beyond_its_reach(transfer: psw.TransferFunction):
    edit = TransferEdit(psw.TransferFunction([(1.0, RED, 0.5), (1.0, BLUE, 0.5)]), LIMITS, psw.editing.LINEAR)
    assert edit.point_at(1.0, 0.5, REACH) == 1
    assert edit.point_at(2.9, 0.5, REACH) == 1
    assert edit.point_at(3.1, 0.5, REACH) is None
    assert edit.press(90.0, 0.5, REACH) is None
    edit.drag(1.0, 0.1)  # nothing is held
    assert not edit.history.can_undo


def test_a_scan_of_colours_is_one_step_until_the_hand_lets_go(transfer: psw.TransferFunction):
    edit = TransferEdit(transfer, LIMITS)
    for red in (0.1, 0.2, 0.3):
        edit.set_colour(0, (red, 0.0, 0.0))
    edit.release()
    edit.set_colour(0, (0.4, 0.0, 0.0))
    edit.undo()
    assert edit.transfer.colours[0].tolist() == [0.3, 0.0, 0.0]
    edit.undo()
    assert edit.transfer is transfer


def test_save_and_load_and_what_is_no_file(transfer: psw.TransferFunction, tmp_path: Path):
    edit = TransferEdit(transfer, LIMITS)
    edit.save(tmp_path / "one.json")
    edit.delete(0)
    edit.load(tmp_path / "one.json")
    assert bits(edit.transfer) == bits(transfer)
    edit.undo()
    assert len(edit.transfer.values) == 3
    with pytest.raises(TransferFunctionError, match="cannot write"):
        edit.save(tmp_path / "no folder" / "one.json")
    with pytest.raises(TransferFunctionError, match="cannot read"):
        edit.load(tmp_path / "none.json")


finite = st.floats(-1e6, 1e6)
share = st.floats(0, 1)
edits = st.one_of(
    st.tuples(st.just("move"), st.integers(0, 9), finite, share),
    st.tuples(st.just("add"), finite),
    st.tuples(st.just("delete"), st.integers(0, 9)),
    st.tuples(st.just("colour"), st.integers(0, 9), st.tuples(share, share, share)),
    st.tuples(st.just("drag"), st.integers(0, 9), st.lists(st.tuples(finite, st.floats(-1, 2)), max_size=4)),
    st.tuples(st.just("undo")),
    st.tuples(st.just("redo")),
)


def perform(edit: TransferEdit, name: str, *given: object) -> None:
    last = len(edit.transfer.values) - 1
    if name == "move":
        edit.move(min(given[0], last), *given[1:])
    elif name == "add":
        edit.add(given[0])
    elif name == "delete":
        edit.delete(min(given[0], last))
    elif name == "colour":
        edit.set_colour(min(given[0], last), given[1])
        edit.release()
    elif name == "drag":
        edit.press(*edit.place(min(given[0], last)), (1e-3, 1e-3))
        for place in given[1]:
            edit.drag(*place)
        edit.release()
    else:
        getattr(edit, name)()


@given(st.lists(edits, max_size=25))
def test_any_edits_leave_a_valid_function_and_undo_the_start(steps: list[tuple]):
    start = psw.TransferFunction(POINTS, 2.0)
    edit = TransferEdit(start, LIMITS)
    seen = {bits(start)}
    for step in steps:
        before = edit.transfer
        perform(edit, *step)
        psw.TransferFunction(edit.transfer.points, edit.transfer.opacity_unit)  # valid, or it raises
        assert edit.transfer is before or edit.transfer.opacity_unit == 2.0
        assert edit.selected is None or 0 <= edit.selected < len(edit.transfer.values)
        seen.add(bits(edit.transfer))
    while edit.history.can_redo:
        edit.redo()
    states = [bits(edit.transfer)]
    while edit.history.can_undo:
        edit.undo()
        states.append(bits(edit.transfer))
    assert edit.transfer is start
    assert set(states) <= seen
    again = [bits(edit.transfer)]
    while edit.history.can_redo:
        edit.redo()
        again.append(bits(edit.transfer))
    assert again == states[::-1]


def test_a_history_forgets_the_oldest_and_what_was_undone():
    history = History("a", most=3)
    for state in "bcd":
        history.do(state)
    history.undo(), history.undo(), history.undo()
    assert history.now == "b"
    history.do("x")
    assert not history.can_redo and history.undo() == "b"


def test_an_added_point_leaves_the_picture_as_it_was_bit_for_bit():
    volume = synthetic_ct(24)
    renderer = psw.Renderer(volume)
    view = psw.Scene.of_volume(volume, size=(48, 40)).view(0)
    before = renderer.render(view)
    transfer = renderer.transfer
    middle = float(transfer.values[:2].mean())
    renderer.transfer = psw.editing.added(transfer, middle)[0]
    assert len(renderer.transfer.values) == len(transfer.values) + 1
    assert before.max() > 0.1
    assert (renderer.render(view) == before).all()


# --- what an edit asks to be encoded -----------------------------------------------------------------------


class Encodings:
    """A renderer that counts the axes it encodes."""

    def __init__(self, volume: psw.Volume, transfer: psw.TransferFunction, **settings: object):
        self.count = 0
        self.renderer = psw.Renderer(volume, transfer, psw.Settings(**settings), progress=self._progress)
        self.view = psw.Scene.of_volume(volume, size=(48, 40)).view(0)

    def _progress(self, done: int, total: int, what: str) -> None:
        self.count += what.startswith("encoding") and done == 0

    def picture_of(self, transfer: psw.TransferFunction) -> np.ndarray:
        self.renderer.transfer = transfer
        return self.renderer.render(self.view).copy()


SHOWN = psw.TransferFunction([(40.0, RED, 0.0), (90.0, GREEN, 0.1), (160.0, BLUE, 0.5)], 1.0)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
@pytest.mark.parametrize("more", [{}, {"skip_empty": False}, {"pack_runs": False}])
def test_only_an_edit_of_what_is_visible_encodes_and_of_one_axis(dtype: type, more: dict):
    volume = psw.Volume(synthetic_ct(24).data.astype(dtype))
    # A coarser level would count, too; so would the slice pairs that pre-integration of a wall asks for.
    more = {"level_of_detail": False, "samples_per_interval": 1, "preintegrated": False, **more}
    one = Encodings(volume, SHOWN, **more)
    one.renderer.render(one.view)
    assert one.count == 1
    edits = {
        "colour": psw.editing.coloured(SHOWN, 1, BLUE),
        "opacity": psw.editing.with_opacity(SHOWN, 2, 0.9),
        "added": psw.editing.added(SHOWN, 100.0)[0],
        "moved": psw.editing.moved(SHOWN, 0, 60.0),
    }
    for name, edited in edits.items():
        before = one.count
        picture = one.picture_of(edited)
        encoded = name == "moved" and more.get("skip_empty", True)
        assert one.count - before == encoded, name
        assert (picture == Encodings(volume, edited, **more).picture_of(edited)).all()
        one.picture_of(SHOWN)


def test_another_level_of_detail_keeps_its_runs_too():
    volume = synthetic_ct(48)
    one = Encodings(volume, SHOWN, quality=0.1)
    one.view = psw.Scene.of_volume(volume, size=(24, 20)).view(0)
    one.renderer.render(one.view)
    count = one.count
    assert count >= 2  # coarser levels show
    one.picture_of(psw.editing.coloured(SHOWN, 1, BLUE))
    assert one.count == count


def test_other_colours_are_no_other_scene_for_the_controller():
    one = Encodings(synthetic_ct(24), SHOWN)
    scene = lambda: one.renderer.features([one.view.eye], [one.view.wall]).scene  # noqa: E731
    first = scene()
    one.renderer.transfer = psw.editing.coloured(SHOWN, 1, BLUE)
    assert scene() == first
    one.renderer.transfer = psw.editing.with_opacity(SHOWN, 1, 0.2)
    assert scene() != first
