"""Keeps results for good: a SQLite file that survives kill -9, locked against a second writer.

Sweeps, fits, the validation and the studies keep what is finished in such files, each with tables
of its own. Any SQLite reads them. The table `header` (key, value as JSON) says what was computed,
and with what (`io.fingerprint`): a file of another computation is refused, and what differs named.

A write is one transaction. Once it returns, no kill of any process undoes it; how it fares in a
power cut is a choice:

    forced     it is on the disk when the call returns (rollback journal, synchronous EXTRA). That
               works on network disks too and leaves one whole file, at some ms a write.
    otherwise  the disk has it within about a second (write-ahead log, synchronous NORMAL), at some
               tens of microseconds a write: for what is quickly computed again. Nobody else can
               read it meanwhile, so that it needs no shared memory, which network disks lack.

The lock is a file of its own beside the store, NAME.lock, held as long as the process lives,
however it ends: SQLite's would keep readers out as well.
"""

from __future__ import annotations

import fcntl
import json
import sqlite3
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from drake_racket.io.errors import InputError, WorkStopped, one_line
from drake_racket.io.fingerprint import as_text, difference

CHECKPOINT_EVERY = 1.0
"""Seconds after which a write-ahead log is brought to the disk at the latest."""


class StoreError(WorkStopped, OSError):
    """The store can no longer be read or written; what was written before is kept."""

    def __init__(self, path: Path | None, error: Exception) -> None:
        reason = one_line(getattr(error, "strerror", None) or str(error), 200)
        super().__init__(f"{path} cannot be read or written: {reason}")
        self.strerror = str(self)  # for those who know it as an OSError


class OtherComputation(InputError):
    """The store has results of another computation."""


class StoreReader:
    """Holds a store to read from, also while another process writes it.

    Raises:
        InputError: there is no such store, or the file is none; naming `key`.

    """

    def __init__(self, path: str | Path, key: str) -> None:
        path = Path(path)
        self.path: Path | None = path
        if not path.is_file():
            raise InputError(key, str(path), "a store that is there")
        try:
            # with write access where there is one: a killed writer's last transaction is undone
            self._database = sqlite3.connect(
                f"{path.resolve().as_uri()}?mode=rw", uri=True, isolation_level=None, timeout=30.0
            )
            self.header = self._read_header()
        except sqlite3.Error as error:
            raise InputError(key, str(path), f"a store ({error})") from None

    def _read_header(self) -> dict[str, Any]:
        found = self._database.execute("SELECT key, value FROM header").fetchall()
        return {key: json.loads(value) for key, value in found}

    def read(self, query: str, values: Sequence[Any] = ()) -> Iterator[tuple[Any, ...]]:
        """Gives the rows of a query; raises StoreError for a damaged file."""
        try:
            for row in self._database.execute(query, values):  # noqa: UP028 - it may outlive the file
                yield row
        except sqlite3.Error as error:
            raise StoreError(self.path, error) from None

    def close(self) -> None:
        """Lets the file go."""
        self._database.close()


