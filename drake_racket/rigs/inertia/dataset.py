"""Weighs, balances, swings and twists every specimen, and recovers its inertia.

What the simulated instruments show goes through the sums of `inertia.bench` alone; the inertia
that was put in appears only beside the result.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drake_racket.io.errors import InputError
from drake_racket.io.units import labelled
from drake_racket.parameters.racket import RacketParameters, load_racket
from drake_racket.plant.properties import SWINGWEIGHT_AXIS, racket_properties
from drake_racket.rigs.inertia.bench import (
    STANDARD_GRAVITY,
    Measured,
    pendulum_moments,
    torsional_moment,
    weigh_twice,
)
from drake_racket.rigs.inertia.rigid import (
    SPECIMENS,
    Inertia,
    combine,
    specimen_length,
    specimen_pieces,
)
from drake_racket.rigs.inertia.simulation import (
    AXES,
    EDGE_INSET,
    PLATFORM,
    TORSION_CONSTANT,
    scale_mass,
    swing,
    twist,
)
from drake_racket.rigs.input_checks import check_not_negative

if TYPE_CHECKING:
    import xarray

AMPLITUDE = math.radians(10.0)
"""Where pendulums are let go; inferred, the source prints none. It cancels (K(k))."""

PIVOTS = {"handle": 0.0, "head": 0.0, "frame": SWINGWEIGHT_AXIS, "strung": SWINGWEIGHT_AXIS}
"""m, the pendulum's axis from the specimen's end nearest the butt; inferred, it cancels."""


@dataclass(frozen=True)
class BenchErrors:
    """Holds the standard deviations of the measurements, for the uncertainty of what is recovered.

    The defaults are inferred, typical of a careful bench: a stopwatch by hand, 0.1 s over 20
    swings; scales to 0.1 g; a rule to 0.5 mm. They do not disturb the simulated measurements.

    Attributes:
        period: s, of every period.  mass: kg, of every weighing.  length: m, of every place (of
            both knife-edges and of the pendulum's pivot).

    """

    period: float = 0.005
    mass: float = 1e-4
    length: float = 5e-4


@dataclass(frozen=True)
class BenchResult:
    """Says what the bench finds of one specimen; moments by axis."""

    mass: Measured
    com: Measured
    periods: dict[str, float]
    moments: dict[str, Measured]
    about_pivot: dict[str, Measured]


def measure(
    parameters: RacketParameters,
    specimen: str,
    *,
    amplitude: float = AMPLITUDE,
    oscillations: int = 3,
    gravity: float = STANDARD_GRAVITY,
    errors: BenchErrors | None = None,
) -> BenchResult:
    """Puts one specimen on all instruments of the bench.

    The mass is the sum of two scale masses, with the knife-edges exchanged; their shares of it
    give the balance. Both pendulum axes go through the same pivot (`PIVOTS`).

    Raises:
        InputError: an argument is out of range.
        SimulationError: an instrument gives no number.

    """
    errors = errors or BenchErrors()
    check_not_negative(**asdict(errors))
    pieces = specimen_pieces(parameters, specimen)
    edges = EDGE_INSET, specimen_length(parameters, specimen) - EDGE_INSET
    shown, exchanged = (
        scale_mass(pieces, fixed_edge=a, scale_edge=b, gravity=gravity)
        for a, b in (edges, edges[::-1])
    )
    weighing = weigh_twice(shown, exchanged, edges, scale_sd=errors.mass, place_sd=errors.length)
    mass, com = weighing.mass, weighing.com
    empty = twist([PLATFORM], amplitude=amplitude, oscillations=oscillations).period
    loaded = twist([PLATFORM, *pieces], amplitude=amplitude, oscillations=oscillations).period
    longitudinal = torsional_moment(
        loaded,
        TORSION_CONSTANT,
        empty_period=empty,
        period_sd=errors.period,
        empty_period_sd=errors.period,
    )
    periods = {"longitudinal": loaded}
    moments, about_pivot = {"longitudinal": longitudinal}, {"longitudinal": longitudinal}
    for axis in ("transverse", "frontal"):
        periods[axis] = swing(
            pieces,
            axis,
            pivot=PIVOTS[specimen],
            amplitude=amplitude,
            oscillations=oscillations,
            gravity=gravity,
        ).period
        found = pendulum_moments(
            periods[axis],
            mass.value,
            com.value - PIVOTS[specimen],
            amplitude=amplitude,
            gravity=gravity,
            period_sd=errors.period,
            mass_sd=mass.sd,
            distance_sd=math.hypot(com.sd, errors.length),
            mass_distance_covariance=weighing.covariance,
        )
        moments[axis], about_pivot[axis] = found.about_com, found.about_pivot
    return BenchResult(mass, com, periods, moments, about_pivot)


def inertia_dataset(
    racket_names: Sequence[str] = ("tour", "recreational"),
    *,
    amplitude: float = AMPLITUDE,
    oscillations: int = 3,
    gravity: float = STANDARD_GRAVITY,
    errors: BenchErrors | None = None,
) -> xarray.Dataset:
    """Runs the bench on every specimen of every racket.

    Args:
        racket_names: as `load_racket` takes them.
        amplitude: rad, where pendulums are let go.  oscillations: timed swings.  gravity: m/s^2.
        errors: of the measurements, for the standard deviations.

    Returns:
        A Dataset over `racket`, `part` (handle, head, frame, strung) and `axis`: `period`,
        `moment` with `moment_sd`, `moment_input`, `relative_error`; over `racket` and `part`
        `mass` and `com` with theirs; over `racket` `swingweight`, `twistweight` and `spinweight` of
        the strung racket with those of `racket_properties` (`..._model`). SI units.

    Raises:
        InputError: a name is unknown, given twice, or none is given; an argument is out of range.
        SimulationError: an instrument gives no number.

    """
    import xarray

    if isinstance(racket_names, str) or not racket_names:
        raise InputError("racket_names", racket_names, "a list of at least one racket")
    if len(set(racket_names)) < len(racket_names):
        raise InputError("racket_names", list(racket_names), "each racket once")
    rackets = [load_racket(name) for name in racket_names]
    arguments: dict[str, Any] = {
        "amplitude": amplitude,
        "oscillations": oscillations,
        "gravity": gravity,
        "errors": errors,
    }
    found = [[measure(r, s, **arguments) for s in SPECIMENS] for r in rackets]
    given = [[combine(specimen_pieces(r, s)) for s in SPECIMENS] for r in rackets]
    return xarray.Dataset(
        _parts(found, given) | _moments(found, given) | _whole(rackets, found),
        coords={
            "racket": ("racket", list(racket_names), {"long_name": "racket"}),
            "part": ("part", list(SPECIMENS), {"long_name": "what is measured"}),
            "axis": ("axis", list(AXES), {"long_name": "axis of the moment, through the COM"}),
            "pivot": labelled(
                "part",
                [PIVOTS[s] for s in SPECIMENS],
                "m",
                "pendulum axis from the end nearest the butt",
            ),
        },
        attrs={
            "title": "Inertia bench: moments from simulated periods, balance from knife-edges",
            "amplitude_rad": amplitude,
            "gravity_m_s2": gravity,
            "source": "Glynn, King & Mitchell (2011), doi:10.1007/s12283-010-0056-x, Table 1",
        },
    )


Found = list[list[BenchResult]]
Given = list[list[Inertia]]


def _parts(found: Found, given: Given) -> dict[str, Any]:
    """Mass and balance over racket and part."""
    columns = {
        "mass": ([[f.mass.value for f in row] for row in found], "kg", "mass from the scales"),
        "mass_sd": ([[f.mass.sd for f in row] for row in found], "kg", "its standard deviation"),
        "mass_input": ([[g.mass for g in row] for row in given], "kg", "mass put in"),
        "com": ([[f.com.value for f in row] for row in found], "m", "balance from knife-edges"),
        "com_sd": ([[f.com.sd for f in row] for row in found], "m", "its standard deviation"),
        "com_input": ([[g.com for g in row] for row in given], "m", "balance put in"),
    }
    return {name: labelled(("racket", "part"), *column) for name, column in columns.items()}


def _moments(found: Found, given: Given) -> dict[str, Any]:
    """Periods and moments over racket, part and axis."""
    cube = [[[f.moments[axis] for axis in AXES] for f in row] for row in found]
    moment = np.array([[[m.value for m in line] for line in row] for row in cube])
    put_in = np.array([[[getattr(g, axis) for axis in AXES] for g in row] for row in given])
    columns = {
        "period": (
            [[[f.periods[axis] for axis in AXES] for f in row] for row in found],
            "s",
            "period of the pendulum, or of the torsional pendulum about the longitudinal axis",
        ),
        "moment": (moment, "kg m^2", "moment of inertia about the centre of mass, recovered"),
        "moment_sd": (
            [[[m.sd for m in line] for line in row] for row in cube],
            "kg m^2",
            "its standard deviation, from those of the measurements",
        ),
        "moment_input": (put_in, "kg m^2", "moment of inertia put in"),
        "relative_error": (moment / put_in - 1.0, "1", "recovered over put in, less 1"),
    }
    dimensions = ("racket", "part", "axis")
    return {name: labelled(dimensions, *column) for name, column in columns.items()}


def _whole(rackets: list[RacketParameters], found: Found) -> dict[str, Any]:
    """The strung rackets' numbers as makers quote them, from the bench and from the model."""
    strung = [row[SPECIMENS.index("strung")].about_pivot for row in found]
    model = [racket_properties(r) for r in rackets]
    variables = {}
    for name, axis, text in (
        ("swingweight", "transverse", "about the transverse axis 4 inches from the butt"),
        ("spinweight", "frontal", "about the frontal axis 4 inches from the butt"),
        ("twistweight", "longitudinal", "about the longitudinal axis"),
    ):
        for suffix, values, source in (
            ("", [s[axis].value for s in strung], "from the bench"),
            ("_sd", [s[axis].sd for s in strung], "standard deviation"),
            ("_model", [getattr(m, name) for m in model], "of the model"),
        ):
            label = f"moment of the strung racket {text}, {source}"
            variables[name + suffix] = labelled(("racket",), values, "kg m^2", label)
    return variables
