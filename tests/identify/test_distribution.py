"""Calibration of a frame's distribution: what comes back, what stays open, what is refused."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from drake_racket import InputError, load_racket, racket_properties
from drake_racket.cli import main
from drake_racket.identify import MEASURED, fit_distribution, predictions
from drake_racket.identify.frame.distribution import UNKNOWN, _Start
from drake_racket.parameters.overrides import apply_overrides
from drake_racket.rigs.modes.modal_analysis import modal_system, solve_modes
from drake_racket.rigs.modes.shapes import exact_landmarks, mode_shapes

SHOP = ("mass", "balance", "swingweight", "twistweight", "frequency_out_of_plane")
MOVED = np.array([0.5, -0.4, 0.3, -0.3, 0.5, 0.3, 0.4, -0.5, 0.2, -0.3])


@pytest.fixture(scope="module")
def hidden():
    """A racket that the published one does not know, and what is measured of it."""
    racket = _Start(load_racket()).racket_at(MOVED)
    return racket, predictions(racket)


@pytest.fixture(scope="module")
def everything(hidden):
    return fit_distribution(load_racket(), hidden[1])


def test_predictions_are_those_of_the_plant():
    racket = apply_overrides(
        load_racket("recreational"),
        {"racket.frame.segments": 12, "racket.frame.density": 0.3},
    )
    model = predictions(racket)
    has = racket_properties(racket)
    for name in ("mass", "balance", "swingweight", "twistweight"):
        assert model[name] == pytest.approx(getattr(has, name), rel=1e-9)
    assert model["frequency_in_plane"] == pytest.approx(has.in_plane_frequency, rel=1e-6)
    modes = solve_modes(modal_system(racket, strung=False))
    own = [i for i, kind in enumerate(modes.kinds) if kind == "out_of_plane"]
    assert model["second_frequency"] == pytest.approx(modes.frequencies[own[1]], rel=1e-6)
    shapes = mode_shapes(modes)
    marks = exact_landmarks(shapes.corners[own[0], 1], shapes.places)
    assert (model["node_handle"], model["node_head"]) == pytest.approx(marks.nodes, abs=1e-6)
    assert model["antinode_out_of_plane"] == pytest.approx(marks.antinode, abs=0.01)
    clamped = solve_modes(modal_system(racket, strung=False, support="clamped_handle"))
    first = clamped.frequencies[clamped.bending("out_of_plane")]
    assert model["clamped_frequency"] == pytest.approx(first, rel=1e-6)


def test_a_broader_head_twists_as_its_square():
    """Its breadth leaves mass, balance and swingweight alone."""
    start = _Start(load_racket())
    plain, broad = (predictions(start.racket_at(np.eye(len(UNKNOWN))[4] * x)) for x in (0.0, 1.0))
    head = load_racket().head
    yy = 0.5 * (head.moi_longitudinal.value + head.moi_frontal.value - head.moi_transverse.value)
    more = (np.exp(2.0 * UNKNOWN["head_breadth"][1]) - 1.0) * yy
    assert broad["twistweight"] - plain["twistweight"] == pytest.approx(more, rel=1e-9)
    for name in ("mass", "balance", "swingweight", "second_frequency"):
        assert broad[name] == pytest.approx(plain[name], rel=1e-9)


def test_a_hidden_frame_comes_back(hidden, everything):
    """Within two standard deviations, and the model meets every measurement."""
    start = _Start(load_racket())
    for (name, number), x in zip(everything.numbers.items(), MOVED, strict=True):
        assert number.known(), name
        assert abs(number.value - start.value(name, x)) < 2.0 * number.sd, name
        assert number.sd < 0.35 * number.before, name
    for value, sd, model in everything.measured.values():
        assert abs(model - value) < sd
    assert everything.open() == ()
    assert everything.racket.frame.count() == 6
    own = everything.fields()["density"]
    assert own.interval[0] < 0.65 < own.interval[1]


def test_usual_errors_are_those_that_were_stated():
    """What a measurement is taken to be good for where its user does not say."""
    usual = {name: error for name, (_, error, _) in MEASURED.items()}
    hertz = dict.fromkeys(
        ("frequency_in_plane", "frequency_out_of_plane", "clamped_frequency"), 1.0
    )
    places = dict.fromkeys(("node_handle", "node_head"), 0.003)
    places |= dict.fromkeys(("antinode_in_plane", "antinode_out_of_plane"), 0.005)
    scales = {"mass": 0.001, "balance": 0.001, "swingweight": 5e-5, "twistweight": 1e-5}
    assert usual == hertz | places | scales | {"second_frequency": 4.0}


def test_what_decides_what(everything):
    leans = {name: next(iter(number.leans_on)) for name, number in everything.numbers.items()}
    assert leans["head_breadth"] == "twistweight"
    assert leans["density"] == "second_frequency"
    assert leans["taper_in_plane"] == "antinode_in_plane"
    assert leans["frequency_in_plane"] == "frequency_in_plane"
    assert everything.families["A"] > 50.0  # neither family alone meets all


@pytest.mark.slow
def test_a_shops_numbers_leave_the_distribution_open(hidden):
    shop = fit_distribution(load_racket(), {name: hidden[1][name] for name in SHOP})
    assert {"density", "taper_in_plane", "taper_out_of_plane"} <= set(shop.open())
    assert shop.numbers["density"].share < 0.5
    assert shop.numbers["taper_in_plane"].share == pytest.approx(0.0, abs=1e-6)
    assert max(shop.families.values()) < 1.0  # both families meet a shop's numbers
    more = fit_distribution(
        load_racket(), {name: hidden[1][name] for name in (*SHOP, "second_frequency")}
    )
    assert more.numbers["density"].known()
    assert more.families["A"] > 10.0


@pytest.mark.slow
def test_a_wide_measurement_says_less(hidden):
    values = {name: hidden[1][name] for name in SHOP}
    wide = fit_distribution(load_racket(), values | {"second_frequency": (420.0, 100.0)})
    assert not wide.numbers["density"].known()


@pytest.mark.parametrize(
    ("measured", "message"),
    [
        ({}, "measured: got 'nothing'"),
        ({"weight": 0.3}, "measured.weight: got 'an unknown measurement'; allowed: mass, balance"),
        ({"mass": -1.0}, "measured.mass: got -1.0; allowed: more than 0 kg"),
        ({"mass": (0.3, 0.0)}, "a standard deviation above 0 kg"),
        (
            {"frequency_out_of_plane": 130.0, "second_frequency": 120.0},
            "measured.second_frequency: got 120.0; allowed: more than the fundamental, 130 Hz",
        ),
    ],
)
def test_bad_measurements_are_refused_on_one_line(measured, message):
    with pytest.raises(InputError, match=message) as caught:
        fit_distribution(load_racket(), measured)
    assert "\n" not in str(caught.value)


def test_the_command(tmp_path, monkeypatch, capsys):
    out = tmp_path / "mine"
    words = ["identify", "distribution", "--out", str(out), "--name", "mine"]
    words += ["--measured", "mass=315g", "--measured", "second_frequency=420Hz+-5Hz"]
    words += ["--measured", "frequency_out_of_plane=129Hz"]
    monkeypatch.setattr("sys.argv", ["drake-racket", *words])
    assert main() in (None, 0)
    assert "not determined" in capsys.readouterr().out
    made = load_racket(str(out / "mine.yaml"))
    assert made.frame.count() == 6
    assert made.frame.frequency_out_of_plane.value == pytest.approx(129.0, abs=1.0)
    table = list(csv.DictReader((out / "numbers.csv").open()))
    assert [row["number"] for row in table] == list(UNKNOWN)
    assert {"without_mass", "without_second_frequency"} <= set(table[0])
    assert len(MEASURED) == 12
