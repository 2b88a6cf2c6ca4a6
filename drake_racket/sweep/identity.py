"""Tells what makes two sweeps the same: scenario, files, axes, outputs, and code."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_racket.io.fingerprint import as_text, code_of, computation, digest
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.outputs import OUTPUTS, Output
from drake_racket.sweep.spec import Sweep


def named_files(scenario: Scenario) -> list[str]:
    """Gives user's own files that a scenario names. What those include in turn is not looked at."""
    names = [scenario.racket, scenario.ball]
    if scenario.support in ("grip", "limb"):
        names.append(scenario.grip)
    if scenario.support == "limb":
        names.append(scenario.limb.model)
    return [name for name in names if Path(name).suffix and Path(name).is_file()]


def file_hashes(names: list[str]) -> dict[str, str]:
    """Gives the name -> hash of its content."""
    return {name: digest(Path(name).read_bytes()) for name in names}


def scenario_hash(scenario: Scenario, files: Mapping[str, str]) -> str:
    """Gives the hash of a case: its scenario, and the content of the files it names."""
    tree = _tree(scenario) | {"files": [files[x] for x in named_files(scenario)]}
    return digest(as_text(tree).encode())


def _tree(settings: Any) -> dict[str, Any]:
    """What `dataclasses.asdict` gives, but that nothing is copied."""
    return {
        item.name: _tree(value) if dataclasses.is_dataclass(value) else value
        for item in dataclasses.fields(settings)
        for value in (getattr(settings, item.name),)
    }


def fingerprint(sweep: Sweep, files: Mapping[str, str]) -> dict[str, Any]:
    """Gives all that decides a sweep's results, as plain data.

    Args:
        sweep: the sweep.
        files: name -> hash of every file that a case names.

    """
    axes = {
        axis.name: {
            "labels": list(axis.labels),
            "keys": {
                column.key.name: {
                    "unit": column.unit,
                    "relative": column.relative,
                    "values": list(column.values),
                }
                for column in axis.columns
            },
        }
        for axis in sweep.axes
    }
    return {
        "base": dataclasses.asdict(sweep.base),
        "files": {name: {"hash": files[name], "content": _content(name)} for name in sorted(files)},
        "axes": axes,
        "outputs": [output.name for output in sweep.outputs],
        "own_outputs": {o.name: _own_code(o) for o in sweep.outputs if o.name not in OUTPUTS},
        "histories": sorted(sweep.histories),
        "history_formats": list(sweep.history_formats),
        "computation": computation(),
    }


def _own_code(output: Output) -> list[str]:
    """Hashes of the code that reads an output of the caller's own."""
    return [digest(path.read_bytes()) for path in code_of(output.read)]


def _content(name: str) -> str:
    return Path(name).read_bytes().decode("utf-8", errors="replace")
