"""Sweeps: many impacts as data, with durable results. See docs/sweeps.md."""

from drake_racket.io.progress import Progress
from drake_racket.sweep.export import export_sweep, flat
from drake_racket.sweep.outputs import OUTPUTS, Output
from drake_racket.sweep.run import SweepStopped, run_grid, run_sweep
from drake_racket.sweep.spec import Sweep, load_sweep, make_sweep, parse_sweep

__all__ = [
    "OUTPUTS",
    "Output",
    "Progress",
    "Sweep",
    "SweepStopped",
    "export_sweep",
    "flat",
    "load_sweep",
    "make_sweep",
    "parse_sweep",
    "run_grid",
    "run_sweep",
]
