"""Has the regressions that fill in what a shop does not print, each with its spread.

Fitted over the measurements of 1,337 strung rackets that Tennis Warehouse University publishes
(racket table, twu.tennis-warehouse.com); the table itself is not part of this package.
"""

from __future__ import annotations

from dataclasses import dataclass

SQUARE_INCH = 0.0254**2  # m^2
SOURCE = "regression over 1,337 rackets of Tennis Warehouse University's table"

FREQUENCY_SPREAD = 0.034  # of the value
TWISTWEIGHT_SPREAD = 1.07e-4  # kg m^2
STIFFNESS_SPREAD = 0.073  # of the value, of kf against RA
IN_OVER_OUT = 1.19
"""In-plane over out-of-plane fundamental: the mean of the two published rackets (158/132, 178/150).
"""
IN_OVER_OUT_SPREAD = 0.02  # of the value; two rackets alone: a guess

MEDIAN_FREQUENCY = 148.5  # Hz
MEDIAN_FREQUENCY_SPREAD = 11.9  # Hz: (169 - 130) / 3.29, its 5 and 95 %


@dataclass(frozen=True)
class Estimated:
    """An estimate is a number with the standard deviation of what gave it, in the same unit."""

    value: float
    sd: float


def frequency_of_ra(ra: float, mass: float) -> Estimated:
    """Gives the out-of-plane fundamental (Hz): f1 = 1.702 RA m^-0.24.

    Args:
        ra: flex on the RA scale.  mass: strung, kg.

    """
    value = 1.702 * ra * mass**-0.24
    return Estimated(value, FREQUENCY_SPREAD * value)


def stiffness_of_ra(ra: float) -> Estimated:
    """Gives the throat joint's out-of-plane stiffness (N m/rad): kf = 0.378 RA^1.93."""
    value = 0.378 * ra**1.93
    return Estimated(value, STIFFNESS_SPREAD * value)


def guessed_twistweight(head_area: float, mass: float, swingweight: float) -> Estimated:
    """Guesses the twistweight (kg m^2): 0.180 A + 0.0046 m + 0.034 SW - 16.3.

    (A in in^2, m in g, SW and the result in kg cm^2.)

    Args:
        head_area: m^2.  mass: kg.  swingweight: kg m^2.

    """
    area, grams, sw = head_area / SQUARE_INCH, 1e3 * mass, 1e4 * swingweight
    return Estimated(1e-4 * (0.180 * area + 0.0046 * grams + 0.034 * sw - 16.3), TWISTWEIGHT_SPREAD)
