"""Transfer functions as JSON files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ..errors import TransferFunctionError

Function = TypeVar("Function")


def write_function(path: str | Path, content: dict[str, Any]) -> None:
    """Write what a function's `to_dict` gives."""
    Path(path).write_text(json.dumps(content, indent=1) + "\n")


def read_function(
    path: str | Path, of_content: Callable[[dict[str, Any]], Function], kind: str, keys: str
) -> Function:
    """What `of_content` makes of a file; TransferFunctionError where it is not a `kind` with these `keys`."""
    try:
        return of_content(json.loads(Path(path).read_text()))
    except OSError as error:
        raise TransferFunctionError(f"cannot read the transfer function {path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise TransferFunctionError(f"{path} is not a {kind}: expected JSON with {keys}") from None
