"""`drake-racket compare`: what it takes, refuses and prints."""

from __future__ import annotations

import dataclasses
import json

import pytest

import drake_racket as dr
from drake_racket.compare import spread
from tests.compare.test_compare import made


@pytest.fixture
def quick(monkeypatch):
    """No impacts: what is asked for is kept."""
    asked = []

    def assess(racket, *, base, swing, progress):
        asked.append((racket, base, swing))
        found = made(racket.name, {}, mass=0.3 + 0.01 * len(asked))
        nominal = dataclasses.replace(found.nominal, racket=racket)
        return dataclasses.replace(found, nominal=nominal)

    monkeypatch.setattr(spread, "assess_with_spread", assess)
    return asked


def test_table_page_and_json(run_well, quick, tmp_path):
    out = run_well("compare", "tour", "recreational", "--out", str(tmp_path / "cmp"))
    assert "recreational_low less first" in out
    assert "+10.0" in out
    assert f"wrote {tmp_path / 'cmp' / 'compare.html'}" in out
    rows = json.loads(run_well("compare", "tour", "recreational", "--json"))
    assert rows[0]["unit"] == "kg"
    assert rows[0]["recreational_low"]["difference"] == pytest.approx(0.01)


def test_numbers_with_units(run_well, quick):
    run_well(
        *("compare", "tour", "recreational", "--tension", "60lb", "--speed", "56mph"),
        *("--swing", "300rpm", "--pivot", "10in", "--ball-speed", "36km/h"),
    )
    racket, base, swing = quick[0]
    assert racket.string_bed.stringing_tension.value == pytest.approx(266.893, abs=1e-3)
    assert base.speed == pytest.approx(25.03, abs=0.01)
    assert swing.rate == pytest.approx(31.4159, abs=1e-3)
    assert swing.pivot == pytest.approx(0.254)
    assert swing.ball_speed == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("tour",), "2 to 6"),
        (("tour", "tour"), "each racket once"),
        (("tour", "none"), "recreational or a path ending in .yaml"),
        (("tour", "recreational", "--swing", "fast"), "got 'fast'; allowed: a number"),
        (("tour", "recreational", "--swing", "5000"), "swing: rate"),
        (("tour", "recreational", "--speed", "3kg"), "m/s, km/h, mph"),
        (("tour", "recreational", "--ball", "golf"), "penn_titanium"),
    ],
)
def test_refused(run, quick, arguments, text):
    status, out, err = run("compare", *arguments)
    assert (status, out) == (2, "")
    assert text in err
    assert len(err.splitlines()) == 1
    assert quick == []


def test_a_ball_of_ones_own(run_well, quick, tmp_path):
    ball = dataclasses.replace(dr.load_ball(), name="mine")
    dr.write_ball(ball, tmp_path / "ball.yaml")
    run_well("compare", "tour", "recreational", "--ball", str(tmp_path / "ball.yaml"))
    assert quick[0][1].ball == str(tmp_path / "ball.yaml")
