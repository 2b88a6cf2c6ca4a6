"""What a contact's events do to its record, and what a run counts: small functions, as Python."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drake_racket import IntegratorSettings, Scenario, make_impact_diagram, resolve, run_drake
from drake_racket.engines.compiled import engine as engine_module
from drake_racket.engines.compiled import integrate as run
from drake_racket.engines.compiled.dynamics import events, observe, surface
from drake_racket.engines.compiled.engine import CompiledImpact, Samples, blank_records
from drake_racket.laws.contact import CONTACT, FREE, PASSED
from drake_racket.laws.phases import CB, CONSTANTS, GIVEN_UP, KB, PHASE, POINT, RELEASE, SIZE, TOUCH
from drake_racket.laws.surface import GRIPS, KT, NEARLY, SINCE, SLID, SURFACE_SIZE

STIFF = {"ball.mass": 0.0116, "ball.stiffness_low": 4.5e5}
SHORT = Scenario(
    approach_time=3e-5, after=3e-4, support="clamped_head", overrides=STIFF, offset_x=0.02,
    incidence_deg=20.0, integrator=IntegratorSettings(accuracy=1e-2),
)  # fmt: skip


def start_of(scenario):
    case = resolve(scenario)
    engine = CompiledImpact(make_impact_diagram(case))
    return engine.model.ints, engine.start(case)


@pytest.fixture(scope="module")
def paper():
    return start_of(SHORT)


@pytest.fixture(scope="module")
def spinning():
    return start_of(dataclasses.replace(SHORT, contact="surface", spin_rpm=-1500.0))


@pytest.mark.parametrize("controlled", [True, False])
@pytest.mark.parametrize("which", ["paper", "spinning"])
def test_a_run_counts_what_it_evaluates(which, controlled, request, monkeypatch):
    """In contact with friction taken implicitly, in free flight and while events are sought."""
    ints, start = request.getfixturevalue(which)
    done = [0, 0]

    def counted(name, law):
        def call(*arguments):
            done[name] += 1
            return law(*arguments)

        return call

    monkeypatch.setattr(run, "rates", counted(0, run.rates))
    monkeypatch.setattr(run, "take", counted(1, run.take))
    records = blank_records(ints)
    samples = np.empty((100, 1 + len(start.y)))
    sampled = np.empty((100, *records.shape))
    end, y = SHORT.approach_time + SHORT.after, start.y.copy()
    rest = (controlled, start.scale, samples, sampled)
    count, steps, evaluations, how = run.integrate(start.tables, y, records, end, 1e-2, 4e-5, *rest)
    assert how == run.FINISHED
    assert evaluations == done[0]
    assert count == steps + 1
    assert done[1] > steps  # some were taken again
    assert samples[0, 0] == 0.0
    assert samples[count - 1, 0] == end
    np.testing.assert_array_equal(samples[count - 1, 1:], y)
    np.testing.assert_array_equal(sampled[count - 1], records)
    lengths = np.diff(samples[:count, 0])
    assert np.all(lengths > 0.0)
    assert lengths.max() <= 4e-5 * (1.0 + 1e-9)
    if which == "paper":
        return  # as below, and slower
    room = samples[: count - 1], sampled[: count - 1]
    short = run.integrate(
        start.tables,
        start.y.copy(),
        blank_records(ints),
        end,
        1e-2,
        4e-5,
        controlled,
        start.scale,
        *room,
    )
    assert short[::3] == (count - 1, run.FULL)
    nothing = np.empty((0, samples.shape[1])), np.empty((0, *records.shape))
    again = start.y.copy()
    kept = run.integrate(
        start.tables, again, blank_records(ints), end, 1e-2, 4e-5, controlled, start.scale, *nothing
    )
    assert kept == (0, steps, evaluations, run.FINISHED)
    np.testing.assert_array_equal(again, y)


# the paper's contact

SPEED = CONSTANTS.start + 5  # of sliding, at which friction is near to its full size
NEAR = np.array([1e-3, 2e-3])
POINT_CASES = [
    # phase, height, its rate, what follows
    (FREE, 1e-6, -1.0, FREE),
    (FREE, -1e-6, -1.0, CONTACT),
    (FREE, 0.0, -1.0, CONTACT),
    (FREE, -1e-6, 1.0, PASSED),
    (PASSED, -1e-6, 1.0, PASSED),
    (PASSED, 0.0, 1.0, FREE),
    (CONTACT, -1e-3, -1.0, CONTACT),
    (CONTACT, -1e-3, 8.0, PASSED),  # 5e4 N/m times 1 mm less 8 N s/m times 8 m/s
    (CONTACT, 1e-3, 0.0, FREE),
]


def record_in(phase, size=SIZE):
    record = np.zeros((1, size))
    record[0, [PHASE, POINT, KB, CB]] = phase, 5.0, 5e4, 8.0
    record[0, [TOUCH, RELEASE]] = np.nan
    record[0, SPEED] = 0.02
    return record


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize(("phase", "height", "rate", "after"), POINT_CASES)
def test_a_contact_takes_the_phase_of_its_state(
    paper, monkeypatch, phase, height, rate, after, inside
):
    _, start = paper
    model, asked = start.tables, []
    p = np.array([*(NEAR if inside else 200.0 * NEAR), height])

    def look(model, i, records, w, leaves, choose):
        asked.append(choose)
        return 5, p, np.array([0.0, 0.0, rate])

    monkeypatch.setattr(events, "look", look)
    records = record_in(phase)
    before = records.copy()
    if after == CONTACT and not inside and phase == FREE:
        after = PASSED if height < 0.0 else FREE
    changed = events.update(model, 0, 0.25, start.y, records, None, None)
    assert records[0, PHASE] == after
    assert changed == (after != phase)
    assert asked == [phase != CONTACT]
    if after == CONTACT and phase == FREE:
        assert records[0, TOUCH] == 0.25
        assert records[0, POINT] == 5
    if phase == CONTACT and after != CONTACT:
        assert records[0, RELEASE] == 0.25
        assert records[0, GIVEN_UP] == pytest.approx(0.5 * 5e4 * height**2)
    if not changed:
        np.testing.assert_array_equal(records, before)


@pytest.mark.parametrize(
    ("phase", "rate", "inside", "after"),
    [
        (CONTACT, 1.0, True, PASSED),
        (PASSED, 1.0, True, FREE),
        (FREE, -1.0, True, CONTACT),
        (FREE, -1.0, False, PASSED),
        (FREE, 0.0, True, PASSED),
    ],
)
def test_an_event_changes_the_phase_whatever_the_last_digit_says(
    paper, monkeypatch, phase, rate, inside, after
):
    _, start = paper
    p = np.array([*(NEAR if inside else 200.0 * NEAR), -1e-9])
    seen = []

    def look(model, i, records, w, leaves, choose):
        seen.append((i, choose))
        return 5, p, np.array([0.0, 0.0, rate])

    monkeypatch.setattr(events, "look", look)
    records = record_in(phase)
    events.pass_event(start.tables, 0, 0.25, start.y, records, None, None)
    assert records[0, PHASE] == after
    assert seen == [(0, phase != CONTACT)]
    assert (records[0, TOUCH] == 0.25) == (after == CONTACT)
    assert (records[0, RELEASE] == 0.25) == (phase == CONTACT)


@pytest.mark.parametrize("point", range(1, 10))
def test_within_the_rim_is_told_about_the_point_that_is_hit(paper, point):
    """A ball at 0.999 and at 1.001 of the rim's ellipse, seen from any point."""
    _, start = paper
    racket = resolve(SHORT).racket
    bed = racket.string_bed
    rim = np.array([bed.rim_semi_axis_x.value, bed.rim_semi_axis_y.value])
    places = bed.spacing.value * racket.bed_topology().places
    for angle in np.linspace(0.1, 6.2, 7):
        on = rim * [np.cos(angle), np.sin(angle)]
        for share in (0.999, 1.001):
            p = np.array([*(share * on - places[point - 1]), 0.0])
            assert events._within_rim(start.tables, 0, point, p) == (share < 1.0)


