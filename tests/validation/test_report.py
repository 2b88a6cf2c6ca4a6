"""What a report says of rows of every kind, and what the run keeps and tells."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
import xarray
from matplotlib.figure import Figure

from drake_racket.io.progress import Progress
from drake_racket.validation import PublishedValue, compare, report, run, summary
from drake_racket.validation.outcome import Plan, SectionResult
from tests.recorded import check_record

RECORDS = Path(__file__).parent / "records"


def row(key: str, model: float | None, section: str = "spin", **more: Any) -> Any:
    about = {"unit": "N", "source": "a | source", "note": f"note {key}", "tolerance_reason": "so"}
    return compare(PublishedValue(key, section, f"quantity {key}", **about | more), model)


ROWS = [
    row("value", 101.5, value=100.0, tolerance=0.02),
    row("far", 123.456, value=100.0, tolerance=0.02, unit="deg"),
    row("absolute", 99.0, value=100.0, tolerance=0.5, tolerance_kind="absolute"),
    row("negative", -1.5, value=-1.0, tolerance=0.1, unit="m/s^2"),
    row("zero", 0.25, value=0.0, tolerance=0.5, tolerance_kind="absolute", unit="1"),
    row("same", 3.0, value=3.0, own="fit"),
    row("wrong fit", 3.1, value=3.0, own="fit", depends_on=("grip.torque_stiffness",)),
    row("range", 5.0, section="oblique", low=4.0, high=6.0),
    row("above", 6.3, section="oblique", low=4.0, high=6.0, tolerance=0.1),
    row("below", 3.0, section="oblique", low=4.0, own="input"),
    row("under", 3.0, section="oblique", high=4.0, own="closed form"),
    row("over", 4.7, section="oblique", high=4.0, depends_on=("string_bed.springs",)),
    row("no verdict", 7.0, section="oblique", not_comparable="not printed"),
    row("nothing", None, section="oblique", not_comparable="not printed", unit="1"),
]
TITLES = {"spin": "Ball with radius, and spin", "oblique": "Oblique impacts"}
SECTIONS = {
    "spin": {"text": ["One.", "Two."], "figures": [{"file": "a.png", "caption": "A figure."}]},
    "oblique": {"text": [], "figures": []},
}


@pytest.fixture
def form(monkeypatch):
    """Of today are no matter of the report's form."""
    monkeypatch.setattr(report, "version", lambda name: f"1.0 of {name}")
    monkeypatch.setattr(report.platform, "python_version", lambda: "3.x")
    known = {"grip.torque_stiffness": "a guess", "string_bed.springs": "another", "ball.x": "none"}
    monkeypatch.setattr(report, "inferred_values", lambda: known)


@pytest.mark.parametrize("plan", ["whole", "coarse"])
@pytest.mark.usefixtures("form")
def test_a_report(plan, tmp_path):
    chosen = Plan(workers=3) if plan == "whole" else Plan.coarse()
    rows = ROWS if plan == "whole" else ROWS[:1]
    report.write_report(tmp_path, rows, SECTIONS, TITLES, chosen)
    found = {
        "report": (tmp_path / "report.md").read_text().splitlines(),
        "table": (tmp_path / "rows.csv").read_text().splitlines(),
        "rows": json.loads((tmp_path / "rows.json").read_text()),
    }
    check_record(found, RECORDS / f"report_{plan}.json")
    page = (tmp_path / "report.html").read_text()
    assert "<title>Validation report</title>" in page
    headings = Headings()
    headings.feed(page)
    assert headings.found == {
        summary.slug(line.lstrip("# ")): line.lstrip("# ")
        for line in found["report"]
        if line.startswith("#")
    }


class Headings(HTMLParser):
    """Collects the headings with their anchors."""

    def __init__(self) -> None:
        super().__init__()
        self.found: dict[str, str] = {}
        self.at = ""

    def handle_starttag(self, tag, attributes):
        """Keeps a heading's anchor."""
        if tag in ("h1", "h2", "h3"):
            self.at = dict(attributes)["id"]

    def handle_data(self, data):
        """Keeps its text."""
        if self.at:
            self.found[self.at], self.at = data, ""


def test_sections_that_are_kept_are_not_computed_again(tmp_path, monkeypatch):
    """Progress is told under the section's title; files are written; a kept one tells nothing."""
    asked, told = [], []

    def section(plan, progress):
        asked.append(plan)
        progress(Progress("inside", 3, 7))
        data = xarray.Dataset({"x": ("n", [1.0])})
        return SectionResult(
            {"static.match_small": 0.2, "static.pair": 1.0, "static.match": 0.1},
            ["text"],
            {"curve": data},
            {"curve": ("A caption.", Figure())},
        )

    monkeypatch.setitem(run.SECTIONS, "static_stiffness", ("Pressed", section))
    for fresh, times in ((False, 1), (False, 1), (True, 2)):
        rows = run.validate(tmp_path, only=["static_stiffness"], fresh=fresh, progress=told.append)
        assert len(asked) == times
        assert [one.published.key for one in rows] == [
            "static.pair",
            "static.match",
            "static.match_small",
        ]
    assert [(now.task, now.done, now.total) for now in told] == 2 * [
        ("Pressed", 0, 1),
        ("Pressed", 3, 7),
        ("Pressed", 1, 1),
    ]
    assert asked == [Plan(), Plan()]
    names = {str(path.relative_to(tmp_path)) for path in tmp_path.glob("*/*")}
    assert names == {"figures/static_stiffness_curve.png", "data/static_stiffness_curve.nc"}
    assert "A caption." in (tmp_path / "report.md").read_text()
    (tmp_path / "data" / "static_stiffness_curve.nc").unlink()
    run.validate(tmp_path, only=["static_stiffness"])  # whoever waits is not told
    assert len(asked) == 3


def test_a_row_without_a_tolerance_has_none_but_of_the_last_bits():
    assert PublishedValue().tolerance == 0.0
    assert PublishedValue().tolerance_kind == "relative"
    assert row("x", 1.0, value=1.0).verdict == "agrees"
    near = {"tolerance": 0.5, "tolerance_kind": "absolute"}
    assert row("x", 1.5 + 1e-13, value=1.0, **near).verdict == "agrees"
    assert row("x", 1.5 + 1e-11, value=1.0, **near).verdict == "differs"
