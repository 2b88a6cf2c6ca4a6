"""What the commands of rackets, citations and examples print, line by line."""

from __future__ import annotations

import copy
import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace

import pytest

import drake_racket as dr
from drake_racket.cli import impact
from drake_racket.cli.rackets import files
from drake_racket.cli.show import _UNITS, _object
from tests.recorded import check_record

RECORDS = Path(__file__).parent / "records"
SHOP = ("--mass", "320g", "--balance", "33cm", "--swingweight", "320", "--head", "98in2")


def columns(lines: list[str]) -> list[str]:
    """Lines without the sources of numbers, which files have and may word anew."""
    return [line if len(line) < 100 else line[:88].rstrip() for line in lines]


@pytest.fixture(scope="module")
def mine(tmp_path_factory):
    racket = dr.racket_from_specs(
        "mine", mass="320g", balance="33cm", swingweight="320", head="98in2", ra="65", title="Mine"
    )
    path = tmp_path_factory.mktemp("rackets") / "mine.yaml"
    dr.write_racket(dr.add_mass(racket, "5.4321g", "20cm"), path)
    return path


def test_a_racket(run_well, mine):
    for name in ("tour", str(mine)):
        lines = run_well("show", name).splitlines()
        at = next(i for i, line in enumerate(lines) if line.startswith("parameter"))
        told = columns(lines[:at])
        told += [line[:90].rstrip() for line in lines[at:] if line.startswith(("frame", "string"))]
        told += [line.partition(":")[0] for line in lines if line.startswith("Inferred")]
        check_record(told, RECORDS / f"show_{Path(name).stem}.json")


def test_a_racket_in_numbers(run_well, mine):
    found = {}
    for name in ("tour", str(mine)):
        told = json.loads(run_well("show", name, "--json"))
        found[Path(name).stem] = {key: told[key] for key in _UNITS} | {
            "units": told["units"],
            "statuses": {k: s for k, s in told["statuses"].items() if "." not in k},
            "specs": list(told["specs"]),
            "added": told["added"],
            "notes": len(told["notes"]),
        }
    check_record(found, RECORDS / "show.json")


@pytest.mark.parametrize("added", [True, False])
@pytest.mark.parametrize("status", ["measured", "inferred"])
def test_statuses_of_numbers_that_lead_has_changed(added, status):
    """What was measured before the lead is calculated after it; what is guessed stays a guess."""
    racket = copy.copy(dr.load_racket())
    properties = dr.racket_properties(racket)
    specs = {key: replace_status(status) for key in ("mass", "twistweight", "frequency")}
    object.__setattr__(racket, "specs", specs)
    if added:
        object.__setattr__(racket, "added", dr.add_mass(dr.load_racket(), "5g", 3).added)
    found = _object(racket, properties)["statuses"]
    for key in ("mass", "twistweight"):
        assert found[key] == ("calculated" if added and status == "measured" else status)
    assert found["frequency_out_of_plane"] == status
    assert found["frequency_in_plane"] == found["balance"] == "calculated"


def replace_status(status):
    """A number of a shop with another status."""
    mine = dr.racket_from_specs(
        "mine", mass="320g", balance="33cm", swingweight="320", head="98in2", ra="65"
    )
    return dataclasses.replace(mine.specs["mass"], status=status)


