"""The keys of a scene file, checked: every problem of a file is found before any is reported."""

from __future__ import annotations

import difflib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError, field_validator

from .errors import SceneError
from .geometry.regions import Regions
from .optics.transfer import TransferFunction
from .scene_look import GradientKeys, LightKeys, OneLight, ShapeKeys, accepted

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
Truth = Annotated[bool, Field(strict=True)]
Count = Annotated[int, Field(strict=True, ge=0)]
Unit = Annotated[Number, Field(ge=0, le=1)]
Text = Annotated[str, StringConstraints(min_length=1)]
Vector3 = tuple[Number, Number, Number]


class SceneKeys(BaseModel):
    """All keys a scene may have; each is described in the README's table."""

    model_config = ConfigDict(extra="forbid")

    volume: Text
    name: str = ""
    # Which volume of the file, and how to read one that does not say.
    time_frame: Count | None = None
    component: Any = None  # a number, or "magnitude"
    series: Any = None  # a number, or a DICOM UID
    shape: tuple[Count, Count, Count] | None = None
    dtype: Text | None = None
    byte_order: Literal["little", "big"] = "little"
    header_bytes: Count = 0
    spacing: tuple[Positive, Positive, Positive] | None = None
    # What of it is seen, and how.
    tf: Any = None  # rows, a preset's name or a file: checked below, with the transfer function's own words
    opacity_unit: Positive | None = None
    window: tuple[Number, Positive] | None = None  # level and width of a grey ramp, instead of tf
    clip: list[tuple[Number, Number, Number, Number]] = []
    crop: tuple[Number, Number, Number, Number, Number, Number] | None = None
    crop_flags: Any = "subvolume"  # a name or a number; like `cut`, checked in the words of `Regions`
    cut: list[Any] = []
    # Lit, and shown by the gradient; `scene_look` has the words for these.
    tf2d: Annotated[list[ShapeKeys], Field(min_length=1)] | None = None
    shade: Truth = False
    light: LightKeys = LightKeys()
    lights: list[OneLight] = []
    shadows: Truth | None = None
    gradient: GradientKeys = GradientKeys()
    background: tuple[Unit, Unit, Unit] = (0.0, 0.0, 0.0)
    # Where from.
    eye: Vector3 | None = None
    centre: Vector3 | None = None
    up: Vector3 | None = None
    fovy: Annotated[Number, Field(gt=0, lt=180)] | None = None
    parallel_height: Positive | None = None
    size: tuple[Annotated[Count, Field(ge=1, le=16384)], Annotated[Count, Field(ge=1, le=16384)]] = (512, 512)
    # How often and how finely.
    frames: Annotated[Count, Field(ge=1)] = 1
    eye_step: Vector3 | None = None
    step: Positive | None = None
    max_seconds: Positive | None = None
    # Of sessions: stereo, held quality and so on of `persp-sw view`, which checks it; nothing else reads it.
    view: dict[str, Any] = {}

    @field_validator("tf")
    @classmethod
    def _transfer(cls, value: Any) -> Any:
        if value is None or isinstance(value, str):
            return value
        if not isinstance(value, (list, tuple)):
            raise ValueError(
                "expected rows [[value, r, g, b, a], …], a preset's name or the path of a saved function"
            )
        return accepted(TransferFunction.from_rows, value)

    @field_validator("component")
    @classmethod
    def _component(cls, value: Any) -> Any:
        if value not in (None, "magnitude") and not _is_count(value):
            raise ValueError(f'expected a whole number from 0 or "magnitude"; given {_short(value)}')
        return value

    @field_validator("series")
    @classmethod
    def _series(cls, value: Any) -> Any:
        if value is not None and not _is_count(value) and not (isinstance(value, str) and value):
            raise ValueError(f"expected a number from 1 or a DICOM UID; given {_short(value)}")
        return value

    @field_validator("clip")
    @classmethod
    def _clip(cls, value: Any) -> Any:
        return accepted(lambda clip: Regions(clip=clip), value)

    @field_validator("crop")
    @classmethod
    def _crop(cls, value: Any) -> Any:
        return accepted(lambda crop: Regions(crop=crop), value)

    @field_validator("crop_flags")
    @classmethod
    def _crop_flags(cls, value: Any) -> Any:
        return accepted(lambda flags: Regions(crop=[0] * 6, crop_flags=flags), value)

    @field_validator("cut")
    @classmethod
    def _cut(cls, value: Any) -> Any:
        return accepted(lambda cut: Regions(cut=cut), value)


