# SPDX-License-Identifier: Apache-2.0
"""Random compositions whose parts are spread over two processors, one of which is killed: nothing of them begins afterwards.

The compositions vary with the day; a failure names its seed.
"""

from __future__ import annotations

import datetime
import random

import pytest

import opengpac as gpac
from afar import Afar, until
from drawn_compositions import Drawn, arguments_of, of_svvs, work
from rig import Rig

pytestmark = pytest.mark.alone

TRIED = 4
"""Number of compositions that run when the processor is killed."""
LONGER = 20
"""Factor for the durations of the parts, so that most compositions still run when the processor is killed."""


class SpreadRig(Rig):
    """Rig of a system with a timer of 1 ms here, and one in a process of its own."""

    def __init__(self, afar: Afar) -> None:
        self.cell, self.built, self._modules = afar.cell, afar.built, {}
        self.fast = afar.rtp0.timer("near", period="1 ms", priority=70)
        self.there = afar.rtp1.timer("far", period="1 ms", priority=70)


def passes(counter: gpac.SVV[float]) -> None:
    """Waits for twenty firings of the source here."""
    before = counter.value
    until(lambda: counter.value > before + 20, "the source here goes on")


def is_killed(afar: Afar, rig: SpreadRig, seed: int, svvs: dict[str, gpac.SVV[float]], counter: gpac.SVV[float]) -> bool:
    """Starts a composition and kills the process of one of its processors; returns false if it had ended before."""
    rng = random.Random(seed)
    try:
        drawn = Drawn(rig, rng, None, LONGER)
        place = {label: rig.there if rng.random() < 0.5 else rig.fast for label in drawn.labels()}
        if len({*place.values()}) < 2:
            return False
        verb = drawn.verb.on({f"{label}.*": source for label, source in place.items()})
        vi = verb.new_instance(*arguments_of(verb, svvs)).start()
    except gpac.Error:
        return False
    leaves = drawn.labels()
    here = {f"y{leaves[label].removeprefix('leaf')}" for label, source in place.items() if source is rig.fast}
    seen = lambda: {name: svvs[name].value for name in sorted(here)}  # noqa: E731
    passes(counter)
    if vi.done:
        vi.delete()
        return False
    afar.end()
    until(lambda: vi.done, "the composition ends with its processor")
    counted, where = seen(), f"seed {seed}: {vi.report}: {verb!r}"
    assert vi.report is not None, where
    passes(counter)
    assert seen() == counted, where
    afar.cell.reset()
    everything = work(svvs)
    passes(counter)
    assert seen() == counted and work(svvs) == everything, where
    is_lost = vi.report.condition == "processor_lost"
    vi.delete()
    return is_lost


def test_nothing_begins_in_a_composition_that_lost_a_processor(afar: Afar) -> None:
    rig = SpreadRig(afar)
    svvs, counter = of_svvs(rig), afar.cell.svv("passing")
    rig.counting("passing").on(rig.fast).asynch(counter)
    seeds = iter(range(first := datetime.date.today().toordinal() * 100_000, first + 400))
    tried = 0
    while tried < TRIED:
        tried += is_killed(afar, rig, next(seeds), svvs, counter)
