"""Has the tangents of the engine's own functions, written from their sources when imported."""

from __future__ import annotations

from drake_racket.engines.compiled import integrate
from drake_racket.engines.compiled.dynamics import events, rates
from drake_racket.engines.compiled.dynamics.layout import TABLES
from drake_racket.engines.compiled.tangents.forward import Tangents
from drake_racket.engines.compiled.tangents.kinds import NUMBER, Kind, array

_KINDS = [array(1 if columns == 0 else 2) if kind else None for kind, _, columns in TABLES]
_TABLES: Kind = ("tuple", (*_KINDS, None, array(1)))
"""Kinds of the tables of `layout.open_model`: integers, floats, header, globals."""

_WORK: Kind = ("tuple", tuple(array(n) for n in (1, 2, 2, 1, 2, 2, 2, 1, 2, 2, 1)))
"""Kinds of the work arrays of `integrate`."""

_MOVED = (array(2), array(2))  # work rows of nodes and of leaves

_tangent = Tangents().of
_row, _rows = array(1), array(2)

move = _tangent(rates.move, _TABLES, _row, None, _row, *_MOVED)
rates_of = _tangent(rates.rates, _TABLES, _row, _rows, _row, *_MOVED, _row, _row)
take = _tangent(integrate.take, _TABLES, _row, NUMBER, _rows, None, _WORK, _row)
split_friction = _tangent(integrate.split_friction, _TABLES, None, _rows, _WORK, None, None)
watched = _tangent(events.watched, _TABLES, None, _row, _rows, *_MOVED)
update = _tangent(events.update, _TABLES, None, NUMBER, _row, _rows, *_MOVED)
pass_event = _tangent(events.pass_event, _TABLES, None, NUMBER, _row, _rows, *_MOVED)
