"""What property tests draw: volumes, looks, eyes, walls, regions, settings, from the plainest to the oddest.

Structure is drawn by hypothesis, and shrinks; voxels are made of it by numpy, from a seed that is drawn too.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st

from persp_sw import Cut, Eye, Regions, Settings, TransferFunction, View, Volume, Wall
from persp_sw._jit import max_threads

DTYPES = (np.uint8, np.int16, np.uint16, np.float32)
PIXELS = ((12, 12), (16, 9), (1, 14), (14, 1), (2, 2), (25, 24))
# Voxels off a plane, a corner or a voxel: none, far below float32's steps, about them, and what can be seen.
GAPS = (0.0, 1e-9, -1e-9, 1e-6, -1e-6, 1e-3, -1e-3, 0.1)
EYES = ("far", "near", "inside", "slice", "voxel", "face", "edge", "corner")


@dataclass(frozen=True)
class Scene:
    """All that a picture depends on."""

    volume: Volume
    transfer: TransferFunction
    regions: Regions
    settings: Settings
    eye: Eye
    walls: tuple[Wall, ...]

    @property
    def views(self) -> list[View]:
        """Each wall's."""
        return [View(self.eye, wall) for wall in self.walls]


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """10 ** low … 10 ** high, evenly in the exponent."""
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


# --- Volumes -----------------------------------------------------------------------------------------------


@st.composite
def sizes(draw, least: int = 1, most: int = 24) -> tuple[int, int, int]:
    """(x, y, z): cubes, rods, sheets, and anything between; now and then one voxel thick."""
    kind = draw(st.integers(0, 9))
    thick = max(least, 2)
    side, long = st.integers(thick, 10), st.integers(thick, most)
    if kind < 4:
        return draw(st.tuples(side, side, side))
    if kind < 7:
        size = draw(long), draw(side), thick
        return tuple(size[n] for n in draw(st.permutations([0, 1, 2])))
    return (most,) * 3 if kind < 9 else draw(st.tuples(*[st.integers(least, max(least, 3))] * 3))


def smooth_values(size: tuple[int, int, int], seed: int) -> np.ndarray:
    """Waves of 9 voxels and longer, 0 … 1."""
    rng = np.random.default_rng(seed)
    z, y, x = np.indices(size[::-1])
    angles = [np.tensordot(rng.uniform(-0.4, 0.4, 3), (x, y, z), 1) + rng.uniform(0, 6) for _ in range(3)]
    return 0.5 + np.sin(angles).sum(0) / 6


def _values(kind: str, size: tuple[int, int, int], seed: int) -> np.ndarray:
    """float64 [z, y, x], 0 … 1."""
    rng = np.random.default_rng(seed)
    shape = size[::-1]
    if kind == "constant":
        return np.full(shape, 0.7)
    if kind == "waves":
        return smooth_values(size, seed)
    if kind == "noise":
        return rng.random(shape)
    if kind == "sparse":
        return np.where(rng.random(shape) < 0.05, rng.random(shape), 0)
    values = np.zeros(shape)
    values[tuple(rng.integers(0, shape))] = 1
    return values


@st.composite
def voxels(draw, size: tuple[int, int, int]) -> np.ndarray:
    """Of any type, over its whole range; floats denormal or huge, some of them NaN or infinite."""
    kind = draw(st.sampled_from(["constant", "waves", "noise", "sparse", "point"]))
    values = _values(kind, size, draw(st.integers(0, 999)))
    dtype = draw(st.sampled_from(DTYPES))
    if dtype is not np.float32:
        info = np.iinfo(dtype)
        return np.rint(info.min + values * (float(info.max) - info.min)).astype(dtype)
    values = (values - draw(st.sampled_from([0, 0.5]))) * draw(st.sampled_from([1, 1e-42, 1e-6, 1e6, 3e38]))
    data = values.astype(np.float32)
    for place in draw(st.lists(st.integers(1, data.size), max_size=4)) if data.size > 1 else ():
        if place < data.size:  # the first one stays finite
            data.flat[place] = draw(st.sampled_from([np.nan, np.inf, -np.inf]))
    return data


