"""Plans a sweep's cases before they run: which are valid, and which share a Diagram."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from drake_racket.cases.case import resolve
from drake_racket.io.errors import InputError, one_line
from drake_racket.parameters.scenario import Scenario
from drake_racket.results.outputs import Output
from drake_racket.sweep.identity import file_hashes, named_files, scenario_hash
from drake_racket.sweep.spec import Sweep


@dataclass
class CasePlan:
    """Says what is known of every case before the first one runs.

    Attributes:
        hashes: of the cases' scenarios; empty where there is none.
        invalid: case -> why it cannot run.
        group: case -> number of its topology, in order of first appearance.
        builders: by that number, the scenario that the Diagram is built from: the first case's, so
            that no result depends on which case a process meets first.
        files: name -> hash of every file that a case names.

    """

    hashes: list[str] = field(default_factory=list)
    invalid: dict[int, str] = field(default_factory=dict)
    group: dict[int, int] = field(default_factory=dict)
    builders: list[Scenario] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)

    def order(self) -> list[int]:
        """Gives the valid cases, by topology: a process then needs few Diagrams at a time."""
        return sorted(self.group, key=lambda case: (self.group[case], case))


def make_plan(
    sweep: Sweep, checked: Callable[[int], None] | None = None, *, strict: bool = False
) -> CasePlan:
    """Checks every case.

    Cases that are not valid are kept with the reason; what cannot be meant is refused: a value on
    an axis of one key with which no case is valid, and an output that no case can have.

    Args:
        sweep: the sweep.
        checked: called with the number of cases checked so far.
        strict: refuse any case that is not valid.

    Raises:
        InputError: naming the key, the value and what is allowed.

    """
    plan = CasePlan()
    numbers: dict[Any, int] = {}
    errors: dict[int, InputError] = {}
    possible: set[str] = set()
    for case in range(len(sweep)):
        try:
            scenario = sweep.scenario(case)
            key = resolve(scenario).topology
        except InputError as error:
            if strict:
                raise
            errors[case] = error
            plan.hashes.append("")
        else:
            new = [name for name in named_files(scenario) if name not in plan.files]
            plan.files |= file_hashes(new)
            plan.hashes.append(scenario_hash(scenario, plan.files))
            if key not in numbers:
                numbers[key] = len(numbers)
                plan.builders.append(scenario)
            plan.group[case] = numbers[key]
            possible |= {o.name for o in sweep.outputs if o.available(scenario)}
        if checked is not None:
            checked(case + 1)
    _refuse_values(sweep, errors)
    for output in sweep.outputs:
        if output.name not in possible:
            raise InputError("outputs", output.name, f"one that a case has ({_needed(output)})")
    plan.invalid = {case: one_line(f"not valid: {error}") for case, error in errors.items()}
    return plan


def _refuse_values(sweep: Sweep, errors: dict[int, InputError]) -> None:
    if len(errors) == len(sweep):
        raise errors[0]
    if not errors:
        return
    for i, axis in enumerate(sweep.axes):
        if axis.joint:
            continue
        good = {sweep.places(case)[i] for case in range(len(sweep)) if case not in errors}
        for case, error in errors.items():
            if sweep.places(case)[i] not in good:
                raise error


def _needed(output: Output) -> str:
    needs = {"audit": "audit: true", "hand": "support grip or limb"}
    return needs.get(output.needs, "support limb")