@pytest.mark.parametrize(
    ("before", "after", "slope", "slope_after", "dips"),
    [
        (1.0, 1.0, -3.0, 3.0, True),  # tangents meet at -0.5
        (1.0, 1.0, -1.9, 1.9, False),  # at 0.05
        (1.0, 1.0, -2.0, 2.0, False),  # at 0
        (1.0, 1.9, -3.0, 3.0, True),  # at -0.05
        (1.0, 2.1, -3.0, 3.0, False),  # at 0.05
        (0.0, 1.0, -3.0, 3.0, False),
        (1.0, 0.0, -3.0, 3.0, False),
        (1.0, 1.0, 3.0, 3.0, False),
        (1.0, 1.0, -3.0, -3.0, False),
        (1.0, 1.0, -3.0, 0.0, False),
        (0.51, 1.0, -3.0, 1.2, False),  # at 2 / 7 of 0.51 - 0.5
        (0.49, 1.0, -3.0, 1.2, True),
    ],
)
def test_a_gap_dips_where_its_tangents_meet_below_zero(before, after, slope, slope_after, dips):
    gaps, slopes = (
        np.array([[9.0, before], [9.0, after]]),
        np.array([[0.0, slope], [0.0, slope_after]]) / 0.5,
    )
    assert events.dips(gaps, slopes, 1, 0.5) == dips


