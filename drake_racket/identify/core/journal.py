"""Append-only records of evaluated values: a killed run is replayed from them.

The optimisers are deterministic. A run that is started again asks for the same values in the same
order; the journal answers as far as it goes, and from there on the model is evaluated. So the
resumed run ends with the very same numbers.

A journal file is one line of JSON (what was fitted, how, and with which versions), then binary
records: CRC-32 and length of what follows (two uint32), a hash of the kind and the point asked
for (16 bytes), and the values (float64), little-endian. Each record is handed to the operating
system as soon as it is known, so a killed process loses nothing; it is forced to disk at most once
a second and at the end, so a power failure loses about the last second. A damaged record ends the
journal: it and what follows are evaluated anew.
"""

from __future__ import annotations

import fcntl
import functools
import hashlib
import json
import os
import struct
import time
import zlib
from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np

from drake_racket.identify.core.problem import Array, Problem
from drake_racket.io.errors import InputError
from drake_racket.io.files import check_directory

FORMAT = 1
_FRAME = struct.Struct("<II")  # CRC-32, length
_HASH_BYTES = 16
_SYNC_INTERVAL = 1.0  # s between forced writes to disk
_LOCK_PATIENCE = 5.0  # s; workers of a killed run need a moment to notice
_DISTRIBUTIONS = ("drake-racket", "drake", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Versions of what the numbers depend on."""
    return {name: _version(name) for name in _DISTRIBUTIONS}


@functools.cache  # reads files
def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:  # used from a source tree
        return "not installed"


def journal_header(problem: Problem, settings: Mapping[str, Any]) -> dict[str, Any]:
    """What a journal must agree on with the run that reads it."""
    sigma = b"" if problem.sigma is None else np.asarray(problem.sigma, "<f8").tobytes()
    return {
        "format": FORMAT,
        "problem": problem.fingerprint(),
        "sigma": hashlib.blake2b(sigma, digest_size=_HASH_BYTES).hexdigest(),
        "parameters": [
            [p.name, p.unit, *(float(v).hex() for v in (p.lower, p.upper, p.start))]
            for p in problem.parameters
        ],
        "settings": dict(settings),
        "versions": versions(),
    }


class Journal:
    """Values by the order in which they are asked for, on file or (path None) not kept.

    Raises:
        InputError: the file is another run's journal, is in use, or cannot be written.

    """

    def __init__(self, path: Path | None, header: Mapping[str, Any]) -> None:
        self.path = path
        self.replayed = 0
        self._replaying = path is not None
        self._synced = time.monotonic()
        self._file: BinaryIO | None = None
        if path is None:
            return
        try:
            # neither truncated nor in append mode: a damaged tail is written over
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        except OSError as error:
            raise InputError("journal", path, f"a file to write ({error.strerror})") from None
        self._file = os.fdopen(descriptor, "r+b", buffering=0)
        try:
            self._lock()
            self._check_header(json.dumps(header, sort_keys=True).encode() + b"\n")
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Journal:
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
        if self._file is not None:
            os.fsync(self._file.fileno())
            self._file.close()
            self._file = None

    def value(self, kind: str, x: Array, compute: Callable[[], Array]) -> Array:
        """The values of this kind at x: from the journal, or computed and recorded.

        Raises:
            InputError: the journal's next record is of another point.

        """
        if self._file is None:
            return compute()
        key = hashlib.blake2b(kind.encode() + x.tobytes(), digest_size=_HASH_BYTES).digest()
        if self._replaying:
            body = self._next_record(self._file)
            if body is not None:
                if body[:_HASH_BYTES] != key:
                    raise InputError("journal", self.path, "a journal of the same computation")
                self.replayed += 1
                return np.frombuffer(body[_HASH_BYTES:], "<f8").astype(np.float64)
        found = np.ascontiguousarray(compute(), "<f8")
        self._append(self._file, key + found.tobytes())
        return found.astype(np.float64).ravel()

    def _next_record(self, file: BinaryIO) -> bytes | None:
        """The next whole record; None at the journal's end, from where it is then written."""
        position = file.tell()
        frame = _read(file, _FRAME.size)
        if len(frame) == _FRAME.size:
            check, length = _FRAME.unpack(frame)
            left = os.fstat(file.fileno()).st_size - file.tell()
            body = _read(file, length) if _HASH_BYTES <= length <= left else b""
            if body and zlib.crc32(body) == check:
                return body
        self._replaying = False
        file.seek(position)
        file.truncate()
        return None

    def _append(self, file: BinaryIO, body: bytes) -> None:
        record = memoryview(_FRAME.pack(zlib.crc32(body), len(body)) + body)
        while record:  # a full disk may take a part
            record = record[file.write(record) :]
        now = time.monotonic()
        if now - self._synced > _SYNC_INTERVAL:
            os.fsync(file.fileno())
            self._synced = now

    def _lock(self) -> None:
        """Keeps a second run off this file; the lock goes with the process."""
        assert self._file is not None
        deadline = time.monotonic() + _LOCK_PATIENCE
        while True:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            except BlockingIOError:
                if time.monotonic() > deadline:
                    raise InputError(
                        "journal", self.path, "a journal that no other run is writing"
                    ) from None
                time.sleep(0.05)

    def _check_header(self, header: bytes) -> None:
        assert self._file is not None
        found = _read(self._file, len(header))
        if found == header:
            return
        if not header.startswith(found):  # a part: killed while writing it
            self._file.seek(0)
            why = _difference(self._file.readline(), header)
            raise InputError("journal", self.path, f"a journal of this very computation; {why}")
        self._file.seek(0)
        self._file.truncate()
        self._file.write(header)
        os.fsync(self._file.fileno())
        self._replaying = False


def prepare_directory(journal: Path | None) -> None:
    """Makes a journal's directory.

    Raises:
        InputError: it cannot be made or written.

    """
    if journal is None:
        return
    if journal.exists() and not journal.is_dir():
        raise InputError("journal", journal, "a directory (for one file per start)")
    check_directory(journal, "journal")
    journal.mkdir(parents=True, exist_ok=True)


def _read(file: BinaryIO, size: int) -> bytes:
    """`size` bytes, or what there is: an unbuffered read may give less than asked."""
    parts = []
    while size > 0:
        part = file.read(size)
        if not part:
            break
        parts.append(part)
        size -= len(part)
    return b"".join(parts)


def _difference(line: bytes, header: bytes) -> str:
    """What a journal's first line says otherwise."""
    try:
        found = json.loads(line)
    except ValueError:
        return "this is none"
    expected = json.loads(header)
    other = [
        key for key in expected if not isinstance(found, dict) or found.get(key) != expected[key]
    ]
    return f"this one has another {' and '.join(other)}: use another directory or delete it"
