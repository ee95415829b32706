"""Ways to sample, and switches to turn off: named changes of the settings, for charts and ablations.

A new setting is one more line here. Lines whose setting this version does not have are left out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

from ..settings import Settings

Changes = Mapping[str, Any]

# Where settings as accurate as a peer are looked for.
MODES: dict[str, Changes] = {
    "1 sample": {"samples_per_interval": 1},
    "2 samples": {"samples_per_interval": 2},
    "4 samples": {"samples_per_interval": 4},
    "pre-integrated": {"preintegrated": True, "samples_per_interval": 1},
    "pre-integrated, 2 samples": {"preintegrated": True, "samples_per_interval": 2},
    "4 samples, residual 0.0005": {"samples_per_interval": 4, "residual": 0.0005},
}

# Each a curve in the chart, along the qualities. All that a chart varies is set, not left as the user has it.
_AS_USUAL: Changes = {
    "preintegrated": False,
    **{name: getattr(Settings(), name) for name in ("residual", "level_of_detail")},
}
SAMPLING: dict[str, Changes] = {
    name: {**_AS_USUAL, **changes} for name, changes in MODES.items() if "residual" not in changes
}
# What else a chart varies, one option after the other.
OPTIONS: dict[str, dict[str, Changes]] = {
    "levels of detail": {"no levels of detail": {"level_of_detail": False}},
    "termination": {"residual 0.0005": {"residual": 0.0005}, "residual 0.02": {"residual": 0.02}},
}

# Each against the default.
ABLATIONS: dict[str, Changes] = {
    "no skipping": {"skip_empty": False},
    "no packing": {"pack_runs": False},
    "no termination": {"residual": 0.0},
    "2 samples an interval": {"samples_per_interval": 2},
    "4 samples an interval": {"samples_per_interval": 4},
    "pre-integrated": {"preintegrated": True},
    "samples at points": {"preintegrated": False},
    "no levels of detail": {"level_of_detail": False},
    "one face for all rays": {"single_face_tangent": 8.0},
}


def available(table: Mapping[str, Changes], base: Settings) -> dict[str, Settings]:
    """The settings that each line makes of `base`; only those that this version has."""
    known = {field.name for field in fields(Settings)}
    return {name: replace(base, **changes) for name, changes in table.items() if known >= set(changes)}
