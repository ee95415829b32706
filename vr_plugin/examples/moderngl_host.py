"""A moderngl-window program that shows our volume among its own objects.

    python -m vr_plugin.examples.moderngl_host head.nrrd
    python -m vr_plugin.examples.moderngl_host --offscreen -o picture.png head.nrrd

Drag to turn, scroll to come nearer. What concerns the volume are the lines with `plugin`; the rest is an
ordinary program: its matrices are PyGLM's, its objects moderngl's, its picture a linear one of half floats
that it encodes for the screen itself.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import moderngl
import moderngl_window
import numpy as np
from pyglm import glm

import persp_sw as psw
from vr_plugin.examples.moderngl_scene import SKY, HostScene, room
from vr_plugin.host import VolumeInHost
from vr_plugin.host_view import HostView
from vr_plugin.placement import ROOM_FROM_LPS, corners_in_room

MIDDLE = (0.0, 1.3, 0.0)  # of the volume, metres
START = 0.46, 0.24, 2.75  # of the camera: radians to the right and up, metres away
EYES_APART = 0.064
FOVY = 38  # degrees
NEAR = 0.05
SAMPLES = 4

_SCREEN = """#version 330 core
uniform sampler2D picture;
out vec4 colour;

void main() {
    vec3 linear = clamp(texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb, 0.0, 1.0);
    vec3 bright = 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055;
    colour = vec4(mix(12.92 * linear, bright, greaterThan(linear, vec3(0.0031308))), 1.0);
}
"""
_WHOLE = """#version 330 core
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }
"""


class Host(moderngl_window.WindowConfig):
    """The host: a camera, its scene, a picture, a window."""

    title = "A volume in a moderngl-window program"
    gl_version = (3, 3)
    window_size = (1200, 900)
    aspect_ratio = None
    renderer: psw.Renderer  # set by `main`
    stereo = False

    def __init__(self, **keys: object):
        super().__init__(**keys)
        self.turn, self.lift, self.distance = START
        placed = standing(self.renderer.volume)
        self.scene = HostScene(self.ctx, room(corners_in_room(placed, self.renderer.volume)))
        self.screen = self.ctx.program(vertex_shader=_WHOLE, fragment_shader=_SCREEN)
        self.whole = self.ctx.vertex_array(self.screen, [])
        self.picture = None
        self.plugin = VolumeInHost(self.renderer, placed)
        self.plugin.start()

    def draw_picture(self, size: tuple[int, int]) -> moderngl.Framebuffer:
        """One frame: the host's objects, and among them the volume."""
        if self.picture is None or self.picture.size != size:
            samples = min(SAMPLES, self.ctx.max_samples)
            colours = self.ctx.renderbuffer(size, samples=samples, dtype="f2")
            depths = self.ctx.depth_renderbuffer(size, samples=samples)
            self.smooth = self.ctx.framebuffer([colours], depths)
            self.picture = self.ctx.framebuffer([self.ctx.texture(size, 4, dtype="f2")])
        views = views_of_camera(self.turn, self.lift, self.distance, size, self.stereo)
        self.plugin.prepare([view for view, _ in views])
        self.smooth.use()
        self.smooth.clear(*SKY, 1.0)
        for view, viewport in views:
            self.smooth.viewport = viewport
            self.scene.draw(view.clip_from_host)
            self.plugin.draw(view)
        self.smooth.viewport = (0, 0, *size)
        self.ctx.copy_framebuffer(self.picture, self.smooth)
        return self.picture

    def on_render(self, time: float, frame_time: float) -> None:
        """Draw and show a frame."""
        picture = self.draw_picture(self.wnd.buffer_size)
        self.wnd.use()
        self.ctx.enable_only(moderngl.NOTHING)
        picture.color_attachments[0].use(0)
        self.whole.render(moderngl.TRIANGLES, 3)

    def on_mouse_drag_event(self, x: int, y: int, dx: int, dy: int) -> None:
        """Turn."""
        self.turn -= 0.005 * dx
        self.lift = float(np.clip(self.lift + 0.005 * dy, -0.2, 1.4))

    def on_mouse_scroll_event(self, x_offset: float, y_offset: float) -> None:
        """Come nearer, or go."""
        self.distance = float(np.clip(self.distance * 0.9**y_offset, 0.2, 10))

    def on_close(self) -> None:
        """Give back what the volume has, while the context is still there."""
        self.plugin.stop()


