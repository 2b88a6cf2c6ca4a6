"""Tangents written from a law's source, against its partial derivatives by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_racket.engines.compiled.tangents.forward import Tangents
from drake_racket.engines.compiled.tangents.kinds import NUMBER, NotDifferentiable, array
from drake_racket.engines.compiled.tangents.lanes import LANES, load, store
from drake_racket.laws.compilation import HAS_NUMBA, compilable, compiled
from drake_racket.laws.contact import contact_law, contact_partials
from drake_racket.laws.strings import spring_law, spring_partials

pytestmark = pytest.mark.skipif(not HAS_NUMBA, reason="lanes of compiled code")


@compilable
def _all_rules(x, y, table, n):
    """Has each thing that a law may hold."""
    a, b = math.sin(x) * math.exp(-y), math.cos(y) ** 2
    total = 0.0
    for i in range(n):
        total += table[i, 0] * a - table[i, 1] / b
    if x > y:
        total = max(total, x) + min(x, 2.0)
    else:
        total -= abs(y) + math.sqrt(x * x + 1.0) ** 3
    k = 0
    while k < n:
        row = table[k]
        row[2] += total * (x if k > 0 else y)
        k += 1
    pair = _two(total, math.atan2(y, x))
    return pair[0] - pair[1] + table[n - 1, 2]


@compilable
def _two(a, b):
    return (a * b, math.log(b + 10.0)) if a > b else (b, math.tanh(a))


def lanes_of(*slopes):
    out = np.zeros((len(slopes), LANES))
    for i, own in enumerate(slopes):
        out[i, : len(own)] = own
    return out


@pytest.mark.parametrize(("x", "y"), [(0.7, 0.2), (0.3, 1.1), (-0.4, 0.9)])
def test_every_rule_against_differences(x, y):
    twin = Tangents().of(_all_rules, NUMBER, NUMBER, array(2), None)

    def run(x, y, table, d_xy, d_table, out):
        value, lanes = twin(x, load(d_xy, 0), y, load(d_xy, 1), table, d_table, 2)
        store(out, lanes, 0)
        return value

    rng = np.random.default_rng(3)
    table = rng.normal(size=(2, 3))
    d_xy, d_table = lanes_of((1.0, 0.0, 0.3), (0.0, 1.0, -0.2)), np.zeros((2, 3, LANES))
    d_table[:, :, 2] = rng.normal(size=(2, 3))
    out, inner = np.zeros((1, LANES)), d_table.copy()
    value = compiled(run)(x, y, table.copy(), d_xy, inner, out)
    assert value == pytest.approx(_all_rules(x, y, table.copy(), 2), rel=1e-14)
    for lane in range(3):
        h = 1e-6
        plus, minus = (
            _all_rules(
                x + s * d_xy[0, lane], y + s * d_xy[1, lane], table + s * d_table[:, :, lane], 2
            )
            for s in (h, -h)
        )
        assert out[0, lane] == pytest.approx((plus - minus) / (2.0 * h), rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("by_displacement", [0.0, 1.0])
def test_contact_law_has_its_partials(by_displacement):
    constants = np.array([5e4, 15.0, 0.35, 1e-3, -2e-3, 0.02, by_displacement, 3e5, 40.0])
    p, v = (0.01, -0.004, -0.006), (3.0, -1.0, -4.0)
    three = ("tuple", (NUMBER,) * 3)
    twin = Tangents().of(contact_law, three, three, array(1))

    def run(p, v, constants, d_p, d_v, d_c, out):
        value, lanes = twin(
            p,
            (load(d_p, 0), load(d_p, 1), load(d_p, 2)),
            v,
            (load(d_v, 0), load(d_v, 1), load(d_v, 2)),
            constants,
            d_c,
        )
        for i in range(3):
            store(out, lanes[i], i)
        return value

    d_p, d_v, d_c, out = (np.zeros((n, LANES)) for n in (3, 3, 9, 3))
    d_p[0, 0] = d_v[0, 1] = d_v[2, 2] = d_c[2, 3] = 1.0  # by p_x, v_x, v_z and mu
    fx, fy, normal, _ = compiled(run)(p, v, constants, d_p, d_v, d_c, out)
    theirs = contact_partials(p, v, constants)
    assert (fx, fy, normal) == pytest.approx(theirs[:3], rel=1e-14)
    _, _, _, ux, uy, ex, ey, share = theirs
    slide = 0 if by_displacement else 1  # the lane of what the friction's direction is of
    assert out[:, slide] == pytest.approx([-share * (1 - ex * ex), share * ex * ey, 0.0], rel=1e-12)
    assert out[:, 1 - slide] == pytest.approx([0.0, 0.0, 0.0])
    by_rate = -15.0 - 40.0 * 0.006
    assert out[:, 2] == pytest.approx([by_rate * ux, by_rate * uy, by_rate], rel=1e-12)
    assert out[:, 3] == pytest.approx([fx / 0.35, fy / 0.35, 0.0], rel=1e-12)


def test_spring_law_has_its_partials():
    given = (0.006, 1.3, 2e5, 630.0, 0.0047, 2.0)
    twin = Tangents().of(spring_law, *(NUMBER,) * 6)

    def run(x, d, out):
        value, lanes = twin(
            x[0],
            load(d, 0),
            x[1],
            load(d, 1),
            x[2],
            load(d, 2),
            x[3],
            load(d, 3),
            x[4],
            load(d, 4),
            x[5],
            load(d, 5),
        )
        store(out, lanes[0] * value[1] + lanes[1] * value[0], 0)
        return value[0] * value[1]

    entry = compiled(run)
    expected = spring_partials(*given)
    found = []
    for first in (0, 3):
        d, out = np.zeros((6, LANES)), np.zeros((1, LANES))
        for lane in range(3):
            d[first + lane, lane] = 1.0
        assert entry(np.array(given), d, out) == pytest.approx(expected[0], rel=1e-14)
        found += list(out[0, :3])
    assert found == pytest.approx(list(expected[1:]), rel=1e-11)


@compilable
def _with_list(x):
    return [x, x][0]


@compilable
def _two_kinds(x, n):
    a = x
    if n > 0:
        a = (x, x)
    return a


@pytest.mark.parametrize(("law", "told"), [(_with_list, "_with_list"), (_two_kinds, "one name")])
def test_what_is_not_known_is_refused_by_name(law, told):
    kinds = (NUMBER, None)[: law.__code__.co_argcount]
    with pytest.raises(NotDifferentiable, match=told):
        Tangents().of(law, *kinds)
