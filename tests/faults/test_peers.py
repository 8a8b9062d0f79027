# SPDX-License-Identifier: Apache-2.0
"""Two victims of a compromised processor; `make faults` attacks forty, with a million writes."""

from __future__ import annotations

import pytest

from peers import attack


@pytest.mark.parametrize("seed", ["one", "two"])
def test_a_compromised_processor_harms_nobody_else(seed: str) -> None:
    done = attack(seed, 10_000)
    assert not done.wrong
    assert done.writes == 10_000 and done.truncations > 10 and done.unconnected, "it reached something, and that was told"
