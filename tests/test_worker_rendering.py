"""Compositing in a worker thread beside a display that warps: the same bits, no growth, a clean end."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from threading import Event, Thread

import numba
import numpy as np
import pytest
from samples import ROOT

import persp_sw as psw
from persp_sw import _jit, compositor
from persp_sw.measure.cave import eye_pair, four_walls, placed
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.worker import Worker

LONG = 60.0  # seconds; only a failure waits so long
FOG = psw.TransferFunction([(0, (0.2, 0.3, 0.8), 0.001), (255, (1, 0.9, 0.7), 0.1)], opacity_unit=1 / 15)
POSES = 8
# How much the allocator's and the interpreter's own memory may come and go, bytes.
RSS_NOISE = 4 * 2**20
# Interrupted while the kernel runs, with `close` left to the context manager or to the interpreter's exit.
_PROGRAM = """
import sys
import persp_sw as psw
from persp_sw.measure.cave import eye_pair, four_walls, placed
from persp_sw.volume.phantoms import synthetic_ct
from vr_plugin.worker import Worker

renderer = psw.Renderer(placed(synthetic_ct(16)), None, psw.Settings(intermediate_size=512))

def work(task, cancel):
    try:
        while True:
            renderer.composite(eye_pair(0)[0], four_walls(512), cancel=cancel)
            print("composited", flush=True)
    except psw.Cancelled:
        print("given up", flush=True)

worker = Worker(work)
worker.ask("endless")
if sys.argv[1] == "closed":
    with worker:
        worker.wait()
worker.wait()
"""


def renderer_of(edge: int = 16, **settings) -> psw.Renderer:
    return psw.Renderer(placed(synthetic_ct(edge)), FOG, psw.Settings(**settings))


def both_eyes(renderer: psw.Renderer, walls: list[psw.Wall]):
    """Work: both eyes of a pose's number, as (number, images)."""

    def work(number: int, cancel: psw.Cancel) -> tuple[int, tuple[psw.EyeImage, ...]]:
        eyes = eye_pair(40 * (number % POSES))
        return number, tuple(renderer.composite(eye, walls, cancel=cancel) for eye in eyes)

    return work


def test_a_display_that_warps_beside_it_changes_no_bit():
    renderer, walls = renderer_of(threads=_jit.max_threads()), four_walls(40)
    work = both_eyes(renderer, walls)

    def warped(images):
        return [renderer.warp(image, psw.View(image.eye, walls[0])) for image in images]

    alone = [work(pose, psw.Cancel())[1] for pose in range(POSES)]
    pictures = [warped(images) for images in alone]
    assert all(picture.any() for pair in pictures for picture in pair)
    shown, number = None, 0
    with Worker(work) as worker:
        worker.ask(number)
        while number < 1000:
            result = worker.newest()
            if result is not shown:
                shown, number = result, number + 1
                worker.ask(number)
            if shown is None:
                continue
            pose = shown[0] % POSES
            for one, other in zip(shown[1], alone[pose], strict=True):
                np.testing.assert_array_equal(one.pixels, other.pixels)
            for one, other in zip(warped(shown[1]), pictures[pose], strict=True):
                np.testing.assert_array_equal(one, other)


@pytest.mark.skipif(_jit.max_threads() < 2, reason="needs two threads")
def test_each_thread_has_its_own_number_of_threads():
    said, go = Event(), Event()
    counts = []

    def one():
        _jit.set_threads(1)
        said.set()
        assert go.wait(LONG)
        counts.append(numba.get_num_threads())

    thread = Thread(target=one)
    thread.start()
    assert said.wait(LONG)
    _jit.set_threads(2)
    go.set()
    thread.join()
    assert counts == [1] and numba.get_num_threads() == 2
    _jit.set_threads(_jit.max_threads())


def test_close_ends_a_compositing_early(monkeypatch):
    light = renderer_of()
    light.composite(eye_pair(0)[0], four_walls(512))  # encoded and compiled
    light.settings = psw.Settings(intermediate_size=4096, samples_per_interval=4, residual=0, threads=1)
    kernel, begun, rows = compositor.composite_face, Event(), []

    def watched(*arguments):
        rows.append(arguments[-2])
        begun.set()
        kernel(*arguments)

    monkeypatch.setattr(compositor, "composite_face", watched)
    worker = Worker(both_eyes(light, four_walls(4096)))
    worker.ask(0)
    assert begun.wait(LONG)
    worker.close()
    assert len(rows) == 1 and (rows[0] > 0).mean() < 0.5
    assert worker.newest() is None


def test_an_error_of_the_renderer_reaches_the_display():
    walls = four_walls(40)
    with Worker(both_eyes(renderer_of(), walls)) as worker:
        worker.ask(0)
        assert worker.wait(LONG)
        walls.append(psw.Wall((0, 0, 1), (0, 1, 1), (-1, 0, 1), (8, 8), "edge-on"))  # holds the eyes
        worker.ask(1)
        assert worker.wait(LONG)
        with pytest.raises(psw.PerspSWError, match="edge-on"):
            worker.newest()
        assert worker.newest()[0] == 0


@pytest.mark.skipif(not Path("/proc/self/statm").is_file(), reason="needs /proc")
@pytest.mark.parametrize("frames", [2000, pytest.param(10_000, marks=pytest.mark.slow)])
def test_frames_do_not_make_memory_grow(frames):
    renderer, walls = renderer_of(threads=1, intermediate_size=64), four_walls(40)
    canvas = psw.Canvas(*walls[0].pixels)
    with Worker(both_eyes(renderer, walls)) as worker:
        for number in range(400 + frames):
            worker.ask(number)
            if number % 4 == 0:  # else it is replaced, or its predecessor cancelled
                worker.ask(number, cancel_running=True)
                assert worker.wait(LONG)
            if (shown := worker.newest()) is not None:
                for image in shown[1]:
                    renderer.warp(image, psw.View(image.eye, walls[0]), canvas)
            if number == 400:
                start = _resident_bytes()
    size = sum(image.pixels.nbytes for image in shown[1])
    assert size * frames / 4 > 10 * RSS_NOISE  # so one finished frame in ten that stays is seen
    assert _resident_bytes() - start < RSS_NOISE


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize("how", ["closed", "left"])
def test_an_interrupt_ends_the_program(how):
    program = subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, how],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert program.stdout.readline() == "composited\n"
        program.send_signal(signal.SIGINT)
        told, said = program.communicate(timeout=LONG)
    finally:
        program.kill()
    assert program.returncode == -signal.SIGINT, said
    assert said.rstrip().endswith("KeyboardInterrupt") and said.count("Traceback") == 1
    assert told.endswith("given up\n")  # before the interpreter was taken down
    assert "Fatal" not in said and "does not stop" not in said
