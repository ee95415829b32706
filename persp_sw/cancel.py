"""Work given up before it is done, because nobody wants its result any more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


class Cancelled(Exception):
    """The work was given up: whoever holds its `Cancel` asked for it.

    No `PerspSWError`, for nothing is wrong and there is nothing to mend.
    """


class Cancel:
    """Asks work in another thread to stop at its next look; once asked, for good. Make one for each task.

    Attributes
    ----------
    flag
        uint8 (1,): 0, or 1 once cancelled; what compiled code looks at.
    """

    __slots__ = ("flag",)

    def __init__(self):
        self.flag: NDArray[np.uint8] = np.zeros(1, np.uint8)

    def cancel(self) -> None:
        """Ask the work to stop; from any thread, as often as one likes."""
        self.flag[0] = 1

    @property
    def is_cancelled(self) -> bool:
        """Whether that was asked."""
        return bool(self.flag[0])

    def check(self) -> None:
        """Go on, or raise `Cancelled`: for work between its parts."""
        if self.flag[0]:
            raise Cancelled
