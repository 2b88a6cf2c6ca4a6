"""`drake-racket new` and `show --json`: a shop's numbers in, a racket out, and back."""

from __future__ import annotations

import json

import pytest

NUMBERS = ("--mass", "320g", "--balance", "33cm", "--swingweight", "320", "--head", "98in2")
SHOP = (*NUMBERS, "--twistweight", "14.2", "--ra", "65")


def test_new_and_show(run_well, tmp_path):
    out = run_well("new", "mine", *SHOP, "--title", "My racket", "--out", str(tmp_path))
    path = tmp_path / "mine.yaml"
    assert f"wrote {path}" in out
    for text in ("My racket", "measured", "inferred", "sd 3.4 %", "are safe", "are not"):
        assert text in out
    found = json.loads(run_well("show", str(path), "--json"))
    assert found["name"] == "mine"
    assert found["mass"] == pytest.approx(0.320, abs=1e-9)
    assert found["balance"] == pytest.approx(0.33, abs=1e-9)
    assert found["swingweight"] == pytest.approx(0.0320, abs=1e-10)
    assert found["twistweight"] == pytest.approx(0.00142, abs=1e-11)
    assert found["frequency_in_plane"] > found["frequency_out_of_plane"]
    assert found["units"]["swingweight"] == "kg*m^2"
    statuses = found["statuses"]
    assert statuses["mass"] == "measured"
    assert statuses["frequency_out_of_plane"] == "inferred"
    assert statuses["handle.mass"] == "inferred"
    assert found["specs"]["frequency"]["sd"] == pytest.approx(0.034 * 145.424, rel=1e-3)


def test_show_tells_what_a_racket_is_made_of(run_well, tmp_path):
    path = tmp_path / "mine.yaml"
    run_well("new", "mine", *SHOP, "--out", str(path))
    run_well(
        "customise", str(path), "--add", "5g@12", "--static", "--out", str(tmp_path / "b.yaml")
    )
    out = run_well("show", str(tmp_path / "b.yaml"))
    assert "Made of" in out
    assert "printed by the shop" in out
    assert "added: 5 g at 12" in out
    assert "Made of" not in run_well("show", "tour")


def test_a_shipped_racket_as_json(run_well):
    found = json.loads(run_well("show", "tour", "--json"))
    assert found["mass"] == pytest.approx(0.3089)
    assert found["frequency_out_of_plane"] == pytest.approx(128.54, abs=0.01)
    assert found["statuses"]["mass"] == "calculated"
    assert found["specs"] == {}


def test_new_writes_over_its_own_files_only(run, run_well, tmp_path):
    path = tmp_path / "mine.yaml"
    run_well("new", "mine", *SHOP, "--out", str(path))
    run_well("new", "mine", *SHOP, "--ra", "70", "--out", str(path))
    path.write_text("name: something of mine\n")
    status, out, err = run("new", "mine", *SHOP, "--out", str(path))
    assert (status, out) == (2, "")
    assert "one that new wrote" in err
    assert path.read_text() == "name: something of mine\n"


def test_a_table(run, run_well, tmp_path):
    table = tmp_path / "shop.csv"
    table.write_text("Model,Static (g),Balance (cm),SW,Head (in2),RA\nA 1,320,33,320,98,65\n")
    status, _, err = run("new", "--table", str(table), "--out", str(tmp_path / "out"))
    assert status == 2
    assert "--column mass=..." in err
    assert not (tmp_path / "out").exists()
    options = ("--table", str(table), "--column", "mass=Static", "--out", str(tmp_path / "out"))
    assert f"wrote {tmp_path / 'out' / 'a_1.yaml'}" in run_well("new", *options)


REFUSED = {
    "no name": (SHOP, "NAME: got 'nothing'"),
    "no number": (("mine", "--mass", "320g"), "balance: got 'nothing'"),
    "does not fit": (("mine", *SHOP, "--swingweight", "500"), "320 g balanced at 33 cm has"),
    "both": (("mine", "--table", "x.csv"), "--table: got 'mine'"),
    "table and numbers": (("--table", "x.csv", "--ra", "65"), "--table: got '--ra'"),
    "column alone": (("mine", *SHOP, "--column", "mass=x"), "together with --table"),
    "column": (("--table", "x.csv", "--column", "mass"), "mass=Weight"),
    "column of nothing": (("--table", "x.csv", "--column", "mass= "), "mass=Weight"),
    "a name": (("my racket", *SHOP), "letters, digits and _"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused_in_one_line(case, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    arguments, text = REFUSED[case]
    status, out, err = run("new", *arguments)
    assert (status, out) == (2, "")
    assert text in err
    assert len(err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
