"""All that decides what a sample looks like, for one volume."""

from __future__ import annotations

from typing import NamedTuple

from .classification import Classification
from .look import Look
from .shadows import Shadows


class Appearance(NamedTuple):
    """A transfer function as a table, its look, and the shadows that go with both, where any are cast."""

    classification: Classification
    look: Look = Look()
    shadows: Shadows | None = None

    @property
    def asks_gradients(self) -> bool:
        """Whether anything depends on gradients."""
        return not self.look.is_plain or self.classification.magnitudes > 1
