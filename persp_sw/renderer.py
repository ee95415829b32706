"""Renderer: the one object most users need."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any

from . import _jit
from .arrays import Image
from .cancel import Cancel
from .compositor import composite_eye
from .eye_image import EyeImage
from .geometry.faces import Face
from .geometry.regions import Regions
from .geometry.view import Eye, View, Wall
from .optics.appearance import Appearance
from .optics.classification import Classification
from .optics.classification2d import classify
from .optics.look import Look
from .optics.presets import choose
from .optics.shadows import Shadows
from .optics.transfer import TransferFunction
from .optics.transfer2d import TransferFunction2D
from .planning import EyePlan, plan_eye
from .quality.features import SceneFeatures, features_of
from .sampling import choose_sampling
from .settings import Settings
from .volume.detail import DetailStore
from .volume.grid import Volume
from .volume.runs import RunStore
from .volume.visibility import EverythingVisible
from .warp.canvas import Canvas
from .warp.software import warp_eye_image

_log = logging.getLogger("persp_sw")


class Renderer:
    """Pictures of one volume.

    Parameters
    ----------
    volume
        What to show.
    transfer
        How; None chooses a preset from the values' histogram.
    settings
        Speed and accuracy.
    regions
        Which part is shown.
    progress
        Called as progress(done, total, what) while the volume is encoded.
    look
        Lights, and what gradients do to the transfer function; None: neither.

    All of these but the volume may be changed at any time by assigning to the attribute of that name; what
    has to be encoded anew is, when next needed.

    Attributes
    ----------
    detail
        The run-length stores of all levels of detail; `runs` is that of the finest.
    last
        Statistics of the last picture: `encode_ms`, `composite_ms`, `warp_ms`, `compile_ms` (numba; not in
        the others), `faces`, `intermediate_size` (width and height of the largest face), `samples`,
        `samples_per_interval` and `preintegrated` (how rays were sampled), `runs_bytes`, `threads`.
    """

    def __init__(
        self,
        volume: Volume,
        transfer: TransferFunction | TransferFunction2D | None = None,
        settings: Settings | None = None,
        regions: Regions | None = None,
        progress: Callable[[int, int, str], None] | None = None,
        look: Look | None = None,
    ):
        self.volume = volume
        self.settings = settings or Settings()
        self.regions = regions or Regions()
        self._look = look or Look()
        self.last: dict[str, Any] = {}
        self._shadowed: tuple[Any, Shadows] | None = None
        self._transfer = transfer or choose(volume).transfer
        self._classification = classify(self._transfer, volume)
        self._classified = 0
        self._skipping, self._packing = self.settings.skip_empty, self.settings.pack_runs
        self.detail = DetailStore(volume, self._visibility(), progress, self._stored())
        if min(volume.size) == 1:
            _log.warning(
                "%s is one voxel thick: the box of its voxel centres holds nothing, the picture is empty",
                "×".join(map(str, volume.size)),
            )

    @property
    def runs(self) -> RunStore:
        """The run-length store of the finest level."""
        return self.detail.store(0)

    @property
    def transfer(self) -> TransferFunction | TransferFunction2D:
        """The transfer function; assigning another drops what was encoded, if other values are visible."""
        return self._transfer

    @transfer.setter
    def transfer(self, transfer: TransferFunction | TransferFunction2D | None) -> None:
        self._transfer = transfer or choose(self.volume).transfer
        before, self._classification = self._classification, classify(self._transfer, self.volume)
        self._classified += not self._classification.hides_like(before)
        self.detail.classify(self._visibility(), self._stored())

    @property
    def look(self) -> Look:
        """Lights, and what gradients do to the transfer function."""
        return self._look

    @look.setter
    def look(self, look: Look | None) -> None:
        look = look or Look()
        self._classified += look.is_plain != self._look.is_plain  # what a sample costs
        self._look = look

    def composite(
        self,
        eye: Eye,
        walls: Sequence[Wall],
        previous: EyeImage | None = None,
        cancel: Cancel | None = None,
    ) -> EyeImage:
        """One eye image that serves all `walls`; the eye may be anywhere, inside the volume too.

        `previous`, the image of the frame before, is looked at for an eye at infinity only: the axis of its
        rays stays while no other is better by a tenth, so that an eye at rest between two does not flicker.
        Nothing else depends on earlier frames.

        `cancel`, asked in another thread, ends the work before the next row of pixels; the renderer, and
        `last`, then are as before the call, but that what was encoded is kept. Encoding itself is not
        cancelled: what has begun of it is waited for.

        Cost: one compositing, whatever the number of walls; none where no wall shows anything visible.

        Raises
        ------
        Cancelled
            By `cancel`; nothing of the image is left.
        """
        return self._composite(lambda: self._plan(eye, walls, previous.faces if previous else ()), cancel)

    def composite_plan(self, plan: EyePlan, cancel: Cancel | None = None) -> EyeImage:
        """The eye image of a `plan`, at the present settings; all else as `composite`.

        Where regions, transfer function or `Settings.single_face_tangent` have changed since, the eye is
        planned anew.
        """

        def current() -> EyePlan:
            self._keep_up()
            fits = plan.fits(self.runs, self.regions, self.settings)
            return plan if fits else self._plan(plan.eye, plan.walls, plan.previous)

        return self._composite(current, cancel)

    def _composite(self, plan: Callable[[], EyePlan], cancel: Cancel | None) -> EyeImage:
        compiled, encoded = _jit.compile_seconds(), self.detail.encode_seconds
        start = perf_counter()
        before, appearance = self._shadowed, Appearance(self._classification, self.look, self._shadows())
        # None at all where no shadows were made: a frame that encoded something tells nothing of the next.
        making = perf_counter() - start - (_jit.compile_seconds() - compiled)
        shadowed = making if self._shadowed is not before else 0.0
        image = composite_eye(self.detail, appearance, self.regions, self.settings, plan(), cancel)
        spent = perf_counter() - start
        compiled = _jit.compile_seconds() - compiled
        encoded = self.detail.encode_seconds - encoded + shadowed
        self.last = {
            "encode_ms": 1e3 * encoded,
            "composite_ms": 1e3 * max(spent - encoded - compiled, 0.0),
            "warp_ms": 0.0,
            "compile_ms": 1e3 * compiled,
            "faces": len(image.faces),
            "intermediate_size": list(
                max((f.size for f in image.faces), key=lambda s: s[0] * s[1], default=(0, 0))
            ),
            "samples": image.samples,
            **choose_sampling(self.settings, self._classification, self.volume)._asdict(),
            "runs_bytes": self.detail.bytes,
            "threads": self.settings.threads or _jit.max_threads(),
        }
        return image

    def plan(self, eye: Eye, walls: Sequence[Wall], previous: EyeImage | None = None) -> EyePlan:
        """What `composite` finds out before the first pixel: which faces show what this eye sees.

        Of the same parameters. It serves every quality, so a frame's plans are made once: `features_of_plans`
        tells what they ask for, and `composite_plan` makes the images.
        """
        return self._plan(eye, walls, previous.faces if previous else ())

    def _plan(self, eye: Eye, walls: Sequence[Wall], previous: Sequence[Face]) -> EyePlan:
        self._keep_up()
        return plan_eye(self.runs, self.regions, self.settings, eye, walls, previous)

    def features(
        self, eyes: Sequence[Eye], walls: Sequence[Wall], previous: Sequence[EyeImage | None] = ()
    ) -> SceneFeatures:
        """What a frame of these eyes will ask for, before it is drawn: what a `FrameTimeController` needs.

        `previous`: the eyes' images of the frame before, which `composite` gets, too. Where eyes have walls
        of their own, or planning each eye twice, here and in `composite`, is too slow: `plan`.
        """
        before = [*previous, *[None] * (len(eyes) - len(previous))]
        return self.features_of_plans(
            self.plan(eye, walls, image) for eye, image in zip(eyes, before, strict=True)
        )

    def features_of_plans(self, plans: Iterable[EyePlan]) -> SceneFeatures:
        """What a frame of these eyes' plans will ask for.

        Another transfer function makes it another scene, but where only colours are others; other regions do
        not, for a clip plane may move in every frame.
        """
        at_one = replace(self.settings, quality=1.0, intermediate_size=None)
        planned = [(plan.geometry, plan.faces(at_one)) for plan in plans]
        return features_of(planned, (id(self.volume), self._classified))

    def warp(self, eye_image: EyeImage, view: View, out: Image | Canvas | None = None) -> Image:
        """The picture of one view from an eye image; its wall must be one the eye image was made for.

        The view's eye may have moved since; how well that looks, `Settings.depth_slabs` says. ViewError if it
        or the image's is at infinity and it is another.

        `out`, a `Canvas` or (height, width, 4) float32, takes the picture if given. Pictures of a loop on one
        canvas cost least: only what the one before had drawn is cleared.
        """
        compiled = _jit.compile_seconds()
        start = perf_counter()
        image = warp_eye_image(eye_image, view, self.settings.threads, out)
        spent = perf_counter() - start
        compiled = _jit.compile_seconds() - compiled
        last = self.last  # another thread may composite meanwhile
        last["warp_ms"] = last.get("warp_ms", 0.0) + 1e3 * max(spent - compiled, 0.0)
        last["compile_ms"] = last.get("compile_ms", 0.0) + 1e3 * compiled
        return image

    def render(self, view: View, out: Image | Canvas | None = None) -> Image:
        """The picture of one view; `out` takes it if given.

        Returns
        -------
        (height, width, 4) float32, linear, premultiplied, row 0 on top, no background.
        """
        return self.warp(self.composite(view.eye, [view.wall]), view, out)

    def _keep_up(self) -> None:
        """Drop what was encoded for other settings."""
        if (self._skipping, self._packing) != (self.settings.skip_empty, self.settings.pack_runs):
            self._skipping, self._packing = self.settings.skip_empty, self.settings.pack_runs
            self.detail.classify(self._visibility(), self._stored())

    def _shadows(self) -> Shadows | None:
        """Those of the present transfer function, look and regions; made when they have changed."""
        lighting = self.look.lighting
        if lighting is None or not any(light.shadows for light in lighting.lights):
            return None
        of = self._classification, self.look, self.regions
        if self._shadowed is None or self._shadowed[0] != of:
            self._shadowed = of, Shadows(self.volume, *of)
        return self._shadowed[1]

    def _visibility(self) -> Classification | EverythingVisible:
        return self._classification if self.settings.skip_empty else EverythingVisible()

    def _stored(self) -> EverythingVisible | None:
        return None if self.settings.pack_runs else EverythingVisible()
