"""The durable store: kept through kills, one writer, other computations named, full disks."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import resource
import sqlite3
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_racket.io.errors import InputError
from drake_racket.store import KeptResults, OtherComputation, Store, StoreError, StoreReader

SCHEMA = ("CREATE TABLE things (number INTEGER PRIMARY KEY, content BLOB)",)
INSERT = "INSERT INTO things VALUES (?, ?)"


def make(path: Path | None, header=None, **options) -> Store:
    return Store(path, header or {"a": 1}, SCHEMA, key="--out", what="test", **options)


def things(path: Path) -> list[tuple[int, bytes]]:
    with contextlib.closing(sqlite3.connect(path)) as database:
        assert database.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        return database.execute("SELECT * FROM things ORDER BY number").fetchall()


def write_for_ever(path: Path, forced: bool, told: Connection) -> None:
    store = make(path, forced=forced)
    number = sum(1 for _ in store.read("SELECT number FROM things"))
    while True:
        store.write(INSERT, [(number, bytes([number % 256]) * 3000), (number + 1, b"second")])
        number += 2
        told.send(number)


@pytest.mark.parametrize("forced", [True, False])
def test_what_was_written_survives_kill_9(forced, tmp_path):
    path = tmp_path / "a.sqlite"
    count = 0
    for more in (4, 30):
        here, there = multiprocessing.Pipe(duplex=False)
        process = multiprocessing.get_context("fork").Process(
            target=write_for_ever, args=(path, forced, there)
        )
        process.start()
        there.close()
        told = 0
        while told < count + more:
            told = here.recv()
        process.kill()
        process.join()
        with contextlib.suppress(EOFError):
            while True:
                told = here.recv()
        found = things(path)
        assert told <= len(found) <= told + 2
        assert len(found) % 2 == 0, "a write is all of its rows, or none"
        assert [number for number, _ in found] == list(range(len(found)))
        count = len(found)


@given(header=st.dictionaries(st.text("abcde", min_size=1), st.integers() | st.text(), min_size=1))
@settings(max_examples=25, deadline=None)
def test_a_header_comes_back_and_another_one_is_named(header, tmp_path_factory):
    path = tmp_path_factory.mktemp("store") / "a.sqlite"
    with contextlib.closing(make(path, header)) as store:
        assert store.header == header
    with contextlib.closing(make(path, header)) as store:
        assert store.header == header
    key = sorted(header)[-1]
    with pytest.raises(OtherComputation) as error:
        make(path, header | {key: "something else"})
    assert error.value.value == "something else"
    assert error.value.key == f"{path.parent}: {key}"
    assert "\n" not in str(error.value)
    make(path, header).close()  # the refusal has let it go


def test_a_second_writer_is_refused_and_a_reader_is_not(tmp_path):
    path = tmp_path / "a.sqlite"
    with contextlib.closing(make(path)) as store:
        store.write(INSERT, [(1, b"x")])
        began = time.monotonic()
        with pytest.raises(InputError, match="no other test is running"):
            make(path, patience=0.2)
        assert 0.2 <= time.monotonic() - began < 5.0
        with contextlib.closing(StoreReader(path, "--out")) as reader:
            assert reader.header == {"a": 1}
            assert list(reader.read("SELECT * FROM things")) == [(1, b"x")]
            store.write(INSERT, [(2, b"y")])
            assert len(list(reader.read("SELECT * FROM things"))) == 2
    make(path).close()


def test_what_is_no_store_is_refused_and_kept(tmp_path):
    path = tmp_path / "a.sqlite"
    path.write_text("my notes, which are longer than the header of a database")
    for opened in (make, lambda path: StoreReader(path, "--out")):
        with pytest.raises(InputError, match="--out: got") as error:
            opened(path)
        assert "\n" not in str(error.value)
    assert path.read_text().startswith("my notes")
    with pytest.raises(InputError, match="that is there"):
        StoreReader(tmp_path / "none.sqlite", "--out")


@pytest.mark.parametrize("forced", [True, False])
def test_a_full_disk_is_one_line_and_costs_nothing_written(forced, tmp_path):
    """Writes beyond a file's largest size fail as they do on a full disk."""
    path = tmp_path / "a.sqlite"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with contextlib.closing(make(path, forced=forced)) as store:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, before[1]))
        said, number = "", -1
        try:
            while number < 1000:
                number += 1
                store.write(INSERT, [(number, bytes(3000))])
        except StoreError as error:
            said = str(error)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert said.startswith(f"{path} cannot be read or written")
    assert "\n" not in said
    assert len(things(path)) == number > 0


