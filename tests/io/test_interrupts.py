"""Signals that a library swallows are raised again, and none is left behind."""

from __future__ import annotations

import contextlib
import os
import signal

import pytest

from drake_racket.io.interrupts import (
    Terminated,
    exit_status,
    raise_interrupts,
    terminable,
    undisturbed,
)

KINDS = {signal.SIGINT: KeyboardInterrupt, signal.SIGTERM: Terminated}


@pytest.mark.parametrize("number", KINDS)
def test_a_swallowed_signal_is_raised_again(number: int) -> None:
    with terminable() as come:
        with contextlib.suppress(KeyboardInterrupt):  # as a destructor would
            os.kill(os.getpid(), number)
        assert [type(x) for x in come] == [KINDS[number]]
        with pytest.raises(KINDS[number]):
            raise_interrupts()
    assert exit_status(come[-1]) == 128 + number
    raise_interrupts()  # outside there is nothing left


def test_nothing_is_raised_where_nothing_came() -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)
    with terminable() as come:
        raise_interrupts()
        with undisturbed():
            os.kill(os.getpid(), signal.SIGTERM)
        raise_interrupts()
    assert come == []
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before
