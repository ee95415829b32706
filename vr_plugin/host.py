"""Our volume in the scene of another program: with its matrices, its framebuffer and its depth buffer.

Five calls, whatever draws the rest:

    start     once for each OpenGL context, or for each group of contexts that share; it is current
    update    whenever something is to look different or stand elsewhere
    prepare   once a frame, with all views of the frame; needs no OpenGL
    draw      once for each view, after the host's opaque objects, into what is bound
    stop      once for each start

The page docs/plug-in.md says more, also what a host in C++ does.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

import persp_sw as psw
from persp_sw.errors import GraphicsError, ViewError

from .host_view import HostView, matrix_of, seen_in_world
from .rigs.similarity import flaw_of


@dataclass(frozen=True, eq=False)
class _Eye:
    """All views of one eye, and what was composited for them."""

    eye: psw.Eye
    walls: tuple[psw.Wall, ...]
    look: tuple[object, ...]
    image: psw.EyeImage
    statistics: dict[str, Any]

    def serves(self, eye: psw.Eye, walls: list[psw.Wall], look: tuple[object, ...]) -> bool:
        """Whether compositing these would change nothing."""
        return (
            len(walls) == len(self.walls)
            and all(a is b for a, b in zip(look, self.look, strict=True))
            and np.array_equal(_numbers(eye, walls), _numbers(self.eye, self.walls))
        )


class VolumeInHost:
    """A volume that a host draws among its own objects.

    Parameters
    ----------
    renderer
        What is shown. Its attributes may be assigned at any time, here or by `update`.
    host_from_world
        (4, 4) similarity: where the volume's world (mm for a patient) stands in the host's scene, whatever
        the host's unit. Opacity stays per world length.
    precision
        How textures hold pixels, as for `psw.TextureWarp`.
    same_eye
        Eyes this close (host units; radians for parallel views) are one: composited once for all their
        views. The default is what matrices of float32 numbers can tell.

    Attributes
    ----------
    compositings
        Eye images that the last `prepare` made and that show anything: what the frame cost.
    reused
        Eye images that the last `prepare` kept, for neither eye nor walls nor looks had changed.
    images, statistics
        Of each eye of the last `prepare`, in the views' order: the eye image, and `Renderer.last` of it.

    Raises
    ------
    ViewError
        host_from_world is no similarity.
    GraphicsError
        No such precision.
    """

    def __init__(
        self,
        renderer: psw.Renderer,
        host_from_world: np.ndarray | None = None,
        precision: str = "auto",
        same_eye: float = 1e-5,
    ):
        self.renderer = renderer
        self.same_eye = same_eye
        self.compositings = self.reused = 0
        self._precision = psw.TextureWarp(precision).precision  # refuses here, not in start
        self._contexts: dict[Hashable, _Uploads] = {}
        self._eyes: list[_Eye] = []
        self._drawn: dict[HostView, tuple[int, np.ndarray]] = {}
        self.host_from_world = np.eye(4) if host_from_world is None else host_from_world

    @property
    def host_from_world(self) -> np.ndarray:
        """(4, 4) similarity; a new one holds from the next `prepare` on."""
        return self._host_from_world.copy()

    @host_from_world.setter
    def host_from_world(self, matrix: np.ndarray) -> None:
        matrix = matrix_of(matrix, "host_from_world")
        flaw = flaw_of(matrix)
        if flaw:
            raise ViewError(f"host_from_world is no similarity: {flaw}")
        self._host_from_world = matrix

    @property
    def images(self) -> list[psw.EyeImage]:
        """One for each eye of the last `prepare`."""
        return [eye.image for eye in self._eyes]

    @property
    def statistics(self) -> list[dict[str, Any]]:
        """`Renderer.last` of each eye of the last `prepare`; of a reused one, that of its compositing."""
        return [dict(eye.statistics) for eye in self._eyes]

    def start(self, context: Hashable = "") -> None:
        """Make ready to draw in the context that is current, and in all that share with it.

        `context` names it: only for hosts that have several which do not share.

        Raises
        ------
        GraphicsError
            No context is current, it is older than OpenGL 3.3, or this one was started already.
        MissingPackageError
            No PyOpenGL.
        """
        if context in self._contexts:
            raise GraphicsError(f"context {context!r} was started already; stop it first, or name another")
        uploads = _Uploads(self._precision)
        uploads.check()
        self._contexts[context] = uploads

    def update(
        self,
        *,
        transfer: psw.TransferFunction | None = None,
        settings: psw.Settings | None = None,
        regions: psw.Regions | None = None,
        host_from_world: np.ndarray | None = None,
    ) -> None:
        """Show it otherwise from the next `prepare` on; what is not given stays."""
        if host_from_world is not None:
            self.host_from_world = host_from_world  # first: it may be refused
        for name, value in (("transfer", transfer), ("settings", settings), ("regions", regions)):
            if value is not None:
                setattr(self.renderer, name, value)

    def prepare(self, views: Iterable[HostView], near: float = 0.0) -> None:
        """Composite what all views of one frame show: once for each eye, however many views it has.

        Needs no OpenGL context and touches none. The first time it also encodes the volume.

        Parameters
        ----------
        views
            All of this frame; in the same order each time, so that each eye's image can keep the choices it
            made the frame before.
        near
            Distance before each eye, host units, in which nothing is shown; nothing else clips the volume.
            Of no effect in parallel views.

        Raises
        ------
        ViewError
            A matrix or viewport that is none. Nothing has changed then.
        """
        placed = self._host_from_world
        scale = float(np.cbrt(np.linalg.det(placed[:3, :3])))  # host units in a world unit
        volume = self.renderer.volume
        eyes: list[psw.Eye] = []
        walls: list[list[psw.Wall]] = []
        drawn: dict[HostView, tuple[int, np.ndarray]] = {}
        for view in views:
            ours = seen_in_world(view, placed, volume, near / scale)
            n = next((n for n, eye in enumerate(eyes) if self._same(eye, ours.eye, scale)), len(eyes))
            if n == len(eyes):
                eyes.append(ours.eye)
                walls.append([])
            walls[n].append(ours.wall)
            drawn[view] = n, view.clip_from_host @ placed
        renderer = self.renderer
        look = (volume, renderer.transfer, renderer.settings, renderer.regions, renderer.look)
        made, compositings, reused = [], 0, 0
        for n, (eye, behind) in enumerate(zip(eyes, walls, strict=True)):
            before = self._eyes[n] if n < len(self._eyes) else None
            if before is not None and before.serves(eye, behind, look):
                made.append(before)
                reused += 1
                continue
            alike = before is not None and before.eye.is_at_infinity == eye.is_at_infinity
            image = self.renderer.composite(eye, behind, before.image if alike else None)
            made.append(_Eye(eye, tuple(behind), look, image, dict(self.renderer.last)))
            compositings += bool(image.faces)
        self.compositings, self.reused = compositings, reused
        self._eyes, self._drawn = made, drawn

    def draw(self, view: HostView, context: Hashable = "", depth_test: bool = True) -> None:
        """Lay the volume over what is in the framebuffer and viewport that are bound.

        Call it after the host's opaque objects. Uploads, the first time an eye's image is drawn in a context.
        Depths are tested, and never written; all of OpenGL's state is afterwards as it was.

        Parameters
        ----------
        view
            One of those that `prepare` was given: the object itself.
        context
            As given to `start`.
        depth_test
            Off: the volume is in front of everything.

        Raises
        ------
        ViewError
            A view that was not prepared.
        GraphicsError
            Not started, or the current context shares nothing with the one that was.
        """
        if context not in self._contexts:
            raise GraphicsError(f"context {context!r} is not started; call start while it is current")
        if view not in self._drawn:
            raise ViewError("this view was not prepared; give prepare all views of the frame, then draw them")
        n, clip_from_world = self._drawn[view]
        self._contexts[context].draw(n, self._eyes[n].image, clip_from_world, depth_test)

    def stop(self, context: Hashable = "") -> None:
        """Delete all that was made in a context, which is current; one that was not started is left alone.

        After the last one eye images go, too. It may be started again.
        """
        if context in self._contexts:
            self._contexts.pop(context).close()
        if not self._contexts:
            self._eyes, self._drawn = [], {}

    def _same(self, one: psw.Eye, other: psw.Eye, scale: float) -> bool:
        if one.is_at_infinity != other.is_at_infinity:
            return False
        unit = 1.0 if one.is_at_infinity else scale
        return float(np.linalg.norm(one.position - other.position)) * unit <= self.same_eye


class _Uploads:
    """What one group of contexts holds: a texture for each eye."""

    def __init__(self, precision: str):
        self._warp = psw.TextureWarp(precision)
        self._held: dict[int, psw.EyeImage] = {}

    def check(self) -> None:
        """GraphicsError where the current context will not do."""
        nothing = psw.EyeImage(psw.Eye(np.zeros(3)), np.eye(4), (), np.zeros((0, 4), np.float32), 0)
        self._warp.upload(nothing)

    def draw(self, number: int, image: psw.EyeImage, clip_from_world: np.ndarray, depth_test: bool) -> None:
        if self._held.get(number) is not image:
            self._warp.upload(image, str(number))
            self._held[number] = image
        self._warp.draw(clip_from_world, str(number), depth_test)

    def close(self) -> None:
        self._warp.close()
        self._held = {}


def _numbers(eye: psw.Eye, walls: Iterable[psw.Wall]) -> np.ndarray:
    """All that an eye image depends on besides the scene."""
    parts = [[*eye.position, eye.near, eye.w]]
    parts += [[*w.lower_left, *w.lower_right, *w.upper_left, *w.pixels] for w in walls]
    return np.concatenate(parts)
