"""Records of evaluated values: a killed run is replayed from them.

The optimisers are deterministic. A run that is started again asks for the same values in the same
order; the checkpoint answers as far as it goes, and from there on the model is evaluated. So the
resumed run ends with the very same numbers.

A checkpoint is a store (`drake_racket.store`), one file per start, since starts run in processes of
their own and a store has one writer. Its header says what was fitted, how, and what computed it;
its table `evaluations` has for each value its number, a hash of the kind and the point asked for,
the values (float64, little-endian) and a CRC-32 of both. Each record is in the file as soon as it
is known, so a killed process loses nothing; a power failure loses about the last second. A damaged
record ends the checkpoint: it and what follows are evaluated anew.
"""

from __future__ import annotations

import hashlib
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from drake_racket.identify.core.problem import Array, Problem
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory
from drake_racket.io.fingerprint import code_of, computation
from drake_racket.store import Store, StoreError

_LOCK_PATIENCE = 5.0  # s; workers of a killed run need a moment to notice
_SCHEMA = (
    "CREATE TABLE evaluations (number INTEGER PRIMARY KEY, point BLOB NOT NULL,"
    ' "values" BLOB NOT NULL, crc INTEGER NOT NULL)'
)


def checkpoint_header(problem: Problem, settings: Mapping[str, Any]) -> dict[str, Any]:
    """What a checkpoint must agree on with the run that reads it."""
    sigma = b"" if problem.sigma is None else np.asarray(problem.sigma, "<f8").tobytes()
    return {
        "problem": problem.fingerprint(),
        "sigma": hashlib.blake2b(sigma, digest_size=16).hexdigest(),
        "parameters": [
            [p.name, p.unit, *(float(v).hex() for v in (p.lower, p.upper, p.start))]
            for p in problem.parameters
        ],
        "settings": dict(settings),
        "computation": computation("identify", *code_of(type(problem))),
    }


class Checkpoint:
    """Values by the order in which they are asked for, on file or (path None) not kept.

    Raises:
        OtherComputation: the file is another run's checkpoint.
        InputError: it is in use, is no checkpoint, or cannot be written.

    """

    def __init__(self, path: str | Path | None, header: Mapping[str, Any]) -> None:
        path = None if path is None else Path(path)
        self.path = path
        self._number = 0
        self._store: Store | None = None
        self._records: Iterator[tuple[Any, ...]] | None = None
        if path is None:
            return
        self._store = Store(
            path,
            header,
            [_SCHEMA],
            key="checkpoint",
            what="fit",
            forced=False,
            patience=_LOCK_PATIENCE,
        )
        self._records = self._store.read("SELECT * FROM evaluations ORDER BY number")

    def __enter__(self) -> Checkpoint:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Forces what is written to disk and lets the file go; values are then no longer kept."""
        if self._store is not None:
            store, self._store, self._records = self._store, None, None
            store.close()

    def value(self, kind: str, x: Array, compute: Callable[[], Array]) -> Array:
        """The values of this kind at x: from the checkpoint, or computed and recorded.

        Raises:
            InputError: the checkpoint's next record is of another point.
            StoreError: it can no longer be written.

        """
        if self._store is None:
            return compute()
        key = hashlib.blake2b(kind.encode() + x.tobytes(), digest_size=16).digest()
        found = self._next_record(self._store)
        if found is None:
            values = np.ascontiguousarray(compute(), "<f8").tobytes()
            row = (self._number, key, values, zlib.crc32(key + values))
            self._store.write("INSERT INTO evaluations VALUES (?, ?, ?, ?)", [row])
        else:
            if found[0] != key:
                raise InputError("checkpoint", self.path, "a checkpoint of the same computation")
            values = found[1]
        self._number += 1
        return np.frombuffer(values, "<f8").astype(np.float64)

    def _next_record(self, store: Store) -> tuple[bytes, bytes] | None:
        """The next whole record, point and values; None at the checkpoint's end."""
        if self._records is None:
            return None
        try:
            row = next(self._records, None)
        except StoreError as error:
            allowed = f"a whole checkpoint, another directory, or none ({error})"
            raise InputError("checkpoint", self.path, allowed) from None
        if row is not None:
            number, key, values, crc = row
            if number == self._number and zlib.crc32(key + values) == crc:
                return key, values
        self._records = None  # which ends its reading: a write would wait for it
        store.write("DELETE FROM evaluations WHERE number >= ?", [(self._number,)])
        return None


def prepare_directory(checkpoint: str | Path | None) -> None:
    """Makes a checkpoint's directory.

    Raises:
        InputError: it cannot be made or written.

    """
    checkpoint = None if checkpoint is None else Path(checkpoint)
    if checkpoint is None:
        return
    if checkpoint.exists() and not checkpoint.is_dir():
        raise InputError("checkpoint", checkpoint, "a directory (for one file per start)")
    check_directory(checkpoint, "checkpoint")
    checkpoint.mkdir(parents=True, exist_ok=True)
