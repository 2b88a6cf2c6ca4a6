"""Assignments of the string springs: the symmetries, the criterion, and unfinished runs."""

from __future__ import annotations

import dataclasses
import sqlite3
from contextlib import closing

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket.io.errors import InputError
from drake_racket.parameters.racket import load_racket
from drake_racket.plant.string_bed import string_bed_model
from studies.spring_assignment import scores
from studies.spring_assignment.assignments import (
    GROUPINGS,
    RIM,
    SpringAssignment,
    all_assignments,
    assignment_of,
    geometric_factors,
)
from studies.spring_assignment.figures import assignment_figure
from studies.spring_assignment.ranking import (
    assignment_at,
    firmness,
    rank_all,
    shares,
    shortlist,
    vary,
)
from tests.conftest import BEDS, clamped_problem
from tests.oracles.clamped_impact import simulate as oracle

SHIPPED = assignment_of(load_racket())
OTHER = SpringAssignment("side mains share", (1, 3, 2, 4), (2, 5, 1, 1, 6, 3, 4))


@st.composite
def assignments(draw):
    grouping = draw(st.sampled_from(list(GROUPINGS)))
    numbers = draw(st.permutations(range(1, 7)))
    p = [0] * len(RIM)
    for number, members in zip(numbers, GROUPINGS[grouping], strict=True):
        for i in members:
            p[i] = number
    k = tuple(draw(st.permutations(range(1, 5))))
    return SpringAssignment(grouping, k, tuple(p))


def turned(springs, points, ends):
    """Springs of a bed seen in a mirror: points and ends renamed."""
    found = {}
    for name, formula in springs.items():
        a, b = name.split("-")
        a, b = points.get(a, ends.get(a, a)), points.get(b, b)
        if a.isdigit() and int(a) > int(b):
            a, b = b, a
        found[f"{a}-{b}"] = formula
    return found


LEFT_RIGHT = dict(zip("123456789", "321654987", strict=True)), {"left": "right", "right": "left"}
TIP_THROAT = dict(zip("123456789", "789456123", strict=True)), {"tip": "throat", "throat": "tip"}


@given(assignments())
@settings(max_examples=30, deadline=None)
def test_assignments_have_the_symmetries_and_use_every_parameter(found):
    springs = found.springs()
    assert turned(springs, *LEFT_RIGHT) == springs
    assert turned(springs, *TIP_THROAT) == found.mirrored().springs()
    assert found.mirrored() != found
    assert found.mirrored().mirrored() == found
    used = {part for formula in springs.values() for part in formula.split("*")}
    assert used == {f"k{i}" for i in range(1, 5)} | {f"p{i}" for i in range(1, 7)}
    # a rim spring has the k of the line that it ends
    for name, formula in springs.items():
        end, point = name.split("-")
        if end in ("left", "right"):
            inner = {"left": f"{point}-{int(point) + 1}", "right": f"{int(point) - 1}-{point}"}
        else:
            inner = {"tip": f"{point}-{int(point) + 3}", "throat": f"{int(point) - 3}-{point}"}
        if end in inner:
            assert formula.split("*")[1] == springs[inner[end]]


@pytest.mark.parametrize("grouping", list(GROUPINGS))
def test_all_assignments_are_there_once(grouping):
    found = list(all_assignments(grouping))
    assert len(found) == 24 * 720 // 2
    either = {a.label() for a in found} | {a.mirrored().label() for a in found}
    assert len(either) == 24 * 720


def test_the_shipped_rackets_have_one_assignment(bed):
    racket = load_racket(*bed)
    found = assignment_of(racket)
    assert found == SHIPPED
    spelled = {name: f.replace(" ", "") for name, f in racket.string_bed.springs.value.items()}
    assert found.springs() == spelled


def test_an_assignment_that_is_none_of_these_is_refused():
    racket = load_racket()
    springs = dataclasses.replace(
        racket.string_bed.springs, value={**racket.string_bed.springs.value, "1-4": "k1"}
    )
    bed = dataclasses.replace(racket.string_bed, springs=springs)
    with pytest.raises(InputError, match=r"string_bed\.springs"):
        assignment_of(dataclasses.replace(racket, string_bed=bed))
    with pytest.raises(InputError, match="grouping"):
        list(all_assignments("none"))


