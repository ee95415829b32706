"""Panels: three places of Gauss on a part of a ray, and the light they make."""

from __future__ import annotations

import numpy as np

from .._jit import kernel

# Columns: where, how often halved, steps and bends at both ends, extinction and colour at three places.
START, WIDTH, LEVEL, ENDS, NODES, PANEL = 0, 1, 2, 3, 7, 19

_ROOT15 = np.sqrt(15.0)
PLACES = (0.5 - _ROOT15 / 10, 0.5, 0.5 + _ROOT15 / 10)  # of a panel's width

# All of an opaque panel's light comes from its first part, where no place may be: in its own shadow, then.
DEEPEST = 2.0

# A bend between an end of a half panel and its first place hides ½ · 0.056² of the slope there: of twice the
# mean slope, at both ends, this part of what the colour changes over the panel.
_HIDDEN = 0.006


@kernel
def hidden_change(whole, front, back, opacity):
    """Most that a step or a bend that no place has met can change, where the zones tell that there is one."""
    middle = back[ENDS : ENDS + 2]
    stepped = whole[ENDS] != middle[0] or whole[ENDS + 2] != middle[0]
    bent = whole[ENDS + 1] != middle[1] or whole[ENDS + 3] != middle[1]
    if not (stepped or bent):
        return 0.0
    brightest, spread = 1.0, 0.0
    for c in range(1, 4):
        least, most = whole[NODES + c], whole[NODES + c]
        for n in range(NODES + c, PANEL, 4):
            least = min(least, min(whole[n], min(front[n], back[n])))
            most = max(most, max(whole[n], max(front[n], back[n])))
        brightest, spread = max(brightest, most), max(spread, most - least)
    return opacity * brightest if stepped else opacity * spread * _HIDDEN


@kernel
def light_of_panel(panel, length):
    """Optical depth and light of one panel by the three-stage Gauss rule."""
    scale = length * panel[WIDTH]
    a, b, c = panel[NODES : NODES + 4], panel[NODES + 4 : NODES + 8], panel[NODES + 8 : NODES + 12]
    t1, t2, t3 = scale * a[0], scale * b[0], scale * c[0]
    depth = (5 * t1 + 8 * t2 + 5 * t3) / 18
    if not depth > 0:
        return 0.0, 0.0, 0.0, 0.0
    # Depths up to the three nodes.
    d1 = t1 * (5 / 36) + t2 * (2 / 9 - _ROOT15 / 15) + t3 * (5 / 36 - _ROOT15 / 30)
    d2 = t1 * (5 / 36 + _ROOT15 / 24) + t2 * (2 / 9) + t3 * (5 / 36 - _ROOT15 / 24)
    d3 = t1 * (5 / 36 + _ROOT15 / 30) + t2 * (2 / 9 + _ROOT15 / 15) + t3 * (5 / 36)
    e1, e2, e3 = 5 * t1 * np.exp(-d1) / 18, 8 * t2 * np.exp(-d2) / 18, 5 * t3 * np.exp(-d3) / 18
    opacity = -np.expm1(-depth)
    # The colour's mean, weighted by extinction, is exact at any depth; the rest is small where colours are
    # alike: red = mean · opacity + Σ e · (colour − mean).
    w1, w2, w3 = 5 * t1 / (18 * depth), 8 * t2 / (18 * depth), 5 * t3 / (18 * depth)
    rest = opacity - e1 - e2 - e3
    f1, f2, f3 = w1 * rest + e1, w2 * rest + e2, w3 * rest + e3
    red = f1 * a[1] + f2 * b[1] + f3 * c[1]
    green = f1 * a[2] + f2 * b[2] + f3 * c[2]
    blue = f1 * a[3] + f2 * b[3] + f3 * c[3]
    return depth, red, green, blue
