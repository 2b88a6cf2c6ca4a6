"""Numbers with their unit behind them."""

from __future__ import annotations

import math

import pytest

import drake_racket as dr
from drake_racket.cases.case import parse_scenario
from drake_racket.io.units import converted_to, measure

GOOD = [  # text, unit, value by hand
    ("320g", "kg", 0.320),
    ("11.3 oz", "kg", 11.3 * 28.349523125e-3),
    ("0.7lb", "kg", 0.7 * 0.45359237),
    ("33cm", "m", 0.33),
    ("330 mm", "m", 0.33),
    ("27in", "m", 0.6858),
    ("98in2", "m^2", 98 * 6.4516e-4),
    ("632 cm²", "m^2", 0.0632),
    ("320 kg·cm²", "kg*m^2", 0.0320),
    ("0.032 kg*m^2", "kg*m^2", 0.0320),
    ("24kg", "N", 235.3596),
    ("55lb", "N", 55 * 4.4482216152605),
    ("0.25kN", "N", 250.0),
    ("56mph", "m/s", 25.03424),
    ("108 km/h", "m/s", 30.0),
    ("300rpm", "rad/s", 10.0 * math.pi),
    ("90deg/s", "rad/s", math.pi / 2),
    ("0.5rad", "degrees", math.degrees(0.5)),
    ("17°", "degrees", 17.0),
    ("20ms", "s", 0.02),
    ("1e-3 m", "m", 1e-3),
    ("-.5 m", "m", -0.5),
    ("45kN/m", "N/m", 45e3),
    ("148 Hz", "Hz", 148.0),
]


@pytest.mark.parametrize(("text", "unit", "value"), GOOD)
def test_what_people_write(text, unit, value):
    assert measure("key", text, unit) == pytest.approx(value, rel=1e-14)


def test_without_a_unit():
    assert measure("key", 0.32, "kg") == 0.32
    assert measure("key", "25", "m/s", bare="") == 25.0
    assert measure("key", "320", "kg*m^2", bare="kg cm^2") == pytest.approx(0.0320)
    with pytest.raises(dr.InputError, match="a number with its unit"):
        measure("key", "25", "m/s")


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("25 kg", "m/s"),
        ("25m", "N"),
        ("1,5 m", "m"),
        ("5 5 m", "m"),
        ("nan m", "m"),
        ("1e999 m", "m"),
        ("", "m"),
        ("m", "m"),
        ("5 M", "m"),
        ("1 g", "N"),
        ("0x10 m", "m"),
    ],
)
def test_what_is_refused(text, unit):
    with pytest.raises(dr.InputError, match=r"key: got .*; allowed: a number with its unit"):
        measure("key", text, unit, bare="")


@pytest.mark.parametrize("value", [None, True, math.nan, math.inf, [1.0]])
def test_what_is_no_number(value):
    with pytest.raises(dr.InputError, match="a finite number"):
        measure("key", value, "m")


def test_a_unit_that_is_no_multiple():
    assert converted_to(1.0, "m", "kg") is None
    assert converted_to(2.0, "mm", "m") == 0.002


def test_scenarios_take_them():
    scenario = parse_scenario(
        "tension: 60lb\noffset_y: 20mm\nspeed: 67mph\nincidence_deg: 0.3rad\nafter: 20ms\n"
        "gravity: [0, 0, -1 g0]\nintegrator: {maximum_step: 0.1ms}\n"
        "overrides: {racket.head.mass: 170g, ball.stiffness_low: 46kN/m}\n"
    )
    assert scenario.offset_y == 0.02
    assert scenario.speed == pytest.approx(67 * 0.44704)
    assert scenario.incidence_deg == pytest.approx(math.degrees(0.3))
    assert scenario.after == 0.02
    assert scenario.gravity == (0.0, 0.0, -9.80665)
    assert scenario.integrator.maximum_step == pytest.approx(1e-4)
    assert scenario.overrides == {"racket.head.mass": 0.17, "ball.stiffness_low": 46e3}
    racket = scenario.load_racket()
    assert racket.string_bed.stringing_tension.value == pytest.approx(60 * 4.4482216152605)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("speed: 25 kg", "scenario: speed: got '25 kg'; allowed: a finite number .m/s, km/h"),
        ("tension: 60mm", "tension: got '60mm'"),
        ("overrides: {racket.head.mass: 17cm}", "overrides.racket.head.mass: got '17cm'"),
        ("overrides: {racket.head.mas: 17g}", "overrides.racket.head.mas"),
        ("speed: 300mph", "scenario: speed: got 134.112"),
    ],
)
def test_scenarios_refuse(text, key):
    with pytest.raises(dr.InputError, match=key):
        parse_scenario(text + "\n")
