"""The validation report: published numbers, verdicts, resuming, files, command line."""

from __future__ import annotations

import contextlib
import csv
import dataclasses
import json
import math
import sqlite3
import subprocess
import sys
from html.parser import HTMLParser

import pytest
import xarray
from hypothesis import assume, given
from hypothesis import strategies as st

from drake_racket import InputError
from drake_racket.cli import main
from drake_racket.rigs.modes.frame_modes import published_antinodes, published_fundamentals
from drake_racket.validation import SECTIONS, PublishedValue, compare, load_published, validate
from drake_racket.validation.outcome import Plan
from drake_racket.validation.report import inferred_values
from drake_racket.validation.run import FILE, fingerprint
from drake_racket.validation.summary import STUDIES
from tests.conftest import ROOT

ENTRY = PublishedValue("k", "static_stiffness", "q", "N", "s", value=100.0, note="n")
NUMBERS = st.floats(-1e6, 1e6)


# ---- the published numbers


def test_every_entry_belongs_to_a_section_and_to_known_inferred_values():
    known = inferred_values()
    for entry in load_published():
        assert entry.section in SECTIONS
        assert set(entry.depends_on) <= set(known), entry.key


def test_the_papers_numbers_are_those_printed():
    # Glynn et al. 2011, Results; the same numbers are drawn into the figures of the modes
    entries = {entry.key: entry for entry in load_published()}
    for racket, hertz, metres in (
        ("tour", (158.0, 132.0), (0.366, 0.349)),
        ("recreational", (178.0, 150.0), (0.375, 0.350)),
    ):
        assert published_fundamentals(racket) == hertz
        assert published_antinodes(racket) == metres
        for plane, f, x in zip(("in_plane", "out_of_plane"), hertz, metres, strict=True):
            assert entries[f"modes.{racket}.{plane}"].value == f
            assert entries[f"antinode.{racket}.{plane}"].value == x
    assert entries["modes.tour.in_plane"].tolerance == 0.03


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("value: 1.0", "unit"),
        ('unit: "N"', "value, low or high"),
        ('unit: "N"\n    value: 1.0\n    low: 0.5', "not both"),
        ('unit: "N"\n    low: 2.0\n    high: 1.0', "at most high"),
        ('unit: "N"\n    value: 1.0\n    tolerance: -0.1', "0 or more"),
        ('unit: "N"\n    value: 1.0\n    tolerance_kind: rough', "relative, absolute"),
        ('unit: "N"\n    value: 1.0\n    tolerance_reason: ""', "a reason"),
        ('unit: "N"\n    value: 1.0\n    verdict: agrees', "unknown key"),
        ('unit: "N"\n    value: 1.0\n    own: hope', "input, fit, closed form"),
        ('unit: "N"\n    value: .nan', "finite"),
    ],
)
def test_a_bad_published_file_is_refused(change, said, tmp_path):
    text = (
        "entries:\n  - key: a\n    section: oblique\n    quantity: q\n    source: s\n    note: n\n"
    )
    reason = "" if "tolerance_reason" in change else "    tolerance_reason: r\n"
    path = tmp_path / "published.yaml"
    path.write_text(f"{text}{reason}    {change}\n")
    with pytest.raises(InputError, match=said) as error:
        load_published(path)
    assert "\n" not in str(error.value)


def test_a_repeated_key_is_refused(tmp_path):
    entry = (
        "  - {key: a, section: oblique, quantity: q, unit: N, source: s, note: n, value: 1.0,"
        " tolerance_reason: r}\n"
    )
    path = tmp_path / "published.yaml"
    path.write_text("entries:\n" + entry + entry)
    with pytest.raises(InputError, match="each key once"):
        load_published(path)


# ---- verdicts


@given(NUMBERS, NUMBERS, st.floats(0.0, 1e3))
def test_a_value_agrees_within_its_absolute_tolerance(published, model, tolerance):
    gap = abs(model - published)
    assume(abs(gap - tolerance) > 1e-9 * max(gap, tolerance))
    entry = dataclasses.replace(
        ENTRY, value=published, tolerance=tolerance, tolerance_kind="absolute"
    )
    row = compare(entry, model)
    assert row.verdict == ("agrees" if gap < tolerance else "differs")
    assert row.difference == model - published


@given(NUMBERS, st.floats(-1e3, 1e3), st.floats(0.0, 1e3))
def test_a_range_holds_what_is_inside(model, low, width):
    entry = dataclasses.replace(
        ENTRY, value=None, low=low, high=low + width, tolerance_kind="absolute"
    )
    row = compare(entry, model)
    assert (row.verdict == "agrees") == (low <= model <= low + width)
    assert (row.difference == 0.0) == (low <= model <= low + width)


def test_relative_tolerances_are_of_the_published_value_or_the_nearer_end():
    three = dataclasses.replace(ENTRY, tolerance=0.03)
    assert compare(three, 103.0).verdict == "agrees"
    assert compare(three, 103.1).verdict == "differs"
    assert compare(three, 97.0).verdict == "agrees"
    ends = dataclasses.replace(three, value=None, low=100.0, high=200.0)
    assert compare(ends, 206.0).verdict == "agrees"
    assert compare(ends, 96.9).verdict == "differs"
    assert compare(dataclasses.replace(ends, low=None), -5.0).verdict == "agrees"


