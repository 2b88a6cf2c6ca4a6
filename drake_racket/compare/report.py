"""Writes a comparison: one table as CSV and JSON, one page as Markdown and HTML, its figures."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from drake_racket.compare.assessment import Swing
from drake_racket.compare.figures import axis_figure, hand_figure, maps_figure
from drake_racket.compare.numbers import NUMBERS, Number
from drake_racket.compare.spread import Assessed
from drake_racket.io.files import write_figure, write_text
from drake_racket.parameters.scenario import Scenario
from drake_racket.validation.report import as_html

FIGURES = {
    "restitution_maps.png": (maps_figure, "Apparent restitution at nine points"),
    "along_the_axis.png": (axis_figure, "Restitution and ball speed along the axis"),
    "vibration_and_hand.png": (hand_figure, "Vibration and load on the hand"),
}


def difference(first: Assessed, other: Assessed, name: str) -> tuple[float, float]:
    """Gives by how much a number of `other` is above that of `first`, with its spread.

    The strings are unknown in the same way for both rackets: what they move together cancels.
    What else was inferred is independent.
    """
    change = other.nominal.values[name] - first.nominal.values[name]
    squares = 0.0
    for part in {**first.parts, **other.parts}:
        a = first.parts.get(part, {}).get(name, 0.0)
        b = other.parts.get(part, {}).get(name, 0.0)
        shared = part == "string_bed" and part in first.parts and part in other.parts
        squares += (b - a) ** 2 if shared else a * a + b * b
    return change, math.sqrt(squares)


def comparison_table(rackets: Sequence[Assessed]) -> list[dict[str, Any]]:
    """Gives a row a number, SI: values and standard deviations, differences from the first."""
    rows = []
    for number in known(rackets):
        row: dict[str, Any] = {"name": number.name, "text": number.text, "unit": number.unit}
        for found in rackets:
            row[found.racket.name] = {
                "value": found.nominal.values[number.name],
                "sd": found.sd[number.name],
            }
        for found in rackets[1:]:
            change, sd = difference(rackets[0], found, number.name)
            row[found.racket.name] |= {"difference": change, "difference_sd": sd}
        rows.append(row)
    return rows


def known(rackets: Sequence[Assessed]) -> list[Number]:
    """Lists the numbers that the rackets have."""
    return [n for n in NUMBERS if n.name in rackets[0].nominal.values]


def write_comparison(
    rackets: Sequence[Assessed], out: str | Path, base: Scenario, swing: Swing
) -> list[Path]:
    """Writes compare.md, .html, .csv, .json and the figures into `out`, which is made.

    Returns:
        The files.

    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    for name, (draw, _) in FIGURES.items():
        write_figure(draw(rackets), out / name)
    page = markdown(rackets, base, swing)
    write_text(page, out / "compare.md")
    write_text(_with_figures(as_html(page), out), out / "compare.html")
    rows = comparison_table(rackets)
    write_text(json.dumps(rows, indent=1, allow_nan=False) + "\n", out / "compare.json")
    write_text(_as_csv(rows, [a.racket.name for a in rackets]), out / "compare.csv")
    return [out / f"compare.{suffix}" for suffix in ("md", "html", "csv", "json")] + [
        out / name for name in FIGURES
    ]


def _with_figures(page: str, out: Path) -> str:
    """The page with its figures inside: one file, to be sent on."""

    def inside(found: re.Match[str]) -> str:
        content = base64.b64encode((out / found[1]).read_bytes()).decode()
        return f'src="data:image/png;base64,{content}"'

    return re.sub(r'src="([a-z_]+\.png)"', inside, page)


def _as_csv(rows: Sequence[Mapping[str, Any]], names: Sequence[str]) -> str:
    columns = ("value", "sd", "difference", "difference_sd")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", "unit", *(f"{n}: {c}" for n in names for c in columns)])
    for row in rows:
        cells = [row[name].get(column, "") for name in names for column in columns]
        writer.writerow([row["name"], row["unit"], *cells])
    return text.getvalue()


