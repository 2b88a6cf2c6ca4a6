"""The options here are those that several commands of `drake-racket identify` have."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from drake_racket.cli.case_options import in_unit

Out = Annotated[Path, typer.Option(help="Directory for parameter file, result and report.")]
Table = Annotated[Path, typer.Argument(metavar="FILE", help="The measurements (CSV).")]
Racket = Annotated[
    str, typer.Option(help="tour, recreational, or a parameter file: what is not fitted.")
]
Tension = Annotated[str, typer.Option(help="low, high, or of stringing: 280 (N), 25kg, 55lb.")]
Ball = Annotated[str, typer.Option(help="penn_titanium, or a ball's parameter file.")]
Name = Annotated[str | None, typer.Option(help="Name in the parameter file written.")]
Begin = Annotated[
    list[str] | None, typer.Option("--start", help="NAME=VALUE to begin at (again and again).")
]
Select = Annotated[
    list[str] | None, typer.Option(help="COLUMN=TEXT: take these rows (again and again).")
]
KeepRepeats = Annotated[
    bool, typer.Option("--keep-repeats", help="Fit each shot, not the mean of a setting's.")
]
SpeedSigma = Annotated[
    float | None,
    typer.Option(help="Standard deviation of a measured speed, m/s.", parser=in_unit("m/s")),
]
Profiles = Annotated[
    bool, typer.Option("--profiles", help="Intervals from likelihood profiles (slow).")
]
Rescale = Annotated[
    bool, typer.Option("--rescale", help="Scale the standard deviations by the residuals.")
]
Method = Annotated[str, typer.Option(help="least-squares or annealing.")]
Starts = Annotated[int, typer.Option(help="Starts of least squares, or chains of annealing.")]
Seed = Annotated[int, typer.Option(help="Of starts and annealing.")]
Workers = Annotated[int, typer.Option(help="Processes that share the starts.")]
Evaluations = Annotated[int, typer.Option(help="Of each annealing chain, at most.")]
Temperature = Annotated[float, typer.Option(help="At which an annealing chain begins.")]
Polish = Annotated[bool, typer.Option("--polish", help="Finish annealing by least squares.")]
Fresh = Annotated[
    bool, typer.Option("--fresh", help="Begin anew, whatever an interrupted fit left in OUT.")
]
