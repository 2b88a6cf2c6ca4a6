"""Writes the tangent of a law from its source: forward differentiation, function by function.

A law and all `compilable` functions that it calls are read as syntax trees; for each a twin is
made that computes what the law does, and beside every number x that depends on the state or on a
parameter its lanes d_x (see `lanes`). So a derivative cannot differ from its law: there is no
second law. A twin takes d_x after each such argument x, and returns (value, lanes).

A function marked `finds_root` solves an equation: its own derivative is left out, since the step of
Newton's method that follows on it has that of the root.

What depends on what is found by itself from the kinds of the entry's arguments. The subset of
Python that laws are written in is small; anything else is refused with its place.
"""

from __future__ import annotations

import ast
import inspect
import linecache
import math
import sys
import textwrap
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from drake_racket.engines.compiled.tangents import lanes
from drake_racket.laws.compilation import compilable

Kind = Any
"""What is known of a value: None, it has no derivative; NUMBER; ("array", n) of rank n; or
("tuple", kinds)."""

NUMBER = "number"


def array(rank: int) -> Kind:
    """Gives the kind of an array whose numbers have derivatives."""
    return ("array", rank)


class NotDifferentiable(Exception):
    """A law holds something that `forward` does not know."""


@dataclass(frozen=True)
class Twin:
    """A twin is the tangent of one function for one set of arguments' kinds."""

    name: str
    function: Callable[..., Any]
    gives: Kind


def join(a: Kind, b: Kind) -> Kind:
    """Gives the kind of a value that is of one kind or the other."""
    if a == b or b is None:
        return a
    if a is None:
        return b
    if a[0] == b[0] == "tuple" and len(a[1]) == len(b[1]):
        return ("tuple", tuple(join(x, y) for x, y in zip(a[1], b[1], strict=True)))
    raise NotDifferentiable(f"one name for {a} and {b}")