# contact surface


def made_up(found, monkeypatch):
    """The law and the gap of contact surface, as given."""
    moved = np.array([*NEAR, 0.03])
    monkeypatch.setattr(surface, "ball_in_head", lambda *_: (moved, np.zeros(3), np.zeros(3), None))
    law = np.zeros(11)
    law[2], law[8], law[10] = found
    monkeypatch.setattr(surface, "law_of", lambda *_: law)


def gripping(grips):
    record = record_in(CONTACT, SURFACE_SIZE)[0]
    record[[GRIPS, KT, SINCE, SLID]] = grips, 3e4, 0.1, 0.02
    return record


@pytest.mark.parametrize(
    ("normal", "spare", "done"),
    [
        (100.0, 1.0, ""),
        (100.0, -0.9 * NEARLY * 100.0, ""),
        (100.0, -1.1 * NEARLY * 100.0, "turns"),
        (1e-3, -1.1 * NEARLY * 1e-3, "turns"),
        (0.0, 1.0, "leaves"),
        (-1.0, -1.0, "leaves"),
    ],
)
@pytest.mark.parametrize("grips", [0.0, 1.0])
def test_contact_surface_turns_and_leaves_at_its_borders(
    spinning, monkeypatch, normal, spare, done, grips
):
    _, start = spinning
    made_up((normal, 2e-3, spare), monkeypatch)
    record, y = gripping(grips), start.y.copy()
    y[element(start)] = 1e-3
    before = record.copy()
    changed = surface.surface_update(start.tables, 0, 0.25, y, record, None, None)
    assert changed == bool(done)
    if not done:
        np.testing.assert_array_equal(record, before)
    elif done == "turns":
        assert record[PHASE] == CONTACT
        assert record[GRIPS] == 1.0 - grips
        assert record[SINCE] == 0.25
    else:
        left(record, grips)


def element(start):
    return int(start.tables[surface.at.CONTACT_ROWS][0, surface.at.ELEMENT])


def left(record, grips):
    """It has left with 2 mm of compression and 1 mm of shear."""
    assert (record[PHASE], record[RELEASE]) == (PASSED, 0.25)
    assert record[SLID] == pytest.approx(0.02 + (0.0 if grips else 0.15))
    assert record[GIVEN_UP] == pytest.approx(0.5 * 5e4 * 4e-6 + 0.5 * 3e4 * 1e-6)


@pytest.mark.parametrize(
    ("normal", "turning", "leaves"),
    [(1.001e-3, True, False), (0.999e-3, True, True), (100.0, False, True), (100.0, True, False)],
)
@pytest.mark.parametrize("grips", [0.0, 1.0])
def test_an_event_of_contact_surface_turns_it_unless_the_force_is_gone(
    spinning, monkeypatch, normal, turning, leaves, grips
):
    _, start = spinning
    made_up((normal, 2e-3, 0.0), monkeypatch)
    record, y = gripping(grips), start.y.copy()
    y[element(start)] = 1e-3
    surface.surface_event(start.tables, 0, turning, 0.25, y, record, None, None)
    if leaves:
        left(record, grips)
    else:
        assert record[PHASE] == CONTACT
        assert record[GRIPS] == 1.0 - grips


