"""The gallery's scenes as data: scene-file keys; `key`: a light (right, up, towards the eye)."""

from __future__ import annotations

from typing import Any

import numpy as np

LOOKS = {
    "unlit": "unlit",
    "lit": "headlight",
    "shadows": "key light, shadows",
    "modulated": "gradient-modulated",
    "tf2d": "2D function",
}
HEADLIGHT = {"ambient": 0.25, "diffuse": 0.85, "specular": 0.25, "power": 24}
FILL = {"ambient": 0.18, "diffuse": 0.9, "specular": 0.3, "power": 30, "headlight": 0.3}
KEY_COLOUR = [1.05, 1.0, 0.92]

SCENES: dict[str, dict[str, Any]] = {
    "engine": {
        "tf": [
            [60, 0.42, 0.5, 0.6, 0],
            [105, 0.5, 0.6, 0.72, 0.03],
            [150, 0.55, 0.66, 0.78, 0.04],
            [172, 0.6, 0.6, 0.6, 0.03],
            [190, 1, 0.35, 0.08, 0.3],
            [215, 1, 0.5, 0.12, 0.85],
            [255, 1, 0.78, 0.35, 0.95],
        ],
        "eye": [330, 560, -290],
        "centre": [124, 130, 62],
        "up": [0, 0, -1],
        "fovy": 22.5,
        "key": (-0.9, 0.75, 0.5),
        "gradient": {"distance": 2},
        "tf2d": [
            {
                "shape": "triangle",
                "value": 75,
                "magnitudes": [6, 60],
                "width": 60,
                "colour": [0.5, 0.66, 0.85],
                "opacity": 0.25,
                "soft": 1,
            },
            {
                "shape": "box",
                "values": [175, 256],
                "magnitudes": [0, 60],
                "colour": [1, 0.5, 0.12],
                "opacity": 0.6,
                "soft": 0.3,
            },
        ],
        "modulation": {"opacity": 1, "low": 0.02, "high": 0.22},
    },
    "mni152_nilearn": {
        "tf": [
            [85, 0.55, 0.25, 0.18, 0],
            [125, 0.75, 0.42, 0.33, 0.15],
            [165, 0.85, 0.55, 0.45, 0.5],
            [205, 0.95, 0.78, 0.68, 0.8],
            [230, 1, 0.95, 0.88, 0.9],
        ],
        "eye": [520, 380, 280],
        "centre": [98, 116, 88],
        "up": [0, 0, 1],
        "fovy": 21,
        "key": (-0.95, 0.8, 0.25),
        "tf2d": [
            {
                "shape": "triangle",
                "value": 105,
                "magnitudes": [3, 70],
                "width": 90,
                "colour": [0.85, 0.5, 0.42],
                "opacity": 0.06,
                "soft": 1,
            },
            {
                "shape": "box",
                "values": [195, 256],
                "magnitudes": [0, 30],
                "colour": [1, 0.92, 0.8],
                "opacity": 0.6,
                "soft": 0.6,
            },
        ],
        "modulation": {"opacity": 1, "low": 0.02, "high": 0.2},
    },
    "stent": {
        "tf": [
            [150, 0.45, 0.08, 0.05, 0],
            [210, 0.6, 0.12, 0.07, 0.015],
            [270, 0.8, 0.33, 0.2, 0.12],
            [340, 0.9, 0.6, 0.42, 0.4],
            [450, 0.95, 0.82, 0.66, 0.65],
            [700, 0.85, 0.9, 1, 0.9],
            [1200, 1, 1, 1, 0.97],
        ],
        "eye": [240, -390, 150],
        "centre": [64, 64, 128],
        "up": [0, 0, 1],
        "fovy": 28,
        "key": (-0.9, 0.6, 0.4),
        "tf2d": [
            {
                "shape": "triangle",
                "value": 230,
                "magnitudes": [30, 250],
                "width": 160,
                "colour": [0.85, 0.35, 0.22],
                "opacity": 0.4,
                "soft": 1,
            },
            {
                "shape": "box",
                "values": [600, 2400],
                "magnitudes": [0, 1200],
                "colour": [0.9, 0.95, 1],
                "opacity": 0.9,
                "soft": 0.3,
            },
        ],
        "modulation": {"opacity": 1, "low": 0.01, "high": 0.12},
    },
    "bonsai": {
        "tf": [
            [28, 0.1, 0.35, 0.06, 0],
            [45, 0.16, 0.5, 0.1, 0.12],
            [70, 0.3, 0.6, 0.12, 0.3],
            [95, 0.42, 0.24, 0.1, 0.5],
            [135, 0.5, 0.28, 0.14, 0.75],
            [170, 0.35, 0.22, 0.16, 0.85],
            [215, 0.55, 0.5, 0.48, 0.9],
        ],
        "eye": [128, 300, 580],
        "centre": [128, 128, 120],
        "up": [0, 1, 0],
        "fovy": 27,
        "key": (-0.8, 0.8, 0.4),
        "tf2d": [
            {
                "shape": "triangle",
                "value": 40,
                "magnitudes": [3, 40],
                "width": 25,
                "colour": [0.25, 0.6, 0.12],
                "opacity": 0.5,
                "soft": 1,
            },
            {
                "shape": "box",
                "values": [85, 160],
                "magnitudes": [6, 80],
                "colour": [0.5, 0.28, 0.14],
                "opacity": 0.6,
                "soft": 0.5,
            },
        ],
        "crop": [0, 255, 62, 255, 0, 255],
        "modulation": {"opacity": 1, "low": 0.01, "high": 0.12},
    },
    "heptane": {
        "tf": [
            [12, 0.1, 0.14, 0.3, 0],
            [30, 0.12, 0.2, 0.5, 0.006],
            [60, 0.5, 0.2, 0.3, 0.02],
            [110, 0.9, 0.3, 0.06, 0.08],
            [170, 1, 0.55, 0.1, 0.2],
            [240, 1, 0.9, 0.5, 0.5],
        ],
        "eye": [100, -560, 300],
        "centre": [150, 151, 151],
        "up": [-1, 0, 0],
        "fovy": 27,
        "key": (-0.9, 0.7, 0.4),
        "tf2d": [
            {
                "shape": "triangle",
                "value": 60,
                "magnitudes": [2, 40],
                "width": 60,
                "colour": [0.9, 0.4, 0.1],
                "opacity": 0.3,
                "soft": 1,
            },
            {
                "shape": "triangle",
                "value": 20,
                "magnitudes": [1, 15],
                "width": 14,
                "colour": [0.2, 0.35, 0.9],
                "opacity": 0.06,
                "soft": 1,
            },
        ],
        "modulation": {"opacity": 1, "low": 0.0, "high": 0.1},
    },
    "nuclei_confocal": {
        "tf": [
            [9500, 0.02, 0.1, 0.3, 0],
            [12500, 0.05, 0.3, 0.6, 0.1],
            [16000, 0.08, 0.5, 0.7, 0.3],
            [26000, 0.5, 0.9, 0.6, 0.5],
            [40000, 1, 1, 0.75, 0.7],
        ],
        "eye": [128, -170, 310],
        "centre": [128, 118, 25],
        "up": [0, 0, 1],
        "fovy": 30,
        "key": (-0.9, 0.6, 0.35),
        "gradient": {"distance": 3},
        "tf2d": [
            {
                "shape": "triangle",
                "value": 11000,
                "magnitudes": [100, 3500],
                "width": 7000,
                "colour": [0.1, 0.5, 0.75],
                "opacity": 0.25,
                "soft": 1,
            },
            {
                "shape": "box",
                "values": [19000, 66000],
                "magnitudes": [0, 9000],
                "colour": [1, 0.8, 0.45],
                "opacity": 0.5,
                "soft": 0.8,
            },
        ],
        "modulation": {"opacity": 1, "low": 0.0, "high": 0.06},
    },
}