class Tangents:
    """Writes twins, one for each function and kinds of arguments."""

    def __init__(self) -> None:
        self._twins: dict[tuple[Callable[..., Any], tuple[Kind, ...]], Twin] = {}

    def of(self, law: Callable[..., Any], *kinds: Kind) -> Callable[..., Any]:
        """Gives the twin of a law: the same arguments, each with a derivative followed by its own.

        Raises:
            NotDifferentiable: the law, or one that it calls, holds what is not known here.

        """
        return self.twin(law, kinds).function

    def twin(self, law: Callable[..., Any], kinds: tuple[Kind, ...]) -> Twin:
        """Gives the twin of a law, written at the first call."""
        key = (law, kinds)
        if key not in self._twins:
            self._twins[key] = self._write(law, kinds)
        return self._twins[key]

    def _write(self, law: Callable[..., Any], kinds: tuple[Kind, ...]) -> Twin:
        tree = ast.parse(textwrap.dedent(inspect.getsource(law))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        names = [a.arg for a in tree.args.args]
        if len(names) != len(kinds):
            raise NotDifferentiable(f"{law.__name__}: {len(kinds)} arguments for {names}")
        body = _Body(self, law, dict(zip(names, kinds, strict=True)))
        statements = body.written(tree.body)
        arguments = []
        for name, kind in zip(names, kinds, strict=True):
            arguments += [ast.arg(name)] + ([ast.arg("d_" + name)] if kind is not None else [])
        name = f"{law.__name__}_tangent_{len(self._twins)}"
        made = ast.FunctionDef(
            name=name,
            args=ast.arguments([], arguments, None, [], [], None, []),
            body=statements or [ast.Pass()],
            decorator_list=[],
            returns=None,
        )
        if sys.version_info >= (3, 12):
            made.type_params = []
        source = ast.unparse(ast.fix_missing_locations(ast.Module([made], [])))
        file = f"<tangent {name} of {law.__module__}>"
        linecache.cache[file] = (len(source), None, source.splitlines(True), file)
        space = dict(law.__globals__) | body.used
        exec(compile(source, file, "exec"), space)
        return Twin(name, compilable(space[name]), body.gives)


def _d(name: str) -> ast.Name:
    return ast.Name("d_" + name, ast.Load())


def _name(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(_name(name), list(arguments), [])


def _product(a: ast.expr, b: ast.expr) -> ast.expr:
    return ast.BinOp(a, ast.Mult(), b)


def _text(node: ast.AST) -> str:
    return ast.unparse(node)


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


class _Body:
    """Writes the body of one twin."""

    def __init__(self, writer: Tangents, law: Callable[..., Any], kinds: dict[str, Kind]) -> None:
        self._writer, self._law = writer, law
        self.kinds: dict[str, Kind] = dict(kinds)
        self.gives: Kind = None
        self.used: dict[str, Any] = {
            "lanes_load": lanes.load,
            "lanes_store": lanes.store,
            "lanes_zero": lanes.zero,
            "math": math,
        }
        self._count = 0

    def written(self, statements: list[ast.stmt]) -> list[ast.stmt]:
        """The twin's statements; kinds of names are found by going over them until they stay."""
        while True:
            before = (dict(self.kinds), self.gives)
            self._count = 0
            out = self._block(statements)
            if before == (self.kinds, self.gives):
                return out

    # ---- statements

    def _block(self, statements: list[ast.stmt]) -> list[ast.stmt]:
        out: list[ast.stmt] = []
        for statement in statements:
            self._statement(statement, out)
        return out

    def _statement(self, s: ast.stmt, out: list[ast.stmt]) -> None:
        if isinstance(s, ast.Expr):
            if isinstance(s.value, ast.Call):
                self._expression(s.value, out, kept=False)
        elif isinstance(s, ast.Assign) and len(s.targets) == 1:
            self._assign(s.targets[0], s.value, out)
        elif isinstance(s, ast.AnnAssign) and s.value is not None:
            self._assign(s.target, s.value, out)
        elif isinstance(s, ast.AugAssign):
            old = ast.parse(_text(s.target), mode="eval").body
            self._assign(s.target, ast.BinOp(old, s.op, s.value), out)
        elif isinstance(s, ast.If):
            test = self._expression(s.test, out)[0]
            out.append(ast.If(test, self._block(s.body) or [ast.Pass()], self._block(s.orelse)))
        elif isinstance(s, ast.For):
            around = self._expression(s.iter, out)[0]
            out.append(ast.For(s.target, around, self._block(s.body) or [ast.Pass()], []))
        elif isinstance(s, ast.While):
            out.append(ast.While(s.test, self._block(s.body) or [ast.Pass()], []))
        elif isinstance(s, ast.Return):
            self._return(s.value, out)
        elif isinstance(s, (ast.Break, ast.Continue, ast.Pass)):
            out.append(s)
        else:
            raise self._refused(s)

    def _return(self, value: ast.expr | None, out: list[ast.stmt]) -> None:
        if value is None:
            out.append(ast.Return(None))
        elif isinstance(value, ast.IfExp):
            first: list[ast.stmt] = []
            other: list[ast.stmt] = []
            test = self._expression(value.test, out)[0]
            self._return(value.body, first)
            self._return(value.orelse, other)
            out.append(ast.If(test, first, other))
        else:
            x, d, kind = self._expression(value, out)
            self.gives = join(self.gives, kind)
            if self.gives is None:
                out.append(ast.Return(x))
            else:
                lanes_ = self._full(d, kind, self.gives)
                out.append(ast.Return(ast.Tuple([x, lanes_], ast.Load())))

    def _assign(self, target: ast.expr, value: ast.expr, out: list[ast.stmt]) -> None:
        if isinstance(value, ast.IfExp) and _has_call(value):
            first: list[ast.stmt] = []
            other: list[ast.stmt] = []
            test = self._expression(value.test, out)[0]
            self._assign(target, value.body, first)
            self._assign(target, value.orelse, other)
            out.append(ast.If(test, first, other))
            return
        x, d, kind = self._expression(value, out)
        if isinstance(target, ast.Tuple):
            self._unpack(target, value, x, d, kind, out)
        elif isinstance(target, ast.Name):
            self._note(target.id, kind)
            if self.kinds[target.id] is not None:
                held = self._full(d, kind, self.kinds[target.id])
                out.append(ast.Assign([ast.Name("d_" + target.id, ast.Store())], held))
            out.append(ast.Assign([target], x))
        else:
            self._set(target, d, kind, out)
            out.append(ast.Assign([target], x))

    def _unpack(
        self,
        target: ast.Tuple,
        value: ast.expr,
        x: ast.expr,
        d: ast.expr | None,
        kind: Kind,
        out: list[ast.stmt],
    ) -> None:
        """All lanes are computed before any is written, and all are written before the values."""
        count = len(target.elts)
        kinds = kind[1] if kind is not None else (None,) * count
        if len(kinds) != count:
            raise self._refused(target)
        target = ast.Tuple([self._kept_name(e) for e in target.elts], ast.Store())
        parts: list[ast.expr | None]
        if isinstance(d, ast.Tuple):
            parts = list(d.elts)
        else:
            parts = [
                None if d is None else ast.Subscript(d, ast.Constant(i), ast.Load())
                for i in range(count)
            ]
        held: list[tuple[ast.expr, ast.expr | None, Kind]] = []
        names: list[ast.expr] = []
        values: list[ast.expr] = []
        for element, part, own in zip(target.elts, parts, kinds, strict=True):
            if isinstance(element, ast.Name):
                self._note(element.id, own)
                full = self.kinds[element.id]
                if full is not None:
                    names.append(ast.Name("d_" + element.id, ast.Store()))
                    values.append(self._full(part if own is not None else None, own, full))
            elif own is not None:
                temporary = self._temporary()
                names.append(ast.Name(temporary, ast.Store()))
                assert part is not None
                values.append(part)
                held.append((element, _name(temporary), own))
            else:
                held.append((element, None, None))
        if names:
            out.append(
                ast.Assign([ast.Tuple(names, ast.Store())], ast.Tuple(values, ast.Load()))
                if len(names) > 1
                else ast.Assign([names[0]], values[0])
            )
        for element, part, own in held:
            self._set(element, part, own, out)
        out.append(ast.Assign([target], x))

    def _kept_name(self, element: ast.expr) -> ast.expr:
        """A name of its own for each number that is not used."""
        if isinstance(element, ast.Name) and element.id == "_":
            return ast.Name(self._temporary(), ast.Store())
        return element

    def _set(self, target: ast.expr, d: ast.expr | None, kind: Kind, out: list[ast.stmt]) -> None:
        """Writes lanes into an array."""
        assert isinstance(target, ast.Subscript)
        _, base, base_kind = self._expression(target.value, out)
        if base_kind is None:
            if kind is not None:
                raise self._refused(target)
            return
        assert base is not None
        if self._rank_after(base_kind, target.slice) != 0 or kind not in (None, NUMBER):
            raise self._refused(target)
        held = d if d is not None else _call("lanes_zero")
        out.append(ast.Expr(_call("lanes_store", base, held, *_places(target.slice))))

    # ---- expressions

    def _expression(
        self, e: ast.expr, out: list[ast.stmt], *, kept: bool = True
    ) -> tuple[ast.expr, ast.expr | None, Kind]:
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

    def _tuple(self, e: ast.Tuple, out: list[ast.stmt]) -> tuple[ast.expr, ast.expr | None, Kind]:
        parts = [self._expression(x, out) for x in e.elts]
        made = ast.Tuple([x for x, _, _ in parts], ast.Load())
        kinds = tuple(kind for _, _, kind in parts)
        if all(kind is None for kind in kinds):
            return made, None, None
        held: list[ast.expr] = [ast.Constant(0.0) if d is None else d for (_, d, _) in parts]
        if set(kinds) <= {None, NUMBER}:  # all numbers, or it could not be indexed in a loop
            kinds = (NUMBER,) * len(kinds)
            held = [_call("lanes_zero") if d is None else d for (_, d, _) in parts]
        return made, ast.Tuple(held, ast.Load()), ("tuple", kinds)

    def _binary(self, e: ast.BinOp, out: list[ast.stmt]) -> tuple[ast.expr, ast.expr | None, Kind]:
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

    def _subscript(
        self, e: ast.Subscript, out: list[ast.stmt]
    ) -> tuple[ast.expr, ast.expr | None, Kind]:
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
            return made, _call("lanes_load", d, *_places(e.slice)), NUMBER
        return made, ast.Subscript(d, e.slice, ast.Load()), array(rank)

    def _rank_after(self, kind: Kind, index: ast.expr) -> int:
        """The rank that is left after indexing an array."""
        if kind[0] != "array":
            raise self._refused(index)
        taken = 0
        for place in _places(index):
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

    def _called(
        self, e: ast.Call, out: list[ast.stmt], kept: bool
    ) -> tuple[ast.expr, ast.expr | None, Kind]:
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
            zero = _call("lanes_zero")
            return plain, _code(terms, x=x, y=y, dx=dx or zero, dy=dy or zero), NUMBER
        if function in _LARGER or function in _SMALLER:
            (a, da, _), (b, db, _) = parts
            pattern = "(da if a > b else db)" if function in _LARGER else "(da if a < b else db)"
            zero = _call("lanes_zero")
            return plain, _code(pattern, a=a, b=b, da=da or zero, db=db or zero), NUMBER
        if not inspect.isfunction(function) or function.__module__.startswith("numpy"):
            raise self._refused(e)
        return self._law_called(function, parts, out)

    def _law_called(
        self,
        function: Callable[..., Any],
        parts: list[tuple[ast.expr, ast.expr | None, Kind]],
        out: list[ast.stmt],
    ) -> tuple[ast.expr, ast.expr | None, Kind]:
        twin = self._writer.twin(function, tuple(kind for _, _, kind in parts))
        self.used[twin.name] = twin.function
        arguments = []
        for x, d, _ in parts:
            arguments += [x] if d is None else [x, d]
        call = _call(twin.name, *arguments)
        result = self._temporary()
        out.append(ast.Assign([ast.Name(result, ast.Store())], call))
        if twin.gives is None:
            return _name(result), None, None
        value = ast.Subscript(_name(result), ast.Constant(0), ast.Load())
        tangent = ast.Subscript(_name(result), ast.Constant(1), ast.Load())
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
            return _call("lanes_zero") if d is None else d
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
        return NotDifferentiable(f"{where}: {_text(node)}")


def _places(index: ast.expr) -> list[ast.expr]:
    return list(index.elts) if isinstance(index, ast.Tuple) else [index]


def _part(part: tuple[ast.expr, ast.expr | None, Kind]) -> ast.expr:
    assert part[1] is not None
    return part[1]


def _has_call(e: ast.expr) -> bool:
    return any(isinstance(node, ast.Call) for node in ast.walk(e))
