"""The atlas as files: strips as PNG, one HTML and one Markdown page, JSON."""

from __future__ import annotations

import html
import json
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from ...errors import FileError
from .case import Finding, Strip
from .outcome import Outcome
from .strips import write_strip

Pictures = dict[Strip, str]  # file names of strips; a strip is shown once, however many findings it has

_TITLE = "Where methods fail: the stability atlas"
_COLUMNS = ("case", "metric", "value", "bound", "ray caster", "2001", "verdict")
_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 76rem; margin: 2rem auto }
h1 { font-size: 1.6rem }
h2 { font-size: 1.25rem; margin-top: 2.5rem; border-top: 1px solid #ddd; padding-top: 1rem }
table { border-collapse: collapse; margin: 1rem 0 }
th, td { padding: .25rem .8rem .25rem 0; text-align: left; vertical-align: top }
tr { border-bottom: 1px solid #e4e4e4 }
td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums }
.holds { color: #00704e } .fails { color: #b22000; font-weight: bold }
figure { margin: 1rem 0 } img { max-width: 100%; image-rendering: pixelated }
figcaption, .derived, footer { color: #666; font-size: .87rem }
"""


def write_pictures(outcome: Outcome, folder: Path) -> Pictures:
    """Write a case's strips as NAME-1.png, NAME-2.png …; the file name of each. FileError."""
    strips = list(dict.fromkeys(strip for finding in outcome.findings for strip in finding.strips))
    pictures = {strip: f"{outcome.case.name}-{number}.png" for number, strip in enumerate(strips, 1)}
    for strip, name in pictures.items():
        write_strip(strip, folder / name)
    return pictures


def write_page(
    outcomes: Sequence[Outcome], pictures: Pictures, about: dict[str, Any], folder: Path
) -> list[Path]:
    """Write atlas.html, atlas.md and atlas.json, which holds `about`, too. FileError where it cannot."""
    report = report_of(outcomes, pictures, about)
    texts = {
        "atlas.html": as_html(outcomes, pictures, about),
        "atlas.md": as_markdown(outcomes, pictures, about),
        "atlas.json": json.dumps(report, ensure_ascii=False, allow_nan=False, indent=1) + "\n",
    }
    paths = [folder / name for name in texts]
    for path, text in zip(paths, texts.values(), strict=True):
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise FileError(f"cannot write {path}: {error.strerror}; choose another folder with -o") from None
    return paths


def report_of(outcomes: Sequence[Outcome], pictures: Pictures, about: dict[str, Any]) -> dict[str, Any]:
    """`about`, and `cases`: one entry a finding. JSON-ready: what is not finite is null."""
    entries = []
    for outcome in outcomes:
        case = {"name": outcome.case.name, "title": outcome.case.title}
        if outcome.fault:
            unmeasured = dict.fromkeys(("metric", "ours", "bound", "ray_caster", "single_axis"))
            entries.append(case | unmeasured | {"holds": False, "fault": outcome.fault})
        for finding in outcome.findings:
            entries.append(
                case
                | {
                    "metric": finding.metric,
                    "unit": finding.unit,
                    "ours": _finite(finding.value),
                    "bound": _finite(finding.bound),
                    "at_least": finding.at_least,
                    "ray_caster": _finite(finding.ray_caster),
                    "single_axis": _finite(finding.single_axis),
                    "derived": finding.derived,
                    "holds": finding.holds,
                    "pictures": [pictures[strip] for strip in finding.strips],
                }
            )
    seconds = {outcome.case.name: round(outcome.seconds, 1) for outcome in outcomes}
    holds = all(outcome.holds for outcome in outcomes)
    return {**about, "holds": holds, "seconds": seconds, "cases": entries}


def overview(outcomes: Sequence[Outcome]) -> list[tuple[str, ...]]:
    """Rows of the overview table: case, metric, value, bound, ray caster, 2001, verdict."""
    rows = []
    for outcome in outcomes:
        if outcome.fault:
            rows.append((outcome.case.name, f"broke off: {outcome.fault}", "", "", "", "", "fails"))
        for finding in outcome.findings:
            rows.append((outcome.case.name, with_unit(finding), *figures(finding)))
    return rows


def with_unit(finding: Finding) -> str:
    """The metric, and its unit in brackets unless the metric names it."""
    return finding.metric if finding.unit in finding.metric else f"{finding.metric} ({finding.unit})"


def figures(finding: Finding) -> tuple[str, str, str, str, str]:
    """Value, bound, ray caster, the method of 2001, all without unit, and the verdict of a finding."""
    return (
        number_text(finding.value),
        ("≥ " if finding.at_least else "≤ ") + number_text(finding.bound),
        _rival_text(finding.ray_caster),
        _rival_text(finding.single_axis),
        "holds" if finding.holds else "fails",
    )


def _rival_text(value: float | None) -> str:
    """Nothing where it was not measured; n/a where that method has no picture to measure."""
    if value is None:
        return ""
    return "n/a" if math.isnan(value) else number_text(value)


def number_text(value: float) -> str:
    """Three significant digits, whole numbers below a million in full."""
    value = float(value)
    whole = math.isfinite(value) and (value == int(value) or abs(value) >= 1000) and abs(value) < 1e6
    return f"{value:.0f}" if whole else f"{value:.3g}"


def as_markdown(outcomes: Sequence[Outcome], pictures: Pictures, about: dict[str, Any]) -> str:
    """The whole atlas as one Markdown page, pictures by file name."""
    lines = [f"# {_TITLE}", "", _verdict(outcomes), "", *_markdown_table(_COLUMNS, overview(outcomes)), ""]
    for outcome in outcomes:
        lines += [f"## {outcome.case.title}", "", outcome.case.what, ""]
        if outcome.fault:
            lines += [f"**Broke off: {_cell(outcome.fault)}**", ""]
        lines += [f"- {_cell(text)}" for text in _derivations(outcome)]
        lines.append("")
        for strip in _strips(outcome):
            lines += [f"![{_cell(strip.label)}]({pictures[strip]})", "", f"*{_cell(strip.label)}*", ""]
    return "\n".join([*lines, _made_by(about), ""])


def _markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    dashes = ["---" if n < 2 or n == len(head) - 1 else "---:" for n in range(len(head))]
    bold = [[*row[:-1], f"**{row[-1]}**" if row[-1] == "fails" else row[-1]] for row in rows]
    return [
        f"| {' | '.join(head)} |",
        f"|{'|'.join(dashes)}|",
        *(f"| {' | '.join(map(_cell, row))} |" for row in bold),
    ]


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def as_html(outcomes: Sequence[Outcome], pictures: Pictures, about: dict[str, Any]) -> str:
    """The whole atlas as one HTML page, pictures by file name."""
    rows = [_html_row(row, f"#{row[0]}") for row in overview(outcomes)]
    parts = [
        "<!doctype html>",
        f'<html lang="en"><meta charset="utf-8"><title>{_TITLE}</title><style>{_STYLE}</style>',
        f"<h1>{_TITLE}</h1><p>{html.escape(_verdict(outcomes))}</p>",
        _html_table(_COLUMNS, rows),
    ]
    for outcome in outcomes:
        case = outcome.case
        parts.append(f'<h2 id="{case.name}">{html.escape(case.title)}</h2><p>{html.escape(case.what)}</p>')
        if outcome.fault:
            parts.append(f'<p class="fails">Broke off: {html.escape(outcome.fault)}</p>')
        rows = [
            _html_row((with_unit(finding), *figures(finding)), note=finding.derived)
            for finding in outcome.findings
        ]
        parts.append(_html_table(_COLUMNS[1:], rows) if rows else "")
        for strip in _strips(outcome):
            label, name = html.escape(strip.label), html.escape(pictures[strip])
            parts.append(f'<figure><img src="{name}" alt="{label}"><figcaption>{label}</figcaption></figure>')
    return "\n".join([*parts, f"<footer>{html.escape(_made_by(about))}</footer></html>", ""])


def _html_table(head: Sequence[str], rows: Sequence[str]) -> str:
    return "\n".join(["<table><tr>", *(f"<th>{name}</th>" for name in head), "</tr>", *rows, "</table>"])


def _html_row(row: Sequence[str], link: str = "", note: str = "") -> str:
    """A table's row; the first cell with a link, the metric with a note below it."""
    *texts, value, bound, caster, published, verdict = map(html.escape, row)
    if link:
        texts[0] = f'<a href="{html.escape(link)}">{texts[0]}</a>'
    if note:
        texts[-1] += f'<br><span class="derived">bound: {html.escape(note)}</span>'
    cells = [f"<td>{text}</td>" for text in texts]
    cells += [f'<td class="number">{text}</td>' for text in (value, bound, caster, published)]
    return f'<tr>{"".join(cells)}<td class="{verdict}">{verdict}</td></tr>'


def _derivations(outcome: Outcome) -> Iterator[str]:
    for finding in outcome.findings:
        value, bound, *_, verdict = figures(finding)
        yield f"{with_unit(finding)}: {value}, {bound}, {verdict}. Bound: {finding.derived}"


def _strips(outcome: Outcome) -> list[Strip]:
    return list(dict.fromkeys(strip for finding in outcome.findings for strip in finding.strips))


def _verdict(outcomes: Sequence[Outcome]) -> str:
    findings = [finding for outcome in outcomes for finding in outcome.findings]
    broken = sum(bool(outcome.fault) for outcome in outcomes)
    good = sum(finding.holds for finding in findings)
    text = f"{good} of {len(findings)} findings of {len(outcomes)} cases hold."
    return f"{text} {broken} broke off." if broken else text


def _made_by(about: dict[str, Any]) -> str:
    machine = about["machine"]
    size = "small sizes" if about["quick"] else "full sizes"
    return (
        f"Made by persp-sw {machine['versions']['persp_sw']} atlas, {size}, on {machine['processor']}, "
        f"{machine['cores']} cores. Ray caster: as many samples on each ray, in equal steps. 2001: a "
        "single-axis perspective shear-warp without correction per ray, as published in 2001; n/a: it has no "
        "picture of such views."
    )


def _finite(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)