class Store(StoreReader):
    """Holds a store to write to; one process may have it at a time."""

    def __init__(
        self,
        path: str | Path | None,
        header: Mapping[str, Any],
        schema: Sequence[str],
        *,
        key: str,
        what: str,
        forced: bool = True,
        patience: float = 0.0,
    ) -> None:
        """Opens the store, or makes it.

        Args:
            path: the file; None keeps everything in memory.
            header: what is computed, and with what, as plain data.
            schema: statements that make the tables.
            key: the option or argument that gave the path, for errors.
            what: is computed: `sweep`, `fit`.
            forced: see the module.
            patience: seconds to wait for another process to let it go.

        Raises:
            OtherComputation: it has another header.
            InputError: another process writes it, it cannot be made, or the file is no store.

        """
        path = None if path is None else Path(path)
        self.path = path
        self._forced = forced
        self._checkpoint = time.monotonic()
        self._lock = None if path is None else lock_file(path, key, what, patience)
        try:
            self._database = self._connect()
            try:
                self._begin(json.loads(as_text(dict(header))), schema, what)
            except BaseException:
                self._database.close()
                raise
        except sqlite3.Error as error:
            self._release()
            allowed = f"a file that a {what} can be kept in ({error})"
            raise InputError(key, str(path), allowed) from None
        except BaseException:
            self._release()
            raise

    def _connect(self) -> sqlite3.Connection:
        name = ":memory:" if self.path is None else str(self.path)
        database = sqlite3.connect(name, isolation_level=None, timeout=30.0)
        settings = (
            ("journal_mode = DELETE", "synchronous = EXTRA")
            if self._forced or self.path is None
            else ("locking_mode = EXCLUSIVE", "journal_mode = WAL", "synchronous = NORMAL")
        )
        for setting in settings:
            database.execute(f"PRAGMA {setting}")
        return database

    def _begin(self, header: dict[str, Any], schema: Sequence[str], what: str) -> None:
        if not self._database.execute("SELECT name FROM sqlite_master").fetchall():
            with self._database:  # all of it, or nothing
                self._database.execute("BEGIN")
                self._database.execute("CREATE TABLE header (key TEXT PRIMARY KEY, value TEXT)")
                for statement in schema:
                    self._database.execute(statement)
                rows = [(name, as_text(value)) for name, value in header.items()]
                self._database.executemany("INSERT INTO header VALUES (?, ?)", rows)
            self.header = header
            return
        self.header = self._read_header()
        found = difference(self.header, header)
        if found is not None:
            name, old, new = found
            assert self.path is not None
            allowed = f"{_brief(old)}, as the {what} in there has it"
            raise OtherComputation(f"{self.path.parent}: {name}", new, allowed)

    def write(self, statement: str, rows: Sequence[tuple[Any, ...]]) -> None:
        """Writes rows in one transaction.

        Raises:
            StoreError: it cannot; none of the rows is kept.

        """
        try:
            with self._database:
                self._database.execute("BEGIN")
                self._database.executemany(statement, rows)
            if not self._forced and time.monotonic() - self._checkpoint > CHECKPOINT_EVERY:
                self._database.execute("PRAGMA wal_checkpoint(PASSIVE)")
                self._checkpoint = time.monotonic()
        except sqlite3.Error as error:
            raise StoreError(self.path, error) from None

    def close(self) -> None:
        """Closes the file and lets other processes have it."""
        self._database.close()  # which brings a write-ahead log to the disk
        self._release()

    def _release(self) -> None:
        if self._lock is not None:
            self._lock.close()


class KeptResults(Store):
    """Results by name, each with the fingerprint of what computed it.

    Another fingerprint is no error: the result is then computed and kept anew.
    """

    def __init__(self, path: str | Path | None, *, key: str, what: str) -> None:
        schema = (
            "CREATE TABLE results (name TEXT PRIMARY KEY, fingerprint TEXT NOT NULL,"
            " content BLOB NOT NULL)",
        )
        super().__init__(path, {"what": what}, schema, key=key, what=what)

    def kept(self, name: str, fingerprint: str) -> bytes | None:
        """Gives a result's content, if one of that name and fingerprint is there."""
        query = "SELECT content FROM results WHERE name = ? AND fingerprint = ?"
        for (content,) in self.read(query, (name, fingerprint)):
            return bytes(content)
        return None

    def keep(self, name: str, fingerprint: str, content: bytes) -> None:
        """Keeps a result in place of any of that name."""
        row = (name, fingerprint, content)
        self.write("INSERT OR REPLACE INTO results VALUES (?, ?, ?)", [row])


def lock_file(path: str | Path, key: str, what: str, patience: float = 0.0) -> IO[str]:
    """Gives the lock of a store, taken; it is held until it is closed, or the process ends.

    The store's directory is made if need be.

    Raises:
        InputError: another process has it, or it cannot be made.

    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.with_suffix(".lock").open("w")
    except OSError as error:
        raise InputError(key, str(path), f"a file to write ({error.strerror})") from None
    end = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return file
        except BlockingIOError:
            if time.monotonic() >= end:
                file.close()
                allowed = f"a directory in which no other {what} is running"
                raise InputError(key, str(path.parent), allowed) from None
            time.sleep(0.05)
        except OSError as error:
            file.close()
            raise InputError(key, str(path), f"a disk with locks ({error.strerror})") from None


def _brief(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
