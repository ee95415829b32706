"""Settings that differ from host to host: what one host of COVISE or CalVR sees of a file.

Both look for a setting in several scopes and take the first that has it. COVISE: LOCAL of the host, then
CLUSTER, then GLOBAL. CalVR: what is in no scope, then GLOBAL, then LOCAL of the host. Source: coConfigRoot
and coConfigEntry of COVISE, XMLReader of CalVR.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from .report import Report
from .xml_file import Element

_MOST_HOSTS = 500
_ON = ("on", "true", "yes", "1")


def hosts_of(sections: list[Element], report: Report) -> dict[str, set[str]]:
    """Each host that LOCAL sections name, with all its names: `wall` and `wall.site.de` are one machine."""
    listed = [name for section in sections for name in _names(section.get("host"))]
    hosts: dict[str, set[str]] = {}
    for name in dict.fromkeys(listed):
        short = name.partition(".")[0]
        own = short if short in listed and not short.isdigit() else name
        hosts.setdefault(own, set()).add(name)
    if len(hosts) > _MOST_HOSTS:
        raise report.broken(sections[0].path.name, f"{len(hosts)} hosts: more than {_MOST_HOSTS}")
    return hosts


def sections_for(sections: list[Element], names: set[str], attribute: str = "host") -> list[Element]:
    """Those sections that are for a host of these names."""
    return [s for s in sections if names & set(_names(s.get(attribute)))]


def _names(text: str) -> list[str]:
    return [name for part in text.split(",") if (name := part.strip().lower())]


class Settings:
    """What one host sees.

    Parameters
    ----------
    scopes
        Elements whose children are settings; earlier ones count first.
    host
        Its name, for messages.
    """

    def __init__(self, scopes: list[Element], host: str, report: Report):
        self._scopes = scopes
        self.host = host
        self._report = report

    def elements(self, path: str) -> Iterator[Element]:
        """All elements of a path such as COVER.ScreenConfig.Screen:0, the ones that count first, first.

        A part is an element's name, or several as A|B; `:0` asks for its attribute name (or index).
        """
        parts = [_part(part) for part in path.split(".")]
        for scope in self._scopes:
            yield from _below(scope, parts)

    def has(self, path: str) -> bool:
        """Whether there is such an element."""
        return next(self.elements(path), None) is not None

    def find(self, path: str, attribute: str = "value") -> tuple[Element, str] | None:
        """The first element of a path that has the attribute, with its text."""
        for element in self.elements(path):
            if text := element.get(attribute).strip():
                return element, text
        return None

    def text(self, path: str, attribute: str = "value", default: str = "") -> str:
        """An attribute's text."""
        found = self.find(path, attribute)
        return found[1] if found else default

    def is_on(self, path: str, attribute: str = "value", default: bool = False) -> bool:
        """Whether a switch is on, true or above 0."""
        text = self.text(path, attribute).lower()
        return text in _ON if text else default

    def number(self, path: str, attribute: str = "value", default: float = 0.0) -> float:
        """A number; Broken if it is none."""
        found = self.find(path, attribute)
        if not found:
            return default
        name = f"{path.rpartition('.')[2]} {attribute}".strip()
        return self._report.number(self.where(found[0]), name, found[1])

    def whole(self, path: str, attribute: str = "value", default: int = 0) -> int:
        """A whole number; Broken if it is none."""
        value = self.number(path, attribute, default)
        if value != int(value):
            found = self.find(path, attribute)
            where = self.where(found[0]) if found else path
            raise self._report.broken(where, f"{attribute} is a whole number; given {value:g}")
        return int(value)

    def count(self, path: str, default: int, most: int) -> int:
        """How many there are of something, 0 … `most`; Broken otherwise."""
        value = self.whole(path, default=default)
        if not 0 <= value <= most:
            raise self._report.broken(self.host or path, f"{path} is 0 … {most}; given {value}")
        return value

    def where(self, element: Element) -> str:
        """file:line and the host, for messages."""
        return f"{element.where}: host {self.host}" if self.host else element.where


def _part(text: str) -> tuple[frozenset[str], str | None]:
    names, colon, suffix = text.partition(":")
    return frozenset(names.split("|")), suffix if colon else None


def _below(parent: Element, parts: list[tuple[frozenset[str], str | None]]) -> Iterator[Element]:
    names, suffix = parts[0]
    for child in parent.children:
        if child.name not in names or not _is_for_us(child):
            continue
        if suffix is not None and (child.get("name") or child.get("index")) != suffix:
            continue
        if len(parts) == 1:
            yield child
        else:
            yield from _below(child, parts[1:])


def _is_for_us(element: Element) -> bool:
    """COVISE marks elements for one kind of system; Linux is x11 there."""
    given = element.get("ARCH").lower()
    return not given or bool(re.search("x11|linux|unix", given))