@st.composite
def poses(draw, *, gentle: bool = False) -> np.ndarray:
    """(4, 4) world from object: any spacing, turned, sheared, mirrored, far from the origin."""
    unit = 1.0 if gentle else draw(st.sampled_from([1.0, 1e-6, 1e6, 1e-15, 1e15]))
    ratio = draw(
        st.one_of(
            st.sampled_from([(1, 1, 1), (1, 1, 20), (20, 1, 1), *([(1, 1, 1000)] if not gentle else [])]),
            st.tuples(*[powers(-0.7, 0.7)] * 3),
        )
    )
    linear = np.diag(ratio).astype(float)
    if draw(st.booleans()):
        linear = linear @ np.array([[1, 0.5, -0.3], [0, 0.9, 0.4], [0.2, 0, 1.1]])
    if draw(st.booleans()):
        turn, _ = np.linalg.qr(np.random.default_rng(draw(st.integers(0, 99))).normal(size=(3, 3)))
        linear = turn @ linear
    if draw(st.booleans()):
        linear[:, 0] *= -1
    pose = np.eye(4)
    pose[:3, :3] = unit * linear
    pose[:3, 3] = unit * draw(st.sampled_from([0.0, 50.0, -1e3] if gentle else [0.0, 50.0, -1e6]))
    pose[1, 3] *= -0.5
    return pose


@st.composite
def volumes(draw) -> Volume:
    """Anything that is one."""
    return Volume(draw(voxels(draw(sizes()))), world_from_object=draw(poses()))


@st.composite
def smooth_volumes(draw, least: int = 4) -> Volume:
    """Waves of 9 voxels and longer, of any type and gentle pose."""
    values = smooth_values(draw(sizes(least, 20)), draw(st.integers(0, 999)))
    dtype = draw(st.sampled_from(DTYPES))
    scale = {np.uint8: 255, np.int16: 3e4, np.uint16: 6e4, np.float32: 1}[dtype]
    data = values * scale
    return Volume(
        (data if dtype is np.float32 else np.rint(data)).astype(dtype),
        world_from_object=draw(poses(gentle=True)),
    )


def stored_otherwise(volume: Volume, order: list[int], flips: tuple[bool, bool, bool]) -> Volume:
    """The same body in the world, its voxels stored along other axes, some of them backwards."""
    data = volume.data.transpose([2 - axis for axis in order[::-1]])
    pose = volume.world_from_object[:, [*order, 3]].copy()
    for axis in np.flatnonzero(flips):
        data = np.flip(data, 2 - axis)
        pose[:3, 3] += pose[:3, axis] * (data.shape[2 - axis] - 1)
        pose[:3, axis] *= -1
    return Volume(data, world_from_object=pose)


def scaled(scene: Scene, by: float) -> Scene:
    """All lengths times `by`."""
    pose = scene.volume.world_from_object.copy()
    pose[:3] *= by
    eye, shown, unit = scene.eye, scene.regions, scene.transfer.opacity_unit
    cut = [replace(c, plane=(*c.plane[:3], c.plane[3] * by), thickness=c.thickness * by) for c in shown.cut]
    return Scene(
        Volume(scene.volume.data, world_from_object=pose),
        TransferFunction(scene.transfer.points, unit and unit * by),
        replace(shown, clip=[(*plane[:3], plane[3] * by) for plane in shown.clip], cut=cut),
        scene.settings,
        eye if eye.is_at_infinity else Eye(eye.position * by, eye.near * by),
        tuple(Wall(w.lower_left * by, w.lower_right * by, w.upper_left * by, w.pixels) for w in scene.walls),
    )


# --- Looks -------------------------------------------------------------------------------------------------

_COLOURS = st.tuples(*[st.floats(0, 1)] * 3)