def views_of_camera(
    turn: float, lift: float, distance: float, size: tuple[int, int], stereo: bool = False
) -> list[tuple[HostView, tuple[int, int, int, int]]]:
    """The camera's view, or its two eyes' side by side, each with its viewport."""
    flat = np.cos(lift)
    towards = glm.vec3(flat * np.sin(turn), np.sin(lift), flat * np.cos(turn))
    seen = glm.lookAt(glm.vec3(MIDDLE) + distance * towards, glm.vec3(MIDDLE), glm.vec3(0, 1, 0))
    count = 2 if stereo else 1
    width, height = size[0] // count, size[1]
    half = NEAR * np.tan(np.radians(FOVY) / 2)  # of the near plane's height
    across = half * width / height
    views = []
    for n in range(count):
        aside = (n - (count - 1) / 2) * EYES_APART
        shift = NEAR * aside / distance  # both eyes see the volume's middle in their pictures' middles
        projection = glm.frustum(-across - shift, across - shift, -half, half, NEAR, 50)
        view = glm.translate(glm.vec3(-aside, 0, 0)) * seen
        views.append((HostView(projection, view, (width, height)), (n * width, 0, width, height)))
    return views


def standing(volume: psw.Volume) -> np.ndarray:
    """host_from_world: the volume 1 m large, upright, in the middle."""
    matrix = np.eye(4)
    matrix[:3, :3] = ROOM_FROM_LPS / max(volume.extent)
    matrix[:3, 3] = MIDDLE - matrix[:3, :3] @ volume.centre
    return matrix


def made_up() -> psw.Renderer:
    """A gyroid in a ball: what is shown where no file is given."""
    z, y, x = 7 * np.mgrid[-1:1:96j, -1:1:96j, -1:1:96j]
    gyroid = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)
    data = 255 * np.exp(-3 * gyroid**2) * (x**2 + y**2 + z**2 < 45)
    points = [(100, (0, 0.05, 0.3), 0.0), (180, (0.7, 0.06, 0.02), 0.04), (250, (1, 0.8, 0.4), 0.12)]
    return psw.Renderer(psw.Volume(data.astype(np.uint8)), psw.TransferFunction(points))


def main(arguments: list[str] | None = None) -> int:
    """The program."""
    parser = argparse.ArgumentParser(description="A volume among the objects of a moderngl-window program.")
    parser.add_argument("file", nargs="?", metavar="FILE", help="volume or scene file; a gyroid without")
    parser.add_argument("--offscreen", action="store_true", help="one picture, without a screen (EGL)")
    parser.add_argument("-o", "--output", metavar="FILE", help=".png, .npy or .exr, with --offscreen")
    parser.add_argument("--size", type=int, nargs=2, default=Host.window_size, metavar=("W", "H"))
    parser.add_argument("--stereo", action="store_true", help="both eyes, side by side")
    given = parser.parse_args(arguments)
    if given.offscreen != bool(given.output):
        parser.error("--offscreen and -o FILE go together")
    try:
        if given.output:
            psw.images.check_output(given.output)
        renderer = open_renderer(given.file) if given.file else made_up()
        host = type("Host", (Host,), {"renderer": renderer, "stereo": given.stereo, "log_level": 30})
        size = f"{given.size[0]}x{given.size[1]}"
        window = ["--window", "headless", "--backend", "egl"] if given.offscreen else ["--window", "pyglet"]
        if not given.offscreen:
            moderngl_window.run_window_config(host, args=[*window, "--size", size])
            return 0
        program = moderngl_window.create_window_config_instance(host, args=[*window, "--size", size])
        picture = program.draw_picture(tuple(given.size))
        numbers = np.frombuffer(picture.read(components=4, dtype="f4"), np.float32)
        psw.images.write(given.output, numbers.reshape(*picture.size[::-1], 4)[::-1])
        print(
            f"{given.output}: {program.plugin.compositings} compositings, {program.ctx.info['GL_RENDERER']}"
        )
        program.on_close()
    except psw.PerspSWError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


def open_renderer(path: str) -> psw.Renderer:
    """Of a volume file, or of a scene file with its transfer function."""
    if Path(path).suffix.lower() in (".json", ".toml"):
        scene = psw.Scene.load(path)
        return psw.Renderer(scene.volume, scene.transfer, psw.Settings(), scene.regions, look=scene.look)
    return psw.Renderer(psw.load(path))


if __name__ == "__main__":
    sys.exit(main())
