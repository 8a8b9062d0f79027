# SPDX-License-Identifier: Apache-2.0
"""ω of a condition: the value that it reported, which may be 0, and nothing if it was not reported."""

from __future__ import annotations

import opengpac as gpac
from opengpac import activate, deactivate, on, wait
from rig import Rig


def telling(rig: Rig) -> gpac.Verb[..., gpac.Report]:
    return gpac.Verb(
        "telling",
        blocks={"t": rig.block("tell.tell")},
        input_parameters={"value": "t.value", "tells": "t.tells"},
        output_values={"told": "t.told", "y": "t.y"},
        conditions={"completed": on(returns=["told", "y"])},
        command_lists={"start": [activate("t", every="1 ms"), wait("3 ms"), deactivate("t")]},
    )


def test_r085_a_condition_that_was_not_reported_has_no_value(rig: Rig) -> None:
    vi = telling(rig).on(rig.fast).new_instance()
    told = [vi.start(value=value, tells=tells).wait().told for value, tells in ((0.0, True), (0.0, False), (2.5, True), (2.5, False))]
    assert told == [0.0, None, 2.5, None], "each start begins with nothing reported"


def test_r085_the_other_outputs_are_there_all_the_same(rig: Rig) -> None:
    report = telling(rig).on(rig.fast)(value=4.0, tells=False)
    assert (report.told, report.y) == (None, 4.0) and "told=None" in repr(report)
