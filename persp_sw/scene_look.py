"""The keys of a scene file that light it: checked in the words of what they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    ValidationInfo,
    field_validator,
    model_validator,
)

from .errors import PerspSWError
from .optics.lighting import Light, Lighting
from .optics.look import Look, Modulation
from .optics.transfer2d import shape_of

if TYPE_CHECKING:
    from .scene_schema import SceneKeys


def accepted(make: Callable[[Any], object], value: Any) -> Any:
    """`value`, if `make` takes it; its complaint as the ValueError that pydantic collects, if not."""
    try:
        make(value)
    except PerspSWError as error:
        raise ValueError(str(error)) from None
    return value


class LightKeys(BaseModel):
    """How surfaces answer light, and the headlight: the keys of `Lighting` but its lights."""

    model_config = ConfigDict(extra="forbid")
    ambient: Any = 0.2
    diffuse: Any = 0.8
    specular: Any = 0.3
    power: Any = 20.0
    emissive: Any = 0.0
    headlight: Any = 1.0
    two_sided: Any = True
    model: Any = "phong"
    shadow_offset: Any = 2.0

    @field_validator("*")
    @classmethod
    def _one(cls, value: Any, info: ValidationInfo) -> Any:
        return accepted(lambda given: Lighting(**{info.field_name: given}), value)


class OneLight(BaseModel):
    """One of the lights: the keys of `Light`."""

    model_config = ConfigDict(extra="forbid")
    direction: Any
    colour: Any = (1.0, 1.0, 1.0)
    shadows: Any = None  # as the scene's key of that name

    @field_validator("*")
    @classmethod
    def _one(cls, value: Any, info: ValidationInfo) -> Any:
        if info.field_name == "shadows" and value is None:
            return value
        return accepted(lambda given: Light(**{"direction": (0, 0, 1), info.field_name: given}), value)


class GradientKeys(BaseModel):
    """How far the gradient reaches, and what its magnitude modulates: the keys of `Look` and `Modulation`.

    Of opacity and colour, the one that is not given is not modulated.
    """

    model_config = ConfigDict(extra="forbid")
    distance: Any = 1.0
    low: Any = 0.0
    high: Any = 0.25
    opacity: Any = 0.0
    colour: Any = 0.0

    @field_validator("distance")
    @classmethod
    def _distance(cls, value: Any) -> Any:
        return accepted(lambda given: Look(gradient_distance=given), value)

    @field_validator("low", "high", "opacity", "colour")
    @classmethod
    def _one(cls, value: Any, info: ValidationInfo) -> Any:
        # Alone each end may be anything; how the two compare is asked when both are known.
        return accepted(lambda given: Modulation(**{"high": 1.0, info.field_name: given}), value)

    @model_validator(mode="after")
    def _ends(self) -> GradientKeys:
        if {"low", "high"} & self.model_fields_set and not self.modulates:
            raise ValueError("low and high do nothing without opacity or colour; give one of them")
        accepted(lambda ends: Modulation(*ends), (self.low, self.high))
        return self

    @property
    def modulates(self) -> bool:
        """Whether there is anything to modulate."""
        return bool({"opacity", "colour"} & self.model_fields_set)


ShapeKeys = Annotated[Any, AfterValidator(lambda value: accepted(shape_of, value))]


def look_problems(keys: SceneKeys) -> list[str]:
    """What one of these keys alone cannot tell."""
    problems = []
    if not keys.shade:
        wanted = [name for name in ("lights", "shadows") if getattr(keys, name)]
        problems += [
            f'{name}: without "shade": true nothing is lit; add it or remove {name}' for name in wanted
        ]
    elif keys.shadows and not keys.lights:
        problems.append("shadows: the headlight casts none; give lights, too")
    if keys.tf2d is not None and keys.tf is not None:
        problems.append("tf2d: it takes the place of tf; give one of the two")
    return problems


def look_of(keys: SceneKeys) -> Look:
    """The look that checked keys ask for."""
    lighting = modulation = None
    if keys.shade:
        lights = [
            Light(one.direction, one.colour, bool(keys.shadows) if one.shadows is None else one.shadows)
            for one in keys.lights
        ]
        lighting = Lighting(**keys.light.model_dump(), lights=lights)
    gradient = keys.gradient
    if gradient.modulates:
        modulation = Modulation(**gradient.model_dump(exclude={"distance"}))
    return Look(lighting, modulation, gradient.distance)


def keys_of_look(look: Look) -> dict[str, Any]:
    """Keys that ask for a look: what `look_of` makes it of."""
    lighting, modulation = look.lighting, look.modulation
    keys: dict[str, Any] = {"shade": lighting is not None, "light": None, "lights": None, "shadows": None}
    if lighting is not None:
        light = asdict(lighting)
        keys["lights"] = [_listed(one) for one in light.pop("lights")]
        keys["light"] = _listed(light)
    keys["gradient"] = {"distance": look.gradient_distance, **(asdict(modulation) if modulation else {})}
    return keys


def _listed(values: dict[str, Any]) -> dict[str, Any]:
    return {key: list(value) if isinstance(value, tuple) else value for key, value in values.items()}