@pytest.mark.parametrize("model", [math.nan, math.inf])
def test_what_is_not_finite_differs(model):
    assert compare(dataclasses.replace(ENTRY, tolerance=1e9), model).verdict == "differs"
    ends = dataclasses.replace(ENTRY, value=None, high=200.0)
    assert compare(ends, model).verdict == "differs"


def test_no_verdict_without_a_measurement_and_no_row_without_a_model():
    barred = dataclasses.replace(ENTRY, value=None, not_comparable="not printed")
    assert compare(barred, None).verdict == "not comparable"
    with pytest.raises(KeyError, match="no model value"):
        compare(ENTRY, None)


# ---- the run and its files


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("validation")
    seen: list[tuple[str, float, float]] = []
    rows = validate(
        out,
        only=["static_stiffness", "force_plate"],
        plan=Plan.coarse(),
        progress=lambda now: seen.append((now.task, now.done, now.total)),
    )
    return out, rows, seen


def test_rows_of_the_sections_asked_for(finished):
    _, rows, seen = finished
    assert [row.published.section for row in rows] == ["force_plate"] * 8 + ["static_stiffness"] * 3
    verdicts = {row.published.key: row.verdict for row in rows}
    assert verdicts["plate.closed_form"] == "agrees"
    assert verdicts["static.match_small"] == "differs"
    assert {title for title, _, _ in seen} == {SECTIONS[n][0] for n in ("force_plate",)} | {
        SECTIONS["static_stiffness"][0]
    }


def test_machine_readable_rows(finished):
    out, rows, _ = finished
    table = list(csv.DictReader((out / "rows.csv").open()))
    records = json.loads((out / "rows.json").read_text())
    assert len(table) == len(records) == len(rows)
    for line, record, row in zip(table, records, rows, strict=True):
        assert line["verdict"] == record["verdict"] == row.verdict
        assert float(line["model"]) == record["model"] == row.model
        assert line["quantity"] == row.published.quantity


