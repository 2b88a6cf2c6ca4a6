"""Sweeps: many impacts as data, with durable results. See docs/sweeps.md."""

from drake_racket.sweep.export import flat
from drake_racket.sweep.outputs import OUTPUTS, SweepOutput
from drake_racket.sweep.run import Progress, run_sweep
from drake_racket.sweep.spec import Sweep, load_sweep, make_sweep, parse_sweep
from drake_racket.sweep.worker import SweepStopped

__all__ = [
    "OUTPUTS",
    "Progress",
    "Sweep",
    "SweepOutput",
    "SweepStopped",
    "flat",
    "load_sweep",
    "make_sweep",
    "parse_sweep",
    "run_sweep",
]
