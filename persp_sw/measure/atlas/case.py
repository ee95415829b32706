"""What a case of the stability atlas is, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ...arrays import Image

Progress = Callable[[int, int, str], None]  # called as progress(done, total, what)
T = TypeVar("T")


@dataclass(frozen=True)
class Scale:
    """How large cases are.

    Attributes
    ----------
    quick
        Small pictures and volumes and few views, for tests and `--quick`.
    """

    quick: bool

    def pick(self, quick: T, full: T) -> T:
        """The first in a quick run, the second in a full one."""
        return quick if self.quick else full


@dataclass(frozen=True, eq=False)
class Strip:
    """Pictures of one size to be shown side by side: ours, the reference, their difference.

    Attributes
    ----------
    label
        What is seen, a few words.
    ours, reference
        (h, w, 4) linear, premultiplied, row 0 on top. Without a reference there is ours alone.
    error
        (h, w, 4) what they differ by; None: |ours − reference|.
    gain
        What the difference is multiplied by to be shown, where 1 is the brightest.
    single_axis
        (h, w, 4) the shear-warp's of 2001, shown beside ours, with its own difference from the reference.
    """

    label: str
    ours: Image
    reference: Image | None = None
    error: Image | None = None
    gain: float = 4.0
    single_axis: Image | None = None


@dataclass(frozen=True, eq=False)
class Finding:
    """One metric of a case beside its bound.

    Attributes
    ----------
    metric
        What was measured, as the overview names it.
    value, bound
        In `unit`. NaN never holds.
    derived
        Where the bound comes from, one line: an equation, or "1.5 × a plain ray caster".
    unit
        Of value, bound, ray_caster and single_axis; empty for a pure number.
    at_least
        The value must not fall below the bound; else it must not exceed it.
    strips
        Pictures that show it.
    ray_caster
        The same metric of a plain ray caster with as many samples a ray; None: not measured.
    single_axis
        The same metric of a single-axis perspective shear-warp without per-ray correction, as published in
        2001 (`single_axis.py`), on the same views; None: not measured, or the metric has no meaning there;
        NaN: that method has no picture of such a view.
    """

    metric: str
    value: float
    bound: float
    derived: str
    unit: str = ""
    at_least: bool = False
    strips: Sequence[Strip] = ()
    ray_caster: float | None = None
    single_axis: float | None = None

    @property
    def holds(self) -> bool:
        """Whether the value is on the good side of its bound, or on it."""
        return bool(self.value >= self.bound if self.at_least else self.value <= self.bound)


Part = Callable[[Scale], Sequence[Finding]]  # of a case: measures some of its metrics


@dataclass(frozen=True)
class Case:
    """A way in which volume renderers fail.

    Attributes
    ----------
    name
        As `--case` has it: lower case, words joined by hyphens.
    title
        A heading.
    what
        Two or three sentences: what goes wrong in such methods, why, and what is done about it here.
    run
        Measures it.
    """

    name: str
    title: str
    what: str
    run: Callable[[Scale, Progress], list[Finding]]


def in_parts(parts: Mapping[str, Part], scale: Scale, progress: Progress) -> list[Finding]:
    """The findings of all parts, measured one after the other; progress is told the name of each."""
    found: list[Finding] = []
    for done, (name, part) in enumerate(parts.items()):
        progress(done, len(parts), name)
        found += part(scale)
    progress(len(parts), len(parts), "done")
    return found
