"""Changes one thing in a module, runs the default tests that pass over it, and says which noticed.

    python benchmarks/mutants.py [--modules laws/contact.py limbs ...] [--each 1] [--core 4]
                                 [--seed 1] [--reached reach.jsonl] [--out mutants.jsonl] [--again]
    python benchmarks/mutants.py --table mutants.jsonl more.jsonl [--page docs/mutants.md]

A mutant is one random change in a function's code (`benchmarks/mutations.py`). The same seed gives
the same mutants of the same source; what `--out` has already is not run again (`--again`: but for
what survived). The package is copied first: the working tree is never touched.

Which tests? Those that `--reached` has on the changed lines (`benchmarks/reached.py` writes that
file in one run of the default tests), the quickest first, those of the mirrored folder before all
others; then, for what survives or is not reached in plain Python, the tests that mirror the module
(`tests/laws/test_contact.py` of `laws/contact.py`, all of its folder, or what `BESIDE` names), and
all others that pass over it. Where a change would be compiled anew, `INTERPRETED` has modules whose
tests run with numba's compiler off. Slow tests are left out.

The outcome goes to `--out`, a line a mutant, and a table by room to standard output: found, of how
many, and each survivor with its line, to be killed by a test or to be named as equivalent. Without
running anything, `--table FILE ...` counts the outcomes of several files, the last of each mutant;
what `--page` lists under "No change at all", by module and line, is counted apart.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import re
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path

import hypothesis  # noqa: F401  this and the others are imported once, for all forks
import matplotlib.pyplot  # noqa: F401
import numba
import pandas  # noqa: F401
import pydrake.all  # noqa: F401
import pytest
import scipy.optimize  # noqa: F401
import xarray  # noqa: F401
from mutations import Mutant, mutate

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, TESTS = ROOT / "drake_racket", ROOT / "tests"
CORE = ("laws", "plant/systems", "results", "engines")
"""Rooms that have `--core` mutants a module in place of `--each`."""

INTERPRETED = ("engines/clamped", "engines/compiled", "laws")
"""Modules that are compiled: their mirrored tests run with the compiler off."""

BESIDE = {
    "simulation.py": ["test_simulation.py", "test_impact.py"],
    "pool.py": ["test_pool.py"],
    "store.py": ["test_store.py"],
    "derivatives.py": ["test_derivatives.py"],
    "optimise.py": ["test_optimise.py"],
    "cases/effort.py": ["cases/test_effort.py"],
    "cases": ["cases", "plant/test_composition.py"],
    "cli": ["cli"],
    "engines/drake": ["engines/test_drake_engine.py", "test_impact.py"],
    "engines/clamped/surface.py": ["engines/test_clamped_surface.py"],
    "engines/clamped/spinning.py": ["engines/test_clamped_surface.py"],
    "engines/clamped": ["engines/test_clamped_kernel.py"],
    "engines/compiled/tangents": ["engines/compiled/test_forward.py",
                                  "engines/compiled/test_tangents.py", "test_derivatives.py"],
    "engines/compiled/dynamics": ["engines/compiled/test_accelerations.py",
                                  "engines/compiled/test_steps.py",
                                  "engines/compiled/test_phases.py",
                                  "engines/compiled/test_surface.py"],
    "engines/compiled": ["engines/compiled/test_steps.py", "engines/compiled/test_composed.py",
                         "engines/compiled/test_trajectories.py"],
    "io/csv_text.py": ["io/test_tables.py", "io/test_signals.py"],
    "io/csv_numbers.py": ["io/test_tables.py", "io/test_signals.py", "io/test_numbers.py"],
    "io/units.py": ["io/test_tables.py", "io/test_signals.py"],
    "io/schema.py": ["io/test_text_paths.py", "io/test_yaml_files.py", "parameters"],
    "laws/limits.py": ["limbs/test_limits.py"],
    "laws/totals.py": ["test_impact.py", "limbs/test_physics.py"],
    "laws/strings.py": ["laws/test_strings.py", "engines/test_clamped_kernel.py"],
    "laws/contact.py": ["laws/test_contact.py", "plant/test_autodiff.py", "test_impact.py"],
    "laws/compilation.py": ["engines/test_clamped_kernel.py", "engines/test_without_numba.py"],
    "laws/bed.py": ["laws", "plant/test_other_beds.py"],
    "laws/surface.py": ["laws", "plant/test_surface_contact.py",
                        "engines/compiled/test_surface.py"],
    "laws/places.py": ["laws", "plant/test_surface_contact.py"],
    "limbs/chain.py": ["limbs/test_chain.py", "limbs/test_composition.py"],
    "limbs/inertia.py": ["limbs/test_chain.py"],
    "limbs/files": ["limbs/test_files.py", "limbs/test_ties.py", "limbs/test_chain.py"],
    "limbs/models.py": ["limbs/test_files.py", "limbs/test_ties.py", "limbs/test_composition.py"],
    "limbs/mujoco": ["limbs/test_mujoco.py", "limbs/test_files.py"],
    "limbs/opensim": ["limbs/test_files.py"],
    "limbs/stroke_position.py": ["limbs/test_stroke.py", "limbs/test_ties.py"],
    "limbs/stroke_velocity.py": ["limbs/test_ties.py", "limbs/test_stroke.py"],
    "limbs/stroke.py": ["limbs/test_stroke.py", "limbs/test_ties.py"],
    "limbs/torques.py": ["limbs/test_torques.py", "limbs/test_ties.py"],
    "parameters": ["parameters"],
    "plant": ["plant", "test_impact.py"],
    "plots": ["plots", "cli/test_plot_command.py", "cli/test_names_in_files.py"],
    "results/loads.py": ["results/test_loads.py"],
    "results/warnings.py": ["results/test_warnings.py"],
    "results": ["results", "test_impact.py"],
}  # fmt: skip
"""Tests of a module or room in place of those of its own file; the first key that fits counts."""


def mirrored(module: str) -> list[str]:
    """The tests that mirror a module, as paths below tests/."""
    room, _, rest = module.partition("/")
    own = TESTS / room / f"test_{Path(rest).stem}.py"
    for key, listed in BESIDE.items():
        if module == key or module.startswith(f"{key}/"):
            return listed
    if rest and own.is_file():
        return [str(own.relative_to(TESTS))]
    return [room]


AT_IMPORT = {
    "cli/": "tests/cli/test_printed.py::test_options_",
    "validation/outcome.py": "tests/validation/test_sections.py::test_plans",
    "validation/published.py": "tests/validation/test_report.py::test_a_row_without_a_tolerance_",
}
"""Tests of what runs when a module is imported, and that pass over none of its lines."""


class Reach:
    """Knows which tests pass over which lines, and how long they take."""

    def __init__(self, file: Path | None) -> None:
        self.seconds: dict[str, float] = {}
        self.by_line: dict[tuple[str, int], set[str]] = defaultdict(set)
        self.by_module: dict[str, set[str]] = defaultdict(set)
        shared: dict[str, list[tuple[str, int]]] = defaultdict(list)
        for text in file.read_text(encoding="utf-8").splitlines() if file else []:
            entry = json.loads(text)
            test = entry["test"]
            self.seconds[test] = entry["seconds"]
            for phase in ("setup", "call"):
                for module, lines in entry.get(phase, {}).items():
                    self.by_module[module].add(test)
                    for line in lines:
                        self.by_line[module, line].add(test)
                        if phase == "setup":
                            shared[test.partition("::")[0]].append((module, line))
        for test in self.seconds:
            for place in shared[test.partition("::")[0]]:
                self.by_line[place].add(test)

    def tests(self, mutant: Mutant) -> list[str]:
        """Tests that pass over a mutant: of each function one case, mirrored and quick ones first.

        Then the second case of each, and so on.
        """
        if mutant.lines:
            found = set().union(*(self.by_line[mutant.module, line] for line in mutant.lines))
        else:
            found = set(self.by_module[mutant.module])
            for start, test in AT_IMPORT.items():
                if mutant.module.startswith(start):
                    found |= {name for name in self.seconds if name.startswith(test)}
        near = tuple(f"tests/{test}" for test in mirrored(mutant.module))
        cases: dict[str, int] = defaultdict(int)
        ranks = {}
        for test in sorted(found, key=lambda test: self.seconds[test]):
            function = test.partition("[")[0]
            ranks[test] = cases[function], not test.startswith(near), self.seconds[test]
            cases[function] += 1
        return sorted(found, key=lambda test: ranks[test])

    def within(self, tests: list[str], seconds: float) -> list[str]:
        """Tests from the first on, as many as take that long by their own account."""
        chosen, total = [], 0.0
        for test in tests:
            total += self.seconds[test]
            if total > seconds and chosen:
                break
            chosen.append(test)
        return chosen


def run(
    copied: Path, tests: list[str], seconds: float, plain: bool, keep: bool = False
) -> tuple[bool, str]:
    """Whether the tests notice, and the first that does; in a fork, which has the imports.

    `plain`: with numba's compiler off; `keep`: compiled Python files are written.
    """
    said = copied / "said.txt"
    child = os.fork()
    if child == 0:
        os.setsid()
        os.chdir(copied)
        with said.open("w") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        most = int(seconds) + 1  # of processor time: the machine may be busy
        resource.setrlimit(resource.RLIMIT_CPU, (most, most))
        if plain:
            numba.config.DISABLE_JIT = 1
            os.environ["NUMBA_DISABLE_JIT"] = "1"
        sys.dont_write_bytecode = not keep
        status = 3
        try:
            status = int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", *tests]))
        finally:
            sys.stdout.flush()
            os._exit(status)
    status = _wait(child, 10.0 * seconds)
    if status is None or -status in (signal.SIGXCPU, signal.SIGKILL):
        return True, "it does not end"
    if status == 0:
        return False, ""
    text = said.read_text(encoding="utf-8", errors="replace").splitlines()
    failed = [line for line in text if line.startswith(("FAILED", "ERROR"))]
    return True, (failed or [f"exit status {status}"])[0][:160]


def _wait(child: int, seconds: float) -> int | None:
    """The exit status of a process; None if it has to be ended."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.05)
    os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


