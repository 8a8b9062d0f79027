# SPDX-License-Identifier: Apache-2.0
"""The example programs end as expected, with the traces recorded in `traces/`.

A simulated arm is compared within a tolerance, because its physics engine may give other bits on another machine; results of our own
blocks alone are compared to the last digit written.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import opengpac as gpac
import programs as shared
from opengpac import activate
from opengpac import library as lib

WITHIN = {
    "coordinated_motion": 1e-4,
    "filtered_servo": 1e-3,
    "distributed_servo": 0.0,
    "guarded_move": 1e-2,
    "compliant_motion": 1e-3,
}
"""Maximum distance of a program's trace from the recorded one, in the units of its columns (rad, m, N)."""


@pytest.mark.parametrize("program", WITHIN)
def test_the_program_ends_as_it_should_with_its_trace(programs: Any, program: str) -> None:
    done = programs.run(program)
    assert done.code == 0, done.printed
    assert "All verbs ended as they should" in done.printed
    programs.compare(program, done.trace, WITHIN[program])


@pytest.mark.parametrize("program", ["coordinated_motion", "guarded_move", "centering_grasp"])
def test_the_program_ends_as_it_should_by_the_driver_of_a_controller(programs: Any, program: str) -> None:
    done = programs.run(program, "--driver", "ur")
    assert done.code == 0, done.printed
    assert "All verbs ended as they should" in done.printed
    assert "should be" not in done.printed and done.trace, "the values that it recorded are written"


def test_parts_are_palletised_and_the_replay_is_the_same(programs: Any) -> None:
    done = programs.script("examples/palletising.py")
    assert done.code == 0, done.printed
    assert "4 parts" in done.printed and "the replay is the same" in done.printed


def test_an_option_that_is_unknown_is_an_error(programs: Any) -> None:
    done = programs.run("guarded_move", "--clocks", "none")
    assert done.code == 2 and "--clocks" in done.printed


def test_ctrl_c_halts_what_runs_and_is_exit_code_130(capsys: pytest.CaptureFixture[str]) -> None:
    cell = gpac.System("interrupted", clock="virtual")
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    wave = gpac.Verb(
        "wave",
        blocks={"wave": lib.block("signal_generator")},
        instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="1 ms")]},
    )
    instance = wave.on(fast).asynch(cell.svv("y"))

    def main() -> int:
        with cell:
            raise KeyboardInterrupt

    with pytest.raises(SystemExit) as ended:
        shared.run(main)
    assert ended.value.code == 130 and "Interrupted" in capsys.readouterr().err
    assert cell.closed and instance.done


def test_a_verb_that_did_not_end_as_it_should_is_exit_code_1(capsys: pytest.CaptureFixture[str]) -> None:
    account = shared.Account()
    account.expect("a figure", holds=False, more="3 mm")
    assert account.verdict() == 1 and "should be holds" in capsys.readouterr().out


def test_a_trace_is_what_each_svv_was_at_each_time() -> None:
    with gpac.System("traced", clock="virtual") as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        y = cell.svv("y", history=100)
        wave = gpac.Verb(
            "wave",
            blocks={"wave": lib.block("signal_generator")(shape=3, frequency=10.0)},
            instantiation_parameters={"y": "wave.y"},
            command_lists={"start": [activate("wave", every="5 ms")]},
        )
        trace = shared.Trace(y)
        with wave.on(fast).asynch(y):
            cell.advance("50 ms")
            trace.collect()
        lines = trace.table(every=0.01).splitlines()
        assert lines[0] == "time y" and len(lines) == 7
        times, values = trace.of(y)
        for line in lines[2:]:
            time, value = map(float, line.split())
            assert np.isclose(value, values[times <= time + 1e-9][-1], atol=1e-8)
