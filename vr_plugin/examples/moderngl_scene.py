"""A host's own scene, drawn with moderngl: floor, pedestal, a ball behind, a cube before, a frame of bars.

Nothing here knows of volumes. Metres, y up; colours linear; depth tested and written, as usual.
"""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

Point = Sequence[float]

SKY = (0.035, 0.045, 0.065)

_VERTEX = """#version 330 core
uniform mat4 clip_from_host;
in vec3 place;
in vec3 normal;
in vec3 paint;
out vec3 at, facing, tint;

void main() {
    at = place;
    facing = normal;
    tint = paint;
    gl_Position = clip_from_host * vec4(place, 1.0);
}
"""

_FRAGMENT = """#version 330 core
const vec3 SUN = normalize(vec3(0.35, 0.9, 0.55));
uniform vec3 sky;
in vec3 at, facing, tint;
out vec4 colour;

// Squares of half a metre on the floor, softened to their mean where they are smaller than a pixel.
vec3 tiles(vec3 paint) {
    vec2 wave = sin(6.28318531 * at.xz), width = fwidth(at.xz) * 2.0;
    vec2 sharp = clamp(wave / (6.28318531 * max(width, 1e-4)), -1.0, 1.0);
    return paint * (1.0 + 0.22 * sharp.x * sharp.y * clamp(1.5 - max(width.x, width.y), 0.0, 1.0));
}

void main() {
    vec3 n = normalize(facing), paint = at.y < 1e-6 ? tiles(tint) : tint;
    float sun = max(dot(n, SUN), 0.0), above = 0.5 + 0.5 * n.y;
    vec3 around = mix(vec3(0.10, 0.09, 0.08), vec3(0.16, 0.20, 0.27), above);
    vec3 lit = paint * (0.75 * sun * vec3(1.0, 0.93, 0.82) + around);
    float far = at.y < 1e-6 ? smoothstep(1.0, 6.5, length(at.xz)) : 0.0;
    colour = vec4(mix(lit, sky, far), 1.0);
}
"""


def cuboid(low: Point, high: Point, paint: Point) -> np.ndarray:
    """(36, 9) vertices of a box: place, normal, paint."""
    triangles = []
    for axis in range(3):
        for sign in (-1, 1):
            normal = np.zeros(3)
            normal[axis] = sign
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)):
                corner = np.empty(3)
                corner[[axis, (axis + 1) % 3, (axis + 2) % 3]] = sign, a, b
                place = (np.add(low, high) + corner * np.subtract(high, low)) / 2
                triangles.append([*place, *normal, *paint])
    return np.array(triangles, np.float32)


def ball(middle: Point, radius: float, paint: Point, steps: int = 40) -> np.ndarray:
    """(n, 9) vertices of a ball."""
    polar, around = np.meshgrid(
        np.linspace(0, np.pi, steps + 1), np.linspace(0, 2 * np.pi, 2 * steps + 1), indexing="ij"
    )
    normals = np.stack([np.sin(polar) * np.cos(around), np.cos(polar), np.sin(polar) * np.sin(around)], -1)
    a, b, c, d = normals[:-1, :-1], normals[1:, :-1], normals[1:, 1:], normals[:-1, 1:]
    normals = np.stack([a, b, c, a, c, d], 2).reshape(-1, 3)
    paints = np.broadcast_to(paint, normals.shape)
    return np.concatenate([np.add(middle, radius * normals), normals, paints], 1).astype(np.float32)


def frame(corners: np.ndarray, thickness: float, paint: Point) -> np.ndarray:
    """(n, 9) vertices of bars along the edges of a box that is parallel to the axes; (8, 3) its corners."""
    low, high = corners.min(0) - thickness / 2, corners.max(0) + thickness / 2
    bars = []
    for axis in range(3):
        for a in (0, 1):
            for b in (0, 1):
                start, stop = low.copy(), high.copy()
                for other, end in (((axis + 1) % 3, a), ((axis + 2) % 3, b)):
                    start[other] = (low, high)[end][other] - thickness / 2
                    stop[other] = start[other] + thickness
                bars.append(cuboid(start, stop, paint))
    return np.concatenate(bars)


def room(corners: np.ndarray) -> list[np.ndarray]:
    """All objects around a box that is parallel to the axes: (8, 3) its corners."""
    low, high = corners.min(0), corners.max(0)
    floor = np.array(
        [
            [x, 0, z, 0, 1, 0, 0.20, 0.19, 0.18]
            for x, z in ((-8, -8), (-8, 8), (8, 8), (-8, -8), (8, 8), (8, -8))
        ],
        np.float32,
    )
    x, y, z = (low + high) / 2
    top = low[1] - 0.04
    return [
        floor,
        cuboid((x - 0.3, 0, z - 0.3), (x + 0.3, top, z + 0.3), (0.42, 0.40, 0.37)),
        ball((x - 0.42, y + 0.15, low[2] - 0.7), 0.4, (0.55, 0.05, 0.035)),
        cuboid(
            (x + 0.12, low[1] + 0.1, high[2] + 0.2),
            (x + 0.37, low[1] + 0.35, high[2] + 0.45),
            (0.05, 0.28, 0.4),
        ),
        frame(corners, 0.012, (0.6, 0.45, 0.15)),
    ]


class HostScene:
    """The objects in OpenGL's memory."""

    def __init__(self, context: moderngl.Context, objects: Sequence[np.ndarray]):
        self.context = context
        self._program = context.program(vertex_shader=_VERTEX, fragment_shader=_FRAGMENT)
        self._program["sky"] = SKY
        self._vertices = context.buffer(np.concatenate(objects).tobytes())
        layout = [(self._vertices, "3f 3f 3f", "place", "normal", "paint")]
        self._array = context.vertex_array(self._program, layout)

    def draw(self, clip_from_host: np.ndarray) -> None:
        """All of them, into what is bound."""
        self.context.enable_only(moderngl.DEPTH_TEST)
        self._program["clip_from_host"].write(clip_from_host.T.astype(np.float32).tobytes())  # by columns
        self._array.render()

    def close(self) -> None:
        """Give memory back."""
        for thing in (self._array, self._vertices, self._program):
            thing.release()
