"""Writes a calibrated frame: the racket's file, and two tables of what determines what."""

from __future__ import annotations

from pathlib import Path

from drake_racket.identify.frame.distribution import DistributionFit
from drake_racket.io.files import write_text
from drake_racket.parameters.written import write_racket


def write_distribution_fit(fit: DistributionFit, out: Path) -> list[Path]:
    """Writes racket, numbers and measurements to a directory; returns the files.

    `numbers.csv`: value, standard deviation with and without the measurements, the share of the
    variance that they take away, and by how much it would grow without each of them.
    """
    out.mkdir(parents=True, exist_ok=True)
    racket, numbers = out / f"{fit.racket.name}.yaml", out / "numbers.csv"
    measured = out / "measured.csv"
    write_racket(fit.racket, racket, "drake-racket identify distribution")
    names = list(fit.measured)
    head = ["number", "unit", "value", "sd", "sd_before", "share", *(f"without_{n}" for n in names)]
    rows = [
        [
            name,
            number.unit,
            *(f"{x:.6g}" for x in (number.value, number.sd, number.before, number.share)),
            *(f"{number.leans_on[n]:.4g}" for n in names),
        ]
        for name, number in fit.numbers.items()
    ]
    write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n", numbers)
    lines = ["measured,value,sd,model"]
    lines += [f"{n},{v:.6g},{sd:.6g},{model:.6g}" for n, (v, sd, model) in fit.measured.items()]
    write_text("\n".join(lines) + "\n", measured)
    return [racket, numbers, measured]