def markdown(rackets: Sequence[Assessed], base: Scenario, swing: Swing) -> str:
    """Gives the page as Markdown."""
    titles = [_cell(a.racket.title) for a in rackets]
    lines = [
        f"# {' and '.join(titles) if len(titles) == 2 else ', '.join(titles)}",
        "",
        *(f"- {line}" for line in findings(rackets)),
        "",
        f"Nine points: free racket, ball at {base.speed:g} m/s straight on. Swing: the racket turns"
        f" at {swing.rate:g} rad/s about an axis {1e2 * swing.pivot:g} cm behind the butt and meets"
        f" a ball of {swing.ball_speed:g} m/s. Hand: in a grip at rest ({base.grip}, whose numbers"
        " are inferred). ± is one standard deviation of what inferred numbers leave open; of"
        " differences it leaves out what is unknown of all in the same way (the strings). Numbers"
        " without it rest on measured or published values, or do not feel the inferred ones.",
        "",
        *_table(rackets, titles),
    ]
    for name, (_, text) in FIGURES.items():
        lines += [f"![{text}]({name})", ""]
    for found in rackets:
        lines += _about(found)
    return "\n".join(lines).rstrip() + "\n"


def _table(rackets: Sequence[Assessed], titles: Sequence[str]) -> list[str]:
    heads = ["", *titles, *(f"{title} less {titles[0]}" for title in titles[1:])]
    lines: list[str] = []
    group = ""
    for number in known(rackets):
        if number.group != group:
            group = number.group
            lines += [*([""] if lines else []), f"## {group}", ""]
            lines += [f"| {' | '.join(heads)} |", f"|{'---|' * len(heads)}"]
        unit = f" ({number.shown})" if number.shown else ""
        cells = [number.format(a.nominal.values[number.name], a.sd[number.name]) for a in rackets]
        for found in rackets[1:]:
            change, sd = difference(rackets[0], found, number.name)
            cells.append(("+" if change > 0 else "") + number.format(change, sd))
        lines.append(f"| {number.text}{unit} | {' | '.join(cells)} |")
    return [*lines, ""]


_ASKED = (
    ("swing_speed_centre", "At its centre {} returns this swing's ball", "faster", "slower"),
    ("restitution_5", "At its centre {} has an apparent restitution", "higher", "lower"),
    ("handle_ringing", "The handle of {} rings", "more", "less"),
    ("peak_hand_force", "{} loads the hand", "more", "less"),
)


def findings(rackets: Sequence[Assessed]) -> list[str]:
    """Says in sentences what differs by more than is open, and what does not."""
    first, lines = rackets[0], []
    numbers = {n.name: n for n in known(rackets)}
    for found in rackets[1:]:
        open_still = []
        for name, text, more, less in _ASKED:
            if name not in numbers:
                continue
            number = numbers[name]
            change, sd = difference(first, found, name)
            size = f"{number.format(abs(change), sd)} {number.shown}".rstrip()
            if abs(change) > 2.0 * sd and float(number.format(abs(change))) > 0.0:
                told = text.format(_cell(found.racket.title))
                lines.append(f"{told} {more if change > 0 else less} by {size}.")
            else:
                open_still.append(f"{number.text} ({size})")
        if open_still:
            lines.append(
                f"No sure difference between {_cell(found.racket.title)} and"
                f" {_cell(first.racket.title)}: {', '.join(open_still)}."
            )
    return lines


def _about(found: Assessed) -> list[str]:
    """What of a racket was inferred."""
    racket = found.racket
    lines = [f"## About {_cell(racket.title)}", ""]
    for key, spec in racket.specs.items():
        if spec.status == "inferred":
            lines.append(f"- {key.replace('_', ' ')}: {spec.source}")
    lines += [f"- {_cell(note)}" for note in racket.notes]
    for added in racket.added:
        lines.append(f"- {1e3 * added.mass:.4g} g added at {added.at}")
    return [*lines, ""]


def _cell(text: str) -> str:
    """Text that does not end a table's cell."""
    return " ".join(text.replace("|", "/").split())