@st.composite
def transfers(draw, volume: Volume) -> TransferFunction:
    """Steps, spikes, combs, faint, opaque, beside the values; any unit of opacity."""
    low, high = volume.value_range
    width = (high - low) or abs(high) or 1.0
    opacity = draw(st.sampled_from([1.0, 0.5, 0.9, 0.2, 1e-3, 1e-6, 1 - 1e-7]))
    at = draw(st.floats(0, 1))
    rows = {
        "ramp": [(0, 0), (1, opacity)],
        "flat": [(at, opacity)],
        "step": [(at - 1, 0), (at, 0), (at, opacity), (at + 1, opacity / 2)],
        "spike": [(at - 0.02, 0), (at, opacity), (at + 0.02, 0)],
        "comb": [(n / 20, opacity * (n % 2)) for n in range(21)],
        "teeth": [(n // 2 / 8, opacity * (n % 4 > 1)) for n in range(16)],
        "beyond": [(2, opacity), (3, 1)],
        "inverse": [(0, opacity), (1, 0)],
    }[draw(st.sampled_from(["ramp", "flat", "step", "spike", "comb", "teeth", "beyond", "inverse"]))]
    colours = [draw(_COLOURS) for _ in range(3)]
    points = [(low + width * v, colours[n % 3], a) for n, (v, a) in enumerate(rows)]
    unit = draw(st.one_of(st.none(), powers(-6, 6)))
    return TransferFunction(points, unit and unit * min(volume.spacing))


@st.composite
def smooth_transfers(draw, volume: Volume) -> TransferFunction:
    """Linear in the value; of the longest edge a half to nearly all is opaque where values are highest."""
    low, high = volume.value_range
    colours = [draw(_COLOURS) for _ in range(2)]
    rows = [
        (low, colours[0], draw(st.sampled_from([0.0, 0.1]))),
        (high, colours[1], draw(st.floats(0.3, 0.9))),
    ]
    return TransferFunction(rows, draw(powers(-0.5, 0.3)) * max(volume.extent))


# --- Eyes and walls ----------------------------------------------------------------------------------------


@st.composite
def eyes(draw, volume: Volume, *, kinds: tuple[str, ...] = EYES, infinite: bool = True) -> Eye:
    """Far, near, inside, on or beside slices, voxels, sides, edges and corners; at infinity."""
    if infinite and draw(st.integers(0, 7)) == 7:
        towards = draw(st.tuples(*[st.sampled_from([0.0, 1.0, -1.0, 0.3, 1e-9])] * 3).filter(any))
        return Eye.at_infinity(volume.world_from_object[:3, :3] @ towards)
    high = np.array(volume.size) - 1.0
    kind = draw(st.sampled_from(kinds))
    place = np.array([draw(st.floats(0, 1)) for _ in range(3)]) * high
    gap = draw(st.sampled_from(GAPS))
    axis = draw(st.integers(0, 2))
    ends = np.where([draw(st.booleans()) for _ in range(3)], -gap, high + gap)
    if kind in ("far", "near"):
        away = np.array([draw(st.floats(-1, 1)) for _ in range(3)])
        away[axis] = draw(st.sampled_from([1.0, -1.0]))
        reach = draw(powers(0.3, 4) if kind == "far" else powers(-0.2, 0.3))
        place = high / 2 + (high.max() or 1.0) * reach * away
    elif kind == "slice":
        place[axis] = np.rint(place[axis]) + gap
    elif kind == "voxel":
        place = np.rint(place) + gap
    elif kind == "face":
        place[axis] = ends[axis]
    elif kind == "edge":
        place = np.where(np.arange(3) == axis, place, ends)
    elif kind == "corner":
        place = ends
    pose = volume.world_from_object
    near = draw(st.sampled_from([0.0, 0.0, 0.3, 5.0])) * min(volume.spacing)
    return Eye(pose[:3, :3] @ place + pose[:3, 3], near)


def _frame(forward: np.ndarray, turn: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors forward, right, up."""
    forward = forward / np.linalg.norm(forward)
    aside = np.eye(3)[np.argmin(np.abs(forward))]
    right = np.cross(forward, aside)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    return forward, np.cos(turn) * right + np.sin(turn) * up, np.cos(turn) * up - np.sin(turn) * right


@st.composite
def walls(draw, volume: Volume, eye: Eye, most: int = 4, widest: float = 150.0) -> tuple[Wall, ...]:
    """Around the eye as of a room, the first towards the volume, mostly; oblique, off-axis, to `widest`°."""
    pose, high = volume.world_from_object, np.array(volume.size) - 1.0
    target = np.array([draw(st.floats(0.1, 0.9)) for _ in range(3)]) * high
    target = pose[:3, :3] @ target + pose[:3, 3]
    edge = max(volume.extent) or max(volume.spacing)
    forward = -eye.position if eye.is_at_infinity else target - eye.position
    distance = np.linalg.norm(forward)
    if distance <= 1e-9 * np.linalg.norm(eye.position) or distance == 0:
        forward = np.array((1.0, 0.2, 0.1))
    forward, right, up = _frame(forward, draw(st.floats(-3, 3)))
    reach = edge * draw(powers(-2, 2))
    made = []
    for number in range(draw(st.integers(1, most))):
        ahead, across = ((forward, right), (right, -forward), (-right, forward), (up, right))[number]
        above = np.cross(across, ahead)
        if eye.is_at_infinity:
            ahead, across, above = forward, right, up
            middle, half = target + edge * number * right, edge * draw(powers(-1, 0.5))
        else:
            sees = min(np.degrees(2 * np.arctan(2 * edge / max(distance, 1e-3 * edge))), widest)
            angle = draw(st.one_of(st.just(sees), st.floats(min(5.0, sees), widest)))
            middle, half = eye.position + reach * ahead, reach * np.tan(np.radians(angle / 2))
        shift = draw(st.sampled_from([0.0, 0.0, 0.4]))
        slant = draw(st.sampled_from([0.0, 0.0, 0.2]))  # one side is farther away
        side = half * (across + slant * ahead * (1 if half < 2 * reach else 0.1))
        raised = half * (above + 0.2 * slant * across)
        corner = middle + shift * half * across - side - raised
        pixels = draw(st.sampled_from(PIXELS))
        made.append(Wall(corner, corner + 2 * side, corner + 2 * raised, pixels, f"wall {number}"))
    return tuple(made)


def halves(wall: Wall, columns: int) -> tuple[Wall, Wall]:
    """A wall cut upright, so many of its pixels' columns in the left part."""
    width, height = wall.pixels
    across = (wall.lower_right - wall.lower_left) * (columns / width)
    return (
        Wall(wall.lower_left, wall.lower_left + across, wall.upper_left, (columns, height)),
        Wall(wall.lower_left + across, wall.lower_right, wall.upper_left + across, (width - columns, height)),
    )


# --- Regions and settings ----------------------------------------------------------------------------------


@st.composite
def regions(draw, volume: Volume) -> Regions:
    """Nothing, a crop that may be thin or empty, planes askew and through voxels, slabs."""
    if draw(st.booleans()):
        return Regions()
    pose, high = volume.world_from_object, np.array(volume.size) - 1.0

    def plane() -> tuple[float, ...]:
        point = np.array([draw(st.floats(-0.1, 1.1)) for _ in range(3)]) * high
        normal = np.array([draw(st.sampled_from([0.0, 1.0, -1.0, 0.37, 1e-6])) for _ in range(3)])
        if not normal.any():
            normal = np.array((1.0, 0, 0))
        if draw(st.booleans()):
            point = np.rint(point)
        normal = np.linalg.inv(pose[:3, :3]).T @ normal
        normal /= np.linalg.norm(normal)
        return (*normal, -normal @ (pose[:3, :3] @ point + pose[:3, 3]))

    crop = None
    if draw(st.booleans()):
        ends = np.array([[draw(st.floats(-0.2, 1.2)) for _ in range(2)] for _ in range(3)])
        crop = np.sort(ends * high[:, None], axis=1)
        if draw(st.booleans()):
            crop = np.rint(crop)
        crop = crop.ravel()
    cuts = [
        Cut(plane(), thickness * min(volume.spacing), draw(st.sampled_from(["outside", "outside", "inside"])))
        for thickness in draw(st.lists(st.sampled_from([2.5, 0.3, 0.0]), max_size=2))
    ]
    flags = (
        draw(st.sampled_from(["subvolume", "fence", "inverted_cross"])) if crop is not None else "subvolume"
    )
    return Regions(crop, [plane() for _ in range(draw(st.sampled_from([0, 0, 1, 2])))], cuts, flags)


@st.composite
def settings(draw, **fixed: object) -> Settings:
    """Any; small pictures."""
    drawn = {
        "quality": draw(st.sampled_from([1.0, 0.05, 0.3, 2.0])),
        "samples_per_interval": draw(st.sampled_from([None, 1, 2, 4])),
        "preintegrated": draw(st.sampled_from([None, False, True])),
        "residual": draw(st.sampled_from([0.005, 0.0, 0.5])),
        "single_face_tangent": draw(st.sampled_from([3.0, 1.0, 1.5, 8.0])),
        "level_of_detail": draw(st.booleans()),
        "max_intermediate": draw(st.sampled_from([64, 16, 31, 100])),
        "depth_slabs": draw(st.sampled_from([0, 0, 1, 3])),
        "threads": draw(st.sampled_from([None, 1, max_threads()])),
    }
    return Settings(**(drawn | fixed))


@st.composite
def scenes(draw) -> Scene:
    """Anything that can be asked for."""
    volume = draw(volumes())
    eye = draw(eyes(volume))
    changes = {"depth_slabs": 0} if eye.is_at_infinity else {}
    return Scene(
        volume,
        draw(transfers(volume)),
        draw(regions(volume)),
        draw(settings(**changes)),
        eye,
        draw(walls(volume, eye)),
    )


@st.composite
def smooth_scenes(draw, *, kinds: tuple[str, ...] = EYES, most: int = 2, **fixed: object) -> Scene:
    """Smooth volumes and looks, whole, at settings given: pictures of which bounds can be told."""
    volume = draw(smooth_volumes())
    eye = draw(eyes(volume, kinds=kinds))
    eye = eye if eye.is_at_infinity else Eye(eye.position)
    return Scene(
        volume,
        draw(smooth_transfers(volume)),
        Regions(),
        Settings(**fixed),
        eye,
        draw(walls(volume, eye, most, 120.0)),
    )


# --- What is no input --------------------------------------------------------------------------------------

_NUMBERS = st.sampled_from(
    [
        0,
        1,
        -1,
        0.5,
        3,
        255,
        1e-300,
        1e-30,
        1e30,
        1e300,
        -1e308,
        np.nan,
        np.inf,
        -np.inf,
        10**400,
        np.float32(2),
    ]
)
_OTHERS = st.sampled_from(
    [None, "", "x", "1", b"1", True, 1j, [], {}, (), object(), np.array(1.0), np.ones(3)]
)


def junk() -> st.SearchStrategy:
    """Numbers good and bad, things that are none, and lists of them, of any length and depth."""
    one = st.one_of(_NUMBERS, _OTHERS)
    lists = st.recursive(one, lambda inner: st.lists(inner, max_size=4), max_leaves=6)
    return st.one_of(one, numbers(3), numbers(4), lists)


def numbers(count: int) -> st.SearchStrategy:
    """So many numbers, good and bad, as a list or an array."""
    made = st.lists(_NUMBERS, min_size=count, max_size=count)
    return st.one_of(made, made.map(lambda values: np.array(values, object)))


def arrays() -> st.SearchStrategy:
    """Arrays that may be voxels or not."""
    shapes = st.sampled_from([(2, 2, 2), (1, 1, 1), (0, 2, 2), (3,), (), (2, 2, 2, 2)])
    kinds = st.sampled_from(["f4", "f8", "u1", "i8", "u8", "c8", "U1", "O", "b1", ">i2", "f2", "m8[s]", "i1"])
    fills = st.sampled_from([0, 1, -1, 1e39, np.nan, np.inf])

    def made(shape, kind, fill):
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return np.full(shape, fill, "f8").astype(kind)

    return st.builds(made, shapes, kinds, fills)
