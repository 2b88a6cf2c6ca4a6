"""Tells what a racket was made of: a shop's numbers, and what regressions filled in."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table

if TYPE_CHECKING:
    from drake_racket.parameters.racket import RacketParameters
    from drake_racket.plant.properties import RacketProperties


def specs_table(racket: RacketParameters, has: RacketProperties) -> Table:
    """Gives what was wanted, what the racket has of it, and where each number comes from."""
    from drake_racket.parameters.specs.given import PRINTED, as_shops_print

    same = {
        "mass": has.mass,
        "balance": has.balance,
        "swingweight": has.swingweight,
        "twistweight": has.twistweight,
        "frequency": has.out_of_plane_frequency,
    }
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("number", "wanted", "the racket has", "sd", "status", "source"):
        table.add_column(heading, no_wrap=heading != "source", overflow="fold")
    for key, spec in racket.specs.items():
        unit = PRINTED[key].unit if key in PRINTED else "1"
        mark = "[yellow]" if spec.status == "inferred" else ""
        table.add_row(
            key.replace("_", " "),
            as_shops_print(unit, spec.value),
            as_shops_print(unit, same[key]) if key in same else "",
            as_shops_print(unit, spec.sd) if spec.sd else "",
            f"{mark}{spec.status}",
            escape(spec.source),
        )
    return table
