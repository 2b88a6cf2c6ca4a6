"""Has the equations of a ball that spins on a bed whose head is clamped, and the loop over impacts.

The law is that of `laws.surface`. The ODE of `ode` with five states more behind its 2 n + 6: the
ball's angular velocity and the element u. With f = (F_x, F_y, N) at C, r below the centre, and I
the ball's moment of inertia:

    m_s z_i'' -= w_i N,    m_b p'' = f,    I omega' = (-r e_z) x f

Steps are Runge and Kutta's of order 4, cut at touch, release and the turns of gripping and sliding.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drake_racket.engines.clamped import ode
from drake_racket.engines.clamped.ode import rates
from drake_racket.laws import contact, phases, places, strings
from drake_racket.laws import surface as law
from drake_racket.laws.compilation import (
    compilable,
    compiled,
    makes_arrays,
    parallel_range,
    sources_stamp,
)
from drake_racket.laws.contact import CONTACT, FREE, PASSED
from drake_racket.laws.phases import PHASE, RELEASE, TOUCHES
from drake_racket.laws.places import met_weights
from drake_racket.laws.strings import spring_energy
from drake_racket.laws.surface import (
    POINT_0,
    SLID,
    SURFACE_SIZE,
    WEIGHT_0,
    round_place,
    surface_law,
    surface_release,
    surface_switch,
    surface_touch,
)

MORE = 5
"""States behind those of `ode`: three of spin, two of the element."""
LONGEST = 0.1  # s of motion, after which an impact is given up


@compilable
def _law(y: Any, record: Any) -> Any:
    """What `surface_law` says at a state."""
    n = (len(y) - MORE) // 2 - 3
    b = 2 * n
    z, rate = 0.0, 0.0
    for i in range(4):
        k = round_place(record[POINT_0 + i])
        z += record[WEIGHT_0 + i] * y[k]
        rate += record[WEIGHT_0 + i] * y[n + k]
    p, v = (y[b], y[b + 1], y[b + 2]), (y[b + 3], y[b + 4], y[b + 5])
    spin = (y[b + 6], y[b + 7], y[b + 8])
    return surface_law(p, v, spin, z, rate, y[b + 9], y[b + 10], record)


@compilable
def _rates(
    y: Any, record: Any, ends: Any, bed: Any, ball: Any, mass: Any, moment: Any, g: Any, f: Any
) -> None:
    """Writes y' into f; the arguments as of `ode.rates`."""
    plain = len(y) - MORE
    n = plain // 2 - 3
    b = 2 * n
    rates(y[:plain], False, 0, ends, bed, ball, mass, g, f[:plain])
    for i in range(MORE):
        f[plain + i] = 0.0
    if record[PHASE] != CONTACT:
        return
    found = _law(y, record)
    for i in range(3):
        f[b + 3 + i] = found[i] / mass[0]
    for i in range(4):
        f[n + round_place(record[POINT_0 + i])] -= record[WEIGHT_0 + i] * found[2] / mass[1]
    r = found[7]
    f[b + 6], f[b + 7] = r * found[1] / moment, -r * found[0] / moment
    f[b + 9], f[b + 10] = found[3], found[4]


@compilable
def _step(
    y: Any,
    h: float,
    record: Any,
    ends: Any,
    bed: Any,
    ball: Any,
    mass: Any,
    moment: Any,
    g: Any,
    w: Any,
    new: Any,
) -> None:
    """Takes one step from y into `new`; w (5, states) is work."""
    _rates(y, record, ends, bed, ball, mass, moment, g, w[0])
    for stage in range(1, 4):
        part = h if stage == 3 else 0.5 * h
        for i in range(len(y)):
            w[4, i] = y[i] + part * w[stage - 1, i]
        _rates(w[4], record, ends, bed, ball, mass, moment, g, w[stage])
    for i in range(len(y)):
        new[i] = y[i] + h / 6.0 * (w[0, i] + 2.0 * w[1, i] + 2.0 * w[2, i] + w[3, i])


@compilable
def _gap(y: Any, grid: Any, rim: Any, surface: Any) -> Any:
    """Gap (m) of a ball apart, and the rate (m/s) of compression."""
    n = (len(y) - MORE) // 2 - 3
    b = 2 * n
    points, weights, _ = met_weights(grid, rim, y[b], y[b + 1], surface[4])
    gap, rate = y[b + 2] - surface[0], -y[b + 5]
    for i in range(4):
        gap -= weights[i] * y[points[i]]
        rate += weights[i] * y[n + points[i]]
    return gap, rate


@compilable
def _watched(y: Any, record: Any, grid: Any, rim: Any, surface: Any) -> Any:
    """Two numbers, of which the first that falls through 0 is the next event."""
    if record[PHASE] == CONTACT:
        found = _law(y, record)
        return found[2], found[10]
    gap, _ = _gap(y, grid, rim, surface)
    return gap if record[PHASE] == FREE else -gap, 1.0


@compilable
def _touch(
    y: Any,
    record: Any,
    time: float,
    law_of_ball: Any,
    friction: Any,
    surface: Any,
    grid: Any,
    rim: Any,
) -> None:
    n = (len(y) - MORE) // 2 - 3
    b = 2 * n
    _, rate = _gap(y, grid, rim, surface)
    p, v = (y[b], y[b + 1], y[b + 2]), (y[b + 3], y[b + 4], y[b + 5])
    spin = (y[b + 6], y[b + 7], y[b + 8])
    surface_touch(record, p, v, spin, rate, time, law_of_ball, friction, surface, grid, rim)
    y[b + 9], y[b + 10] = 0.0, 0.0


