"""What a test found, as plain data, against what is recorded of it in a JSON file.

A record says all that a figure or a report has: every curve in six numbers and every text as it
stands. `RECORD=1 pytest ...` writes the files anew: read the difference before it is kept.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np

SHARE = 1e-4
"""By which a number may be off: other processors add in another order."""


def check_record(found: Any, path: Path) -> None:
    """Compares; a failure names each place that differs."""
    found = _plain(found)
    if os.environ.get("RECORD"):
        path.parent.mkdir(exist_ok=True)
        path.write_text(_text(found) + "\n", encoding="utf-8")
    recorded = json.loads(path.read_text(encoding="utf-8"))
    wrong = list(_differences(found, recorded, ""))
    assert not wrong, f"{path.name}: " + "; ".join(wrong[:10])


def summary(values: Any) -> list[Any]:
    """How many numbers are finite, of how many; first, last, least, largest, mean; up to six as
    they are.
    """
    values = np.asarray(values, dtype=float).reshape(-1)
    if len(values) <= 6:
        return [_rounded(x) for x in values]
    known = values[np.isfinite(values)]
    if not len(known):
        return [0, len(values)]
    numbers = known[0], known[-1], known.min(), known.max(), known.mean()
    return [len(known), len(values), *map(_rounded, numbers)]


def _rounded(value: float) -> float | None:
    return float(f"{value:.6g}") + 0.0 if np.isfinite(value) else None


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray):
        return summary(value)
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, (bool, str, int)) or value is None:
        return value
    return _rounded(float(value))


def _text(value: Any, indent: str = "") -> str:
    """JSON with a line for what is short."""
    line = json.dumps(value, ensure_ascii=False)
    if len(line) + len(indent) <= 100 or not isinstance(value, (dict, list)):
        return line
    inner = indent + " "
    if isinstance(value, dict):
        parts = [
            f"{json.dumps(k, ensure_ascii=False)}: {_text(v, inner)}" for k, v in value.items()
        ]
        return "{\n" + ",\n".join(inner + p for p in parts) + f"\n{indent}}}"
    return "[\n" + ",\n".join(inner + _text(v, inner) for v in value) + f"\n{indent}]"


def _differences(found: Any, recorded: Any, where: str) -> Any:
    if isinstance(found, dict) and isinstance(recorded, dict):
        for key in {**recorded, **found}:
            if key not in found or key not in recorded:
                yield f"{where}/{key}: {'not' if key not in found else 'newly'} there"
            else:
                yield from _differences(found[key], recorded[key], f"{where}/{key}")
    elif isinstance(found, list) and isinstance(recorded, list) and len(found) == len(recorded):
        numbers = [x for x in recorded if type(x) in (int, float)]
        size = max((abs(x) for x in numbers), default=0.0)
        for i, (one, other) in enumerate(zip(found, recorded, strict=True)):
            yield from _differences_of_numbers(one, other, f"{where}/{i}", size)
    else:
        yield from _differences_of_numbers(found, recorded, where, 0.0)


def _differences_of_numbers(found: Any, recorded: Any, where: str, size: float) -> Any:
    kinds = {type(found), type(recorded)}
    if kinds <= {int, float} and kinds != {int}:
        # a sum that cancels has the round-off of its terms
        if abs(found - recorded) > max(SHARE * abs(recorded), 1e-9 * size, 1e-12):
            yield f"{where}: {found} for {recorded}"
    elif (
        isinstance(found, (dict, list))
        and type(found) is type(recorded)
        and (isinstance(found, dict) or len(found) == len(recorded))
    ):
        yield from _differences(found, recorded, where)
    elif found != recorded:
        yield f"{where}: {found!r} for {recorded!r}"