def verdict(
    copied: Path, mutant: Mutant, maps: tuple[Reach, Reach], given: argparse.Namespace
) -> None:
    """Runs the nearest tests, and for what survives them the others."""
    start = time.monotonic()
    plain = mutant.module.startswith(INTERPRETED) and bool(maps[1].tests(mutant))
    tests = maps[plain].tests(mutant)
    first = maps[plain].within(tests, given.near)
    if first:
        mutant.found, mutant.by = run(copied, first, given.seconds, plain)
    if not mutant.found:
        rest = maps[plain].within(tests[len(first) :], given.far) if given.far > 0.0 else []
        if rest:
            mutant.found, mutant.by = run(copied, rest, given.seconds, plain)
    if not mutant.found and (given.far > 0.0 or not first) and (plain or not first):
        tests = [*maps[0].within(maps[0].tests(mutant), given.far)] if plain else []
        tests = tests or [f"tests/{test}" for test in mirrored(mutant.module)]
        mutant.found, mutant.by = run(copied, tests, given.seconds, False)
    mutant.seconds = round(time.monotonic() - start, 1)


def table(mutants: list[Mutant], same: set[str] | None = None) -> str:
    """Found and made, by room, and the survivors; `same`: places whose change is none."""
    rooms: dict[str, list[Mutant]] = {}
    for mutant in mutants:
        room = mutant.module.partition("/")[0].removesuffix(".py")
        if mutant.module.startswith("plant/systems"):
            room = "plant/systems"
        rooms.setdefault(room, []).append(mutant)
    lines = ["| room | changes | found | no change at all | left |", "|---|---|---|---|---|"]
    left: list[Mutant] = []
    for room, those in [*sorted(rooms.items()), ("all", mutants)]:
        found = sum(m.found for m in those)
        survived = [m for m in those if not m.found]
        left = [m for m in survived if f"{m.module}:{m.line}" not in (same or set())]
        none = len(survived) - len(left)
        share = found / max(len(those) - none, 1)
        lines.append(f"| {room} | {len(those)} | {found} ({share:.0%}) | {none} | {len(left)} |")
    lines.append("")
    lines += [f"- `{m.module}:{m.line}`, `{m.after}` for `{m.before}`" for m in left]
    return "\n".join(lines) + "\n"