class _Page(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.rows = 0
        self.pictures: list[str] = []
        self.links: set[str] = set()
        self.names: set[str] = set()

    def handle_starttag(self, tag, attrs):
        self.rows += tag == "tr"
        self.names |= {value for key, value in attrs if key == "id"}
        if tag == "a":
            self.links.add(dict(attrs)["href"])
        if tag == "img":
            self.pictures.append(dict(attrs)["src"])


def test_pages_hold_every_row_and_their_pictures_exist(finished):
    out, rows, _ = finished
    text = (out / "report.md").read_text()
    for row in rows:
        assert row.published.quantity in text
    assert "A coarse grid" in text
    assert "`string_bed.springs`" in text
    page = _Page()
    page.feed((out / "report.html").read_text())
    inferred = {key for row in rows for key in row.published.depends_on}
    tables = 5  # kinds of rows, contents, two sections, what is inferred; each with a head
    kinds = {row.published.own for row in rows}
    assert page.rows == len(rows) + len(inferred) + len(kinds) + 2 + tables
    assert page.links <= {f"#{name}" for name in page.names}
    assert "#command-force_plate" in page.links
    assert page.pictures
    for picture in page.pictures:
        assert (out / picture).stat().st_size > 10_000


def test_rows_that_could_have_failed_are_counted_apart(finished):
    out, rows, _ = finished
    able = [row for row in rows if not row.published.own]
    assert len(able) == 4  # the drop test, and three of the pressed bed
    failed = sum(row.verdict == "differs" for row in able)
    text = (out / "report.md").read_text()
    assert f"**{len(able) - failed} agree and {failed} differ**" in text
    line = next(line for line in text.splitlines() if line.startswith("| a number that had"))
    assert line.endswith("| 4 | 4 | 0 | 0 |")
    section = next(line for line in text.splitlines() if line.startswith("| [Ball on a force"))
    assert section.endswith("| 0 | 1 | 7 | 0 |")


def test_the_commands_of_the_rows_are_there():
    for section, command in STUDIES.items():
        assert section in SECTIONS
        assert (ROOT / command.split()[1]).is_file()


def test_data_opens_with_units(finished):
    out, _, _ = finished
    data = xarray.open_dataset(out / "data" / "static_stiffness_stiffness.nc", engine="h5netcdf")
    assert data["deflection"].attrs["units"] == "m"


def test_a_finished_section_is_kept_and_a_broken_or_stale_one_is_not(finished, monkeypatch):
    out, rows, _ = finished
    computed: list[str] = []
    real = dict(SECTIONS)
    for name, (title, section) in real.items():

        def counted(plan, progress, name=name, section=section):
            computed.append(name)
            return section(plan, progress)

        monkeypatch.setitem(SECTIONS, name, (title, counted))

    def again(**options):
        computed.clear()
        result = validate(out, only=["static_stiffness"], plan=Plan.coarse(), **options)
        return result, list(computed)

    kept, done = again()
    assert done == []
    assert kept == rows[-3:]
    (out / "figures" / "static_stiffness_curves.png").unlink()
    assert again()[1] == ["static_stiffness"]
    for change in (
        "DELETE FROM results WHERE name = 'static_stiffness'",
        "UPDATE results SET fingerprint = '0' || fingerprint",
    ):
        with contextlib.closing(sqlite3.connect(out / FILE)) as database, database:
            database.execute(change)
        assert again()[1] == ["static_stiffness"]
    assert again()[1] == []
    assert again(fresh=True)[1] == ["static_stiffness"]


def test_the_plan_is_in_the_fingerprint_and_the_workers_are_not():
    assert fingerprint(Plan()) == fingerprint(Plan(workers=2))
    assert fingerprint(Plan()) != fingerprint(Plan.coarse())


def test_an_interrupted_run_keeps_what_is_finished(tmp_path, monkeypatch):
    def interrupted(plan, progress):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setitem(SECTIONS, "static_stiffness", ("Interrupted", interrupted))
        with pytest.raises(KeyboardInterrupt):
            validate(tmp_path, only=["force_plate", "static_stiffness"], plan=Plan.coarse())
    with contextlib.closing(sqlite3.connect(tmp_path / FILE)) as database:
        assert database.execute("SELECT name FROM results").fetchall() == [("force_plate",)]
    assert not (tmp_path / "report.md").exists()
    seen: list[str] = []
    rows = validate(
        tmp_path,
        only=["force_plate", "static_stiffness"],
        plan=Plan.coarse(),
        progress=lambda now: seen.append(now.task),
    )
    assert len(rows) == 11
    assert SECTIONS["force_plate"][0] not in seen


@pytest.mark.slow
def test_every_published_number_gets_a_row(tmp_path):
    plan = Plan(points=(5,), speeds=(18.0, 33.0), axis_step=0.14, forces=(1.0, 800.0))
    rows = validate(tmp_path, plan=plan)
    assert [row.published.key for row in rows] == [entry.key for entry in load_published()]
    verdicts = {row.published.key: row.verdict for row in rows}
    for racket in ("tour", "recreational"):
        for plane in ("in_plane", "out_of_plane"):
            assert verdicts[f"modes.{racket}.{plane}"] == "agrees"
            assert verdicts[f"modes.{racket}.{plane}.as_printed"] == "differs"
            assert verdicts[f"hammer.{racket}.{plane}"] == "agrees"
        for tension in ("low", "high"):
            assert verdicts[f"clamped.{racket}.{tension}.falls"] == "agrees"
            assert verdicts[f"clamped.{racket}.{tension}.rms"] == "not comparable"
        assert verdicts[f"free.{racket}.centre"] == "agrees"
        assert verdicts[f"grip.{racket}.centre"] == "agrees"


# ---- the command line


def cli(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "drake_racket.cli", "validate", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


def test_the_command_writes_the_report(tmp_path):
    done = cli("--out", str(tmp_path / "out"), "--only", "static_stiffness", "--coarse")
    assert done.returncode == 0, done.stderr
    assert "2 agrees" in done.stdout
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--only", "golf"], "force_plate"),
        (["--workers", "0"], "workers"),
        (["--out", "/dev/null/x"], "--out"),
        ([], "--out"),
    ],
)
def test_bad_options_are_one_line(arguments, said, tmp_path, monkeypatch, capfd):
    out = [] if arguments in ([], ["--out", "/dev/null/x"]) else ["--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", ["drake-racket", "validate", *arguments, *out])
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert said in line
    assert not (tmp_path / "out").exists()


def test_rows_of_frame_and_hand_say_which_could_hardly_fail():
    own = {entry.key: entry.own for entry in load_published() if entry.own}
    assert own["plate.kb_growth"] == "input"
    assert own["plate.closed_form"] == "closed form"
    assert not any(key.startswith(("hand.transfer", "shop", "places")) for key in own)


def test_shops_numbers_and_hands(tmp_path):
    rows = {row.published.key: row for row in validate(tmp_path, only=["frame_and_hand"])}
    assert all(row.verdict == "agrees" for row in rows.values() if row.published.own == "fit")
    for racket, kf in (("tour", 910.0), ("recreational", 1075.0)):
        assert rows[f"shop.{racket}.kf"].model == kf
        assert rows[f"shop.{racket}.kf"].verdict == "agrees"
        assert rows[f"hand.{racket}.grip"].verdict == "agrees"
    assert rows["shop.tour.mass"].model == pytest.approx(0.3089, abs=1e-4)
    assert rows["shop.tour.frequency"].model == pytest.approx(127.8, abs=0.05)
    assert rows["hand.transfer.frequency"].model < 0.88  # its node is farther from the hand
    assert -0.3 < rows["aside.tour.50"].model < rows["aside.tour.25"].model < -0.05
