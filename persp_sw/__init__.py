"""Perspective shear-warp volume rendering for immersive virtual reality."""

from .errors import PerspSWError
from .geometry.view import Eye, View, Wall
from .optics.transfer import TransferFunction
from .volume.grid import Volume

__all__ = ["Eye", "PerspSWError", "TransferFunction", "View", "Volume", "Wall"]
__version__ = "0.1.0"
