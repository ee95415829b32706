"""Compositing that is given up: it ends early, leaves nothing behind, and spoils nothing."""

from threading import Event, Thread

import numpy as np
import pytest

import persp_sw as psw
from persp_sw import compositor
from persp_sw.measure.cave import eye_pair, four_walls, placed
from persp_sw.volume.phantoms import synthetic_ct

FOG = psw.TransferFunction([(0, (0.2, 0.3, 0.8), 0.001), (255, (1, 0.9, 0.7), 0.01)], opacity_unit=1 / 31)
INSIDE = psw.Eye((0.05, 1.5, -0.2))


def renderer(**settings):
    return psw.Renderer(placed(synthetic_ct(32)), FOG, psw.Settings(**settings))


def spy(monkeypatch, before=lambda *_: None, after=lambda *_: None):
    """Call `before` and `after` about every call of the compositing kernel, with its samples and picture."""
    kernel = compositor.composite_face
    calls = []

    def watched(*arguments):
        *_, samples, out = arguments
        calls.append(out)
        before(samples, out)
        kernel(*arguments)
        after(samples, out)

    monkeypatch.setattr(compositor, "composite_face", watched)
    return calls


def test_the_kernel_leaves_scanlines_that_begin_after_the_cancel(monkeypatch):
    cancel, left = psw.Cancel(), []
    spy(
        monkeypatch,
        before=lambda *_: cancel.cancel(),
        after=lambda samples, out: left.append((samples.copy(), out.any())),
    )
    with pytest.raises(psw.Cancelled):
        renderer().composite(eye_pair(0)[0], four_walls(128), cancel=cancel)
    ((samples, anything),) = left
    assert samples.size > 16 and not samples.any() and not anything


def test_a_cancel_in_another_thread_is_seen_while_the_kernel_runs(monkeypatch):
    # A thousand million samples, unless it ends early; a load of the flag out of the loop would not see it.
    one = renderer(intermediate_size=2048, samples_per_interval=4, residual=0, threads=1)
    one.settings, heavy = psw.Settings(threads=1, samples_per_interval=4), one.settings
    one.composite(eye_pair(0)[0], four_walls(64))  # encoded and compiled
    one.settings = heavy
    cancel, begun, rows, raised = psw.Cancel(), Event(), [], []

    def note(samples, out):
        rows.append((samples, out))
        begun.set()

    spy(monkeypatch, before=note)

    def work():
        try:
            one.composite(eye_pair(0)[0], four_walls(2048), cancel=cancel)
        except psw.Cancelled as error:
            raised.append(error)

    thread = Thread(target=work)
    thread.start()
    assert begun.wait(60)
    samples, out = rows[0]
    while not samples.any() and thread.is_alive():
        pass
    cancel.cancel()
    thread.join()
    done = samples > 0
    assert len(rows) == len(raised) == 1
    assert 0 < done.sum() < 0.5 * len(out)
    assert not out[~done].any() and out[done].any()


def test_nothing_follows_a_cancel_between_faces(monkeypatch):
    one = renderer()
    whole = spy(monkeypatch)
    assert len(one.composite(INSIDE, four_walls(128)).faces) > 3
    assert len(whole) > 3
    monkeypatch.undo()
    cancel = psw.Cancel()
    begun = spy(monkeypatch, after=lambda *_: len(begun) == 3 and cancel.cancel())
    with pytest.raises(psw.Cancelled):
        one.composite(INSIDE, four_walls(128), cancel=cancel)
    assert len(begun) == 3


def test_a_renderer_is_after_a_cancel_as_before(monkeypatch):
    one, walls = renderer(), four_walls(128)
    cancel = psw.Cancel()
    spy(monkeypatch, after=lambda *_: cancel.cancel())
    with pytest.raises(psw.Cancelled):
        one.composite(INSIDE, walls, cancel=cancel)
    assert one.last == {}
    encoded = one.detail.bytes
    assert encoded > 0
    monkeypatch.undo()
    first = one.composite(INSIDE, walls)
    assert one.detail.bytes > encoded  # the other axes; what was encoded is kept
    kept = dict(one.last)
    with pytest.raises(psw.Cancelled):
        one.composite(eye_pair(0)[0], walls, cancel=cancel)
    assert one.last == kept
    again, fresh = one.composite(INSIDE, walls), renderer().composite(INSIDE, walls)
    np.testing.assert_array_equal(first.pixels, fresh.pixels)
    np.testing.assert_array_equal(again.pixels, fresh.pixels)
    assert one.last["encode_ms"] == 0


def test_a_cancel_that_nobody_asks_changes_no_bit():
    one, walls = renderer(), four_walls(128)
    plain, watched = (one.composite(INSIDE, walls, cancel=cancel) for cancel in (None, psw.Cancel()))
    np.testing.assert_array_equal(plain.pixels, watched.pixels)
    assert plain.samples == watched.samples > 0


def test_a_cancel_is_for_good_and_no_error_of_the_user():
    cancel = psw.Cancel()
    cancel.check()
    assert not cancel.is_cancelled
    for _ in range(2):
        cancel.cancel()
        assert cancel.is_cancelled
        with pytest.raises(psw.Cancelled):
            cancel.check()
    assert not issubclass(psw.Cancelled, psw.PerspSWError)
