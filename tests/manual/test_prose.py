"""Numbers in the text are those of the result files that commands rewrite, and of a run."""

from __future__ import annotations

import json
import re

import pytest

import drake_racket as dr
from drake_racket.results.summary import summary_rows
from tests.conftest import ROOT

DOCS = ROOT / "docs"
ROWS = {
    row["key"]: row
    for row in json.loads((DOCS / "validation" / "rows.json").read_text(encoding="utf-8"))
}


def model(key: str) -> float:
    return float(ROWS[key]["model"])


def text(page: str) -> str:
    return " ".join((ROOT / page).read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def impact() -> dict[str, str]:
    return dict(summary_rows(dr.simulate()))


@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_the_first_impact_prints_what_the_page_shows(page, impact):
    shown = (ROOT / page).read_text(encoding="utf-8").split("```text\n")[1].split("```")[0]
    lines = [line for line in shown.splitlines() if re.match(r"[A-Z][a-z ]+  +\S", line)]
    assert len(lines) >= 5
    for line in lines:
        name, value = re.split(r"  +", line, maxsplit=1)
        assert impact[name].startswith(value), line


def test_frequencies_of_the_model_page():
    page = text("docs/model.md")
    for racket in ("tour", "recreational"):
        for reading in (".as_printed", ""):
            pair = [
                model(f"modes.{racket}.{plane}{reading}") for plane in ("in_plane", "out_of_plane")
            ]
            assert f"{pair[0]:.1f} / {pair[1]:.1f} Hz" in page
    misses = [
        abs(model(key) / ROWS[key]["published"] - 1.0) * 100.0
        for key in ROWS
        if key.endswith("as_printed")
    ]
    assert f"miss them by {min(misses):.0f}-{max(misses):.0f} % with `as_printed`" in page
    strung = 1.0 - model("modes.tour.out_of_plane.strung") / 132.0
    assert f"out-of-plane mode is {100 * strung:.1f} % low" in page


def test_findings_of_the_model_page():
    page = text("docs/model.md")
    assert f"rebounds up to {model('clamped.recreational.low.highest'):.1f} m/s" in page
    assert f"they differ by {100 * model('static.match_small'):.0f} %" in page
    assert 0.03 < model("static.match") < 0.045  # "3-4 % on average"


def test_the_summary_of_the_report_counts_its_rows():
    report = text("docs/validation/report.md")
    able = [row for row in ROWS.values() if not row["own"]]
    agree = sum(row["verdict"] == "agrees" for row in able)
    differ = sum(row["verdict"] == "differs" for row in able)
    assert f"**{agree} agree and {differ} differ**" in report


def test_the_bounds_of_the_ball_page():
    page = text("docs/ball_calibration.md")
    assert f"{model('plate.peak_force') / 1e3:.2f} kN: kept" in page
    assert f"{1e3 * model('plate.contact_time'):.1f} ms: kept" in page
    assert f"{model('plate.drop_restitution'):.3f}: **missed**" in page
    lowest = min(model(key) for key in ROWS if key.endswith(".lowest"))
    assert f"{lowest:.1f} m/s: kept" in page


def test_one_version_everywhere():
    import tomllib
    from importlib.metadata import version

    import yaml

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert project["version"] == str(cff["version"]) == version("drake-racket") == dr.__version__
    headings = re.findall(r"^## (.+)$", changes, re.MULTILINE)
    assert project["version"] in [heading.split()[0] for heading in headings[:2]]


def test_the_papers_table_is_the_reports():
    page = text("docs/paper.md")
    for kind, said in (
        ("", "a measurement that the model never saw"),
        ("fit", "a number that had a say in an inferred value"),
        ("input", "the model's own input"),
        ("closed form", "a closed form, or the same equations in another way"),
    ):
        rows = [row for row in ROWS.values() if row["own"] == kind]
        counts = [len(rows)]
        for verdict in ("agrees", "differs", "not comparable"):
            counts.append(sum(row["verdict"] == verdict for row in rows))
        assert f"| {said} | {' | '.join(map(str, counts))} |" in page


def test_the_papers_references_are_used_and_known():
    page = text("docs/paper.md")
    body, listed = page.split("## References")
    known = text("docs/engines.md") + text("drake_racket/parameters/data/references.yaml")
    entries = re.findall(r"- (\w+), [^(]*\((\d{4})\)", listed)
    assert len(entries) == listed.count("- ") == 4
    for name, year in entries:
        assert re.search(rf"{name}[^)]*\b{year}", body), name
        assert re.search(rf"{name}[^)]*\b{year}", known) or name in known, name