@compilable
def _pass(
    y: Any,
    record: Any,
    turning: bool,
    time: float,
    law_of_ball: Any,
    friction: Any,
    surface: Any,
    grid: Any,
    rim: Any,
) -> None:
    """Takes the record through an event that was located."""
    n = (len(y) - MORE) // 2 - 3
    b = 2 * n
    if record[PHASE] == CONTACT:
        found = _law(y, record)
        if turning and found[2] > 1e-9:
            surface_switch(record, time)
            return
        surface_release(record, found[8], y[b + 9], y[b + 10], time)
        return
    inside = (y[b] / rim[0]) ** 2 + (y[b + 1] / rim[1]) ** 2 < 1.0
    if record[PHASE] == PASSED:
        record[PHASE] = FREE
    elif inside:
        _touch(y, record, time, law_of_ball, friction, surface, grid, rim)
    else:
        record[PHASE] = PASSED


@compilable
def _reach(y: Any, ends: Any, bed: Any, mass: Any, stiffness: Any) -> float:
    """How far (m) any string mass can come out."""
    n = (len(y) - MORE) // 2 - 3
    energy, least = 0.0, stiffness[0]
    for i in range(n):
        energy += 0.5 * mass[1] * y[n + i] * y[n + i]
        least = min(least, stiffness[i])
    for s in range(ends.shape[1]):
        dz = y[ends[0, s]]
        if ends[1, s] >= 0:
            dz -= y[ends[1, s]]
        energy += spring_energy(dz, bed[0, s], bed[1, s], bed[2, s])
    return float((2.0 * energy / least) ** 0.5)


@makes_arrays
def _impact(
    place: Any,
    velocity: Any,
    spin: Any,
    surface: Any,
    friction: Any,
    moment: float,
    law_of_ball: Any,
    grid: Any,
    rim: Any,
    ends: Any,
    bed: Any,
    mass: Any,
    stiffness: Any,
    h: float,
    out: Any,
) -> None:
    """One impact, from touch to where the ball is out of reach."""
    n = len(grid)
    size, b = 2 * n + 6 + MORE, 2 * n
    y, new, w, g = np.zeros(size), np.zeros(size), np.zeros((5, size)), np.zeros((7, ends.shape[1]))
    record, ball = np.zeros(SURFACE_SIZE), np.zeros(9)
    y[b], y[b + 1], y[b + 2] = place[0], place[1], surface[0]
    for i in range(3):
        y[b + 3 + i], y[b + 6 + i] = velocity[i], spin[i]
    _touch(y, record, 0.0, law_of_ball, friction, surface, grid, rim)
    time = 0.0
    while time < LONGEST:
        first, second = _watched(y, record, grid, rim, surface)
        _step(y, h, record, ends, bed, ball, mass, moment, g, w, new)
        one, two = _watched(new, record, grid, rim, surface)
        part, event = h, -1
        if first > 0.0 >= one or second > 0.0 >= two:
            low, high = 0.0, h
            # the first of both: an event lies before `high` while either number is not positive
            for _ in range(60):
                part = 0.5 * (low + high)
                _step(y, part, record, ends, bed, ball, mass, moment, g, w, new)
                one, two = _watched(new, record, grid, rim, surface)
                if (first > 0.0 >= one) or (second > 0.0 >= two):
                    high, event = part, 0 if first > 0.0 >= one else 1
                else:
                    low = part
                if high - low < 1e-15:
                    break
            part = high
            _step(y, part, record, ends, bed, ball, mass, moment, g, w, new)
        time += part
        for i in range(size):
            y[i] = new[i]
        if event >= 0:
            _pass(y, record, event == 1, time, law_of_ball, friction, surface, grid, rim)
            if record[PHASE] != CONTACT:
                for i in range(6):
                    out[i] = y[b + 3 + i]
        elif record[PHASE] == CONTACT and two < 0.0:
            surface_switch(record, time)
        leaves = record[PHASE] == FREE and y[b + 5] > 0.0
        if leaves and y[b + 2] - surface[0] > _reach(y, ends, bed, mass, stiffness):
            out[9] = 1.0
            break
    out[6], out[7], out[8] = record[RELEASE], record[SLID], record[TOUCHES]


def _batch(stamp: int) -> Any:
    """The compiled loop over impacts; `stamp` makes numba's cache see changes in the laws."""

    def run_batch(
        places: Any,
        velocities: Any,
        spins: Any,
        surfaces: Any,
        friction: Any,
        moment: float,
        law_of_ball: Any,
        grid: Any,
        rim: Any,
        ends: Any,
        bed: Any,
        mass: Any,
        stiffness: Any,
        h: float,
        out: Any,
    ) -> int:
        for m in parallel_range(len(places)):
            _impact(
                places[m],
                velocities[m],
                spins[m],
                surfaces[m],
                friction[m],
                moment,
                law_of_ball,
                grid,
                rim,
                ends,
                bed,
                mass,
                stiffness,
                h,
                out[m],
            )
        return stamp

    return compiled(run_batch, parallel=True)


run_surface_batch = _batch(sources_stamp(strings, contact, phases, places, law, ode))
