"""What is wrong with the keys of a file, in sentences for who wrote it."""

from __future__ import annotations

import difflib
import json
import typing
from collections.abc import Iterable
from typing import Any

from pydantic import BaseModel

_WORDS = {
    "greater_than": "expected a number greater than {gt:g}",
    "greater_than_equal": "expected a number of at least {ge:g}",
    "less_than": "expected a number less than {lt:g}",
    "less_than_equal": "expected a number of at most {le:g}",
    "finite_number": "expected a finite number",
    "float_type": "expected a number",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "bool_type": "expected true or false",
    "string_type": "expected text",
    "string_too_short": "expected text that is not empty",
}


def sentences(problems: Iterable[Any], schema: type[BaseModel], unions: Iterable[str] = ()) -> list[str]:
    """pydantic's problems with a file, one line each: the key, what is wrong, what was given, what to do.

    Parameters
    ----------
    problems
        `ValidationError.errors()`.
    schema
        The model of the whole file. A field's description says what belongs there: "[x, y, z], metres".
    unions
        Tags that pydantic puts into a problem's place where one of several models was chosen.
    """
    unions = set(unions)
    lines = list(dict.fromkeys(_sentence(problem, schema, unions) for problem in problems))
    return [line for line in lines if not any(other.startswith(f"{line};") for other in lines)]


def _sentence(problem: Any, schema: type[BaseModel], unions: set[str]) -> str:
    kind, context = problem["type"], problem.get("ctx", {})
    place = tuple(part for part in problem["loc"] if part not in unions)
    given = f"; given {_short(problem['input'])}"
    if kind in ("missing", "too_long"):  # of numbers in a list, or of lists in one: said of the outermost
        while place and isinstance(place[-1], int):
            given = given if kind == "missing" else ""
            kind, place = "wrong_length", place[:-1]
    name = _name(place)
    if kind == "extra_forbidden":
        return f"{name}: unknown key; {_nearest(str(place[-1]), _keys(schema, place[:-1]))}"
    wanted = _description(schema, place)
    if kind == "missing":
        return f"{name}: this key is missing; give {wanted or 'it'}"
    if kind == "value_error":
        return f"{name}: {context['error']}"
    if kind == "literal_error":
        options = context["expected"]
        near = _close(problem["input"], options.replace("'", "").replace(" or ", ", ").split(", "))
        return f"{name}: expected {options}{given}" + (f": did you mean '{near}'?" if near else "")
    if kind in _WORDS:
        text = _WORDS[kind].format(**context)
        whole = f" (one of {wanted})" if wanted and isinstance(place[-1], int) else ""
        return f"{name}: {text}{whole}{given}"
    return f"{name}: expected {wanted or problem['msg'][:1].lower() + problem['msg'][1:]}{given}"


def nearest_of(given: str, known: Iterable[str]) -> str:
    """Advice for a name that is none of those known."""
    return _nearest(given, list(known))


def _name(place: tuple[str | int, ...]) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in place)[1:] or "the file"


def _nearest(given: str, known: list[str]) -> str:
    near = _close(given, known)
    return f"did you mean {near}?" if near else f"there are {', '.join(known)}"


def _close(given: object, known: list[str]) -> str | None:
    return next(iter(difflib.get_close_matches(str(given).lower(), known, 1, 0.5)), None)


def _keys(schema: type[BaseModel], place: tuple[str | int, ...]) -> list[str]:
    """The keys of the table at that place."""
    for part in place:
        if isinstance(part, str):
            models = _models(schema.model_fields[part].annotation)
            if not models:
                return []
            schema = models[0]
    return list(schema.model_fields)


def _description(schema: type[BaseModel], place: tuple[str | int, ...]) -> str:
    """What the innermost field on the way to that place says of itself."""
    text = ""
    for part in place:
        if isinstance(part, int):
            continue
        if part not in schema.model_fields:
            break
        field = schema.model_fields[part]
        text = field.description or ""
        models = _models(field.annotation)
        if models:
            schema = models[0]
    return text


def _models(annotation: Any) -> list[type[BaseModel]]:
    """All models in a type."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in typing.get_args(annotation) for model in _models(part)]


def _short(value: object) -> str:
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"
