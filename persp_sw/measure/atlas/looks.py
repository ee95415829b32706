"""Transfer functions that cases share: soft light everywhere, and hard surfaces."""

from __future__ import annotations

from ...optics.transfer import TransferFunction

# For volumes of values 0 … 255, `synthetic_ct` above all: air 0, flesh 60, bone 180, tubes 230.
SMOOTH = TransferFunction([(0, (0.2, 0.4, 0.9), 0), (90, (0.9, 0.6, 0.3), 0.05), (255, (1, 1, 1), 0.3)])
SURFACE = TransferFunction(
    [(0, (0, 0, 0), 0), (100, (0.9, 0.7, 0.5), 0), (130, (0.9, 0.7, 0.5), 0.9), (255, (1, 1, 1), 0.95)]
)
LOOKS = {"smooth": SMOOTH, "surface": SURFACE}
