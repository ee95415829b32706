"""What the user may choose about speed and accuracy."""

from __future__ import annotations

from dataclasses import dataclass

from ._jit import max_threads
from .arrays import number
from .errors import SettingsError


@dataclass(frozen=True)
class Settings:
    """Speed and accuracy; none of them changes the look, only the error.

    Parameters
    ----------
    quality
        Pixels of the intermediate image per pixel that the view or the volume asks for, 0.05 … 8.
        1: one pixel a voxel on the nearest visible slice, or fewer where the walls cannot show so many.
    samples_per_interval
        Samples along the ray in one slice interval: 1, 2 or 4. None: 1. Steep rays take more on their own.
    preintegrated
        Every scalar on a ray counts, not only those at samples: each sample takes the transfer function's
        mean over the scalars that its piece of the ray runs through. None: where the transfer function can
        hide more than half within an interval, or voxels are NaN, and `samples_per_interval` is None, too.
    residual
        A ray stops when no more than this transparency is left, 0 … 0.5. The picture's error is at most this.
    single_face_tangent
        1: each ray is sampled along its own axis, so that no axis switch pops. Above, to 8: one face of the
        eye image serves while no ray is steeper against it than this tangent; at the same cost, and it pops.
    level_of_detail
        Take coarser voxels where pixels are more than some 2.4 voxels apart, which would alias and cost more.
    skip_empty
        Leave out what the transfer function makes invisible. Changes no pixel of a face where `residual` is
        0, else none by more than that: 16 rays go on together, and further past their end the more there is
        to see. Without, faces are as large as the whole volume asks for; off only for measuring.
    pack_runs
        Store visible voxels alone. Changes no pixel; off only for measuring.
    intermediate_size
        Pixels of the largest face's longer side, 16 … `max_intermediate`; `quality` then does nothing. Up to
        four fewer, for pixels have their places; a width is a multiple of 16.
        None: as `quality` says.
    max_intermediate
        Largest width and height of a face, pixels.
    depth_slabs
        What eye images carry for eyes that have moved since, 0 … 8. 0: nothing, they lie in the middle of
        what is shown. 1: the distance at which their colours lie, measured by a coarse image. 2 or more: as
        many slabs, each at its own distance. See `docs/rewarp.md`. For an eye at infinity: 0.
    threads
        Threads to composite and warp with; None: all cores.

    Raises
    ------
    SettingsError
        A number outside its range.
    """

    quality: float = 1.0
    samples_per_interval: int | None = None
    preintegrated: bool | None = None
    residual: float = 0.005
    single_face_tangent: float = 1.0
    level_of_detail: bool = True
    skip_empty: bool = True
    pack_runs: bool = True
    max_intermediate: int = 4096
    intermediate_size: int | None = None
    depth_slabs: int = 0
    threads: int | None = None

    def __post_init__(self):
        number(self.quality, "quality", SettingsError, 0.05, 8)
        number(self.residual, "residual", SettingsError, 0, 0.5)
        number(self.single_face_tangent, "single_face_tangent", SettingsError, 1, 8)
        number(self.max_intermediate, "max_intermediate", SettingsError, 16, 16384)
        self._check_whole("max_intermediate")
        number(self.depth_slabs, "depth_slabs", SettingsError, 0, 8)
        self._check_whole("depth_slabs")
        if self.intermediate_size is not None:
            number(self.intermediate_size, "intermediate_size", SettingsError, 16, self.max_intermediate)
            self._check_whole("intermediate_size")
        if self.samples_per_interval is not None:
            self._check_whole("samples_per_interval")
            if self.samples_per_interval not in (1, 2, 4):
                raise SettingsError(f"samples_per_interval is 1, 2 or 4; given {self.samples_per_interval!r}")
        if self.threads is not None:
            number(self.threads, "threads", SettingsError, 1, max_threads())
            self._check_whole("threads")

    def _check_whole(self, name: str) -> None:
        value = getattr(self, name)
        if number(value, name, SettingsError) != int(value):
            raise SettingsError(f"{name} must be a whole number; given {value!r}")
        object.__setattr__(self, name, int(value))
