# SPDX-License-Identifier: Apache-2.0
"""ω across sources: every value is that of its SVV when the verb has ended, wherever its writer runs and whatever ends it."""

from __future__ import annotations

from typing import Any

import pytest

import opengpac as gpac
from opengpac import activate, deactivate, on, wait
from rig import Rig

EVERY_MS = [activate("ends", every="1 ms"), activate("tells", every="1 ms"), activate("takes", every="1 ms")]


def across(rig: Rig, **changes: Any) -> gpac.Verb[..., Any]:
    """Returns a verb with a block that ends it, one that counts on another source, and one that takes both numbers as an array."""
    definition: dict[str, Any] = {
        "blocks": {"ends": rig.block("count.count"), "tells": rig.block("count.count"), "takes": rig.block("mapping.times")},
        "instantiation_parameters": {"a": "ends.y", "b": "tells.y", "both": "takes.u", "y": "takes.y"},
        "input_parameters": {"limit": gpac.input("ends.enough", default=1e9), "never": gpac.input("tells.enough", default=1e9)},
        "output_values": {"a_last": "ends.y", "b_last": "tells.y", "b_seen": "takes.u", "y_last": "takes.y"},
        "conditions": {name: on(*of, returns=["a_last", "b_last", "b_seen", "y_last"]) for name, of in ENDS.items()},
        "modes": {"takes.u": "asynchronous"},
        "command_lists": {"start": EVERY_MS},
    }
    return gpac.Verb("across", **{**definition, **changes})


ENDS: dict[str, tuple[str, ...]] = {"enough": ("ends.enough",), "halted": ()}


class Across:
    """Verb on three sources; the source that ends it has the given rank among their priorities."""

    def __init__(self, rig: Rig, priority: int, apart: bool) -> None:
        processor = rig.cell.processor("rtp1") if apart else rig.rtp
        ends = processor.timer("ends", period="1 ms", priority=priority)
        tells, takes = rig.rtp.timer("tells", period="1 ms", priority=70), rig.rtp.timer("takes", period="1 ms", priority=65)
        self.sources = {"ends": ends, "tells": tells, "takes": takes}
        (self.a, self.b), self.y = rig.svvs("a", "b", history=50), rig.cell.svv("pair", "double[2]")

    def on(self, verb: gpac.Verb[..., Any]) -> Any:
        """Returns an instance of the verb."""
        return verb.on(self.sources).new_instance(self.a, self.b, [self.a, self.b], self.y)

    def agrees(self, report: Any) -> None:
        """Checks that the report has the values of the SVVs, which are also the last in their histories."""
        now = [self.a.value, self.b.value]
        assert [report.a_last, report.b_last] == now == [svv.history[:]["value"][-1] for svv in (self.a, self.b)]
        assert [*report.b_seen] == now, "each element is read where it is written"
        assert [*report.y_last] == [*self.y.value]


@pytest.mark.parametrize(("priority", "apart"), [(75, True), (60, False)])
def test_r085_what_another_source_writes_is_what_its_svv_has_at_the_end(rig: Rig, priority: int, apart: bool) -> None:
    parts = Across(rig, priority, apart)
    report = parts.on(across(rig)).start(limit=9).wait()
    assert report.condition == "enough" and report.a_last >= 9
    parts.agrees(report)


def test_r085_also_where_no_block_ends_it_and_where_an_ending_list_follows(rig: Rig) -> None:
    parts = Across(rig, 75, True)
    lists = {"start": EVERY_MS, "rest": [activate("tells", every="1 ms"), wait("3 ms"), deactivate("tells")]}
    halted = parts.on(across(rig)).start()
    rig.until(lambda: parts.b.value >= 5, "it counts")
    halted.halt()
    parts.agrees(halted.wait())
    with_rest = parts.on(across(rig, command_lists=lists, ending="rest", initial="start")).start(limit=9)
    report = with_rest.wait()
    assert report.a_last == parts.a.value and [*report.b_seen] == [report.a_last, report.b_last]
    assert parts.b.value > report.b_last, "ω is read when the present list goes off; the ending list counts on"


@pytest.mark.parametrize(("priority", "others"), [(75, 8.0), (60, 9.0)])
def test_r085_the_others_end_between_two_of_their_firings(rig: Rig, priority: int, others: float) -> None:
    """At the instant of the end, a source of higher priority has had its firing, and one of lower priority has no further one."""
    parts = Across(rig, priority, False)
    report = parts.on(across(rig)).start(limit=9).wait()
    assert (report.a_last, report.b_last) == (9.0, others)
    rig.cell.advance("5 ms")
    parts.agrees(report)
