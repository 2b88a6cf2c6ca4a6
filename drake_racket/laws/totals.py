"""Says where the integrated losses of an impact stand in an engine's totals.

The first nine are those of ball, friction, racket and hand (J; the impulse on the ball in N s); the
next three are there with a limb.
"""

from __future__ import annotations

LOST_BALL, LOST_FRICTION, COUPLE, IMPULSE, LOST_JOINT, LOST_STRINGS = 0, 1, 2, slice(3, 6), 6, 7
GRIP, TOTALS = 8, 9
TORQUE_WORK, LOST_JOINTS, LOST_LIMITS = range(3)
"""Of the limb's own three totals, counted from TOTALS on."""
