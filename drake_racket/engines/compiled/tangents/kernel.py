"""Compiles the replay of a run with its tangents."""

from __future__ import annotations

from drake_racket.engines.compiled.kernel import SOURCES
from drake_racket.engines.compiled.tangents import forward, lanes, replay, twins
from drake_racket.laws.compilation import sources_stamp, stamped

run_tangents = stamped(
    replay.replay, sources_stamp(*SOURCES, forward, lanes, replay, twins), nogil=True
)