def test_a_write_that_fails_keeps_none_of_its_rows(tmp_path):
    with contextlib.closing(make(tmp_path / "a.sqlite")) as store:
        store.write(INSERT, [(1, b"x")])
        with pytest.raises(StoreError):
            store.write(INSERT, [(2, b"y"), (1, b"again")])
    assert things(tmp_path / "a.sqlite") == [(1, b"x")]


def test_a_quick_store_is_on_the_disk_within_a_second(tmp_path, monkeypatch):
    """What is in the file itself, and no longer in the log alone, has been synchronised."""
    clock = [0.0]
    monkeypatch.setattr("drake_racket.store.time.monotonic", lambda: clock[0])
    path = tmp_path / "a.sqlite"
    with contextlib.closing(make(path, forced=False)) as store:
        store.write(INSERT, [(1, bytes(8000))])
        small = path.stat().st_size
        clock[0] = 1.01
        store.write(INSERT, [(2, bytes(8000))])
        assert path.stat().st_size >= small + 16_000


def test_results_are_kept_by_name_and_fingerprint(tmp_path):
    path = tmp_path / "new" / "kept.sqlite"
    with contextlib.closing(KeptResults(path, key="out", what="study")) as store:
        assert store.kept("one", "mark") is None
        store.keep("one", "mark", b"content")
    with contextlib.closing(KeptResults(path, key="out", what="study")) as store:
        assert store.kept("one", "mark") == b"content"
        assert store.kept("one", "another") is None
        store.keep("one", "another", b"anew")
        assert store.kept("one", "mark") is None
        assert store.kept("one", "another") == b"anew"
    with contextlib.closing(KeptResults(None, key="out", what="study")) as store:
        store.keep("one", "mark", b"in memory")
        assert store.kept("one", "mark") == b"in memory"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_directory_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match="a file to write"):
        make(tmp_path / "a.sqlite")


def test_a_place_that_cannot_be_made_is_refused():
    with pytest.raises(InputError, match="a file to write"):
        make(Path("/proc/nowhere/a.sqlite"))


def test_when_a_quick_store_is_brought_to_the_disk(monkeypatch):
    """Where the last time is over a second ago; a forced one, never."""
    clock = [100.0]
    monkeypatch.setattr("drake_racket.store.time.monotonic", lambda: clock[0])
    for forced in (False, True):
        with contextlib.closing(make(None, forced=forced)) as store:
            told: list[str] = []
            store._database.set_trace_callback(told.append)
            asked = []
            for number, seconds in enumerate((0.0, 1.0, 1.005, 1.0, 0.5, 0.51)):
                clock[0] += seconds
                told.clear()
                store.write(INSERT, [(number, b"x")])
                asked.append(any("wal_checkpoint(PASSIVE)" in one for one in told))
            assert asked == [not forced and one for one in (False, False, True, False, True, False)]


def test_how_long_another_connection_is_waited_for(tmp_path, monkeypatch):
    waits = []
    connect = sqlite3.connect

    def connecting(*arguments, **options):
        waits.append(options["timeout"])
        return connect(*arguments, **options)

    monkeypatch.setattr("drake_racket.store.sqlite3.connect", connecting)
    path = tmp_path / "a.sqlite"
    make(path).close()
    StoreReader(path, "--out").close()
    assert waits == [30.0, 30.0]


@pytest.mark.parametrize(("length", "shown"), [(78, 80), (79, 80)])
def test_long_values_are_shown_in_part(length, shown, tmp_path):
    path = tmp_path / "a.sqlite"
    make(path, {"a": "x" * length}).close()
    with pytest.raises(OtherComputation) as error:
        make(path, {"a": 2})
    text = error.value.allowed.removesuffix(", as the test in there has it")
    assert len(text) == shown
    assert text.endswith("x..." if length > 78 else "x'")


@pytest.mark.parametrize(("forced", "mode"), [(True, ("delete", 3)), (False, ("wal", 1))])
def test_how_a_write_fares_in_a_power_cut(forced, mode, tmp_path):
    with contextlib.closing(make(tmp_path / "a.sqlite", forced=forced)) as store:
        asked = ("PRAGMA journal_mode", "PRAGMA synchronous")
        assert tuple(next(store.read(one))[0] for one in asked) == mode