def keys_of(name: str, look: str) -> dict[str, Any]:
    """Scene-file keys, all but volume and size, of one of `SCENES` with one of `LOOKS`."""
    scene = dict(SCENES[name])
    key, shapes, modulation = scene.pop("key"), scene.pop("tf2d"), scene.pop("modulation")
    if look == "unlit":
        return scene
    if look == "shadows":
        lights = [{"direction": _in_world(scene, key), "colour": KEY_COLOUR}]
        return scene | {"shade": True, "light": FILL, "lights": lights, "shadows": True}
    lit = scene | {"shade": True, "light": HEADLIGHT}
    if look == "modulated":
        return lit | {"gradient": scene.get("gradient", {}) | modulation}
    if look == "tf2d":
        del lit["tf"]
        return lit | {"tf2d": shapes}
    return lit


def _in_world(scene: dict[str, Any], key: tuple[float, float, float]) -> list[float]:
    """The key light's direction from the camera's (right, up, towards the eye)."""
    back = np.subtract(scene["eye"], scene["centre"])
    back = back / np.linalg.norm(back)
    right = np.cross(scene["up"], back)
    right /= np.linalg.norm(right)
    direction = np.array(key) @ [right, np.cross(back, right), back]
    return [round(number, 3) for number in direction.tolist()]
