"""Text over a picture that OpenGL draws."""

from __future__ import annotations

from collections.abc import Sequence

from .gl_objects import Texture
from .lettering import text_panel
from .shapes import Shapes, clip_from_pixels


class Overlay:
    """One panel of text; made anew only when the text changes. Belongs to the context of its shapes."""

    def __init__(self, shapes: Shapes, letter: int = 16):
        self.letter = letter
        self.redrawn = 0
        self._shapes = shapes
        self._texture: Texture | None = None
        self._shown: tuple[str, int] | None = None

    def draw(self, text: str, size: Sequence[int], corner: str = "upper left") -> None:
        """Draw the text into the bound framebuffer; nothing for an empty one.

        Parameters
        ----------
        size
            Width and height in pixels of the window that is shown in the end: an eye's picture of half its
            width gets letters of half theirs, which the display stretches again.
        corner
            "upper" or "lower", "left" or "right".
        """
        if not text:
            return
        if (text, self.letter) != self._shown:
            panel = text_panel(text, self.letter)
            if self._texture is None or self._texture.size != panel.shape[1::-1]:
                self.close()
                self._texture = Texture(panel.shape[1::-1])
            self._texture.upload(panel)
            self._shown = text, self.letter
            self.redrawn += 1
        width, height = self._texture.size
        margin = self.letter // 2
        left = size[0] - width - margin if "right" in corner else margin
        top = size[1] - height - margin if "lower" in corner else margin
        corners = [
            (left, top + height, 0),
            (left + width, top + height, 0),
            (left + width, top, 0),
            (left, top, 0),
        ]
        self._shapes.picture(clip_from_pixels(size), corners, self._texture.name, hidden=False)

    def close(self) -> None:
        """Delete its texture."""
        if self._texture:
            self._texture.close()
        self._texture = self._shown = None
