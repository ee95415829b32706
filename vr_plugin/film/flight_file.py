"""Flights as files: CSV, a row for each key view, or JSON and TOML, a table for each."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from persp_sw.errors import PerspSWError

from ..cameras import Camera
from .flight import Flight, FlightError, KeyView

SUFFIXES = (".csv", ".json", ".toml")
_VECTORS = ("eye", "centre", "up")
_COLUMNS = ("seconds", *(f"{name}_{axis}" for name in _VECTORS for axis in "xyz"), "fovy")
_FORM = "seconds, eye [x, y, z], centre, up (world) and fovy (degrees, vertical)"


def load_flight(path: str | Path) -> Flight:
    """The flight of a file.

    Parameters
    ----------
    path
        .csv: the first line names the columns `seconds`, `eye_x` … `eye_z`, `centre_x` …, `up_x` …, `fovy`;
        others are left alone. .json, .toml: a list `key` of tables with `seconds`, `eye`, `centre`, `up`,
        `fovy`. World units, degrees.

    Raises
    ------
    FlightError
        A file that cannot be read, or key views that are none: all of them are told at once.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise FlightError(f"a flight is a file that ends in {', '.join(SUFFIXES)}; given {path}")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise FlightError(f"there is no flight {path}; check the name and the folder") from None
    except UnicodeDecodeError:
        raise FlightError(f"{path} is not a text file; a flight is written in CSV, JSON or TOML") from None
    except OSError as error:
        raise FlightError(f"cannot read the flight {path}: {error.strerror}") from None
    rows = _csv_rows(path, text) if suffix == ".csv" else _tables(path, text, suffix)
    keys, problems = [], []
    for where, row in rows:
        try:
            keys.append(_key_view(row))
        except (PerspSWError, ValueError) as error:
            problems.append(f"{where}: {error}")
    if problems:
        raise FlightError("\n  - ".join([f"{path} has key views that are none:", *problems]))
    return Flight(keys, str(path))


def save_flight(path: str | Path, flight: Flight) -> Path:
    """Write a flight so that `load_flight` gives the same cameras, to rounding.

    Raises
    ------
    FlightError
        Another suffix, or the disk refuses.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise FlightError(f"a flight is a file that ends in {', '.join(SUFFIXES)}; given {path}")
    rows = [_row(key) for key in flight.keys]
    if suffix == ".csv":
        text = "\n".join([",".join(_COLUMNS), *(",".join(map(repr, _flat(row))) for row in rows), ""])
    elif suffix == ".json":
        text = '{"key": [\n' + ",\n".join("  " + json.dumps(row) for row in rows) + "\n]}\n"
    else:
        tables = ("".join(f"{name} = {json.dumps(value)}\n" for name, value in row.items()) for row in rows)
        text = "\n".join("[[key]]\n" + table for table in tables)
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise FlightError(f"cannot write the flight {path}: {error.strerror}") from None
    return path


def _row(key: KeyView) -> dict[str, Any]:
    camera = key.camera
    return {
        "seconds": key.seconds,
        "eye": camera.position.tolist(),
        "centre": camera.pivot.tolist(),
        "up": camera.axes[1].tolist(),
        "fovy": float(np.degrees(camera.fovy)),
    }


def _flat(row: Mapping[str, Any]) -> list[float]:
    return [row["seconds"], *(number for name in _VECTORS for number in row[name]), row["fovy"]]


def _key_view(row: Mapping[str, Any]) -> KeyView:
    """Checked; ValueError or an error of the camera's own."""
    wanted = ("seconds", *_VECTORS, "fovy")
    missing, unknown = [n for n in wanted if n not in row], [n for n in row if n not in wanted]
    if missing or unknown:
        raise ValueError(f"a key view has {_FORM}; given {', '.join(map(str, row))}")
    seconds, fovy = _number(row["seconds"], "seconds"), _number(row["fovy"], "fovy")
    eye, centre, up = (_vector(row[name], name) for name in _VECTORS)
    if not 0 < fovy < 180:
        raise ValueError(f"fovy lies between 0 and 180 degrees; given {fovy:g}")
    forward = centre - eye
    if np.linalg.norm(np.cross(forward, up)) <= 1e-9 * np.linalg.norm(forward) * np.linalg.norm(up):
        raise ValueError("eye and centre are one point, or up is along the line of sight; choose another up")
    return KeyView(seconds, Camera.look_at(eye, centre, up, np.radians(fovy)))


def _number(value: Any, name: str) -> float:
    number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else np.nan
    if not np.isfinite(number):
        raise ValueError(f"{name} is a finite number; given {value!r}")
    return number


def _vector(value: Any, name: str) -> np.ndarray:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 3:
        raise ValueError(f"{name} is three numbers; given {value!r}")
    return np.array([_number(item, name) for item in value])


def _csv_rows(path: Path, text: str) -> list[tuple[str, dict[str, Any]]]:
    lines = list(csv.reader(io.StringIO(text)))
    header = [name.strip().lower() for name in lines[0]] if lines else []
    missing = [name for name in _COLUMNS if name not in header]
    if missing:
        raise FlightError(f"{path}: the first line names the columns; missing: {', '.join(missing)}")
    places = [header.index(name) for name in _COLUMNS]
    rows = []
    for number, line in enumerate(lines[1:], 2):
        if not any(cell.strip() for cell in line):
            continue
        try:
            seconds, *vectors, fovy = [float(line[place]) for place in places]
        except (ValueError, IndexError):
            raise FlightError(f"{path}, line {number}: not the numbers that line 1 names") from None
        parts = {name: vectors[3 * i : 3 * i + 3] for i, name in enumerate(_VECTORS)}
        rows.append((f"line {number}", {"seconds": seconds, **parts, "fovy": fovy}))
    return rows


def _tables(path: Path, text: str, suffix: str) -> list[tuple[str, dict[str, Any]]]:
    try:
        content = _toml(text) if suffix == ".toml" else json.loads(text)
    except (ValueError, RecursionError) as error:
        raise FlightError(f"{path} is not valid {suffix[1:].upper()}: {error}; mend the file there") from None
    keys = content.get("key") if isinstance(content, dict) else None
    if not isinstance(keys, list) or not all(isinstance(key, dict) for key in keys):
        raise FlightError(f"{path} holds no list `key` of key views, each with {_FORM}")
    return [(f"key {number}", key) for number, key in enumerate(keys, 1)]


def _toml(text: str) -> dict:
    try:
        import tomllib
    except ImportError:  # Python 3.10
        import tomli as tomllib
    return tomllib.loads(text)
