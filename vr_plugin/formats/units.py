"""Units of length in which foreign files count."""

from __future__ import annotations

import numpy as np

from ..rig import RigError

METRES = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254, "ft": 0.3048}
# What a display's longer edge measures, metres: from a small monitor to a lecture hall's, and most often.
_SMALLEST, _LARGEST, _USUAL = 0.2, 8.0, 2.0


def metres_per_unit(unit: str) -> float:
    """Metres in one mm, cm, m, in or ft.

    Raises
    ------
    RigError
        Another unit.
    """
    if unit not in METRES:
        raise RigError(f"the unit is one of {', '.join(METRES)}; given {unit!r}")
    return METRES[unit]


def ask_for_unit(file: str, longest_edges: np.ndarray) -> str:
    """The message where a format does not say in what it counts: what each unit would make of these walls."""
    edge = float(np.median(longest_edges))
    fits = [unit for unit, metres in METRES.items() if _SMALLEST <= edge * metres <= _LARGEST]
    metric = [unit for unit in fits if unit in ("m", "mm", "cm")] or fits
    likely = sorted(metric, key=lambda unit: abs(np.log(edge * METRES[unit] / _USUAL)))
    sizes = ", ".join(f"{unit} → {_length(edge * metres)}" for unit, metres in METRES.items())
    text = f"{file}: this format does not state its unit of length; give it with --unit {'|'.join(METRES)}."
    text += f" A wall of it is {edge:g} long: {sizes}."
    if likely:
        text += f" Most likely: --unit {likely[0]}"
    return text


def _length(metres: float) -> str:
    """A length for people."""
    if metres >= 1:
        return f"{metres:.3g} m"
    return f"{metres * 100:.3g} cm" if metres >= 0.01 else f"{metres * 1000:.3g} mm"
