"""Writes an expression of a law, and beside it the expression of its lanes.

Each rule of differentiation is here: of operators, of functions of numbers, of arrays and tuples
that are indexed. Calls of laws become calls of their twins, which `forward` writes.
"""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from drake_racket.engines.compiled.tangents.kinds import (
    NUMBER,
    Kind,
    NotDifferentiable,
    Twin,
    array,
    join,
)

Written = tuple[ast.expr, ast.expr | None, Kind]
"""Value, lanes (None: it has no derivative) and kind."""


def _d(name: str) -> ast.Name:
    return ast.Name("d_" + name, ast.Load())


def name_of(name: str) -> ast.Name:
    """Gives a name that is read."""
    return ast.Name(name, ast.Load())


def called(name: str, *arguments: ast.expr) -> ast.Call:
    """Gives a call of a function by its name."""
    return ast.Call(name_of(name), list(arguments), [])


def _product(a: ast.expr, b: ast.expr) -> ast.expr:
    return ast.BinOp(a, ast.Mult(), b)


def _code(text: str, **parts: ast.expr) -> ast.expr:
    """An expression from a pattern, with parts put in by name."""

    class Put(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> ast.expr:
            return parts.get(node.id, node)

    made: ast.expr = Put().visit(ast.parse(text, mode="eval")).body
    return made


_RULES: dict[Any, str] = {
    math.sin: "d * math.cos(x)",
    np.sin: "d * math.cos(x)",
    math.cos: "-d * math.sin(x)",
    math.tan: "d * (1.0 + math.tan(x) ** 2)",
    math.exp: "d * math.exp(x)",
    math.log: "d / x",
    math.sqrt: "d * (0.5 / math.sqrt(x))",
    np.sqrt: "d * (0.5 / math.sqrt(x))",
    math.tanh: "d * (1.0 - math.tanh(x) ** 2)",
    abs: "(d if x > 0.0 else -d)",
    float: "d",
}
_LARGER = (max, np.maximum)
_SMALLER = (min, np.minimum)
_PLAIN = (int, len, bool, round, range, math.isfinite)


class Expressions:
    """Writes the expressions of one twin; statements that must come before them go to `out`."""

    def __init__(
        self,
        twin: Callable[[Callable[..., Any], tuple[Kind, ...]], Twin],
        law: Callable[..., Any],
        kinds: dict[str, Kind],
    ) -> None:
        """Takes what gives the twin of a law that is called, the law, and its arguments' kinds."""
        self._twin, self._law = twin, law
        self.kinds: dict[str, Kind] = dict(kinds)
        self.used: dict[str, Any] = {}
        self._count = 0

    def _expression(self, e: ast.expr, out: list[ast.stmt], *, kept: bool = True) -> Written:
        """Value, lanes and kind of an expression; calls of laws are made before the statement."""
        if isinstance(e, (ast.Constant, ast.Compare, ast.BoolOp, ast.Attribute)):
            return e, None, None
        if isinstance(e, ast.Name):
            kind = self.kinds.get(e.id)
            return e, None if kind is None else _d(e.id), kind
        if isinstance(e, ast.Tuple):
            return self._tuple(e, out)
        if isinstance(e, ast.UnaryOp):
            x, d, kind = self._expression(e.operand, out)
            if isinstance(e.op, ast.Not):
                return e, None, None
            made = ast.UnaryOp(e.op, x)
            return made, None if d is None else ast.UnaryOp(e.op, d), kind
        if isinstance(e, ast.BinOp):
            return self._binary(e, out)
        if isinstance(e, ast.Subscript):
            return self._subscript(e, out)
        if isinstance(e, ast.IfExp):
            a, da, ka = self._expression(e.body, out)
            b, db, kb = self._expression(e.orelse, out)
            kind = join(ka, kb)
            chosen = ast.IfExp(e.test, a, b)
            if kind is None:
                return chosen, None, None
            return (
                chosen,
                ast.IfExp(e.test, self._full(da, ka, kind), self._full(db, kb, kind)),
                kind,
            )
        if isinstance(e, ast.Call):
            return self._called(e, out, kept)
        raise self._refused(e)

    def _tuple(self, e: ast.Tuple, out: list[ast.stmt]) -> Written:
        parts = [self._expression(x, out) for x in e.elts]
        made = ast.Tuple([x for x, _, _ in parts], ast.Load())
        kinds = tuple(kind for _, _, kind in parts)
        if all(kind is None for kind in kinds):
            return made, None, None
        held: list[ast.expr] = [ast.Constant(0.0) if d is None else d for (_, d, _) in parts]
        if set(kinds) <= {None, NUMBER}:  # all numbers, or it could not be indexed in a loop
            kinds = (NUMBER,) * len(kinds)
            held = [called("lanes_zero") if d is None else d for (_, d, _) in parts]
        return made, ast.Tuple(held, ast.Load()), ("tuple", kinds)

    def _binary(self, e: ast.BinOp, out: list[ast.stmt]) -> Written:
        a, da, ka = self._expression(e.left, out)
        b, db, kb = self._expression(e.right, out)
        made = ast.BinOp(a, e.op, b)
        if ka is None and kb is None:
            return made, None, None
        if {ka, kb} - {None, NUMBER}:
            raise self._refused(e)
        return made, self._slope(e, a, da, b, db), NUMBER

    def _slope(
        self, e: ast.BinOp, a: ast.expr, da: ast.expr | None, b: ast.expr, db: ast.expr | None
    ) -> ast.expr:
        op = e.op
        if isinstance(op, (ast.Add, ast.Sub)):
            if da is not None and db is not None:
                return ast.BinOp(da, op, db)
            if da is not None:
                return da
            assert db is not None
            return db if isinstance(op, ast.Add) else ast.UnaryOp(ast.USub(), db)
        if isinstance(op, ast.Mult):
            terms = [_product(d, x) for d, x in ((da, b), (db, a)) if d is not None]
            return terms[0] if len(terms) == 1 else ast.BinOp(terms[0], ast.Add(), terms[1])
        if isinstance(op, ast.Div):
            if db is None:
                assert da is not None
                return _code("da * (1.0 / b)", da=da, b=b)
            if da is None:
                return _code("db * (-a / (b * b))", db=db, a=a, b=b)
            return _code("(da - db * (a / b)) * (1.0 / b)", da=da, db=db, a=a, b=b)
        if isinstance(op, ast.Pow) and isinstance(b, ast.Constant) and da is not None:
            power = float(b.value)  # type: ignore[arg-type]
            if power == 2.0:
                return _code("da * (2.0 * a)", da=da, a=a)
            if power == 0.5:
                return _code("da * (0.5 / math.sqrt(a))", da=da, a=a)
            return _code(f"da * ({power} * a ** {power - 1.0})", da=da, a=a)
        raise self._refused(e)

    def _subscript(self, e: ast.Subscript, out: list[ast.stmt]) -> Written:
        x, d, kind = self._expression(e.value, out)
        made = ast.Subscript(x, e.slice, ast.Load())
        if kind is None:
            return made, None, None
        assert d is not None
        if kind[0] == "tuple":
            number = self._constant(e.slice)
            own = kind[1][number] if isinstance(number, int) else kind[1][0]
            if number is None and len(set(kind[1])) > 1:
                raise self._refused(e)
            if own is None:
                return made, None, None
            if isinstance(d, ast.Tuple) and isinstance(number, int):
                return made, d.elts[number], own
            return made, ast.Subscript(d, e.slice, ast.Load()), own
        rank = self._rank_after(kind, e.slice)
        if rank == 0:
            return made, called("lanes_load", d, *places(e.slice)), NUMBER
        return made, ast.Subscript(d, e.slice, ast.Load()), array(rank)

    def _rank_after(self, kind: Kind, index: ast.expr) -> int:
        """The rank that is left after indexing an array."""
        if kind[0] != "array":
            raise self._refused(index)
        taken = 0
        for place in places(index):
            sliced = isinstance(place, ast.Slice) or isinstance(self._constant(place), slice)
            taken += 0 if sliced else 1
        rank: int = kind[1] - taken
        if rank < 0:
            raise self._refused(index)
        return rank

    def _constant(self, e: ast.expr) -> Any:
        """The value of an index that does not change; None if it may."""
        names = [n.id for n in ast.walk(e) if isinstance(n, ast.Name)]
        if any(name not in self._law.__globals__ or name in self.kinds for name in names):
            return None
        if isinstance(e, (ast.Slice, ast.Tuple)):
            return None
        code = compile(ast.fix_missing_locations(ast.Expression(e)), "<index>", "eval")
        return eval(code, dict(self._law.__globals__))

    def _called(self, e: ast.Call, out: list[ast.stmt], kept: bool) -> Written:
        function = self._function(e.func)
        if e.keywords or any(isinstance(a, ast.Starred) for a in e.args):
            raise self._refused(e)
        parts = [self._expression(a, out) for a in e.args]
        values = [x for x, _, _ in parts]
        plain: ast.expr = ast.Call(e.func, values, [])
        held = function in _PLAIN or getattr(function, "is_root", False)
        if held or all(kind is None for _, _, kind in parts):
            if not kept:
                out.append(ast.Expr(plain))
            return plain, None, None
        if function in _RULES:
            return plain, _code(_RULES[function], x=values[0], d=_part(parts[0])), NUMBER
        if function is math.atan2:
            (y, dy, _), (x, dx, _) = parts
            terms = "(dy * x - dx * y) * (1.0 / (x * x + y * y))"
            zero = called("lanes_zero")
            return plain, _code(terms, x=x, y=y, dx=dx or zero, dy=dy or zero), NUMBER
        if function in _LARGER or function in _SMALLER:
            (a, da, _), (b, db, _) = parts
            pattern = "(da if a > b else db)" if function in _LARGER else "(da if a < b else db)"
            zero = called("lanes_zero")
            return plain, _code(pattern, a=a, b=b, da=da or zero, db=db or zero), NUMBER
        if not inspect.isfunction(function) or function.__module__.startswith("numpy"):
            raise self._refused(e)
        return self._law_called(function, parts, out)

    def _law_called(
        self,
        function: Callable[..., Any],
        parts: list[Written],
        out: list[ast.stmt],
    ) -> Written:
        twin = self._twin(function, tuple(kind for _, _, kind in parts))
        self.used[twin.name] = twin.function
        arguments = []
        for x, d, _ in parts:
            arguments += [x] if d is None else [x, d]
        call = called(twin.name, *arguments)
        result = self._temporary()
        out.append(ast.Assign([ast.Name(result, ast.Store())], call))
        if twin.gives is None:
            return name_of(result), None, None
        value = ast.Subscript(name_of(result), ast.Constant(0), ast.Load())
        tangent = ast.Subscript(name_of(result), ast.Constant(1), ast.Load())
        return value, tangent, twin.gives

    # ---- the rest

    def _function(self, e: ast.expr) -> Any:
        code = compile(ast.fix_missing_locations(ast.Expression(e)), "<name>", "eval")
        return eval(code, dict(self._law.__globals__))

    def _note(self, name: str, kind: Kind) -> None:
        self.kinds[name] = join(self.kinds.get(name), kind)

    def _full(self, d: ast.expr | None, kind: Kind, wanted: Kind) -> ast.expr:
        """Lanes of the kind that a name has elsewhere: zero where this value has none."""
        if kind == wanted and d is not None:
            return d
        if wanted == NUMBER:
            return called("lanes_zero") if d is None else d
        if wanted is None:
            return ast.Constant(0.0)
        if wanted[0] == "tuple" and (d is None or isinstance(d, ast.Tuple)):
            own = kind[1] if kind is not None else (None,) * len(wanted[1])
            held = d.elts if isinstance(d, ast.Tuple) else [None] * len(wanted[1])
            return ast.Tuple(
                [
                    self._full(x if k is not None else None, k, w)
                    for x, k, w in zip(held, own, wanted[1], strict=True)
                ],
                ast.Load(),
            )
        raise NotDifferentiable(f"{self._law.__name__}: {kind} where {wanted} is needed")

    def _temporary(self) -> str:
        self._count += 1
        return f"t{self._count}_"

    def _refused(self, node: ast.AST) -> NotDifferentiable:
        where = f"{self._law.__module__}.{self._law.__name__}"
        return NotDifferentiable(f"{where}: {ast.unparse(node)}")


def places(index: ast.expr) -> list[ast.expr]:
    """Gives the places of an index, one an axis."""
    return list(index.elts) if isinstance(index, ast.Tuple) else [index]


def _part(part: Written) -> ast.expr:
    assert part[1] is not None
    return part[1]
