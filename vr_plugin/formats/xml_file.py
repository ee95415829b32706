"""XML as it is found in the wild, read safely.

Configuration files of walls have several roots, prefixes that nothing binds, and no schema. expat without
namespaces takes the second as it is; the first is cured by a root around everything. Entities cannot be
declared, so nothing expands; size, depth and count are bounded.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from ..rig import RigError

_MOST_BYTES = 4 << 20
_MOST_ELEMENTS = 100_000
_DEEPEST = 64
_ENCODINGS = ("utf-8", "us-ascii", "iso-8859-1", "iso-8859-15", "windows-1252", "utf-16")
_DECLARATION = re.compile(r"<\?xml\s[^>]*\?>")
_DOCTYPE = re.compile(r"<!DOCTYPE[^\[<>]*>")
_ROOT = "everything"


@dataclass(eq=False)
class Element:
    """An element, its names as written.

    Attributes
    ----------
    tag
        With its prefix; see `name`.
    line, path
        Where it starts.
    text
        All its own text, stripped.
    """

    tag: str
    attributes: dict[str, str]
    path: Path
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    @property
    def name(self) -> str:
        """Without prefix."""
        return self.tag.rpartition(":")[2]

    @property
    def where(self) -> str:
        """file:line, for messages."""
        return f"{self.path.name}:{self.line}"

    def get(self, name: str, default: str = "") -> str:
        """An attribute's text; names are compared without regard to case."""
        for key, value in self.attributes.items():
            if key.lower() == name.lower():
                return value
        return default

    def all(self, *names: str) -> list[Element]:
        """Children of these names."""
        return [child for child in self.children if child.name in names]

    def texts(self, name: str) -> list[str]:
        """The texts of all children of a name, as formats that repeat elements for x, y, z have them."""
        return [child.text for child in self.children if child.name == name]

    def value(self, name: str, default: str = "") -> str:
        """The text of the first child of a name."""
        return next(iter(self.texts(name)), default)

    def walk(self) -> Iterator[Element]:
        """This element and all below it, in the order of the file."""
        stack = [self]
        while stack:
            element = stack.pop()
            yield element
            stack.extend(reversed(element.children))


def read_text(path: Path) -> str:
    """A text file's content.

    Raises
    ------
    RigError
        Missing, unreadable, larger than 4 MiB or not text.
    """
    try:
        with path.open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise RigError(f"{path}: {error.strerror or error}") from None
    if len(data) > _MOST_BYTES:
        raise RigError(f"{path}: larger than {_MOST_BYTES >> 20} MiB, which no file of walls is")
    encoding = _encoding(data)
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError:
        text = data.decode("iso-8859-1")  # old files, unmarked; only names and comments hold such letters
    if "\0" in text:
        raise RigError(f"{path}: not a text file")
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def parse(text: str, path: Path) -> Element:
    """All elements of a file below one root.

    Raises
    ------
    RigError
        Not well-formed (with the line), too many or too deep elements, or entities of its own.
    """
    text = _DECLARATION.sub(_blank, text)
    text = _DOCTYPE.sub(_blank, text, count=1)
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise RigError(f"{path}: it declares entities, which are not read; remove its DOCTYPE")
    root = Element(_ROOT, {}, path, 1)
    open_elements: list[Element] = []
    pieces: list[list[str]] = []
    count = 0
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        count += 1
        if count > _MOST_ELEMENTS or len(open_elements) > _DEEPEST:
            limit = f"{_MOST_ELEMENTS} elements" if count > _MOST_ELEMENTS else f"{_DEEPEST} levels"
            raise RigError(
                f"{path}:{parser.CurrentLineNumber}: more than {limit}, which no file of walls has"
            )
        element = Element(tag, attributes, path, parser.CurrentLineNumber)
        if not open_elements:
            element = root
        else:
            open_elements[-1].children.append(element)
        open_elements.append(element)
        pieces.append([])

    def end(tag: str) -> None:
        open_elements.pop().text = "".join(pieces.pop()).strip()

    def characters(data: str) -> None:
        pieces[-1].append(data)

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    try:
        parser.Parse(f"<{_ROOT}>{text}</{_ROOT}>".encode("utf-8", "replace"), True)
    except expat.ExpatError as error:
        raise RigError(
            f"{path}:{error.lineno}: not well-formed XML: {expat.ErrorString(error.code)}"
        ) from None
    return root


def _encoding(data: bytes) -> str:
    """The encoding a file states by its first bytes or its XML declaration; UTF-8 otherwise."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    stated = re.match(rb"\s*<\?xml[^>]*encoding=[\"']([A-Za-z0-9_-]+)", data)
    name = stated.group(1).decode().lower() if stated else "utf-8"
    return name if name in _ENCODINGS and name != "utf-16" else "utf-8"


def _blank(match: re.Match[str]) -> str:
    """As many lines as were there, so that line numbers stay."""
    return "\n" * match.group().count("\n")
