"""How many objects OpenGL holds: what must not grow from frame to frame."""

from __future__ import annotations

from .context import opengl

KINDS = (
    "Texture", "Buffer", "Framebuffer", "Renderbuffer", "VertexArray", "Sampler", "Query", "Program",
    "Shader",
)  # fmt: skip
# Drivers give small names: the smallest free one, or one after the other. A thousand frames that lose one of
# each kind stay below it.
NAMES = 4096


def census(names: int = NAMES) -> dict[str, int]:
    """Live objects of each of `KINDS` in the OpenGL context that is current, of names 1 … `names`.

    Those of contexts that share with it count, too, but for framebuffers, vertex arrays and queries, which
    contexts do not share. What is deleted while it is in use counts as long as it is.

    Cost: some 80 ms for 4,096 names; each is asked for.

    Raises
    ------
    MissingPackageError
        No PyOpenGL.
    """
    gl = opengl()
    asks = {kind: getattr(gl, f"glIs{kind}") for kind in KINDS}
    return {kind: sum(bool(ask(name)) for name in range(1, names + 1)) for kind, ask in asks.items()}


def growth(before: dict[str, int], after: dict[str, int]) -> int:
    """How many objects there are more, of all kinds that have become more."""
    return sum(max(after[kind] - before[kind], 0) for kind in before)
