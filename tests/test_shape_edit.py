"""The editor of two-dimensional transfer functions, without widgets: each edit, and any sequence of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import persp_sw as psw
from persp_sw.errors import TransferFunctionError
from vr_plugin.panel.shape_edit import ShapeEdit, grips_of, reshaped

BOX = psw.Box((20.0, 60.0), (5.0, 15.0), (1.0, 0.5, 0.2), 0.3, 0.5)
TRIANGLE = psw.Triangle(100.0, (2.0, 30.0), 25.0, (0.2, 0.5, 1.0), 0.6, 0.5)
LIMITS = (0.0, 255.0, 50.0)
REACH = (4.0, 1.0)


def editor() -> ShapeEdit:
    return ShapeEdit(psw.TransferFunction2D([BOX, TRIANGLE], 1.0), LIMITS)


@pytest.mark.parametrize(
    ("shape", "part", "by", "changed"),
    [
        (BOX, "middle", (10.0, -2.0), {"values": (30.0, 70.0), "magnitudes": (3.0, 13.0)}),
        (BOX, "middle", (0.0, -9.0), {"magnitudes": (0.0, 10.0)}),  # not below 0, and as high as before
        (BOX, "middle", (500.0, 0.0), {"values": (235.0, 275.0)}),  # the middle stays within
        (BOX, "left", (15.0, 99.0), {"values": (35.0, 60.0)}),
        (BOX, "left", (99.0, 0.0), {"values": (60.0 - 255e-6, 60.0)}),
        (BOX, "right", (-15.0, 0.0), {"values": (20.0, 45.0)}),
        (BOX, "low", (9.0, -7.0), {"magnitudes": (0.0, 15.0)}),
        (BOX, "high", (9.0, -70.0), {"magnitudes": (5.0, 5.0 + 50e-6)}),
        (TRIANGLE, "middle", (-5.0, 3.0), {"value": 95.0, "magnitudes": (5.0, 33.0)}),
        (TRIANGLE, "width", (-5.0, 3.0), {"width": 20.0}),
        (TRIANGLE, "width", (-50.0, 3.0), {"width": 255e-6}),
        (TRIANGLE, "high", (0.0, 10.0), {"magnitudes": (2.0, 40.0)}),
        (TRIANGLE, "low", (0.0, 4.0), {"magnitudes": (6.0, 30.0)}),
    ],
)
def test_each_part_moves_what_it_names(shape, part: str, by: tuple[float, float], changed: dict):
    now = reshaped(shape, part, by, LIMITS)
    for name in ("values", "magnitudes", "value", "width", "colour", "opacity", "soft"):
        if hasattr(shape, name) and not (name == "values" and isinstance(shape, psw.Triangle)):
            assert getattr(now, name) == pytest.approx(changed.get(name, getattr(shape, name)))


def test_every_grip_is_found_where_it_is_and_a_drag_is_one_step():
    edit = editor()
    start = edit.transfer
    for number, shape in enumerate(start.shapes):
        for grip in grips_of(shape):
            assert edit.grip_at(grip.value, grip.magnitude, REACH) == (number, grip.part)
    assert edit.grip_at(200.0, 40.0, REACH) is None
    assert edit.press(61.0, 10.2, REACH) and edit.selected == 0
    edit.drag(61.0, 10.2)
    assert edit.transfer is start
    for step in range(1, 4):
        edit.drag(61.0 + step, 10.2)
    edit.release()
    assert edit.transfer.shapes == (psw.Box((20.0, 63.0), *_rest(BOX)), TRIANGLE)
    edit.undo()
    assert edit.transfer is start and not edit.history.can_undo


def _rest(box: psw.Box) -> tuple:
    return box.magnitudes, box.colour, box.opacity, box.soft


def test_colours_opacities_files_and_the_last_shape(tmp_path: Path):
    edit = editor()
    for red in (0.1, 0.2):
        edit.recolour(1, (red, 0.0, 0.0))
    edit.release()
    edit.weigh(1, 0.9, 0.1)
    assert (edit.transfer.shapes[1].colour, edit.transfer.shapes[1].opacity) == ((0.2, 0.0, 0.0), 0.9)
    edit.undo()
    edit.undo()
    assert edit.transfer.shapes == (BOX, TRIANGLE)
    edit.save(tmp_path / "two.json")
    assert edit.delete(0) and not edit.delete(0)
    edit.load(tmp_path / "two.json")
    assert edit.transfer.shapes == (BOX, TRIANGLE)
    with pytest.raises(TransferFunctionError, match="cannot write"):
        edit.save(tmp_path / "no folder" / "two.json")


share, away = st.floats(0, 1), st.floats(-400, 400)
edits = st.one_of(
    st.tuples(
        st.just("drag"), st.integers(0, 5), st.integers(0, 4), st.lists(st.tuples(away, away), max_size=3)
    ),
    st.tuples(st.just("add"), st.sampled_from([BOX, TRIANGLE])),
    st.tuples(st.just("delete"), st.integers(0, 5)),
    st.tuples(st.just("recolour"), st.integers(0, 5), st.tuples(share, share, share)),
    st.tuples(st.just("undo")),
    st.tuples(st.just("redo")),
)


@given(st.lists(edits, max_size=20))
def test_any_edits_leave_a_valid_function_and_undo_the_start(steps: list[tuple]):
    edit = editor()
    start = edit.transfer
    for name, *given_ in steps:
        last = len(edit.transfer.shapes) - 1
        if name == "drag":
            shape = edit.transfer.shapes[min(given_[0], last)]
            grips = grips_of(shape)
            grip = grips[min(given_[1], len(grips) - 1)]
            edit.press(grip.value, grip.magnitude, REACH)
            for place in given_[2]:
                edit.drag(*place)
            edit.release()
        elif name in ("delete", "recolour"):
            getattr(edit, name)(min(given_[0], last), *given_[1:])
            edit.release()
        else:
            getattr(edit, name)(*given_)
        psw.TransferFunction2D.from_dict(edit.transfer.to_dict())  # valid, or it raises
        assert edit.transfer.opacity_unit == 1.0
    while edit.history.can_redo:
        edit.redo()
    states = [edit.transfer]
    while edit.history.can_undo:
        edit.undo()
        states.append(edit.transfer)
    assert edit.transfer is start
    again = [edit.transfer]
    while edit.history.can_redo:
        edit.redo()
        again.append(edit.transfer)
    assert again == states[::-1]
