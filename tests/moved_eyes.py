"""Volumes, eye images and eyes that have moved, for tests of the re-warp."""

import numpy as np
from views import random_pose

from persp_sw import Eye, Renderer, Settings, TransferFunction, View, Volume

TF = TransferFunction([(0, (1, 0.5, 0.2), 0), (255, (0.3, 1, 1), 0.3)], 1.0)
SOLID = TransferFunction([(0, (1, 0.5, 0.2), 0.99)], 1.0)


def coloured_noise(rng):
    """A volume in a turned, stretched, sheared, mirrored pose."""
    pose = random_pose(rng, spacing=(1, 1.5, 0.7), shear=0.2, mirrored=True)
    return Volume(rng.integers(0, 255, (20, 24, 22)).astype(np.uint8), world_from_object=pose)


def composited(volume, view, transfer=TF, walls=None, **settings):
    return Renderer(volume, transfer, Settings(**settings)).composite(view.eye, walls or [view.wall])


def moved(view, shift):
    """The same wall for an eye elsewhere."""
    return View(Eye(view.eye.position + shift, view.eye.near), view.wall)
