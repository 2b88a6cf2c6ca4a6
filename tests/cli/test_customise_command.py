"""`drake-racket customise`: lead in, a table and a file out."""

from __future__ import annotations

import json

import pytest

import drake_racket as dr
from drake_racket.compare import assessment
from tests.compare.test_compare import made


def test_masses_a_table_and_a_file(run_well, tmp_path, monkeypatch):
    asked = []

    def assess(racket, *, base, progress):
        asked.append((racket, base))
        return made(racket.name, {}, restitution_5=0.40 + 0.01 * len(asked)).nominal

    monkeypatch.setattr(assessment, "assess", assess)
    path = tmp_path / "heavy.yaml"
    out = run_well(
        *("customise", "tour", "--add", "10g@3", "--add", "10g@9", "--tension", "70lb"),
        *("--name", "heavy", "--out", str(path)),
    )
    assert "added 10 g at 3 o'clock" in out
    row = next(line for line in out.splitlines() if "point 5" in line)
    assert row.split()[-3:] == ["0.410", "0.420", "+0.010"]
    new = dr.load_racket(path)
    assert new.name == "heavy"
    assert new.string_bed.stringing_tension.value == pytest.approx(311.375, abs=0.01)
    assert [racket.name for racket, _ in asked] == ["tour_311p376N", "heavy"]
    before = dr.racket_properties(asked[0][0])
    after = dr.racket_properties(new)
    assert after.twistweight - before.twistweight == pytest.approx(0.020 * 0.123**2, rel=1e-12)


def test_a_target_as_json(run_well, tmp_path):
    out = run_well(
        *("customise", "tour", "--target-swingweight", "350", "--target-balance", "33cm"),
        *("--static", "--json", "--out", str(tmp_path)),
    )
    found = json.loads(out)
    assert found["after"]["swingweight"] == pytest.approx(0.0350, rel=1e-12)
    assert found["after"]["balance"] == pytest.approx(0.33, rel=1e-12)
    assert found["units"]["swingweight"] == "kg*m^2"
    assert found["file"] == str(tmp_path / "tour_low_customised.yaml")
    assert {one["at"] for one in found["added"]} == {"butt", "12"}


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((), "--add: got 'nothing'"),
        (("--add", "5g"), "5g@3, 10g@butt"),
        (("--add", "5@3"), "mass: got '5'"),
        (("--add", "5g@0"), "an hour from 1 to 12"),
        (("--target-balance", "30"), "--target-balance: got '30'"),
        (("--target-swingweight", "200"), "swingweight is 338.8"),
        (("--add", "5g@3", "--at", "butt"), "together with a target"),
        (("--add", "5g@3", "--name", "two words"), "letters, digits and _"),
    ],
)
def test_refused(run, arguments, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, out, err = run("customise", "tour", *arguments)
    assert (status, out) == (2, "")
    assert text in err
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
