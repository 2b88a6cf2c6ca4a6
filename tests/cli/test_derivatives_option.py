"""`drake-racket impact --derivatives`, as a user types it."""

from __future__ import annotations

import json

import pytest

import drake_racket as dr

SHORT = ("impact", "--after", "5ms", "--support", "grip", "--derivatives", "speed")


@pytest.mark.slow
def test_a_table_and_json(run_well):
    told = run_well(*SHORT, "--derivatives", "racket.head.mass")
    assert "racket.head.mass (per kg)" in told
    assert "peak hand force (N)" in told
    found = json.loads(run_well(*SHORT, "--json"))["derivatives"]
    result = dr.simulate(dr.Scenario(after=0.005, support="grip"), derivatives=["speed"])
    assert found["rebound_speed"]["speed"] == result.derivatives.of("rebound_speed", "speed")
    assert result.derivatives.units == ("m/s",)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--derivatives", "sped"), "speed"),
        (("--derivatives", "speed"), "each key once"),
        (("--engine", "drake"), "auto or compiled"),
    ],
)
def test_bad_requests_are_one_line(run, options, told):
    status, out, err = run(*SHORT, *options)
    assert (status, out) == (2, "")
    assert told in err
    assert len(err.strip().splitlines()) == 1
