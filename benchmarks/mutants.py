"""Changes one thing in a module, runs the default tests that mirror it, and says which noticed.

    python benchmarks/mutants.py [--modules laws/contact.py limbs ...] [--each 3] [--seed 1]
                                 [--out mutants.jsonl] [--seconds 240]

A mutant is one random change in a function's code: a comparison or its border, an arithmetic sign
or operator, `and` for `or`, a `not` taken away, a number by 1 % (a whole one by 1), a branch turned
round. Texts, annotations, `__repr__` and what only types see are let be. The tests are those of the
module's own file in the mirrored folder (`tests/laws/test_contact.py` of `laws/contact.py`), or
else all of that folder's, or what `BESIDE` names; slow tests are left out. The package is copied
first: the working tree is never touched. The same seed gives the same mutants of the same source.

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
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE, TESTS = ROOT / "drake_racket", ROOT / "tests"

BESIDE = {
    "simulation.py": ["test_simulation.py", "test_impact.py"],
    "pool.py": ["test_pool.py"],
    "store.py": ["test_store.py"],
    "cases/effort.py": ["cases/test_effort.py"],
    "cases": ["cases", "plant/test_composition.py"],
    "engines/drake": ["engines/test_drake_engine.py", "test_impact.py"],
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
    "plots": ["cli/test_plot_command.py", "cli/test_names_in_files.py"],
    "results/loads.py": ["results/test_loads.py"],
    "results/warnings.py": ["results/test_warnings.py"],
    "results": ["results", "test_impact.py"],
}
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
_SILENT = {"__repr__", "shown"}


@dataclass
class Mutant:
    """Holds one change: where, from what to what, and whether a test noticed it."""

    module: str
    line: int
    before: str
    after: str
    found: bool = False
    by: str = ""
    seconds: float = 0.0


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
    elif isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
    ):
        yield from ast.walk(node)


def mutate(source: str, choice: random.Random) -> tuple[str, Mutant] | None:
    """One change of a source, chosen at random; None where there is nothing to change."""
    tree = ast.parse(source)
    found = list(sites(tree))
    if not found:
        return None
    node, kind = choice.choice(found)
    before = ast.unparse(node)
    line = int(getattr(node, "lineno", 0))
    _change(node, kind, choice)
    text = ast.unparse(ast.fix_missing_locations(tree))
    return text, Mutant("", line, before, ast.unparse(node))


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


def tests_of(module: str) -> list[str]:
    """The tests that mirror a module, as paths below tests/."""
    for key, listed in BESIDE.items():
        if module == key or module.startswith(f"{key}/"):
            return listed
    room, _, rest = module.partition("/")
    own = TESTS / room / f"test_{Path(rest).stem}.py"
    if rest and own.is_file():
        return [str(own.relative_to(TESTS))]
    return [room]


def modules(given: list[str]) -> list[str]:
    """Modules below the package, by path; all but __init__ if none is given."""
    every = [str(p.relative_to(PACKAGE)) for p in sorted(PACKAGE.rglob("*.py"))]
    every = [name for name in every if not name.endswith(("__init__.py", "__main__.py"))]
    if not given:
        return every
    return [name for name in every if any(name == g or name.startswith(g + "/") for g in given)]


def run(copied: Path, tests: list[str], seconds: float) -> tuple[bool, str]:
    """Whether the tests notice, and the first that does."""
    environment = os.environ | {"PYTHONPATH": str(copied), "OPENBLAS_NUM_THREADS": "1",
                                "PYTHONDONTWRITEBYTECODE": "1"}  # fmt: skip
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider",
               *(f"tests/{test}" for test in tests)]  # fmt: skip
    try:
        done = subprocess.run(
            command, cwd=copied, env=environment, capture_output=True, text=True, timeout=seconds
        )
    except subprocess.TimeoutExpired:
        return True, "it does not end"
    if done.returncode == 0:
        return False, ""
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return True, (failed or [f"exit status {done.returncode}"])[0][:160]


def table(mutants: list[Mutant]) -> str:
    """Found and made, by room, and the survivors."""
    rooms: dict[str, list[Mutant]] = {}
    for mutant in mutants:
        rooms.setdefault(mutant.module.partition("/")[0].removesuffix(".py"), []).append(mutant)
    lines = ["| room | mutants | found |", "|---|---|---|"]
    for room, those in rooms.items():
        share = sum(m.found for m in those) / len(those)
        lines.append(f"| {room} | {len(those)} | {sum(m.found for m in those)} ({share:.0%}) |")
    lines.append("")
    lines += [
        f"- `{m.module}:{m.line}`: `{m.before}` -> `{m.after}`" for m in mutants if not m.found
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--modules", nargs="*", default=[])
    parser.add_argument("--each", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=240.0)
    parser.add_argument("--budget", type=float, default=float("inf"), help="seconds in all")
    parser.add_argument("--out", type=Path, default=Path("mutants.jsonl"))
    given = parser.parse_args()
    made: list[Mutant] = []
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        copied = Path(folder) / "repository"
        shutil.copytree(ROOT, copied, ignore=shutil.ignore_patterns(".git", "*.pyc", "figures"))
        for name in modules(given.modules):
            source = (PACKAGE / name).read_text(encoding="utf-8")
            target = copied / "drake_racket" / name
            choice = random.Random(f"{given.seed} {name}")
            for _ in range(given.each):
                if time.monotonic() - began > given.budget:
                    break
                changed = mutate(source, choice)
                if changed is None:
                    continue
                text, mutant = changed
                mutant.module = name
                target.write_text(text, encoding="utf-8")
                start = time.monotonic()
                mutant.found, mutant.by = run(copied, tests_of(name), given.seconds)
                mutant.seconds = time.monotonic() - start
                made.append(mutant)
                with given.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(mutant)) + "\n")
                word = "found" if mutant.found else "SURVIVED"
                print(f"{name}:{mutant.line} {word} {mutant.seconds:.0f} s", file=sys.stderr)
            target.write_text(source, encoding="utf-8")
    print(table(made))


if __name__ == "__main__":
    main()