@pytest.mark.parametrize("event", [False, True])
@pytest.mark.parametrize(
    ("phase", "gap", "closing", "inside", "after"),
    [
        (FREE, -1e-9, 1.0, True, CONTACT),
        (FREE, -1e-9, 1.0, False, PASSED),
        (FREE, -1e-9, -1.0, True, PASSED),
        (PASSED, 1e-9, -1.0, True, FREE),
    ],
)
def test_contact_surface_begins_where_the_ball_comes_within_the_rim(
    spinning, monkeypatch, event, phase, gap, closing, inside, after
):
    _, start = spinning
    place = np.array([*(NEAR if inside else 200.0 * NEAR), 0.03])
    monkeypatch.setattr(surface, "ball_in_head", lambda *_: (place, np.zeros(3), np.zeros(3), None))
    monkeypatch.setattr(surface, "apart", lambda *_: (gap, closing, 5))
    touched = []
    monkeypatch.setattr(surface, "_touch", lambda *given: touched.append(given))
    record = record_in(phase, SURFACE_SIZE)[0]
    if event:
        surface.surface_event(start.tables, 0, False, 0.25, start.y, record, None, None)
    else:
        assert surface.surface_update(start.tables, 0, 0.25, start.y, record, None, None)
    assert len(touched) == (after == CONTACT)
    if after == CONTACT:
        assert touched[0][-3:-1] == (closing, 0.25)
    else:
        assert record[PHASE] == after


def test_what_is_watched_of_contact_surface(spinning, monkeypatch):
    """The normal force and what turns it; else the gap, exactly where the ball is near."""
    _, start = spinning
    made_up((7.0, 2e-3, 0.5), monkeypatch)
    watched = surface.surface_watched
    record = gripping(1.0)
    assert watched(start.tables, 0, start.y, record, None, None) == (7.0, 0.0, 0.5)
    record[PHASE] = FREE
    monkeypatch.setattr(surface, "apart", lambda *_: (1e-4, 3.0, 5))
    n = start.tables[surface.at.CONTACT_NUMBERS][0]
    for over, expected in ((0.0049, (1e-4, -3.0, 1.0)), (0.0051, (0.0051, -25.0, 1.0))):
        place = np.array([0.0, 0.0, n[surface.at.SURFACE] + over])
        speed = np.array([0.0, 0.0, -25.0])
        monkeypatch.setattr(
            surface, "ball_in_head", lambda *_, p=place, v=speed: (p, v, None, None)
        )
        found = watched(start.tables, 0, start.y, record, None, None)
        assert found == pytest.approx(expected, rel=1e-9)


# what is seen of a state

SEEN = {
    "hand": {"support": "grip"},
    "weld": {"support": "grip", "grip_kind": "weld"},
    "limb": {"support": "limb", "grip_kind": "torsional"},
    "limb, weld": {"support": "limb", "grip_kind": "weld"},
}


@pytest.mark.parametrize("name", SEEN)
def test_what_is_seen_of_the_first_state_is_drakes(name, monkeypatch):
    """Places, velocities, the sensor's acceleration, loads on the hand and in the joints."""
    case = resolve(
        Scenario(after=1e-4, approach_time=1e-5, gravity=(1.0, 2.0, -9.81), **SEEN[name])
    )
    system = make_impact_diagram(case)
    engine = CompiledImpact(system)
    monkeypatch.setattr(engine_module, "see_motion", observe.observe_motion)
    monkeypatch.setattr(engine_module, "see_contact", observe.observe_contact)
    start = engine.start(case)
    records = blank_records(engine.model.ints)[None]
    first = np.concatenate([[0.0], start.y])[None]
    ours = engine.trajectory(start, Samples(first, records, 0, 0))
    theirs = run_drake(case, system)
    np.testing.assert_allclose(ours.contact[0], theirs.contact[0], rtol=1e-9, atol=1e-12)
    seen = 0
    for field in dataclasses.fields(ours.motion):
        own, other = getattr(ours.motion, field.name), getattr(theirs.motion, field.name)
        assert (own is None) == (other is None), field.name
        if own is None or field.name == "samples":
            continue
        own, other = own[0], other[0]
        if (
            field.name == "poses"
        ):  # the world, and what it holds without mass, are not placed in Drake's
            placed = np.any(other != np.eye(3, 4), axis=(1, 2))
            assert placed.sum() > len(other) - 4
            own, other = own[placed], other[placed]
        size = np.max(np.abs(other))
        np.testing.assert_allclose(own, other, rtol=0, atol=1e-9 * size + 1e-10, err_msg=field.name)
        seen += bool(size > 0.0)
    assert seen >= 3
