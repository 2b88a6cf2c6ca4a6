"""Changes one thing in a module, runs the default tests that pass over it, and says which noticed.

    python benchmarks/mutants.py [--modules laws/contact.py limbs ...] [--each 1] [--core 4]
                                 [--seed 1] [--reached reach.jsonl] [--out mutants.jsonl] [--again]

A mutant is one random change in a function's code: a comparison or its border, an arithmetic sign
or operator, `and` for `or`, a `not` taken away, a number by 1 % (a whole one by 1), a branch turned
round. Texts, annotations, `__repr__`, what errors say, how a figure looks, and what only types see
are let be. The same seed gives the same mutants of the same source; what `--out` has already is
not run again (`--again`: but for what survived). The package is copied first: the working tree is
never touched.

Which tests? Those that `--reached` has on the changed lines (`benchmarks/reached.py` writes that
file in one run of the default tests), the quickest first, those of the mirrored folder before all
others; then, for what survives or is not reached in plain Python, the tests that mirror the module
(`tests/laws/test_contact.py` of `laws/contact.py`, all of its folder, or what `BESIDE` names), and
all others that pass over it. Where a change would be compiled anew, `INTERPRETED` has modules whose
tests run with numba's compiler off. Slow tests are left out.

The outcome goes to `--out`, a line a mutant, and a table by room to standard output: found, of how
many, and each survivor with its line, to be killed by a test or to be named as equivalent.
"""

from __future__ import annotations

import argparse
import ast
import copy
import json
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

import hypothesis  # noqa: F401  this and the others are imported once, for all forks
import matplotlib.pyplot  # noqa: F401
import numba
import pandas  # noqa: F401
import pydrake.all  # noqa: F401
import pytest
import scipy.optimize  # noqa: F401
import xarray  # noqa: F401

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
    "engines/compiled/tangents": ["engines/compiled/test_forward.py", "test_derivatives.py"],
    "engines/compiled/dynamics": ["engines/compiled/test_accelerations.py",
                                  "engines/compiled/test_steps.py",
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

COMPARISONS: dict[type[ast.cmpop], list[type[ast.cmpop]]] = {
    ast.Lt: [ast.LtE, ast.GtE],
    ast.LtE: [ast.Lt, ast.Gt],
    ast.Gt: [ast.GtE, ast.LtE],
    ast.GtE: [ast.Gt, ast.Lt],
    ast.Eq: [ast.NotEq],
    ast.NotEq: [ast.Eq],
    ast.In: [ast.NotIn],
    ast.NotIn: [ast.In],
    ast.Is: [ast.IsNot],
    ast.IsNot: [ast.Is],
}
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
}
_SILENT = {"__repr__", "shown", "_repr_html_", "_repr_mimebundle_"}
_LOOKS = {
    "alpha", "bottom", "color", "constrained_layout", "dpi", "figsize", "fontsize", "height",
    "height_ratios", "hspace", "indent", "left", "linestyle", "linewidth", "lw", "marker",
    "markersize", "ms", "ncol", "ncols", "nrows", "pad", "right", "rotation", "s", "stacklevel",
    "top", "width", "width_ratios", "wspace", "xytext", "zorder",
}  # fmt: skip
"""Keywords of figures and texts that say how something looks."""


@dataclass
class Mutant:
    """Holds one change: where, from what to what, and whether a test noticed it."""

    module: str
    line: int
    before: str
    after: str
    lines: list[int] = field(default_factory=list)
    found: bool = False
    by: str = ""
    seconds: float = 0.0

    @property
    def key(self) -> tuple[str, int, str, str]:
        """Tells it from other mutants."""
        return self.module, self.line, self.before, self.after


def sites(tree: ast.AST) -> Iterator[tuple[ast.AST, str]]:
    """Nodes that can be changed, with the kind of change."""
    texts = {id(n) for node in ast.walk(tree) for n in _left_alone(node)}
    for node in ast.walk(tree):
        if id(node) in texts:
            continue
        if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
            yield node, "compare"
        elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            if not any(isinstance(side, ast.JoinedStr) or _is_text(side)
                       for side in (node.left, node.right)):  # fmt: skip
                yield node, "operate"
        elif isinstance(node, ast.BoolOp):
            yield node, "join"
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.Not, ast.USub)):
            yield node, "sign"
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            yield node, "number"
        elif isinstance(node, ast.IfExp):
            yield node, "branch"


