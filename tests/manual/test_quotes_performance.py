"""The pages on cost have the numbers of the benchmarks' result files (docs/results).

Timings want a quiet machine: `python -m manual.refresh compiled_engine tangents work_precision`. A
benchmark whose result is not committed is skipped by name.
"""

from __future__ import annotations

import re

import pytest

from manual.refresh import COMMANDS, RESULTS
from tests.manual.quotes import found, printed, says

PAGE = "performance"


def committed(name: str) -> pytest.MarkDecorator:
    there = (RESULTS / f"{name}.txt").is_file()
    return pytest.mark.skipif(not there, reason=f"no result of {name} is committed")


def lines_of(table: int, support: str) -> list[str]:
    """The cells of a row of the first or the second table, without errors in brackets."""
    text = printed("compiled_engine").split("50 ms from touch")[table]
    (line,) = re.findall(rf"^\| {support} +\|(.*)\|$", text, re.MULTILINE)
    return [re.sub(r"\(.*\)", "", cell).strip() for cell in line.split("|")]


@committed("compiled_engine")
def test_the_compiled_engine():
    for name, support in (("free", "free"), ("in a hand", "grip"), ("limb", "limb")):
        says(PAGE, f"| {name} | {' | '.join(lines_of(0, support))} |")
    short = {}
    for name in ("free", "limb"):
        drake, compiled, *others = lines_of(1, name)
        says(PAGE, f"| {name} | {float(drake):.0f} | {compiled} | {' | '.join(others)} |")
        short[name] = f"{float(drake) / 1e3:.1f} s", f"{float(compiled):.0f} ms"
    rate, per_second, checked = found(
        "compiled_engine", r"sweep: (\d+) cases .* CPU, (\d+) a second; ([\d.]+) ms"
    )
    (first,) = found("compiled_engine", r"empty cache: ([\d.]+) s of CPU")
    says(
        PAGE,
        f"A sweep runs {rate:.0f} cases of 10 ms for each second of CPU, once each is checked,"
        f" which takes {checked:.1f} ms.",
        f"two cores run {round(per_second, -1):.0f} a second",
        f"A first impact with an empty cache takes {first:.0f} s of CPU",
        f"| one impact of 50 ms, free racket | {' | '.join(short['free'])} |",
        f"| the same in the shipped arm | {' | '.join(short['limb'])} |",
        f"| first use after installing | - | {first:.0f} s, once, to compile |",
    )
    says("engines", f"takes {first:.0f} s of CPU")
    drake, compiled = short["free"]
    says("project/questions", f"{drake} for an impact of 50 ms in Drake, {compiled} compiled")


@committed("tangents")
@pytest.mark.parametrize("racket", ["free", "hand", "limb"])
def test_tangents(racket):
    lines = re.findall(rf"^\| {racket} +\|(.*)\|$", printed("tangents"), re.MULTILINE)
    assert len(lines) == 4
    for line in lines:
        count, run, tangents, share, whole = [cell.strip() for cell in line.split("|")]
        whole = f"{float(whole):.0f}" if float(whole) >= 10 else whole
        if count != "8" and (racket, count) != ("limb", "1"):
            says(PAGE, f"| {racket} | {count} | {run} | {tangents} | {share} | {whole} |")


@committed("tangents")
def test_the_first_compile_of_tangents():
    (seconds,) = found("tangents", r"its tangents (\d+) s of CPU")
    says(PAGE, f"takes about {round(seconds, -1):.0f} s of CPU more than that of a run")


SETTINGS = {
    "RK3, accuracy 1e-2": ("runge_kutta3", "accuracy 0.01"),
    "RK3, accuracy 1e-3": ("runge_kutta3", "accuracy 0.001"),
    "RK3, accuracy 2e-4": ("default", "accuracy 0.0002"),
    "RK3, accuracy 1e-5": ("runge_kutta3", "accuracy 1e-05"),
    "RK3, fixed 50 µs": ("runge_kutta3", "step 50 us"),
    "RK3, fixed 10 µs": ("runge_kutta3", "step 10 us"),
    "RK5, accuracy 2e-4": ("runge_kutta5", "accuracy 0.0002"),
    "RK5, fixed 5 µs": ("runge_kutta5", "step 5 us"),
}


def _short(error: str) -> str:
    return f"{float(error):.0e}".replace("e-0", "e-")


@committed("work_precision")
@pytest.mark.parametrize("name", SETTINGS)
def test_work_and_precision(name):
    scheme, setting = SETTINGS[name]
    lines = re.findall(
        rf"^\| {scheme} +\| +{re.escape(setting)} +\|(.*)\|$", printed("work_precision"), re.M
    )
    shown = []
    for line in lines[:3]:
        rebound, energy, _, evaluations = [cell.strip() for cell in line.split("|")]
        shown += [_short(rebound), _short(energy), evaluations]
    says(PAGE, f"| {name} | {' | '.join(shown)} |")


def test_each_result_has_its_command():
    names = {path.name.split(".")[0] for path in RESULTS.iterdir()}
    assert names <= set(COMMANDS)
    for name in names:
        assert printed(name).startswith(f"$ python {COMMANDS[name]}\n")
