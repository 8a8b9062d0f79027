# SPDX-License-Identifier: Apache-2.0
"""What goes wrong in a block stays there: the Python process lives on, and the other verbs run on."""

from __future__ import annotations

from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from rig import Rig

IN_THE_BLOCK = ["refuses", "not_a_number"]
BY_A_SIGNAL = ["divides", "null_pointer", "endless"]


def failing(rig: Rig, block: str, **changes: Any) -> gpac.Verb[..., Any]:
    """A verb whose block fails at invocation 3."""
    definition: dict[str, Any] = {
        "blocks": {"bad": rig.block(f"faults.{block}")},
        "instantiation_parameters": {"y": "bad.y"},
        "output_values": {"last": "bad.y"},
        "command_lists": {"start": [activate("bad", every="1 ms")]},
    }
    return gpac.Verb(f"failing_{block}", **{**definition, **changes})


@pytest.mark.parametrize("block", IN_THE_BLOCK)
def test_a_fault_of_a_block_ends_its_verb_only(rig: Rig, block: str) -> None:
    good, bad = rig.svvs("good", "bad")
    rig.counting().on(rig.fast).asynch(good)
    with pytest.raises(gpac.Terminated) as caught:
        failing(rig, block).on(rig.fast)(bad, time_limit="1 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    before = good.value
    rig.cell.advance("10 ms")
    assert good.value == before + 10, "the other verb runs on in the same source"
    assert bad.value in (2, 3), "the last good sample"


@pytest.mark.parametrize("block", BY_A_SIGNAL)
def test_a_signal_in_a_block_stops_its_source_only(memory_rig: Rig, block: str) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    good, bad = rig.svvs("good", "bad")
    rig.counting().on(rig.fast).asynch(good)
    with pytest.raises(gpac.Terminated) as caught:
        failing(rig, block).on(doomed)(bad, time_limit="10 s")
    assert (caught.value.condition, caught.value.block) == ("fault", "bad")
    before = good.value
    rig.cell.advance("10 ms")
    assert good.value == before + 10, "the other sources run on"
    assert bad.value == 2
    assert rig.cell.statistics["sources"][doomed.name]["stopped"]


@pytest.mark.parametrize("block", BY_A_SIGNAL)
def test_after_a_signal_the_devices_of_the_source_are_safe(memory_rig: Rig, block: str) -> None:
    rig = memory_rig
    doomed = rig.rtp.timer("doomed", period="1 ms", priority=50)
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=doomed)
    (bad,) = rig.svvs("bad")
    pushing = gpac.Verb(
        "pushing",
        blocks={"write": lib.block("write_channel")},
        instantiation_parameters={"effort": "write.channel"},
        input_parameters={"u": "write.u"},
        modes={"write.u": "asynchronous"},
        command_lists={"start": [activate("write", every="1 ms")]},
    )
    vi = pushing.on(doomed).asynch(drive["x"].effort, u=1.0)
    with pytest.raises(gpac.Terminated):
        failing(rig, block).on(doomed)(bad, time_limit="10 s")
    with pytest.raises(gpac.Terminated) as caught:
        vi.wait()
    assert caught.value.condition == "fault"


def test_a_low_pass_recovers_at_the_next_good_sample(rig: Rig) -> None:
    y = rig.cell.svv("y", history=50)
    verb = gpac.Verb(
        "filtering",
        blocks={"bad": rig.block("faults.not_a_number"), "filter": lib.block("lowpass")(alpha=0.5)},
        instantiation_parameters={"y": "filter.y"},
        cells={"c": ["bad.y", "filter.u"]},
        command_lists={"start": [activate("bad", every="1 ms"), activate("filter")]},
        transitions={("start", "fault"): "start"},
    )
    verb.on(rig.fast).asynch(y)
    rig.cell.advance("10 ms")
    values = y.history[:]["value"]
    assert len(values) >= 6 and (values[1:] >= values[:-1]).all() and values[-1] > 4


def test_a_fault_may_have_a_transition(rig: Rig) -> None:
    (y,) = rig.svvs("y")
    report = failing(
        rig,
        "refuses",
        blocks={"bad": rig.block("faults.refuses"), "count": rig.block("count.count")},
        input_parameters={"limit": "count.enough"},
        command_lists={"start": [activate("bad", every="1 ms")], "after": [activate("count", every="1 ms")]},
        initial="start",
        conditions={"enough": gpac.on("count.enough", returns=["last"])},
        transitions={("start", "fault"): "after"},
    ).on(rig.fast)(y, limit=3, time_limit="1 s")
    assert (report.condition, report.command_list, report.last) == ("enough", "after", 2)
