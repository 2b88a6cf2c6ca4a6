"""Compiles the replay of a run with its tangents."""

from __future__ import annotations

from drake_racket.engines.compiled.kernel import SOURCES, entry
from drake_racket.engines.compiled.tangents import (
    expressions,
    forward,
    kinds,
    lanes,
    replay,
    twins,
)
from drake_racket.laws.compilation import sources_stamp

run_tangents = entry(
    replay.replay, sources_stamp(*SOURCES, kinds, expressions, forward, lanes, replay, twins)
)
