"""What the user's hand has made of a scene while it is shown."""

from __future__ import annotations

from dataclasses import dataclass

import persp_sw as psw


@dataclass(frozen=True)
class Edits:
    """Each None: as the scene, or its preset, has it.

    Attributes
    ----------
    transfer
        The transfer function.
    regions
        Which part is shown.
    look
        Lights, and what gradients do.
    target_hz
        The frame rate that quality follows; 0: none.
    """

    transfer: psw.TransferFunction | None = None
    regions: psw.Regions | None = None
    look: psw.Look | None = None
    target_hz: float | None = None
