"""Nylon and polyester: which numbers of the contact tell their spins apart?

    python studies/spin_by_string.py

Tennis Warehouse University measured 1,403 rpm with nylon and 1,687 with polyester (means of several
beds; 25 m/s, 40 degrees, -3,820 rpm before, head clamped), and about 30 % less in a hand. The two
materials' mu, .425 and .44, do not tell them apart. This fits the element instead: kt and ct for
each material, then ct alone; and prints what chi alone would have to be.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq, least_squares

from drake_racket import Scenario, load_ball, one_line_errors, simulate

RPM = math.pi / 30.0  # rad/s
MATERIALS = {"nylon": (0.425, 1403.0), "polyester": (0.44, 1687.0)}
"""mu and spin after (rpm): Tennis Warehouse University, string table and stringmovement."""
LOSS, RPM_SHARE, LOSS_SHARE = 0.30, 20.0, 0.01
"""What a hand takes of the spin; the residuals of spin (rpm) and loss that weigh the same."""
KEYS = tuple(
    f"ball.surface.{name}" for name in ("tangential_stiffness", "tangential_damping", "flattening")
)


def spins(mu: float, numbers: Sequence[float]) -> tuple[float, float]:
    """Spin after (rpm) with the head clamped, and the share that a hand takes of it.

    Args:
        numbers: kt (N/m), ct (N s/m), chi.

    """
    overrides = dict(zip(KEYS, map(float, numbers), strict=True))
    overrides |= {f"racket.friction.coefficients.mu{i}": mu for i in (1, 2, 3)}
    found = []
    for support in ("clamped_head", "grip"):
        scenario = Scenario(
            contact="surface",
            speed=25.0,
            incidence_deg=40.0,
            spin_rpm=-3820.0,
            support=support,
            approach_time=0.0,
            after=0.008,
            audit=False,
            engine="compiled",
            overrides=overrides,
        )
        result = simulate(scenario, history=False)
        found.append(float(result.spin_after @ scenario.spin_axis()) / RPM)
    return found[0], 1.0 - found[1] / found[0]


def both(mu: float, target: float, shipped: Sequence[float]) -> tuple[float, float]:
    """Gives kt and ct that fit a material's spin and the loss in a hand."""

    def residuals(x: np.ndarray) -> list[float]:
        spin, loss = spins(mu, (1e4 * x[0], 10.0 * x[1], shipped[2]))
        return [(spin - target) / RPM_SHARE, (loss - LOSS) / LOSS_SHARE]

    start = np.array([1e-4 * shipped[0], 0.1 * shipped[1]])
    found = least_squares(residuals, start, bounds=(0.1, 60.0), diff_step=1e-3)
    return 1e4 * float(found.x[0]), 10.0 * float(found.x[1])


def alone(mu: float, target: float, shipped: Sequence[float], place: int) -> list[float]:
    """Gives the three numbers with one of them fitted to a material's spin."""

    def numbers(value: float) -> list[float]:
        return [value if i == place else own for i, own in enumerate(shipped)]

    ends = (20.0, 200.0) if place == 1 else (0.0, 0.95)
    return numbers(brentq(lambda value: spins(mu, numbers(value))[0] - target, *ends))


def main() -> None:
    """Prints each material's numbers by both designs, with what they give."""
    surface = load_ball().surface
    assert surface is not None
    shipped = (
        surface.tangential_stiffness.value,
        surface.tangential_damping.value,
        surface.flattening.value,
    )
    print("            kt [kN/m]  ct [N s/m]  chi   spin [rpm]  loss in a hand")
    for name, (mu, target) in MATERIALS.items():
        kt, ct = both(mu, target, shipped)
        for numbers in (
            shipped,
            (kt, ct, shipped[2]),
            alone(mu, target, shipped, 1),
            alone(mu, target, shipped, 2),
        ):
            spin, loss = spins(mu, numbers)
            print(
                f"{name:10s}  {1e-3 * numbers[0]:9.1f}  {numbers[1]:10.1f}  {numbers[2]:.2f}"
                f"  {spin:10.0f}  {100.0 * loss:.1f} %"
            )


if __name__ == "__main__":
    with one_line_errors("studies/spin_by_string.py"):
        main()
