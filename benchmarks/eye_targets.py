"""What an eye's picture should be drawn in: time and error of the formats of `vr_plugin.screen.eye_target`.

    python benchmarks/eye_targets.py [--size 1024] [--frames 20]

Draws a smooth picture, half transparent, over the whole target three times, as a volume over a scene,
composes two targets into a window's bytes in each stereo mode, and prints the median milliseconds and how far
the screen's values are from those of 32-bit floats, in steps of its 256. Needs no screen.
"""

import argparse
from collections.abc import Callable
from statistics import median
from time import perf_counter

import numpy as np

import persp_sw as psw
from vr_plugin.stereo import MODES, eye_size


def milliseconds(work: Callable[[], None], frames: int) -> float:
    """Median of a work's time, finished."""
    from OpenGL import GL

    times = []
    for _ in range(frames + 1):
        start = perf_counter()
        work()
        GL.glFinish()
        times.append(1e3 * (perf_counter() - start))
    return median(times[1:])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--frames", type=int, default=20)
    options = parser.parse_args()
    size = options.size, options.size
    with psw.OffscreenContext() as context:
        from OpenGL import GL

        from vr_plugin.present import Composer, read_screen
        from vr_plugin.screen.eye_target import FORMATS, EyeTarget
        from vr_plugin.screen.gl_objects import Texture
        from vr_plugin.screen.shapes import Shapes

        print(f"{context.renderer}, {size[0]} × {size[1]} pixels, median of {options.frames}")
        shapes, composer = Shapes(), Composer()
        window = int(GL.glGenFramebuffers(1))
        colour = int(GL.glGenRenderbuffers(1))
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, window)
        GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, colour)
        GL.glRenderbufferStorage(GL.GL_RENDERBUFFER, GL.GL_RGBA8, *size)
        GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_RENDERBUFFER, colour)
        ramp = np.linspace(0, 1, size[0])
        picture = np.ones((size[1], size[0], 4), np.float32)
        picture[..., :3] = (0.6 * ramp**2)[:, None, None] * np.stack([ramp, ramp[::-1], ramp**2], -1)
        texture = Texture(size, GL.GL_RGBA32F)
        texture.upload(0.5 * picture)
        corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
        shown: dict[str, np.ndarray] = {}
        for precision in sorted(FORMATS, key=lambda name: name != "float32"):
            target = EyeTarget(size, precision)

            def draw(target: EyeTarget = target) -> None:
                with target.drawing():
                    for _ in range(3):
                        shapes.picture(np.eye(4), corners, texture.name, hidden=False)

            row = [f"draw {milliseconds(draw, options.frames):6.1f}"]
            for mode in MODES:
                if mode in ("quad", "two_windows", "left", "right"):
                    continue
                eye = EyeTarget(eye_size(mode, size), precision)

                def compose(eye: EyeTarget = eye, mode: str = mode) -> None:
                    composer.compose(eye, eye, mode, size, background=(0.1, 0.1, 0.1))

                row.append(f"{mode} {milliseconds(compose, options.frames):5.1f}")
                eye.close()
            composer.compose(target, target, "mono", size, background=(0.1, 0.1, 0.1))
            shown[precision] = read_screen(size).astype(int)
            error = np.abs(shown[precision] - shown["float32"])
            print(f"{precision:8} {'  '.join(row)}   error max {error.max()}, mean {error.mean():.4f} of 255")
            target.close()


if __name__ == "__main__":
    main()
