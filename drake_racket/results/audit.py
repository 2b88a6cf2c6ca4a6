"""Balances energy and momentum at an instant of a user's own simulation in Drake."""

from __future__ import annotations

from typing import Any

from pydrake.systems.framework import Context

from drake_racket.engines.drake.mechanism import Parts, mechanism_of
from drake_racket.engines.drake.observe import Observer
from drake_racket.engines.trajectory import Trajectory
from drake_racket.io.errors import InputError
from drake_racket.limbs.striking import StrikingLimb
from drake_racket.plant.compose import Impact
from drake_racket.results.energy import Balance, balances


def balance(
    impact: Impact,
    meter: Any,
    root: Context,
    *,
    held: bool,
    limb: StrikingLimb | None = None,
) -> Balance:
    """Gives the balance of one racket and one ball at the state of `root`.

    Of a discrete plant with the velocities of that instant, half-way to those of its next step.

    Args:
        impact: of the racket and the ball.
        meter: the EnergyMeter of the impact; its totals are what is lost so far.
        root: the Context of the Diagram that holds them.
        held: the racket is welded to the world; its rigid motion then counts as bending.
        limb: that holds the racket.

    Raises:
        InputError: the impact has no ball.

    """
    if impact.ball is None or impact.contact is None:
        raise InputError("balance: impact", "without a ball", "an impact with a ball")
    parts = Parts(impact, meter, limb=limb)
    discrete = impact.racket.plant.time_step() > 0.0
    observer = Observer(parts, root.Clone() if discrete else root)
    row = observer.state()
    if discrete:
        observer.bring_to_time(row[None], observer.ahead(), given=False)
        observer.set_state(row)
    time, contact, state, record, element, totals = observer.states(row[None])
    trajectory = Trajectory(
        mechanism=mechanism_of(parts, root),
        time=time,
        state=state,
        record=record,
        totals=totals,
        contact=contact,
        motion=observer.motion([0], [observer.moving()], state),
        steps=0,
        evaluations=0,
        element=element,
    )
    return balances(trajectory, held=held).at(0)
