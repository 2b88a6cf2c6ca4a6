"""Writes the tangent of a law from its source: forward differentiation, function by function.

A law and all `compilable` functions that it calls are read as syntax trees; for each a twin is
made that computes what the law does, and beside every number x that depends on the state or on a
parameter its lanes d_x (see `lanes`). So a derivative cannot differ from its law: there is no
second law. A twin takes d_x after each such argument x, and returns (value, lanes).

A function marked `finds_root` solves an equation: its own derivative is left out, since the step of
Newton's method that follows on it has that of the root.

What depends on what is found by itself from the kinds of the entry's arguments. The subset of
Python that laws are written in is small; anything else is refused with its place. Statements are
here, expressions and their rules in `expressions`.
"""

from __future__ import annotations

import ast
import inspect
import linecache
import math
import sys
import textwrap
from collections.abc import Callable
from typing import Any

from drake_racket.engines.compiled.tangents import lanes
from drake_racket.engines.compiled.tangents.expressions import Expressions, called, name_of, places
from drake_racket.engines.compiled.tangents.kinds import (
    NUMBER,
    Kind,
    NotDifferentiable,
    Twin,
    join,
)
from drake_racket.laws.compilation import compilable


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


class _Body(Expressions):
    """Writes the body of one twin."""

    def __init__(self, writer: Tangents, law: Callable[..., Any], kinds: dict[str, Kind]) -> None:
        super().__init__(writer.twin, law, kinds)
        self.gives: Kind = None
        self.used |= {
            "lanes_load": lanes.load,
            "lanes_store": lanes.store,
            "lanes_zero": lanes.zero,
            "math": math,
        }

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
            old = ast.parse(ast.unparse(s.target), mode="eval").body
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
                held.append((element, name_of(temporary), own))
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
        held = d if d is not None else called("lanes_zero")
        out.append(ast.Expr(called("lanes_store", base, held, *places(target.slice))))


def _has_call(e: ast.expr) -> bool:
    return any(isinstance(node, ast.Call) for node in ast.walk(e))
