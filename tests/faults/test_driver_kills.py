# SPDX-License-Identifier: Apache-2.0
"""The processor of each driver is killed once; `make faults` kills it, its commander and its device 50 times each."""

from __future__ import annotations

import pytest

from driver_benches import BENCHES
from driver_kills import one

# Leftovers are searched for on the whole machine.
pytestmark = pytest.mark.alone


@pytest.mark.parametrize("name", BENCHES)
def test_the_processor_of_a_driver_is_killed(name: str) -> None:
    assert one(name, "process", 0).wrong == []