def test_lead_and_what_it_changes(run_well, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    out = run_well(
        *("customise", "tour", "--add", "10.06g@3", "--add", "2g@butt", "--static"),
        *("--target-mass", "330g", "--at", "12, 3+9", "--out", "a.yaml"),
    )
    again = run_well(
        *("customise", "tour", "--target-mass", "308.9g", "--static", "--name", "same")
    )
    check_record((out + again).splitlines(), RECORDS / "customise.json")


@pytest.mark.parametrize(
    ("option", "text", "said"),
    [
        ("mass", "0g", "more than 0"),
        ("twistweight", "-3", "more than 0"),
        ("mass", "330", "--target-mass: got '330'"),
    ],
)
def test_targets_that_are_none(run, option, text, said, tmp_path):
    status, _, err = run(
        "customise", "tour", f"--target-{option}", text, "--static", "--out", str(tmp_path)
    )
    assert status == 2
    assert said in err


def test_a_shops_racket(run_well, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lines = run_well("new", "mine", *SHOP, "--tension", "24kg").splitlines()
    check_record(columns(lines), RECORDS / "new.json")


def test_many_rackets_say_what_is_safe_once(run_well, tmp_path):
    table = tmp_path / "shop.csv"
    table.write_text("Model,mass (g),balance (cm),swingweight,head (in2),RA\n"
                     "A,320,33,320,98,65\nB,310,32,315,100,63\n")  # fmt: skip
    out = run_well("new", "--table", str(table), "--out", str(tmp_path / "out")).splitlines()
    assert [Path(line.removeprefix("wrote ")).name for line in out[:2]] == ["a.yaml", "b.yaml"]
    first = dr.load_racket(tmp_path / "out" / "a.yaml")
    assert " ".join(out[2:]).split() == " ".join(first.notes[:2]).split()


@pytest.mark.parametrize(
    ("tension", "shown"), [("low", "low"), ("high", "high"), ("250.5", "250.5"), ("25kg", "245.16")]
)
def test_tensions_of_stringing(tension, shown):
    assert files.stringing(tension).startswith(shown)


@pytest.mark.parametrize(("name", "file"), [("a.yaml", True), ("a.yml", True), ("a.y", False)])
def test_what_is_a_file(name, file):
    assert files.is_file(Path(name)) == file


def test_citations(run_well):
    for arguments in ((), ("--racket", "tour"), ("backhand",)):
        lines = run_well("cite", *arguments).splitlines()
        counts = [line.rpartition(" [")[2] for line in lines if line.endswith("numbers]")]
        assert bool(counts) == bool(arguments)
        assert ("With a scenario file" in lines[-1]) == (not arguments)
        found = json.loads(run_well("cite", *arguments, "--json"))
        assert counts == [f"{len(c['numbers'])} numbers]" for c in found if c["numbers"]]
        bibtex = run_well("cite", *arguments, "--bibtex")
        assert bibtex.count("\n@") + 1 == sum(c["reference"] is not None for c in found)
        others = [c for c in found if c["reference"] is None]
        assert bibtex.count("\n% ") == len(others)
        for other in others:
            assert f"({len(other['numbers'])} numbers)" in bibtex


def test_examples(run_well, tmp_path):
    lines = run_well("examples", str(tmp_path)).splitlines()
    wrote = [Path(line.removeprefix("wrote ")).name for line in lines if line.startswith("wrote ")]
    files_there = sorted(path.name for path in tmp_path.iterdir() if path.is_file())
    assert wrote[:-1] == files_there
    count = len(list(tmp_path.glob("studies/**/*.py")))
    assert wrote[-1] == f"studies ({count} files)"
    assert not {"published.yaml", "references.yaml"} & set(files_there)
    assert not list(tmp_path.rglob("test_*")) + list(tmp_path.rglob("conftest.py"))
    suffixes = {path.suffix for path in tmp_path.rglob("*") if path.is_file()}
    assert suffixes == {".py", ".csv", ".yaml"} & suffixes >= {".py", ".yaml"}


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"point": "auto", "support": "grip", "incidence_deg": 17.0},
        {"point": "8", "support": "clamped_handle", "contact": "surface", "racket": "recreational"},
        {"support": "grip", "grip_kind": "weld"},
        {"support": "limb"},
    ],
)
def test_an_impacts_lines(changes, capsys, monkeypatch):
    rows = [("restitution", "0.4"), ("contact time", "4 ms")]
    monkeypatch.setattr("drake_racket.results.summary.summary_rows", lambda result: rows)
    result = SimpleNamespace(
        scenario=dr.Scenario(speed=24.987654, **changes), derivatives=None, warnings=["[deep]"]
    )
    impact._print_summary(result, [Path("out/a.nc")])
    name = "_".join(str(v) for v in changes.values()) or "plain"
    check_record(capsys.readouterr().out.splitlines(), RECORDS / f"impact_{name}.json")


@pytest.mark.parametrize(
    ("text", "found"),
    [(None, ["nc", "csv"]), ("nc", ["nc"]), ("sto, nc,sto", ["sto", "nc"])],
)
def test_formats(text, found):
    assert impact._history_formats(text) == found


@pytest.mark.parametrize("engine", ["drake", "compiled"])
@pytest.mark.parametrize("slow", ["", "about 1 step"])
def test_what_a_slow_impact_says_first(engine, slow, capsys, monkeypatch):
    from drake_racket.io.progress import Progress

    asked = []

    def simulate(case, **more):
        asked.append(sorted(more))
        if "progress" in more:
            more["progress"](Progress("running", 1.234, 30.0))
        return "result"

    monkeypatch.setattr(
        "drake_racket.cases.effort.effort", lambda case: SimpleNamespace(slow=lambda: slow)
    )
    monkeypatch.setattr("drake_racket.cases.effort.unstable", lambda case: "too long a step")
    monkeypatch.setattr("drake_racket.simulation.simulate", simulate)
    case = dataclasses.replace(dr.resolve(dr.Scenario()), scenario=dr.Scenario(engine=engine))
    assert impact._simulated(case, None) == "result"
    assert impact._simulated(case, ["speed"]) == "result"
    assert asked == [["progress"] if slow else [], ["derivatives"]]
    said = capsys.readouterr().err.splitlines()
    assert said[: 1 + bool(slow)] == [
        f"drake-racket: {text}" for text in (slow, "too long a step") if text
    ]
    assert said[1 + bool(slow) :] == ["drake-racket: running: 1.2 of 30 ms"] * bool(slow)