@pytest.fixture(scope="module")
def few():
    """Restitutions of four assignments at two speeds."""
    some = [SHIPPED, SHIPPED.mirrored(), OTHER, OTHER.mirrored()]
    return scores.restitutions(some, speeds=(18.0, 30.0))


def with_springs(problem, racket, assignment):
    """The oracle's problem with the springs' k by their formulas."""
    bed = racket.string_bed
    numbers = {f"k{i + 1}": k for i, k in enumerate(bed.stiffness.value)}
    numbers |= {f"p{i + 1}": p for i, p in enumerate(bed.rim_factors.value)}
    stiffness = [
        np.prod([numbers[part] for part in formula.split("*")])
        for formula in assignment.springs().values()
    ]
    return dataclasses.replace(problem, spring_k=np.array(stiffness))


def test_restitution_is_that_of_the_oracle(few):
    for row, bed, point, column, speed in ((0, 0, 1, 1, 30.0), (2, 3, 7, 0, 18.0)):
        problem = clamped_problem(*BEDS[bed], point, speed)
        racket, assignment = load_racket(*BEDS[bed]), (SHIPPED, None, OTHER)[row]
        expected = oracle(with_springs(problem, racket, assignment)).rebound_speed / speed
        at = scores.SIX_POINTS.index(point)
        assert few[row, bed, at, column] == pytest.approx(expected, abs=1.5e-5)


def test_turned_end_for_end_restitution_is_that_of_the_mirrored_points(few):
    tip_throat = [4, 5, 2, 3, 0, 1]
    assert few[1][:, tip_throat] == pytest.approx(few[0], abs=1e-12)
    assert few[3][:, tip_throat] == pytest.approx(few[2], abs=1e-12)
    assert scores.score(few)[::2] == pytest.approx(scores.score(few)[1::2], abs=1e-12)


def test_points_off_the_middle_tell_tip_from_throat():
    off, back = (scores.Setting("off", shift=d) for d in (5e-3, -5e-3))
    near = scores.restitutions([SHIPPED, SHIPPED.mirrored()], off)
    far = scores.restitutions([SHIPPED.mirrored()], back)
    assert scores.score(near)[0] == pytest.approx(scores.score(far)[0], abs=1e-12)
    assert abs(scores.score(near)[0] - scores.score(near)[1]) > 1e-5


def test_spread_is_over_nine_points(few):
    nine = few[:, :, [0, 1, 0, 2, 3, 2, 4, 5, 4]]
    deviation, extent = scores.spread(few)
    assert deviation == pytest.approx(nine.std(axis=2), rel=1e-9)
    assert extent == pytest.approx(nine.max(axis=2) - nine.min(axis=2), rel=1e-12)
    assert scores.score(few) == pytest.approx(nine.std(axis=2).mean(axis=(1, 2)), rel=1e-9)


def test_a_setting_as_shipped_has_the_shipped_lengths(bed):
    racket = load_racket(*bed)
    assert scores.DEFAULT.lengths(racket) == pytest.approx(string_bed_model(racket).lengths)


def test_factors_by_geometry_are_those_of_springs_of_one_string():
    racket = load_racket()  # rim 0.164 x 0.123 m, spacing 0.0685 m
    s, a, b = 0.0685, 0.164, 0.123
    across, along = a * np.sqrt(1 - (s / b) ** 2) - s, b * np.sqrt(1 - (s / a) ** 2) - s
    expected = [s / (a - s)] * 2 + [s / across] * 2 + [s / (b - s)] + [s / along] * 2
    assert geometric_factors(racket) == pytest.approx(expected)
    twins = scores.geometry_misfit([OTHER, OTHER.mirrored()])
    assert twins[0] == pytest.approx(twins[1], rel=1e-12)


def test_what_is_finished_is_not_computed_again(tmp_path, monkeypatch):
    monkeypatch.setattr(scores, "PART", 2)
    some = [SHIPPED, OTHER, OTHER.mirrored()]
    seen = []
    store = tmp_path / "parts.sqlite"
    first = scores.restitutions(
        some, store=store, progress=lambda now: seen.append((now.done, now.total))
    )
    assert seen == [(2, 3), (3, 3)]
    whole = scores.restitutions(some)
    assert np.array_equal(first, whole)
    calls = []
    run = scores.run
    monkeypatch.setattr(scores, "run", lambda *a, **k: calls.append(1) or run(*a, **k))
    # as if killed between the parts: the half that is there is taken from the disk
    with closing(sqlite3.connect(store)) as database, database:
        query = "DELETE FROM results WHERE name = (SELECT min(name) FROM results)"
        assert database.execute(query).rowcount == 1
    assert np.array_equal(scores.restitutions(some, store=store), first)
    assert len(calls) == 1
    scores.restitutions(some, scores.Setting("softer", stiffness=40e3), store=store)
    assert len(calls) == 3