def read_text(path: Path) -> dict:
    """The keys of a JSON or TOML file, not checked yet; SceneError where it cannot be read or parsed."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise SceneError(f"there is no scene file {path}; check the name and the folder") from None
    except UnicodeDecodeError:
        raise SceneError(f"{path} is not a text file; a scene is written in JSON or TOML") from None
    except OSError as error:
        raise SceneError(f"cannot read the scene file {path}: {error.strerror}") from None
    toml = path.suffix.lower() == ".toml"
    try:
        keys = _toml(text) if toml else json.loads(text)
    except (ValueError, RecursionError) as error:
        kind = "TOML" if toml else "JSON"
        raise SceneError(f"{path} is not valid {kind}: {error}; mend the file there") from None
    if not isinstance(keys, dict):
        raise SceneError(
            f'{path} holds a {_kind(keys)}; a scene is an object of keys such as {{"volume": …}}'
        )
    return keys


def check(keys: Mapping[str, Any]) -> tuple[SceneKeys | None, list[str]]:
    """The checked keys, or None and one line for every problem."""
    try:
        return SceneKeys.model_validate(_plain(keys)), []
    except ValidationError as error:
        return None, list(dict.fromkeys(_sentence(problem) for problem in error.errors()))


def _toml(text: str) -> dict:
    try:
        import tomllib
    except ImportError:  # Python 3.10
        import tomli as tomllib
    return tomllib.loads(text)


def _plain(value: Any) -> Any:
    """numpy arrays and scalars as lists and numbers, so that scenes can be made in Python too."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


def _kind(value: object) -> str:
    return {list: "list", str: "text", float: "number", int: "number", type(None): "null"}.get(
        type(value), type(value).__name__
    )


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


_WANTED = {
    "float_type": "expected a number",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "bool_type": "expected true or false",
    "string_type": "expected text",
    "list_type": "expected a list",
    "model_type": "expected keys and values {…}",
    "tuple_type": "expected a list of numbers",
    "finite_number": "expected a finite number",
    "string_too_short": "expected text that is not empty",
}


def _sentence(problem: Any) -> str:
    """One of pydantic's problems as: where: what is wanted; given …"""
    place, kind, given = problem["loc"], problem["type"], problem["input"]
    name = str(place[0]) + "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place[1:])
    context = problem.get("ctx", {})
    if kind == "extra_forbidden":
        inner = {"light": LightKeys, "lights": OneLight, "gradient": GradientKeys}
        known = list((inner[place[0]] if len(place) > 1 else SceneKeys).model_fields)
        near = difflib.get_close_matches(str(place[-1]).lower(), known, 1, 0.5)
        advice = f"did you mean {near[0]}?" if near else f"the keys are {', '.join(known)}"
        return f"{name}: unknown key; {advice}"
    if kind == "missing":
        if isinstance(place[-1], int):
            parent = name.rpartition("[")[0]
            return f"{parent}: too few numbers; given {_short(given)}"
        advice = "; give the path of a volume file" if place == ("volume",) else ""
        return f"{name}: this key is missing{advice}"
    if kind == "value_error":
        return f"{name}: {context['error']}"
    if kind in _WANTED:
        wanted = _WANTED[kind]
    elif kind == "too_long":
        wanted = f"expected {context['max_length']} numbers, not {context['actual_length'] or 'more'}"
    elif kind == "too_short":
        wanted = f"expected at least {context['min_length']}"
    elif kind == "literal_error":
        wanted = f"expected {context['expected']}"
    elif kind in ("greater_than", "greater_than_equal", "less_than", "less_than_equal"):
        limit = next(context[key] for key in ("gt", "ge", "lt", "le") if key in context)
        words = {"greater_than": "greater than", "greater_than_equal": "at least"}
        words |= {"less_than": "less than", "less_than_equal": "at most"}
        wanted = f"expected a number {words[kind]} {limit:g}"
    else:
        wanted = problem["msg"][:1].lower() + problem["msg"][1:]
    return f"{name}: {wanted}; given {_short(given)}"


def _short(value: object) -> str:
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"
