"""Makes the page of every number that no source prints, from the parameter files themselves."""

from __future__ import annotations

from collections.abc import Iterator

from drake_racket import load_ball, load_grip, load_racket, load_upper_limb
from drake_racket.parameters.quantities import sourced_rows
from manual.tables import code, table, unit

_HEAD = """# What is inferred, and why

The paper prints most of its numbers, but two of its figures are not available: the one that
says which string spring carries which stiffness, and the one with the ball's stiffness and
damping. Two of its statements contradict its own numbers. Nothing here hides that: every number
of the package has a status, and where no source prints a number its status is *inferred*, with
the reason.

What the three weightiest choices rest on:

- **Which spring carries which k and p.** 25,920 assignments have the symmetries of a racket.
  The shipped one makes restitution nearly uniform over all four published beds, as the paper's
  fits suggest. Clamped impacts cannot tell tip from throat: [the whole
  argument](../spring_assignment.md).
- **The ball at 18 m/s.** kb = 45 kN/m and cb = 14 N s/m give rebound speeds near the published
  range and a peak force within the published axis. Other pairs do, too: [the map of
  them](../ball_calibration.md).
- **The labels of the throat joint.** Read as axes of rotation they give all four published
  frequencies within 3 %, read as directions of bending they miss by 21-31 %: [the
  table](../model.md#frame).

To see what hangs on a number, vary it: `--set ball.stiffness_low=40e3`, or a
[sweep](../sweeps.md) with `relative: true`. The [validation report](../validation/report.md)
names, for every row, the inferred numbers that it depends on.

"""


def inferred_page() -> str:
    """Makes the page: one table each for the rackets, the ball, the grip and the limb."""
    parts = [_HEAD]
    things = (
        ("Racket and strings (tour, low tension)", load_racket("tour", "low")),
        ("Ball", load_ball()),
        ("Grip (normal)", load_grip()),
        ("Shipped limb", load_upper_limb()),
    )
    for title, parameters in things:
        parts.append(f"## {title}\n\n{table(('key', 'value', 'unit', 'why'), _rows(parameters))}")
    return "\n".join(parts)


def _rows(parameters: object) -> Iterator[tuple[str, str, str, str]]:
    for key, value, measured_in, status, source in sourced_rows(parameters):
        if status == "inferred":
            yield code(key), value, unit(measured_in), source
