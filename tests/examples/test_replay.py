# SPDX-License-Identifier: Apache-2.0
"""Each example is recorded twice and replayed: record = record = replay, bit for bit. `make faults` does so for 10^6 firings of each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac

PROGRAMS = ["coordinated_motion", "filtered_servo", "distributed_servo", "guarded_move", "compliant_motion"]


@pytest.mark.parametrize("program", PROGRAMS)
def test_records_of_one_program_are_the_same_and_run_again_as_they_were(programs: Any, program: str, tmp_path: Path) -> None:
    found = []
    for number in range(2):
        path = tmp_path / f"{number}.mcap"
        done = programs.run(program, replay=path)
        assert done.code == 0, done.printed
        found.append(gpac.replay(path, trust=True))
    assert [again.stopped for again in found] == ["end", "end"], found
    assert all(again.same for again in found), found
    assert found[0].fingerprint == found[1].fingerprint
    assert found[0].firings > 1_000
