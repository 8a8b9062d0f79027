# SPDX-License-Identifier: Apache-2.0
"""A few of the attacks on watchers; `make faults` makes a thousand."""

from __future__ import annotations

import random

import pytest

import watched

FEW = (
    "threads: kill program",
    "threads: stop guard, kill program",
    "process: stop guard, kill processor",
    "process: kill guard, stop processor",
    "process: stop guard, kill program",
)

# Leftovers are searched for on the whole machine.
pytestmark = pytest.mark.alone


@pytest.mark.parametrize(
    "attack", [attack for attack in watched.attacks() if attack.name in FEW], ids=lambda attack: attack.name.replace(" ", "_")
)
def test_whoever_is_left_makes_the_outputs_safe(attack: watched.Attack) -> None:
    found, _, _ = watched.one(attack, random.Random(1))
    assert not found.wrong and found.safe_ms is not None


def test_every_one_and_every_pair_is_attacked() -> None:
    names = [attack.name for attack in watched.attacks()]
    assert set(FEW) <= set(names) and len(set(names)) == len(names) == 8 + 18
