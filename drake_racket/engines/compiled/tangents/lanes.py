"""A lane holds a number's derivatives along LANES directions; arithmetic works on all of them.

Compiled, a lane is a vector of the processor; without numba it is a NumPy array. A number's lanes
stand in an array beside its own, with LANES as last axis.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from drake_racket.laws.compilation import HAS_NUMBA

LANES = 4
"""Directions that one pass carries: what the vector units of common processors hold."""

if not HAS_NUMBA:

    def load(array: Any, *place: int) -> Any:
        """Gives the lanes of one number."""
        return array[place].copy()

    def store(array: Any, value: Any, *place: int) -> None:
        """Writes the lanes of one number."""
        array[place] = value

    def zero() -> Any:
        """Gives lanes of 0: of a constant."""
        return np.zeros(LANES)

else:
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.core.imputils import lower_builtin
    from numba.core.typing.templates import AbstractTemplate, infer_global, signature
    from numba.extending import intrinsic, models, register_model

    class LanesType(types.Type):
        """The type of lanes in compiled code."""

        def __init__(self) -> None:
            super().__init__(name=f"Lanes{LANES}")

    lanes = LanesType()
    _VECTOR = ir.VectorType(ir.DoubleType(), LANES)
    _FUSED = ("contract",)  # a product and a sum may be one instruction

    @register_model(LanesType)
    class _LanesModel(models.PrimitiveModel):
        def __init__(self, dmm: Any, fe_type: Any) -> None:
            super().__init__(dmm, fe_type, _VECTOR)

    def _spread(builder: Any, value: Any) -> Any:
        """A float in all lanes."""
        place = ir.Constant(ir.IntType(32), 0)
        start = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, place)
        mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return builder.shuffle_vector(start, ir.Constant(_VECTOR, ir.Undefined), mask)

    _WITH = {
        operator.add: ("fadd", (lanes,)),
        operator.iadd: ("fadd", (lanes,)),
        operator.sub: ("fsub", (lanes,)),
        operator.isub: ("fsub", (lanes,)),
        operator.mul: ("fmul", (types.float64,)),
        operator.truediv: ("fdiv", (types.float64,)),
    }

    def _define(function: Any, name: str) -> None:
        """Lets an operator take lanes and lanes, or lanes and a float."""
        scales = name in ("fmul", "fdiv")

        @infer_global(function)
        class _Template(AbstractTemplate):
            def generic(self, args: Any, kws: Any) -> Any:
                if len(args) != 2 or lanes not in args:
                    return None
                a, b = args
                if scales:
                    if a == lanes and isinstance(b, (types.Float, types.Integer)):
                        return signature(lanes, lanes, types.float64)
                    if name == "fmul" and isinstance(a, (types.Float, types.Integer)):
                        return signature(lanes, types.float64, lanes)
                    return None
                return signature(lanes, lanes, lanes) if a == b else None

        if scales:

            @lower_builtin(function, lanes, types.float64)
            def _right(context: Any, builder: Any, sig: Any, args: Any) -> Any:
                return getattr(builder, name)(args[0], _spread(builder, args[1]), flags=_FUSED)

            @lower_builtin(function, types.float64, lanes)
            def _left(context: Any, builder: Any, sig: Any, args: Any) -> Any:
                return getattr(builder, name)(_spread(builder, args[0]), args[1], flags=_FUSED)

        else:

            @lower_builtin(function, lanes, lanes)
            def _both(context: Any, builder: Any, sig: Any, args: Any) -> Any:
                return getattr(builder, name)(args[0], args[1], flags=_FUSED)

    for _function, (_name, _) in _WITH.items():
        _define(_function, _name)

    @infer_global(operator.neg)
    class _Negative(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            return signature(lanes, lanes) if args == (lanes,) else None

    @lower_builtin(operator.neg, lanes)
    def _negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return builder.fneg(args[0])

    def _address(context: Any, builder: Any, kind: Any, array: Any, kinds: Any, place: Any) -> Any:
        """Where the lanes of an array's number are; they are side by side."""
        held = context.make_array(kind)(context, builder, array)
        whole = [context.cast(builder, i, t, types.intp) for i, t in zip(place, kinds, strict=True)]
        start = cgutils.get_item_pointer(
            context, builder, kind, held, [*whole, ir.Constant(ir.IntType(64), 0)], wraparound=False
        )
        return builder.bitcast(start, _VECTOR.as_pointer())

    @intrinsic
    def load(typing: Any, array: Any, *place: Any) -> Any:
        """Gives the lanes of one number."""
        kinds = place[0].types if isinstance(place[0], types.BaseTuple) else place

        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            places = cgutils.unpack_tuple(builder, args[1])
            at = _address(context, builder, sig.args[0], args[0], kinds, places)
            return builder.load(at, align=8)

        return lanes(array, types.Tuple(kinds)), generate

    @intrinsic
    def store(typing: Any, array: Any, value: Any, *place: Any) -> Any:
        """Writes the lanes of one number."""
        kinds = place[0].types if isinstance(place[0], types.BaseTuple) else place

        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            places = cgutils.unpack_tuple(builder, args[2])
            at = _address(context, builder, sig.args[0], args[0], kinds, places)
            builder.store(args[1], at, align=8)
            return context.get_dummy_value()

        return types.void(array, lanes, types.Tuple(kinds)), generate

    @intrinsic
    def zero(typing: Any) -> Any:
        """Gives lanes of 0: of a constant."""

        def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            return ir.Constant(_VECTOR, None)

        return lanes(), generate
