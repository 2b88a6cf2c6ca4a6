"""Tells an impact in words: the lines that the command line prints."""

from __future__ import annotations

import math
from typing import Any

from drake_racket.parameters.scenario import RPM


def summary_rows(result: Any) -> list[tuple[str, str]]:
    """Tells what is said of an impact (an ImpactResult), as pairs of a name and a text."""
    speed = float((result.rebound_velocity @ result.rebound_velocity) ** 0.5)
    x, y, z = (round(float(v), 2) + 0.0 for v in result.rebound_velocity)  # no -0.00
    rows = [
        ("Rebound speed", f"{speed:.2f} m/s  (x {x:+.2f}, y {y:+.2f}, normal {z:+.2f})"),
        ("Apparent restitution", f"{result.apparent_restitution:.3f}"),
        ("Rebound angle", f"{math.degrees(result.rebound_angle):.2f}° from the normal"),
    ]
    if result.sliding_fraction is not None:
        axis = result.scenario.spin_axis()
        before, after = (float(w @ axis) / RPM for w in (result.spin_before, result.spin_after))
        rows.append(
            ("Spin", f"{after:+.0f} rpm (before {before:+.0f}), positive as friction turns")
        )
        slid, over = 100.0 * result.sliding_fraction, 1e3 * result.overspin_time
        rows.append(("On the strings", f"slid {slid:.0f} % of the contact, overspin {over:.2f} ms"))
    if result.contact_time is not None:
        rows.append(("Contact time", f"{1e3 * result.contact_time:.2f} ms"))
    rows += [
        ("Peak normal force", f"{result.peak_normal_force:.0f} N"),
        ("Peak string deflection", f"{1e3 * result.peak_string_deflection:.1f} mm"),
        (
            "Racket after",
            f"centre of mass {_norm(result.racket_velocity):.2f} m/s,"
            f" turning {_norm(result.racket_angular_velocity):.1f} rad/s",
        ),
        (
            "Peak throat bending",
            f"{math.degrees(result.peak_out_of_plane_angle):.2f}° out of plane",
        ),
    ]
    if result.peak_handle_acceleration is not None:
        rows.append(("Peak mid-handle acc.", f"{result.peak_handle_acceleration:.0f} m/s²"))
    if result.kb is not None and result.cb is not None:
        rows.append(("Ball", f"kb {result.kb / 1e3:.1f} kN/m, cb {result.cb:.1f} N s/m"))
    if result.balance is not None:
        b = result.balance
        lost = b.lost_ball + b.lost_friction + b.lost_joint + b.lost_strings + b.lost_limb
        held = "".join(f" {n} {e:.2f}," for n, e in (("grip", b.grip), ("limb", b.limb)) if e)
        rows.append(
            (
                "Energy at the end",
                f"ball {b.ball:.2f}, racket {b.rigid_motion:.2f}, bending {b.bending:.2f},"
                f" strings {b.strings:.2f},{held} lost {lost:.2f} J",
            )
        )
    if result.energy_error is not None:
        momentum = result.momentum_error
        shown = "" if momentum is None else f", momentum {momentum:.1e}"
        rows.append(("Balance closes to", f"energy {result.energy_error:.1e}{shown}"))
    rows.append(("Integrator", f"{result.steps} steps, {result.evaluations} evaluations"))
    return rows


def summary_text(result: Any) -> str:
    """Tells what is said of an impact (an ImpactResult), one line each, warnings last."""
    rows = summary_rows(result)
    width = max(len(name) for name, _ in rows)
    lines = [f"{name:<{width}}  {text}" for name, text in rows]
    return "\n".join([*lines, *(f"warning: {text}" for text in result.warnings)])


def _norm(vector: Any) -> float:
    return float((vector @ vector) ** 0.5)
