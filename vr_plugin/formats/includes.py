"""Configuration files that draw in others: INCLUDE of COVISE and CalVR, and XInclude."""

from __future__ import annotations

from pathlib import Path

from .report import Report, quoted
from .xml_file import Element, parse, read_text

_MOST_FILES = 32


class Includes:
    """Follows the includes of one file, each file once.

    Files are looked for beside the file that names them. One that is missing is noted, unless it was only to
    be tried (TRYINCLUDE) or has a fallback. At most 32 files are read.
    """

    def __init__(self, document: Element, report: Report):
        self._report = report
        self._seen = {document.path.resolve()}

    def splice(self, document: Element) -> None:
        """Put each file in place of the element that names it (COVISE, XInclude)."""
        for parent in list(document.walk()):
            children: list[Element] = []
            for child in parent.children:
                if not _is_include(child):
                    children.append(child)
                    continue
                found = self._load(child)
                self.splice(found)
                children.extend(_without_root(found.children, parent))
            parent.children = children

    def append(self, document: Element) -> None:
        """Put what is drawn in behind everything else, whose values count first (CalVR)."""
        for include in _taken_out(document):
            found = self._load(include)
            self.append(found)
            document.children.extend(found.children)

    def _load(self, element: Element) -> Element:
        """The file that an element names, or its fallback, as a document."""
        name = element.get("href") or element.text
        nothing = Element("nothing", {}, element.path, element.line)
        nothing.children = [child for found in element.all("fallback") for child in found.children]
        path = element.path.parent / name
        if not name or "://" in name or not _is_file(path):
            if element.name != "TRYINCLUDE" and not nothing.children:
                what = "which is on another machine" if "://" in name else "which is not beside it"
                self._report.note(
                    f"{element.where}: it draws in {quoted(name)}, {what}: what that says is missing"
                )
            return nothing
        if path.resolve() in self._seen:
            nothing.children = []
            return nothing
        if len(self._seen) >= _MOST_FILES:
            self._report.note(f"{element.where}: {quoted(name)} is not read: {_MOST_FILES} files are enough")
            return nothing
        self._seen.add(path.resolve())
        return parse(read_text(path), path)


def _is_include(element: Element) -> bool:
    if element.name in ("INCLUDE", "TRYINCLUDE"):
        return True
    return element.name == "include" and bool(element.get("href"))


def _taken_out(document: Element) -> list[Element]:
    """All includes of a document, which then holds none."""
    found: list[Element] = []
    for parent in list(document.walk()):
        found += [child for child in parent.children if _is_include(child)]
        parent.children = [child for child in parent.children if not _is_include(child)]
    return found


def _without_root(found: list[Element], parent: Element) -> list[Element]:
    """What is inside the roots of an included file, where they are of the parent's kind."""
    return [inner for root in found for inner in (root.children if root.name == parent.name else [root])]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
