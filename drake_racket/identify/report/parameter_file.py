"""Writes fitted values as parameter files: what `load_racket` and `load_ball` read.

Every fitted value gets status `fitted` and a source that names the data file and its hash, the
date, the method, the RMS difference and the 95 % interval. A value that the data do not determine
is kept as it was fitted, since only all values together give the RMS, and its source says so: "not
determined by these data". What was not fitted stays as it was, with its own source.
"""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drake_racket.identify.core.estimate import Estimate
from drake_racket.identify.core.search import determined, unit_text
from drake_racket.io.errors import InputError
from drake_racket.parameters import written
from drake_racket.parameters.ball import BallParameters, check_ball
from drake_racket.parameters.quantities import Quantities, Quantity
from drake_racket.parameters.racket import RacketParameters, check_racket


@dataclass(frozen=True)
class Provenance:
    """Says where fitted values come from.

    Attributes:
        data: name of the data file or files.  sha256: of their bytes, in this order.
        date: as 2011-06-30.  method: "least squares", ...
        rms: with its unit, as "0.41 % of restitution".

    """

    data: str
    sha256: str
    date: str
    method: str
    rms: str

    def text(self) -> str:
        """Writes it as a source."""
        head = f"fitted to {self.data} (sha256 {self.sha256}) on {self.date}"
        return f"{head} by {self.method}; RMS difference {self.rms}"


def hash_files(paths: Sequence[Path]) -> str:
    """Gives SHA-256 of the files' bytes, one after the other.

    Raises:
        InputError: a file that cannot be read.

    """
    found = hashlib.sha256()
    for path in paths:
        try:
            found.update(path.read_bytes())
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or "not a file's name"
            raise InputError("file", path, f"a readable file ({reason})") from None
    return found.hexdigest()


def interval_text(estimate: Estimate) -> str:
    """Gives the 95 % interval in words."""
    low, high = estimate.interval
    unit = unit_text(estimate.unit)
    if determined(estimate):
        return f"95 % interval {low:.6g} to {high:.6g}{unit}"
    text = "not determined by these data"
    if not np.isfinite([low, high]).any():
        return f"{text} (no finite 95 % interval)"
    return f"{text} (95 % interval {low:.3g} to {high:.3g}{unit})"


def fitted_quantity(estimate: Estimate, provenance: Provenance) -> Quantity:
    """Gives one fitted number."""
    source = f"{provenance.text()}; {interval_text(estimate)}"
    return Quantity(float(estimate.value), estimate.unit, "fitted", source)


def fitted_quantities(
    old: Quantities, letter: str, found: Mapping[str, Estimate], provenance: Provenance
) -> Quantities:
    """Gives a list of numbers, `letter`1 ..., those in `found` replaced."""
    names = [f"{letter}{i + 1}" for i in range(len(old.value))]
    fitted = [name for name in names if name in found]
    if not fitted:
        return old
    values = [
        float(found[name].value) if name in found else value
        for name, value in zip(names, old.value, strict=True)
    ]
    parts = [f"{name}: {interval_text(found[name])}" for name in fitted]
    kept = [name for name in names if name not in found]
    if kept:
        parts.append(f"{', '.join(kept)} not fitted ({old.status}: {old.source})")
    return Quantities(tuple(values), old.unit, "fitted", "; ".join([provenance.text(), *parts]))


def fitted_racket(
    racket: RacketParameters,
    found: Mapping[str, Estimate],
    provenance: Provenance,
    *,
    name: str | None = None,
    stringing_tension: float | None = None,
) -> RacketParameters:
    """Gives a racket with fitted values in place of its own.

    Args:
        found: by name: T0, k1 ..., p1 ..., mu1 ..., or a field of the throat joint.
        name: of the new racket; the old one's with `_fitted` if None.
        stringing_tension: N, of the racket that was measured, if it is another.

    Raises:
        InputError: a name or value that no racket has.

    """
    bed, friction, joint = racket.string_bed, racket.friction, racket.throat_joint
    tension = bed.initial_tension
    if "T0" in found:
        tension = fitted_quantity(found["T0"], provenance)
    strung = bed.stringing_tension
    if stringing_tension is not None:
        strung = Quantity(stringing_tension, "N", "measured", "given with the data")
    fields = {f.name for f in dataclasses.fields(joint)}
    bending: dict[str, Any] = {
        n: fitted_quantity(e, provenance) for n, e in found.items() if n in fields
    }
    new = replace(
        racket,
        name=_new_name(racket.name, name),
        title=f"{racket.title}, fitted to {provenance.data}",
        string_bed=replace(
            bed,
            initial_tension=tension,
            stringing_tension=strung,
            stiffness=fitted_quantities(bed.stiffness, "k", found, provenance),
            rim_factors=fitted_quantities(bed.rim_factors, "p", found, provenance),
        ),
        friction=replace(
            friction,
            coefficients=fitted_quantities(friction.coefficients, "mu", found, provenance),
        ),
        throat_joint=replace(joint, **bending),
    )
    check_racket(new, "fitted racket")
    return new


def fitted_ball(
    ball: BallParameters,
    found: Mapping[str, Estimate],
    provenance: Provenance,
    *,
    name: str | None = None,
) -> BallParameters:
    """Gives a ball with fitted values in place of its own.

    Args:
        found: by field; an interval without width belongs to a stated number (the speeds).
        name: as for `fitted_racket`.

    Raises:
        InputError: a value that no ball has.

    """
    values: dict[str, Any] = {}
    for key, estimate in found.items():
        if estimate.interval[0] == estimate.interval[1]:
            source = f"range of speeds of {provenance.data}"
            values[key] = Quantity(float(estimate.value), estimate.unit, "measured", source)
        else:
            values[key] = fitted_quantity(estimate, provenance)
    new = replace(
        ball,
        name=_new_name(ball.name, name),
        title=f"{ball.title}, fitted to {provenance.data}",
        **values,
    )
    check_ball(new, "fitted ball")
    return new


def _new_name(old: str, name: str | None) -> str:
    if name is not None:
        return name
    return old if old.endswith("_fitted") else f"{old}_fitted"


def write_parameters(parameters: RacketParameters | BallParameters, path: Path) -> None:
    """Writes a fitted racket's or ball's file; see `written.write_racket`."""
    if isinstance(parameters, RacketParameters):
        written.write_racket(parameters, path, "drake_racket.identify")
    else:
        written.write_ball(parameters, path, "drake_racket.identify")
