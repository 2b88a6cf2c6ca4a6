"""What six and eight segments cost in a hand, beside two, in the compiled engine.

    python benchmarks/segments_cost.py        (needs the extra `fast`; a minute)

50 ms from touch in `hand_medium` at default settings, tour racket, families A and B; runs in turns
in one process, medians of CPU time.
"""

from __future__ import annotations

import os
from statistics import median
from time import process_time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from measure import table, versions

from drake_racket.cases.case import resolve
from drake_racket.cases.diagram import make_impact_diagram
from drake_racket.engines.compiled.engine import CompiledImpact
from drake_racket.parameters.scenario import Scenario
from drake_racket.simulation import simulate

FRAMES = {"two": (2, 0.0), "six, A": (6, 0.0), "six, B": (6, 1.0), "eight, A": (8, 0.0)}
ROUNDS = 25


def main() -> None:
    cases, models, runs = {}, {}, {}
    times: dict[str, dict[str, list[float]]] = {
        n: {"run": [], "all": [], "call": []} for n in FRAMES
    }
    for name, (count, density) in FRAMES.items():
        overrides = {"racket.frame.segments": count, "racket.frame.density": density}
        cases[name] = resolve(
            Scenario(
                support="grip", grip="hand_medium", grip_kind="hand", approach_time=0.0,
                engine="compiled", overrides=overrides if count > 2 else {},
            )
        )  # fmt: skip
        models[name] = CompiledImpact(make_impact_diagram(cases[name]))
        simulate(cases[name], models[name].system, history=False)
    for _ in range(ROUNDS):
        for name, model in models.items():
            begin = process_time()
            start = model.start(cases[name])
            ready = process_time()
            kept = model.samples(cases[name], start)
            done = process_time()
            model.trajectory(start, kept, every_sample=False)
            read = process_time()
            simulate(cases[name], model.system, history=False)
            times[name]["run"].append(done - ready)
            times[name]["all"].append(read - begin)
            times[name]["call"].append(process_time() - read)
            runs[name] = kept.evaluations
    print(f"{versions('numba')}\n")
    rows = []
    for what, key in (
        ("integration alone", "run"),
        ("with reading the case and making its arrays", "all"),
        ("simulate without a history", "call"),
    ):
        ms = {name: 1e3 * median(own[key]) for name, own in times.items()}
        rows.append([what, f"{ms['two']:.1f} ms", *(f"{ms[n] / ms['two']:.2f}" for n in [*ms][1:])])
    rows.append(["evaluations", *(str(runs[n]) for n in FRAMES)])
    print(table(["", *FRAMES], rows))


if __name__ == "__main__":
    main()
