"""The durable results of a sweep: one SQLite file, `sweep.sqlite`, readable with any SQLite.

    table cases     one row per finished case: case (its number), hash (of its scenario), status
                    (done or failed), failure, warnings (JSON list), seconds, then one column per
                    output; NULL is NaN
    table sweep     key, value (JSON): fingerprint (base scenario, files with their content, axes,
                    outputs, versions), content_hash, hashes (of all cases' scenarios), units

One process writes. Each commit is on the disk when it returns (synchronous EXTRA), so that kill -9
and power cuts cost only the cases that are not in a commit. A rollback journal and not WAL: it
works on network disks, where sweeps of a cluster often are, and the one file is whole whenever no
commit is under way; what WAL gives instead, readers beside a busy writer, matters little at one
short commit a moment.
"""

from __future__ import annotations

import fcntl
import json
import math
import re
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from drake_racket.io.errors import InputError
from drake_racket.io.files import meant_for
from drake_racket.io.fingerprint import digest
from drake_racket.results.formats import FORMATS
from drake_racket.sweep.identity import as_text, difference
from drake_racket.sweep.outputs import SweepOutput
from drake_racket.sweep.worker import Outcome

FILE = "sweep.sqlite"
LOCK = "sweep.lock"


@dataclass(frozen=True)
class Row:
    """One finished case."""

    case: int
    failure: str
    warnings: list[str]
    values: list[float]


class Store:
    """The results of one sweep, in a directory or (None) in memory. One process may have it."""

    def __init__(
        self,
        directory: Path | None,
        identity: dict[str, Any],
        hashes: Sequence[str],
        outputs: Sequence[SweepOutput],
    ) -> None:
        """Opens the store, or makes it.

        Args:
            directory: where the file is.
            identity: the sweep's `identity.fingerprint`.
            hashes: of all cases' scenarios.
            outputs: what is kept of every case.

        Raises:
            InputError: the directory holds another sweep, or another process writes there.

        """
        self._names = [output.name for output in outputs]
        self._lock = None if directory is None else _lock(directory)
        try:
            self._database = _connect(directory)
            try:
                self._begin(directory, identity, hashes, outputs)
            except BaseException:
                self._database.close()
                raise
        except sqlite3.Error as error:
            _release(self._lock)
            allowed = f"a directory with a sweep's file, or none ({error})"
            raise InputError("--out", str(directory), allowed) from None
        except BaseException:
            _release(self._lock)
            raise

    def _begin(
        self,
        directory: Path | None,
        identity: dict[str, Any],
        hashes: Sequence[str],
        outputs: Sequence[SweepOutput],
    ) -> None:
        facts = {
            "fingerprint": identity,
            "content_hash": digest(as_text([identity, list(hashes)]).encode()),
            "hashes": list(hashes),
            "units": {output.name: output.units for output in outputs},
        }
        facts = json.loads(as_text(facts))
        tables = self._database.execute("SELECT name FROM sqlite_master").fetchall()
        if tables:
            stored = dict(self._database.execute("SELECT key, value FROM sweep"))
            _refuse_another(directory, {k: json.loads(v) for k, v in stored.items()}, facts)
            return
        columns = ", ".join(f'"{name}" REAL' for name in self._names)
        with self._database:
            self._database.execute("BEGIN")  # both tables and their content, or nothing
            self._database.execute("CREATE TABLE sweep (key TEXT PRIMARY KEY, value TEXT NOT NULL)")
            self._database.execute(
                'CREATE TABLE cases ("case" INTEGER PRIMARY KEY, hash TEXT NOT NULL,'
                " status TEXT NOT NULL CHECK (status IN ('done', 'failed')),"
                f" failure TEXT NOT NULL, warnings TEXT NOT NULL, seconds REAL, {columns})"
            )
            self._database.executemany(
                "INSERT INTO sweep VALUES (?, ?)", [(k, as_text(v)) for k, v in facts.items()]
            )

    def record(self, outcomes: Sequence[Outcome], hashes: Sequence[str]) -> None:
        """Makes finished cases durable, in one transaction."""
        marks = ", ".join("?" * (6 + len(self._names)))
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
        with self._database:
            self._database.execute("BEGIN")
            self._database.executemany(f"INSERT OR REPLACE INTO cases VALUES ({marks})", rows)

    def finished(self) -> dict[int, bool]:
        """Finished case -> whether it failed."""
        found = self._database.execute('SELECT "case", status FROM cases ORDER BY "case"')
        return {case: status == "failed" for case, status in found}

    def rows(self) -> Iterator[Row]:
        """The finished cases by their numbers."""
        found = self._database.execute('SELECT * FROM cases ORDER BY "case"')
        for case, _, _, failure, warnings, _, *values in found:
            numbers = [math.nan if x is None else float(x) for x in values]
            yield Row(case, failure, json.loads(warnings), numbers)

    def content_hash(self) -> str:
        """Hash of all that decides the results."""
        query = "SELECT value FROM sweep WHERE key = 'content_hash'"
        return str(json.loads(self._database.execute(query).fetchone()[0]))

    def close(self) -> None:
        """Closes the file and lets other processes have it."""
        self._database.close()
        _release(self._lock)


def _connect(directory: Path | None) -> sqlite3.Connection:
    name = ":memory:" if directory is None else str(directory / FILE)
    database = sqlite3.connect(name, isolation_level=None, timeout=30.0)
    database.execute("PRAGMA journal_mode = DELETE")
    database.execute("PRAGMA synchronous = EXTRA")
    return database


def _refuse_another(directory: Path | None, stored: dict[str, Any], facts: dict[str, Any]) -> None:
    found = difference(stored["fingerprint"], facts["fingerprint"])
    if found is None:  # the same data may be read by other code
        found = difference(stored["hashes"], facts["hashes"], "the cases' scenarios")
    if found is None:
        return
    key, old, new = found
    raise InputError(
        f"{directory}: {key}",
        new,
        f"{_brief(old)}, as the sweep in there has it (--fresh starts anew)",
    )


def _brief(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _lock(directory: Path) -> IO[str]:
    """Held as long as the process lives, however it ends."""
    file = (directory / LOCK).open("w")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        file.close()
        allowed = "a directory in which no other sweep is running"
        raise InputError("--out", str(directory), allowed) from None
    return file


def _release(lock: IO[str] | None) -> None:
    if lock is not None:
        lock.close()


_HISTORY = re.compile(rf"case_[0-9]{{6,}}\.({'|'.join(FORMATS)})")
_RESULTS = ("results.nc", "results.csv", "results.parquet", "sweep.json")


def remove_sweep(directory: Path) -> None:
    """Deletes what sweeps have written in a directory, and nothing else; nothing if there is none.

    What they were writing when they were killed goes, too.

    Raises:
        InputError: another process writes there.

    """
    if not (directory / FILE).exists():
        return
    with closing(_lock(directory)):
        for path in [
            *(p for p in directory.glob("histories/*") if _HISTORY.fullmatch(meant_for(p).name)),
            *(p for p in directory.iterdir() if meant_for(p).name in _RESULTS),
            directory / f"{FILE}-journal",
            directory / FILE,  # last: as long as it is there, the rest is known to be a sweep's
        ]:
            path.unlink(missing_ok=True)
