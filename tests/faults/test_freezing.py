# SPDX-License-Identifier: Apache-2.0
"""A few of the freezes; `make faults` makes all of them, up to 20 s."""

from __future__ import annotations

import pytest

import freezing

# What is left behind is looked for on the whole machine.
pytestmark = pytest.mark.alone

WAYS = freezing.WAYS if freezing.may_freeze() else freezing.WAYS[:1]
FEW = [(place, WAYS[(number > 0) % len(WAYS)], span_s) for number, place in enumerate(freezing.PLACES) for span_s in (0.3, 0.8)]


@pytest.mark.parametrize(("place", "way", "span_s"), FEW, ids=lambda part: str(part).replace(" ", "_"))
def test_what_was_frozen_keeps_its_speed_tells_the_time_and_blames_nobody(place: str, way: str, span_s: float) -> None:
    found = freezing.one(place, way, span_s)
    assert not found.wrong


def test_somebody_who_is_blamed_is_seen() -> None:
    """The words of what would be wrong are those of the system."""
    for text in ("processor_lost: 'rtp1' was lost", "guard: one of its two processes hung", "its process was ended by SIGKILL"):
        assert freezing.BLAME.search(text)
    assert not freezing.BLAME.search("late: source 'rtp1.fast' was suspended for 0.8 s (its process or the machine was stopped)")
