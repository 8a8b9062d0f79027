# SPDX-License-Identifier: Apache-2.0
"""Requirements 1 to 12: the hardware model."""

from __future__ import annotations

import pytest

import opengpac as gpac
from mappings.mapping import MAPPINGS
from opengpac import activate
from opengpac import library as lib
from rig import Rig


def test_r001_a_processor_runs_several_verbs_of_its_own(rig: Rig) -> None:
    a, b = rig.svvs("a", "b")
    counting = rig.counting()
    counting.on(rig.fast).asynch(a)
    counting.on(rig.slow, every={"count": "10 ms"}).asynch(b)
    rig.cell.advance("100 ms")
    assert (a.value, b.value) == (99, 9)


def test_r002_processors_run_different_programs_at_once(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("beside", period="1 ms", priority=80)
    a, up, down = rig.svvs("a", "up", "down")
    pairing = gpac.Verb(
        "pairing",
        blocks={"pair": rig.block("pair.pair")},
        instantiation_parameters={"up": "pair.a", "down": "pair.b"},
        command_lists={"start": [activate("pair", every="1 ms")]},
    )
    counting = rig.counting().on(rig.fast).asynch(a)
    pairing.on(other).asynch(up, down)
    rig.until(lambda: a.value >= 20 and down.value <= -20, "each goes on with its own program")
    counting.halt()
    stands, goes = a.number, up.number
    rig.until(lambda: up.number >= goes + 20, "one goes on without the other")
    assert a.number == stands


def test_r003_a_system_is_its_processors_on_one_interconnect(rig: Rig) -> None:
    other = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    a, b = rig.svvs("a", "b")
    sampling = gpac.Verb(
        "sampling",
        blocks={"sample": rig.block("copy.sample")},
        instantiation_parameters={"u": "sample.u", "y": "sample.y"},
        command_lists={"start": [activate("sample", every="1 ms")]},
    )
    rig.counting().on(rig.fast).asynch(a)
    sampling.on(other).asynch(a, b)
    rig.cell.advance("50 ms")
    assert b.value > 30, "values of one processor come to the other"


def test_r004_modules_are_downloaded_while_the_system_runs(rig: Rig) -> None:
    (a,) = rig.svvs("a")
    rig.counting().on(rig.fast).asynch(a)
    rig.cell.advance("5 ms")
    code = rig.cell.download(rig.built["pair"], "pair")
    assert {b.name for b in code} == {"pair.pair", "pair.pair_check"}
    rig.cell.advance("5 ms")
    assert a.value == 9


def test_r005_a_processor_has_several_interrupt_sources(rig: Rig) -> None:
    trigger = rig.rtp.trigger("button", priority=50)
    assert {s.name for s in rig.cell.sources.values()} == {"rtp0.fast", "rtp0.slow", "rtp0.button"}
    assert trigger.kind == "trigger"


def test_r006_a_source_is_a_request_for_work(rig: Rig) -> None:
    button = rig.rtp.trigger("button", priority=50)
    (a,) = rig.svvs("a")
    pressing = rig.counting("pressing", command_lists={"start": [activate("count")]})
    pressing.on(button).asynch(a)
    rig.cell.advance("10 ms")
    assert a.number == 0, "nothing without a request"
    for _ in range(3):
        button.request()
        rig.cell.advance("1 ms")
    assert a.value == 2


@pytest.mark.parametrize(("writer", "reader", "seen"), [(80, 60, [0, 1, 2, 3, 4]), (60, 80, [-1, 0, 1, 2, 3])])
def test_r007_of_two_requests_at_one_instant_the_one_of_higher_priority_is_served_first(
    built: dict[str, str], writer: int, reader: int, seen: list[int]
) -> None:
    with gpac.System("cell", clock="virtual", seed=3) as cell:
        rig = Rig(cell, built)
        sources = [rig.rtp.timer(name, period="10 ms", priority=priority) for name, priority in (("w", writer), ("r", reader))]
        a, b = cell.svv("a", initial=-1.0), cell.svv("b", history=10)
        rig.counting(every="10 ms").on(sources[0]).asynch(a)
        rig.sampling(every="10 ms").on(sources[1]).asynch(a, b)
        cell.advance("50 ms")
        assert b.history[:]["value"].tolist() == seen, "who is served first has written before the other one reads"


def test_r007_a_priority_is_a_number_of_the_range(memory_rig: Rig) -> None:
    assert [source.priority for source in (memory_rig.fast, memory_rig.slow)] == [80, 60]
    for wrong in ("high", 0, 100, -1):
        with pytest.raises(gpac.Error, match="priority"):
            memory_rig.rtp.timer("wrong", period="1 ms", priority=wrong)  # type: ignore[arg-type]
    assert "rtp0.wrong" not in memory_rig.cell.sources


def test_r008_a_higher_source_preempts_a_lower_one(built: dict[str, str]) -> None:
    with gpac.System("cell", clock="virtual", seed=3) as cell:
        rig = Rig(cell, built)
        long = rig.rtp.timer("long", period="20 ms", priority=10, virtual_cost="5 ms")
        a, b = rig.svvs("a", "b")
        rig.counting("slowly", every="20 ms").on(long).asynch(b)
        rig.counting().on(rig.fast).asynch(a)
        rig.cell.advance("99 ms")
        assert (a.value, b.value) == (98, 3), "the long firings hold nobody up"


def test_r009_another_processor_raises_a_source(rig: Rig) -> None:
    software = rig.cell.processor("rtp1").software("driven", priority=70)
    a, b = rig.svvs("a", "b")
    copying = gpac.Verb(
        "copying",
        blocks={"copy": rig.block("copy.copy")},
        instantiation_parameters={"u": "copy.u", "y": "copy.y"},
        command_lists={"start": [activate("copy")]},
    )
    source = rig.counting().on(rig.fast).new_instance(a)
    copying.on(software).asynch(a, b)
    source.start()
    rig.cell.advance("50 ms")
    assert b.value >= 40


@pytest.mark.parametrize("processor", ["rtp0", "rtp1"])
@pytest.mark.parametrize("kind", ["bool", "int32_t", "double"])
def test_r009_a_device_raises_a_source(rig: Rig, processor: str, kind: str) -> None:
    button = gpac.drivers.scripted(
        [{"name": "pressed", "direction": "read", "type": kind}, {"name": "level", "direction": "read", "type": "double"}],
        [
            {"at_ns": at * 1_000_000, "values": {"pressed": bool(pressed) if kind == "bool" else pressed}}
            for at, pressed in ((0, 1), (5, 0), (10, 1), (15, 1), (20, 0), (30, 1))
        ],
    )
    panel = rig.rtp.physical_device("panel", button, exchange=rig.fast)
    rtp = rig.rtp if processor == "rtp0" else rig.cell.processor(processor)
    door = rtp.trigger("door", priority=50)
    a = rig.cell.svv("a", history=10)
    panel["pressed"].raises(door)
    rig.counting(command_lists={"start": [activate("count")]}).on(door).asynch(a)
    rig.cell.advance("50 ms")
    assert [round(time, 6) for time in a.history[:]["time"]] == [0.010, 0.030], "it raises when it is pressed, not while it is"
    panel["pressed"].raises(other := rtp.software("other", priority=40))
    assert other.name.endswith("other")


def test_r009_what_cannot_raise_a_source_is_refused(memory_rig: Rig) -> None:
    rig = memory_rig
    channels = [
        {"name": n, "direction": d, "type": t}
        for n, d, t in (("u", "read", "double"), ("v", "read", "double[2]"), ("w", "write", "double"))
    ]
    panel = rig.rtp.physical_device("panel", gpac.drivers.scripted(channels), exchange=rig.fast)
    door = rig.rtp.trigger("door", priority=50)
    with pytest.raises(
        gpac.InvalidState, match=r"channel 'panel\.u' cannot raise source 'rtp0\.fast': it is a timer; name a trigger .* at "
    ):
        panel["u"].raises(rig.fast)
    with pytest.raises(gpac.TypeMismatch, match=r"it is a double\[2\]"):
        panel["v"].raises(door)
    with pytest.raises(gpac.TypeMismatch, match="the channel is written"):
        panel["w"].raises(door)
    with pytest.raises(gpac.CallError, match="pass a source"):
        panel["u"].raises("door")  # type: ignore[arg-type]


REALISATIONS = [(mapping, *priorities) for mapping in ("virtual", "message", "threads") for priorities in ((80, 60), (20, 90))]


def test_r010_the_same_program_gives_the_same_values_however_sources_and_priorities_are_realised(built: dict[str, str]) -> None:
    """A counter drives a copy on another source. In addition a block reads at any time: its values may depend on the realisation."""
    synchronous, asynchronous = [], []
    for mapping, timer, software in REALISATIONS:
        with MAPPINGS[mapping].open("cell") as cell:
            rig = Rig(cell, built)
            writing = rig.rtp.timer("writing", period="2 ms", priority=timer)
            reading = rig.rtp.software("reading", priority=software)
            looking = rig.rtp.timer("looking", period="2 ms", priority=70)
            c, y, seen = (cell.svv(name, history=100) for name in ("c", "y", "seen"))
            n = cell.svv("n", "int64_t")
            counting = rig.counting(every="2 ms").on(writing).new_instance(c)
            copier = rig.copying().on(reading).asynch(c, y, n)
            rig.sampling(every="2 ms").on(looking).asynch(c, seen)
            counting.start()
            rig.until(lambda of=y: len(of.history) >= 50, "fifty values have come through")
            for instance in (counting, copier):
                instance.halt()
            synchronous.append(y.history[:]["value"].tolist()[:50])
            asynchronous.append(tuple(seen.history[:]["value"].tolist()[:50]))
    assert synchronous == len(REALISATIONS) * [[float(k) for k in range(50)]]
    assert asynchronous[0] != asynchronous[1], "the realisations do differ: who has no relation to its writer sees it"


def test_r011_a_device_is_reached_from_its_processor(rig: Rig) -> None:
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x", initial=[0.25]), exchange=rig.fast)
    (y,) = rig.svvs("y")
    reading = gpac.Verb(
        "reading",
        blocks={"read": lib.block("read_channel")},
        instantiation_parameters={"channel": "read.channel", "y": "read.y"},
        command_lists={"start": [activate("read", every="1 ms")]},
    )
    reading.on(rig.fast).asynch(drive["x"].position, y)
    rig.cell.advance("5 ms")
    assert y.value == 0.25


def test_r012_a_device_of_another_processor_is_refused(rig: Rig) -> None:
    drive = rig.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=rig.fast)
    elsewhere = rig.cell.processor("rtp1").timer("fast", period="1 ms", priority=80)
    (y,) = rig.svvs("y")
    reading = gpac.Verb(
        "reading",
        blocks={"read": lib.block("read_channel")},
        instantiation_parameters={"channel": "read.channel", "y": "read.y"},
        command_lists={"start": [activate("read", every="1 ms")]},
    )
    with pytest.raises(gpac.PlacementError) as caught:
        reading.on(elsewhere).new_instance(drive["x"].position, y)
    assert "drive" in str(caught.value) and "rtp1" in str(caught.value)
