# SPDX-License-Identifier: Apache-2.0
"""Forced inputs and outputs: what programs see, what is written, the alarm, and everything that ends a force."""

from __future__ import annotations

from pathlib import Path

import pytest

import opengpac as gpac
from cell_rig import Bench
from opengpac.cell import AnalogInput, AnalogOutput, DigitalInput, set_output, wait_for_input


def states(cell: gpac.System) -> list[tuple[str, str, str]]:
    """Returns code, source and state of each alarm."""
    return [(alarm.code, alarm.source, alarm.state) for alarm in cell.alarms]


def logged(cell: gpac.System, kind: str) -> list[str]:
    """Returns the log entries of a kind, with their subjects."""
    return [f"{entry['about']}: {entry['text']}" for entry in cell.log() if entry["kind"] == kind]


def test_a_forced_input_is_what_every_reader_sees_until_it_is_released(cell: gpac.System) -> None:
    bench = Bench(cell, [(0, {"pressure": 1.0})])
    gate, pressure = DigitalInput("gate", bench.io["gate"]).enable(), AnalogInput("pressure", bench.io["pressure"]).enable()
    cell.advance("5 ms")
    with cell.force(gate, True) as held:
        assert wait_for_input(gate, True, time_limit="10 ms").reading is True
        assert wait_for_input(bench.io["gate"], True, time_limit="10 ms").reading is True, "a channel without a device sees it, too"
        forced = cell.force(pressure, 4.5)
        cell.advance("2 ms")
        assert (pressure.value.value, cell.read(bench.io["pressure"])[0]) == (4.5, 4.5)
        assert {name: (of.channel, of.output, of.value, of.who) for name, of in cell.forced.items()} == {
            "gate": ("io.gate", False, True, "program"),
            "pressure": ("io.pressure", False, 4.5, "program"),
        }
        assert states(cell) == [("forced", "gate", "active"), ("forced", "pressure", "active")]
        cell.force(pressure, 5.5)
        cell.advance("2 ms")
        assert (pressure.value.value, forced.active, held.active) == (5.5, False, True)
        forced.release()
        assert cell.forced["pressure"].value == 5.5, "the first force was replaced, and releases nothing"
    cell.advance("2 ms")
    assert gate.value.value is False
    assert cell.release() == ["pressure"] and cell.release() == [] and not cell.forced
    cell.advance("2 ms")
    assert pressure.value.value == 1.0
    assert states(cell) == [("forced", "gate", "returned"), ("forced", "pressure", "returned")]
    assert logged(cell, "force") == ["gate: to true, by program", "pressure: to 4.5, by program", "pressure: to 5.5, by program"]
    assert logged(cell, "release") == ["gate: by program", "pressure: by program"]
    with pytest.raises(gpac.InvalidState, match="cannot release 'gate': it is not forced"):
        cell.release(gate)


