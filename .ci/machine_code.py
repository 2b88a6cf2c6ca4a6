"""Compiles the laws and engines once, before the test processes would each do it at the same time.

    python .ci/machine_code.py

numba keeps the code on disk. Two test processes that begin with an empty cache compile everything
twice: a minute and a half of processor time.
"""

from __future__ import annotations

import numpy as np

import drake_racket as dr
from drake_racket.engines.clamped.batch import make_bed, make_impacts, run
from drake_racket.engines.clamped.spinning import run_spinning, spinning_impacts
from drake_racket.engines.compiled.dynamics import layout
from drake_racket.engines.compiled.engine import CompiledImpact, blank_records
from drake_racket.engines.compiled.kernel import evaluate
from drake_racket.plant.contacts import surface_model

case = dr.Scenario(after=0.002, approach_time=0.0)
dr.simulate(case, history=False)
dr.simulate(case, history=False, engine="compiled", derivatives=["speed"])

model = CompiledImpact(dr.make_impact_diagram(case))
ints, start = model.model.ints, model.start(model.system.case)
evaluate(
    start.tables,
    start.y,
    blank_records(ints),
    np.zeros(layout.ORIGIN_WORK),
    *layout.work_of(ints),
    np.zeros(ints[layout.VELOCITIES]),
    np.zeros(len(start.y)),
)

racket, ball = dr.load_racket(), dr.load_ball()
run([make_bed(racket)], make_impacts(racket, ball, [5], [25.0]))
spinning = spinning_impacts(racket, ball, [[0.0, 0.0]], [[0.0, 0.0, -25.0]])
run_spinning(make_bed(racket), surface_model(racket, ball), ball.mass.value, spinning)