def same_as_before(page: Path | None) -> set[str]:
    """Places (`module:line`) that a page lists under "No change at all"."""
    text = page.read_text(encoding="utf-8") if page else ""
    part = text.partition("## No change at all")[2].partition("\n## ")[0]
    return set(re.findall(r"^- `([^`]+:\d+)`", part, re.MULTILINE))


def modules(given: list[str]) -> list[str]:
    """Modules below the package, by path; all but __init__ if none is given."""
    every = [str(p.relative_to(PACKAGE)) for p in sorted(PACKAGE.rglob("*.py"))]
    every = [name for name in every if not name.endswith(("__init__.py", "__main__.py"))]
    if not given:
        return every
    return [name for g in given for name in every if name == g or name.startswith(g + "/")]


def planned(given: argparse.Namespace) -> Iterator[tuple[str, Mutant]]:
    """The mutants of the seed, with the changed source; each change once."""
    for name in modules(given.modules):
        source = (PACKAGE / name).read_text(encoding="utf-8")
        choice = random.Random(f"{given.seed} {name}")
        made = set()
        for _ in range(given.core if name.startswith(CORE) else given.each):
            changed = mutate(source, choice)
            if changed is not None and changed[1].key not in made:
                changed[1].module = name
                made.add(changed[1].key)
                yield changed


