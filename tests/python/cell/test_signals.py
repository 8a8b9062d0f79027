# SPDX-License-Identifier: Apache-2.0
"""Inputs and outputs as devices, and the verbs that set, pulse and await them."""

from __future__ import annotations

import asyncio

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.cell import AnalogInput, AnalogOutput, DigitalInput, DigitalOutput, InputTimeout, pulse, set_output, wait_for_input


def test_an_output_is_written_when_the_call_returns_and_stays(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve, seen = bench.output(), DigitalInput("seen", bench.io["valve_seen"]).enable()
    assert (valve.value.value, seen.value.value) == (False, False)
    assert set_output(valve, True).condition == "written"
    cell.advance("2 ms")
    assert (valve.value.value, seen.value.value) == (True, True)
    cell.advance("1 s")
    assert seen.value.value is True
    set_output(valve, value=False)
    cell.advance("2 ms")
    assert seen.value.value is False


def test_a_disabled_output_is_safe_and_begins_anew(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve, seen = bench.output(), DigitalInput("seen", bench.io["valve_seen"]).enable()
    set_output(valve, True)
    valve.disable()
    cell.advance("3 ms")
    assert seen.value.value is False
    valve.enable()
    cell.advance("3 ms")
    assert (seen.value.value, valve.commanded.value) == (False, False), "not the value of its last life"
    closed = DigitalOutput("closed", bench.far_io["valve"], at_enable=True).enable()
    assert closed.value.value is True


def test_an_analog_output_keeps_its_range(cell: gpac.System) -> None:
    bench = Bench(cell)
    heater = AnalogOutput("heater", bench.io["heater"], low=0.0, high=10.0, at_enable=1.0).enable()
    seen = AnalogInput("seen", bench.io["heater_seen"]).enable()
    cell.advance("3 ms")
    assert seen.value.value == 1.0
    set_output(heater, 7.5)
    cell.advance("3 ms")
    assert seen.value.value == 7.5
    with pytest.raises(gpac.Terminated, match="out of the range"):
        set_output(heater, 11.0)
    heater.commanded = 25.0  # by the back door: the last block before the channel cuts it
    cell.advance("3 ms")
    assert seen.value.value == 10.0
    heater.disable()
    cell.advance("3 ms")
    assert seen.value.value == -1.0, "the channel's safe value"


def test_a_level_is_awaited(cell: gpac.System) -> None:
    bench = Bench(cell, [(30, {"gate": True})])
    gate = DigitalInput("gate", bench.io["gate"]).enable()
    report = wait_for_input(gate, True, time_limit="1 s")
    assert (report.condition, report.reading, cell.now) == ("came", True, pytest.approx(0.030))
    assert wait_for_input(gate, True).time <= 0.001 + 1e-9, "it is so already"


def test_an_edge_is_awaited(cell: gpac.System) -> None:
    bench = Bench(cell, [(0, {"gate": True}), (30, {"gate": False}), (50, {"gate": True})])
    gate = DigitalInput("gate", bench.io["gate"]).enable()
    cell.advance("10 ms")
    assert wait_for_input(gate, edge="rising").ended == pytest.approx(0.050)
    with pytest.raises(InputTimeout) as caught:
        wait_for_input(gate, edge="falling", time_limit="20 ms")
    assert caught.value.condition == "time_limit"


def test_a_number_is_awaited(cell: gpac.System) -> None:
    bench = Bench(cell, [(30, {"pressure": 3.0}), (50, {"pressure": 5.0}), (70, {"pressure": 9.0})])
    pressure = AnalogInput("pressure", bench.io["pressure"]).enable()
    report = wait_for_input(pressure, above=4.0, below=6.0)
    assert (report.reading, report.value, cell.now) == (5.0, 5.0, pytest.approx(0.050))
    assert wait_for_input(pressure, above=8.0).ended == pytest.approx(0.070)


def test_a_channel_is_awaited_without_a_device(cell: gpac.System) -> None:
    bench = Bench(cell, [(30, {"gate": True, "pressure": 2.0})])
    assert wait_for_input(bench.io["gate"]).ended == pytest.approx(0.030)
    assert wait_for_input(bench.io["pressure"], above=1.0).reading == 2.0
    with pytest.raises(InputTimeout):
        wait_for_input(bench.io["gate"], False, time_limit="50 ms")


def test_an_svv_is_awaited_whoever_writes_it(cell: gpac.System) -> None:
    bench = Bench(cell)
    level, ready = cell.svv("level"), cell.svv("ready", bool)
    waiting = wait_for_input.on(bench.fast).asynch(level, above=2.0)
    other = wait_for_input.on(bench.slow, every={"watch": "20 ms"}).asynch(ready)
    cell.advance("50 ms")
    level.value = 3.0
    ready.value = True
    assert (waiting.wait().reading, other.wait().reading) == (3.0, True)
    with pytest.raises(gpac.CallError, match="bool or double"):
        wait_for_input.on(bench.fast)(cell.svv("count", int))


@pytest.mark.parametrize("period", ["3 ms", "20 ms"])
def test_an_svv_is_looked_at_as_its_timer_can(period: str) -> None:
    with gpac.System("slow", clock="virtual") as cell:
        timer = cell.processor("rtp0").timer("timer", period=period, priority=60)
        number = cell.svv("number")
        for wait in (wait_for_input, wait_for_input.on(timer)):
            number.value = 0.0
            waiting = wait.asynch(number, above=1.0)
            cell.advance("50 ms")
            assert waiting.state == "running"
            number.value = 2.0
            assert waiting.wait().reading == 2.0


def test_a_snapshot_has_svvs_and_channels(cell: gpac.System) -> None:
    bench = Bench(cell, [(0, {"pressure": 0.25, "gate": True})])
    number = cell.svv("number", initial=3.0)
    bench.arm.enable()
    cell.advance("2 ms")
    snapshot = cell.read(number, bench.io["pressure"], bench.io["gate"])
    assert snapshot == (3.0, 0.25, True) and snapshot.time == cell.now
    with pytest.raises(gpac.CallError, match="pass SVVs and channels of this system"):
        cell.read("io.pressure")  # type: ignore[arg-type]


def test_several_verbs_read_one_input(cell: gpac.System) -> None:
    bench = Bench(cell, [(30, {"gate": True}), (40, {"gate": False})])
    gate = DigitalInput("gate", bench.io["gate"]).enable()
    waits = [wait_for_input.asynch(gate, edge=edge) for edge in ("rising", "falling", "rising")]
    waits[2].halt()
    assert [w.wait().ended for w in waits[:2]] == pytest.approx([0.030, 0.040])


def test_an_input_is_awaited_in_an_event_loop(cell: gpac.System) -> None:
    bench = Bench(cell, [(30, {"gate": True})])
    gate = DigitalInput("gate", bench.io["gate"]).enable()

    async def both() -> list[str]:
        reports = await asyncio.gather(wait_for_input.asynch(gate), wait_for_input.asynch(bench.io["gate"]))
        return [report.condition for report in reports]

    assert asyncio.run(both()) == ["came", "came"]


def test_a_pulse_has_its_width(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve = bench.output()
    seen = DigitalInput("seen", bench.io["valve_seen"]).enable()
    pulsing = pulse.asynch(valve, width="20 ms")
    rising, falling = wait_for_input(seen, edge="rising").ended, wait_for_input(seen, edge="falling").ended
    assert falling - rising == pytest.approx(0.020)
    assert (pulsing.wait().condition, valve.value.value) == ("over", False)


def test_a_pulse_that_is_cut_short_is_off(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve = bench.output()
    pulsing = pulse.asynch(valve, width="1 s")
    cell.advance("20 ms")
    assert valve.value.value is True
    pulsing.halt()
    cell.advance("2 ms")
    assert valve.value.value is False
    pulse.asynch(valve, width="1 s", time_limit="20 ms")
    cell.advance("30 ms")
    assert valve.value.value is False


def test_a_pause_holds_a_pulse_and_a_wait(cell: gpac.System) -> None:
    bench = Bench(cell, [(30, {"gate": True}), (60, {"gate": False})])
    gate, valve = DigitalInput("gate", bench.io["gate"]).enable(), bench.output()
    waiting, pulsing = wait_for_input.asynch(gate, edge="rising"), pulse.asynch(valve, width="20 ms")
    cell.advance("10 ms")
    assert sorted(cell.pause()) == sorted([waiting.name, pulsing.name])
    cell.advance("100 ms")
    assert (waiting.state, pulsing.state, valve.value.value) == ("suspended", "suspended", True)
    cell.resume()
    pulsing.wait()
    assert waiting.state == "running", "an edge that came and went in the pause is not seen"


def test_two_writers_of_one_output_are_refused(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve = bench.output()
    pulsing = pulse.asynch(valve, width="20 ms")
    with pytest.raises(gpac.SecondWriter, match=pulsing.name):
        set_output(valve, False)
    with pytest.raises(gpac.SecondWriter):
        valve.commanded = False


def test_an_output_must_be_enabled(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve = DigitalOutput("valve", bench.io["valve"])
    with pytest.raises(gpac.NotEnabled, match="valve"):
        set_output(valve, True)


def test_wrong_signals_and_values_are_refused(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve = bench.output()
    with pytest.raises(gpac.CallError, match="DigitalOutput"):
        set_output(bench.io["valve"], True)
    with pytest.raises(gpac.CallError, match="that is read"):
        DigitalInput("wrong", bench.io["valve"])
    with pytest.raises(gpac.CallError, match="bool"):
        DigitalOutput("wrong", bench.io["heater"])
    with pytest.raises(gpac.CallError, match="channel"):
        DigitalInput("wrong", "gate")  # type: ignore[arg-type]
    with pytest.raises(gpac.CallError, match="did you mean 'rising'"):
        wait_for_input(bench.io["gate"], edge="risin")
    with pytest.raises(gpac.CallError):
        wait_for_input(bench.io["gate"], False, edge="rising")
    with pytest.raises(gpac.CallError):
        wait_for_input(valve, True)
    with pytest.raises(gpac.CallError):
        pulse(valve, length="1 s")
    with pytest.raises(gpac.ValueRefused):
        set_output(valve, "yes")
    with pytest.raises(gpac.Error):
        set_output(valve, 3)
    assert valve.value.value is False
