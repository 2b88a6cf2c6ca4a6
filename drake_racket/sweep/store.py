"""Keeps a sweep's results durably in one store, `sweep.sqlite`, readable with any SQLite.

    table cases     one row per finished case: case (its number), hash (of its scenario), status
                    (done or failed), failure, warnings (JSON list), seconds, then one column per
                    output; NULL is NaN
    table checks    cases that ran in Drake once more: case, failure, then one column per output
    table header    key, value (JSON): what `identity.fingerprint` has (base scenario, files with
                    their content, axes, outputs, computation), and scenario_hashes of all cases

Each commit is on the disk when it returns: kill -9 and power cuts cost only the cases that are not
in a commit.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_racket.io.errors import InputError
from drake_racket.io.files import meant_for
from drake_racket.results.formats import FORMATS
from drake_racket.results.outputs import Output
from drake_racket.store import OtherComputation, Store, StoreReader, lock_file
from drake_racket.sweep.worker import CaseOutcome

FILE = "sweep.sqlite"


@dataclass(frozen=True)
class CaseRow:
    """Holds one finished case."""

    case: int
    failure: str
    warnings: list[str]
    values: list[float]


class SweepStore(Store):
    """Holds results of one sweep, in a directory or (None) in memory. One process may have it."""

    def __init__(
        self, directory: Path | None, header: Mapping[str, Any], outputs: Sequence[Output]
    ) -> None:
        """Opens the store, or makes it.

        Args:
            directory: where the file is.
            header: the sweep's; see the module.
            outputs: what is kept of every case.

        Raises:
            InputError: the directory holds another sweep, or another process writes there.

        """
        columns = ", ".join(f'"{output.name}" REAL' for output in outputs)
        schema = (
            'CREATE TABLE cases ("case" INTEGER PRIMARY KEY, hash TEXT NOT NULL,'
            " status TEXT NOT NULL CHECK (status IN ('done', 'failed')),"
            f" failure TEXT NOT NULL, warnings TEXT NOT NULL, seconds REAL, {columns})"
        )
        checks = (
            f'CREATE TABLE checks ("case" INTEGER PRIMARY KEY, failure TEXT NOT NULL, {columns})'
        )
        self._columns = 6 + len(outputs)
        path = None if directory is None else directory / FILE
        try:
            super().__init__(path, header, [schema, checks], key="--out", what="sweep")
        except OtherComputation as error:
            allowed = f"{error.allowed} (--fresh starts anew)"
            raise OtherComputation(error.key, error.value, allowed) from None

    def record(self, outcomes: Sequence[CaseOutcome], hashes: Sequence[str]) -> None:
        """Makes finished cases durable, in one transaction."""
        rows = [
            (
                outcome.case,
                hashes[outcome.case],
                "failed" if outcome.failure else "done",
                outcome.failure,
                json.dumps(outcome.warnings),
                outcome.seconds,
                *(None if math.isnan(x) else x for x in outcome.values),
            )
            for outcome in outcomes
        ]
        marks = ", ".join("?" * self._columns)
        self.write(f"INSERT OR REPLACE INTO cases VALUES ({marks})", rows)

    def record_checks(self, outcomes: Sequence[CaseOutcome]) -> None:
        """Makes cases that ran in Drake once more durable."""
        rows = [
            (o.case, o.failure, *(None if math.isnan(x) else x for x in o.values)) for o in outcomes
        ]
        marks = ", ".join("?" * (self._columns - 4))
        self.write(f"INSERT OR REPLACE INTO checks VALUES ({marks})", rows)

    def finished(self) -> dict[int, bool]:
        """Maps each finished case to whether it failed."""
        found = self.read('SELECT "case", status FROM cases ORDER BY "case"')
        return {case: status == "failed" for case, status in found}


def case_rows(store: StoreReader) -> Iterator[CaseRow]:
    """Gives the finished cases by their numbers."""
    for row in store.read('SELECT * FROM cases ORDER BY "case"'):
        case, _, _, failure, warnings, _, *values = row
        numbers = [math.nan if x is None else float(x) for x in values]
        yield CaseRow(case, failure, json.loads(warnings), numbers)


def check_rows(store: StoreReader) -> Iterator[CaseRow]:
    """Gives the cases that ran in Drake once more, by their numbers."""
    for case, failure, *values in store.read('SELECT * FROM checks ORDER BY "case"'):
        numbers = [math.nan if x is None else float(x) for x in values]
        yield CaseRow(case, failure, [], numbers)


def read_sweep(directory: str | Path) -> StoreReader:
    """Gives the results of a sweep that another process may be running.

    Raises:
        InputError: there is none in the directory.

    """
    directory = Path(directory)
    if not (directory / FILE).is_file():
        raise InputError("--out", str(directory), f"a directory with a sweep ({FILE})")
    return StoreReader(directory / FILE, "--out")


_HISTORY = re.compile(rf"case_[0-9]{{6,}}\.({'|'.join(FORMATS)})")
_RESULTS = ("results.nc", "results.csv", "results.parquet", "sweep.json")


def remove_sweep(directory: str | Path) -> None:
    """Deletes what sweeps have written in a directory, and nothing else; nothing if there is none.

    What they were writing when they were killed goes, too.

    Raises:
        InputError: another process writes there.

    """
    directory = Path(directory)
    if not (directory / FILE).exists():
        return
    with closing(lock_file(directory / FILE, "--out", "sweep")):
        for path in [
            *(p for p in directory.glob("histories/*") if _HISTORY.fullmatch(meant_for(p).name)),
            *(p for p in directory.iterdir() if meant_for(p).name in _RESULTS),
            directory / f"{FILE}-journal",
            directory / FILE,  # last: as long as it is there, the rest is known to be a sweep's
        ]:
            path.unlink(missing_ok=True)