def earlier(out: Path) -> dict[tuple[str, int, str, str], Mutant]:
    """What was run before; the last outcome of each."""
    lines = out.read_text(encoding="utf-8").splitlines() if out.is_file() else []
    every = (Mutant(**json.loads(line)) for line in lines)
    return {mutant.key: mutant for mutant in every}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--modules", nargs="*", default=[])
    parser.add_argument("--each", type=int, default=1)
    parser.add_argument("--core", type=int, default=4)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=60.0, help="a mutant's longest run (CPU)")
    parser.add_argument("--near", type=float, default=15.0, help="seconds of tests that run first")
    parser.add_argument("--far", type=float, default=60.0, help="seconds of tests for survivors")
    parser.add_argument("--reached", type=Path, help="lines of tests")
    parser.add_argument("--plain", type=Path, help="lines of tests in plain Python")
    parser.add_argument("--again", action="store_true", help="runs again what survived")
    parser.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    parser.add_argument("--table", type=Path, nargs="+", default=[], help="runs nothing")
    parser.add_argument("--page", type=Path, help="with what is no change at all")
    given = parser.parse_args()
    same = same_as_before(given.page)
    if given.table:
        every = {key: one for file in given.table for key, one in earlier(file).items()}
        print(table([every[key] for key in sorted(every)], same))
        return
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": "1"}
    sys.dont_write_bytecode = True
    maps, done = (Reach(given.reached), Reach(given.plain)), earlier(given.out)
    with tempfile.TemporaryDirectory() as folder:
        copied = Path(folder) / "repository"
        shutil.copytree(ROOT, copied, ignore=shutil.ignore_patterns(".git", "figures"))
        sys.path.insert(0, str(copied))
        os.environ["PYTHONPATH"] = str(copied)
        run(copied, ["--collect-only"], 600.0, False, keep=True)
        for text, mutant in planned(given):
            before = done.get(mutant.key)
            if before is not None and (before.found or not given.again):
                continue
            target = copied / "drake_racket" / mutant.module
            source, times = target.read_bytes(), target.stat()
            target.write_text(text, encoding="utf-8")
            verdict(copied, mutant, maps, given)
            target.write_bytes(source)  # as old as it was: what is compiled of it stays good
            os.utime(target, ns=(times.st_atime_ns, times.st_mtime_ns))
            done[mutant.key] = mutant
            with given.out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(mutant)) + "\n")
            word = "found" if mutant.found else "SURVIVED"
            print(f"{mutant.module}:{mutant.line} {word} {mutant.seconds:.0f} s", file=sys.stderr)
    print(table(list(done.values()), same))


if __name__ == "__main__":
    main()