def _is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _left_alone(node: ast.AST) -> Iterator[ast.AST]:
    """What below a node is no behaviour: annotations, texts, errors' words, hints for types."""
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        if node.name in _SILENT:
            yield from ast.walk(node)
        for part in (*node.decorator_list, node.returns):
            if part is not None:
                yield from ast.walk(part)
    elif isinstance(node, (ast.arg, ast.AnnAssign)) and node.annotation is not None:
        yield from ast.walk(node.annotation)
    elif isinstance(node, (ast.Raise, ast.Assert, ast.JoinedStr)) or (
        isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    ):
        yield from ast.walk(node)
    elif isinstance(node, ast.keyword) and node.arg in _LOOKS:
        yield from ast.walk(node.value)


def mutate(source: str, choice: random.Random) -> tuple[str, Mutant] | None:
    """One change of a source, chosen at random; None where there is nothing to change."""
    tree = ast.parse(source)
    found = list(sites(tree))
    if not found:
        return None
    node, kind = choice.choice(found)
    before, line = ast.unparse(node), int(getattr(node, "lineno", 0))
    lines = _lines(tree, node)
    _change(node, kind, choice)
    text = ast.unparse(ast.fix_missing_locations(tree))
    return text, Mutant("", line, before, ast.unparse(node), lines)


def _lines(tree: ast.AST, node: ast.AST) -> list[int]:
    """Lines of which a test must pass one to meet a node; none for what runs at import."""
    inside = False
    first = last = int(getattr(node, "lineno", 0))
    for parent in _parents(tree, node):
        if isinstance(parent, (ast.FunctionDef, ast.AsyncFunctionDef)):
            if any(child is node for child in ast.walk(parent.args)):
                return list(range(parent.body[0].lineno, (parent.end_lineno or 0) + 1))
            inside = True
        elif isinstance(parent, ast.stmt) and not isinstance(parent, ast.ClassDef):
            first, last = parent.lineno, parent.end_lineno or last
            if hasattr(parent, "body"):
                last = max(first, parent.body[0].lineno - 1)
    return list(range(first, last + 1)) if inside else []


def _parents(tree: ast.AST, node: ast.AST) -> Iterator[ast.AST]:
    """What a node stands in, from outside to inside."""
    for child in ast.iter_child_nodes(tree):
        if child is not node and any(below is node for below in ast.walk(child)):
            yield child
            yield from _parents(child, node)


def _change(node: ast.AST, kind: str, choice: random.Random) -> None:
    if isinstance(node, ast.Compare):
        node.ops[0] = choice.choice(COMPARISONS[type(node.ops[0])])()
    elif isinstance(node, ast.BinOp):
        node.op = OPERATORS[type(node.op)]()
    elif isinstance(node, ast.BoolOp):
        node.op = ast.Or() if isinstance(node.op, ast.And) else ast.And()
    elif isinstance(node, ast.UnaryOp):
        inner = copy.deepcopy(node.operand)
        node.__class__ = inner.__class__  # type: ignore[assignment]
        node.__dict__ = inner.__dict__ | {"lineno": node.lineno, "col_offset": node.col_offset}
    elif isinstance(node, ast.Constant):
        value = node.value
        node.value = value + 1 if isinstance(value, int) else (value * 1.01 if value else 0.01)
    elif isinstance(node, ast.IfExp):
        node.body, node.orelse = node.orelse, node.body


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
            found = self.by_module[mutant.module]
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


def table(mutants: list[Mutant]) -> str:
    """Found and made, by room, and the survivors."""
    rooms: dict[str, list[Mutant]] = {}
    for mutant in mutants:
        room = mutant.module.partition("/")[0].removesuffix(".py")
        if mutant.module.startswith("plant/systems"):
            room = "plant/systems"
        rooms.setdefault(room, []).append(mutant)
    lines = ["| room | mutants | found |", "|---|---|---|"]
    for room, those in sorted(rooms.items()):
        share = sum(m.found for m in those) / len(those)
        lines.append(f"| {room} | {len(those)} | {sum(m.found for m in those)} ({share:.0%}) |")
    lines.append(f"| all | {len(mutants)} | {sum(m.found for m in mutants)} |\n")
    lines += [
        f"- `{m.module}:{m.line}`: `{m.before}` -> `{m.after}`" for m in mutants if not m.found
    ]
    return "\n".join(lines) + "\n"


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
    given = parser.parse_args()
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
    print(table(list(done.values())))


if __name__ == "__main__":
    main()
