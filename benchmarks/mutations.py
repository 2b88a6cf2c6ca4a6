"""Changes one thing in a source at random: what `benchmarks/mutants.py` tries on the tests.

A comparison or its border, an arithmetic sign or operator, `and` for `or`, a `not` taken away, a
number by 1 % (a whole one by 1), a branch turned round. Texts, annotations, `__repr__`, what errors
say, how a figure looks, and what only types see are let be.
"""

from __future__ import annotations

import ast
import copy
import random
from collections.abc import Iterator
from dataclasses import dataclass, field

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