@pytest.fixture(scope="module")
def ranked():
    """A ranking of a few, and two settings."""
    some = [a for n, a in enumerate(all_assignments(SHIPPED.grouping)) if n % 700 == 3]
    ranking = rank_all([*some, SHIPPED])
    positions = shortlist(ranking, best=4, others=4)
    chosen = (scores.DEFAULT, scores.Setting("softer", stiffness=35e3))
    return ranking, positions, vary(ranking, positions, settings=chosen)


def test_the_ranking_is_by_spread_and_knows_the_shipped(ranked):
    ranking, _, _ = ranked
    spread = ranking["spread"].to_numpy()
    assert (np.diff(spread) >= 0.0).all()
    assert ranking["shipped"].sum() == 1
    at = int(np.flatnonzero(ranking["shipped"])[0])
    assert at == 0  # of these
    assert assignment_at(ranking, at) == SHIPPED
    again = scores.restitutions([assignment_at(ranking, 5)])[0, ..., 0]
    assert ranking["restitution"].to_numpy()[5] == pytest.approx(again, abs=1e-12)
    for variable in ranking.data_vars.values():
        assert {"units", "long_name"} <= set(variable.attrs)
    with pytest.raises(InputError, match="shipped"):
        rank_all([OTHER])


def test_settings_are_compared_with_the_shipped_choice(ranked):
    ranking, positions, varied = ranked
    assert {0, 1, 2, 3} <= set(positions.tolist())
    firm = firmness(varied, best=4)
    own = firm.sel(setting=scores.DEFAULT.name)
    assert float(own["correlation_best"]) == pytest.approx(1.0)
    assert int(own["kept_of_ten"]) == min(10, len(positions))
    assert int(own["shipped_rank"]) == 1
    assert float(own["shipped_spread"]) != pytest.approx(float(firm["shipped_spread"][1]), rel=1e-3)
    e = varied["restitution"].sel(setting=scores.DEFAULT.name)
    nine = e[0].sel(point=[1, 2, 1, 4, 5, 4, 7, 8, 7]).mean(["point", "speed"])
    tour, recreational = ((nine[i + 1] - nine[i]).item() for i in (0, 2))
    assert float(varied["tension_effect"][0, 0]) == pytest.approx(max(tour, recreational))
    change = [e[0, i + 1] - e[0, i] for i in (0, 2)]
    share = np.mean([(c > 0.0).sel(point=[1, 2, 1, 4, 5, 4, 7, 8, 7]) for c in change])
    assert float(varied["faster_when_tight"][0, 0]) == pytest.approx(share)
    assert float(varied["matched"][0, 0]) == pytest.approx((nine[0] - nine[3]).item())
    assert float(varied["lowest_rebound"][0, 0]) == pytest.approx(18.0 * float(e[0, ..., 0].min()))
    assert float(varied["highest_rebound"][0, 0]) == pytest.approx(33.0 * float(e[0, ..., 2].max()))
    for key, changes in (("best", (1, 0)), ("others", (4, 1000))):
        with pytest.raises(InputError, match=key):
            shortlist(ranking, *changes)


def test_the_figure_shows_every_setting(ranked):
    ranking, _, varied = ranked
    figure = assignment_figure(ranking, firmness(varied, best=4))
    settings_panel = figure.axes[-1]
    shown = [label.get_text() for label in settings_panel.get_yticklabels()]
    assert shown == varied["setting"].to_numpy().tolist()
    assert len(settings_panel.texts) == len(shown)


def test_shares_count_the_best(ranked):
    by_k, by_p = shares(ranked[0], 4)
    assert by_k.sum(axis=1) == pytest.approx(np.ones(4))
    assert by_p.sum(axis=1) == pytest.approx(np.ones(7))
    first_k, first_p = shares(ranked[0], 1)
    assert [int(np.argmax(row)) + 1 for row in first_k] == list(SHIPPED.k)
    assert [int(np.argmax(row)) + 1 for row in first_p] == list(SHIPPED.p)
