"""Names the places in the vectors that output ports give, as logs and results name the quantities.

    state = impact.contact.GetOutputPort("contact_state").Eval(context)
    compression = state[dr.ContactState.COMPRESSION]

docs/ports.md lists all ports of the systems, with units.
"""

from __future__ import annotations

from enum import IntEnum

from drake_racket.laws import totals


class ContactState(IntEnum):
    """Places in the BallContact's port `contact_state`; the log has variables of these names."""

    PHASE = 0
    CONTACT_POINT = 1
    COMPRESSION = 2
    COMPRESSION_RATE = 3
    NORMAL_FORCE = 4
    FRICTION_X = 5
    FRICTION_Y = 6
    SLIDING_X = 7
    SLIDING_Y = 8


class ContactPower(IntEnum):
    """Places in the BallContact's port `power`: W, and the force on the ball in the world (N)."""

    LOST_BALL = 0
    LOST_FRICTION = 1
    COUPLE = 2
    FORCE_X = 3
    FORCE_Y = 4
    FORCE_Z = 5


class EnergyTotals(IntEnum):
    """Places in the EnergyMeter's port `totals`: J as the log's stores, and the impulse (N s)."""

    LOST_BALL = 0
    LOST_FRICTION = 1
    COUPLE = 2
    IMPULSE_X = 3
    IMPULSE_Y = 4
    IMPULSE_Z = 5
    LOST_JOINT = totals.LOST_JOINT
    LOST_STRINGS = totals.LOST_STRINGS
    GRIP = totals.GRIP


class HandLoad(IntEnum):
    """Places in the GripLoad's port `hand_load`: the log's `hand_torque` and `hand_force`."""

    TORQUE_X = 0
    TORQUE_Y = 1
    TORQUE_Z = 2
    FORCE_X = 3
    FORCE_Y = 4
    FORCE_Z = 5
