"""Numbers as text, and results as JSON."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from drake_racket.io.numbers import as_number, json_data, json_text


@pytest.mark.parametrize(
    ("text", "number"), [("1.5", 1.5), ("-2e3", -2000.0), ("1_0", None), (" 1", None), ("x", None)]
)
def test_text_that_is_a_number(text, number):
    assert as_number(text) == number


def test_what_is_not_finite_is_null():
    data = {"a": math.nan, "b": [1.0, math.inf], "c": 2, "d": "nan", "e": None}
    assert json_data(data) == {"a": None, "b": [1.0, None], "c": 2, "d": "nan", "e": None}
    assert json.loads(json_text({"x": np.float64(0.5)})) == {"x": 0.5}
    assert json_text({"x": 1}) == '{\n "x": 1\n}\n'