def test_a_forced_output_replaces_the_command_and_a_disabled_one_is_safe(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve, seen = bench.output(), DigitalInput("seen", bench.io["valve_seen"]).enable()
    heater = AnalogOutput("heater", bench.io["heater"], low=0.0, high=10.0, at_enable=1.0).enable()
    heated = AnalogInput("heated", bench.io["heater_seen"]).enable()
    cell.force(valve, True)
    cell.force(heater, 7.5)
    cell.advance("3 ms")
    assert (seen.value.value, heated.value.value) == (True, 7.5)
    set_output(valve, False)
    set_output(heater, 2.0)
    cell.advance("3 ms")
    assert (seen.value.value, heated.value.value) == (True, 7.5)
    heater.high = 5.0
    cell.advance("3 ms")
    assert (heated.value.value, list(cell.forced)) == (2.0, ["valve"]), "the new limit does not allow it"
    valve.disable()
    cell.advance("3 ms")
    assert (seen.value.value, cell.forced) == (False, {})
    valve.enable()
    cell.advance("3 ms")
    assert seen.value.value is False, "enabling does not bring a force back"
    assert "valve: the device is no longer enabled" in logged(cell, "release")


def test_an_emergency_stop_ends_every_force_and_none_can_be_set_until_the_reset(cell: gpac.System) -> None:
    bench = Bench(cell)
    valve, seen = bench.output(), DigitalInput("seen", bench.io["valve_seen"]).enable()
    gate = DigitalInput("gate", bench.io["gate"]).enable()
    cell.force(valve, True)
    held = cell.force(gate, True)
    cell.advance("3 ms")
    cell.emergency_stop("a person came in")
    assert not cell.forced and not held.active
    held.release()
    with pytest.raises(gpac.EmergencyStopped, match="cannot force 'gate': the emergency stop is latched"):
        cell.force(gate, True)
    cell.reset()
    for device in (valve, seen, gate):
        device.enable()
    cell.advance("3 ms")
    assert (seen.value.value, gate.value.value) == (False, False)


def test_a_lost_device_ends_its_forces(cell: gpac.System) -> None:
    bench = Bench(cell, fail_at="50 ms", initial=[0.5, 0.5])
    place = AnalogInput("place", bench.drives["x"].position).enable()
    held = cell.force(place, 2.0)
    cell.advance("40 ms")
    assert place.value.value == 2.0
    cell.advance("20 ms")
    assert place.state == "fault" and not held.active
    bench.drives.reopen()
    place.enable()
    cell.advance("2 ms")
    assert place.value.value == 0.5


def test_switches_that_stop_or_permit_motion_are_never_forced(cell: gpac.System) -> None:
    bench = Bench(cell)
    stop, enabling = DigitalInput("stop", bench.io["stop"]).enable(), DigitalInput("enabling", bench.io["enabling"]).enable()
    gate = DigitalInput("gate", bench.io["gate"]).enable()
    cell.emergency_stop_input(bench.io["stop"])
    cell.enabling_switch(bench.io["enabling"])
    for signal, why in ((stop, "is an emergency stop input"), (enabling, "is the enabling switch")):
        with pytest.raises(gpac.NotAllowed, match=why):
            cell.force(signal, True)
    cell.force(gate, True)
    for call in (cell.emergency_stop_input, cell.enabling_switch):
        with pytest.raises(gpac.InUse, match=r"channel 'io.gate' is forced by 'gate'; release 'gate' first"):
            call(bench.io["gate"])


def test_in_manual_mode_an_output_is_forced_only_while_the_enabling_switch_is_held(cell: gpac.System) -> None:
    bench = Bench(cell, [(10, {"enabling": True}), (30, {"enabling": False})])
    valve, gate = bench.output(), DigitalInput("gate", bench.io["gate"]).enable()
    cell.enabling_switch(bench.io["enabling"])
    cell.mode = "manual"
    with pytest.raises(gpac.InvalidState, match=r"enabling switch 'io\.enabling' is not held"):
        cell.force(valve, True)
    cell.advance("15 ms")
    cell.force(valve, True)
    cell.force(gate, True)
    cell.advance("30 ms")
    assert list(cell.forced) == ["gate"]


def test_wrong_forces_are_refused(cell: gpac.System) -> None:
    bench = Bench(cell)
    gate = DigitalInput("gate", bench.io["gate"])
    heater = AnalogOutput("heater", bench.io["heater"], low=0.0, high=10.0).enable()
    with pytest.raises(gpac.NotEnabled, match="cannot force 'gate': it is not enabled"):
        cell.force(gate, True)
    gate.enable()
    with pytest.raises(gpac.ValueRefused, match="'gate': bool takes true or false"):
        cell.force(gate, 0.5)
    with pytest.raises(gpac.OutOfRange, match=r"'heater' cannot be forced to 10\.5: the range of the output is 0 to 10"):
        cell.force(heater, 10.5)
    with pytest.raises(gpac.Error, match="finite"):
        cell.force(heater, float("nan"))
    bench.arm.enable()
    with pytest.raises(gpac.CallError, match=r"'arm\.x' cannot be forced: it is a robot_joint, which has no channel of its own"):
        cell.force(bench.arm[0], 0.5)
    with pytest.raises(gpac.CallError, match=r"the argument of force\(\) must be an input or output, not"):
        cell.force(bench.io["gate"], True)  # type: ignore[arg-type]
    assert not cell.forced and not list(cell.alarms)


def test_a_recording_has_the_forced_values_says_so_and_is_replayed(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with gpac.System("recorded", clock="virtual") as cell:
        cell.record(path, replay=True)
        bench = Bench(cell)
        gate, valve = DigitalInput("gate", bench.io["gate"]).enable(), bench.output()
        cell.advance("10 ms")
        with cell.force(gate, True), cell.force(valve, True):
            cell.advance("10 ms")
        cell.advance("10 ms")
    recorded = gpac.open_recording(path)
    values = recorded["gate.value"][:]
    assert values["value"].any() and not values["value"].all()
    kinds = [(entry["kind"], entry["about"]) for entry in recorded.log if entry["kind"] in ("force", "release")]
    assert kinds == [("force", "gate"), ("force", "valve"), ("release", "valve"), ("release", "gate")]
    again = gpac.replay(path, show=["gate.value"], trust=True)
    assert again.same


def test_a_checked_program_forces_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    Path("forces.py").write_text(
        "import opengpac as gpac\n"
        "cell = gpac.System('cell', clock='virtual')\n"
        "fast = cell.processor('rtp0').timer('fast', period='1 ms', priority=80)\n"
        "inputs = gpac.drivers.scripted([{'name': 'gate', 'direction': 'read', 'type': 'bool'}])\n"
        "io = fast.processor.physical_device('io', inputs, exchange=fast)\n"
        "gate = gpac.cell.DigitalInput('gate', io['gate']).enable()\n"
        "with cell.force(gate, True):\n"
        "    gpac.cell.wait_for_input(gate, True)\n"
        "cell.release(gate)\n"
        "cell.force(io['gate'], True)\n"
    )
    from opengpac.cli import main

    assert main(["check", "forces.py"]) == 1
    said = capsys.readouterr()
    assert "1 error" in said.out and "forces.py:10" in said.err
