"""Run-length stores of a volume's levels of detail."""

from __future__ import annotations

from collections.abc import Callable

from .grid import Volume
from .lift import lifted
from .mip import Levels
from .runs import RunStore
from .visibility import Visibility


class DetailStore:
    """One `RunStore` for each level of detail of a volume, `lifted`, made when first asked for.

    Parameters
    ----------
    volume
        Level 0; at least two voxels along every axis.
    visibility
        What can be seen, in all levels.
    progress
        Called as progress(steps done, steps, what) while a level is made or an axis encoded.
    stored
        As `RunStore`'s.
    """

    def __init__(
        self,
        volume: Volume,
        visibility: Visibility,
        progress: Callable[[int, int, str], None] | None = None,
        stored: Visibility | None = None,
    ):
        self.volume = volume
        volume = lifted(volume)
        self.levels = Levels(volume, progress)
        self._progress = progress
        self._visibility, self._stored = visibility, stored
        self._stores = {0: RunStore(volume, visibility, progress, stored)}

    def __len__(self) -> int:
        """Number of levels."""
        return len(self.levels)

    def store(self, number: int) -> RunStore:
        """The runs of level `number`, 0 the finest."""
        if number not in self._stores:
            level = self.levels.level(number)
            self._stores[number] = RunStore(level, self._visibility, self._progress, self._stored)
        return self._stores[number]

    def classify(self, visibility: Visibility, stored: Visibility | None = None) -> None:
        """Change what can be seen; what was encoded of other voxels is dropped, the levels are kept."""
        self._visibility, self._stored = visibility, stored
        for store in self._stores.values():
            store.classify(visibility, stored)

    @property
    def encode_seconds(self) -> float:
        """Spent encoding so far, compilation not counted."""
        return sum(store.encode_seconds for store in self._stores.values())

    @property
    def bytes(self) -> int:
        """Memory of what is encoded: voxels and index, without the blocks' bounds."""
        return sum(store.bytes for store in self._stores.values())
