# SPDX-License-Identifier: Apache-2.0
"""Devices with a protocol of text lines as physical devices, over TCP and pseudo terminals."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

import opengpac as gpac
from afar import until
from opengpac import activate
from opengpac.cell import AnalogInput, AnalogOutput, DigitalInput, set_output
from opengpac.drivers.fake.ends import TcpEnd

READER = """
#include <opengpac.h>

FUNCTION_BLOCK(read_code, "Reads a text: y = channel.",
    device (uint8_t[16], channel, read, "what was scanned"),
    out    (uint8_t[16], y, "the same"))
{
    for (int i = 0; i < 16; i++) self->y[i] = self->channel[i];
    return OK;
}
"""


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    """Yields a system under the virtual clock, whose devices are exchanged within each firing."""
    with gpac.System("cell", clock="virtual", seed=1) as made:
        yield made


@pytest.mark.parametrize("serial", [False, True], ids=["tcp", "serial"])
def test_a_scale_is_asked_lost_and_comes_back(cell: gpac.System, serial: bool) -> None:
    with gpac.drivers.fake.text(answers={"P": "ST,GS,+  12.50 kg\r"}, serial=serial) as scale:
        slow = cell.processor("rtp0").timer("slow", period="10 ms", priority=60)
        fields = {"weight": {"unit": "kg"}, "stable": {"when": "ST"}}
        driver = gpac.drivers.text(scale.address, asks="P", reads=["{stable},GS,{weight} kg"], fields=fields, answer="30 s")
        device = slow.processor.physical_device("scale", driver, exchange=slow)
        weight, stable = AnalogInput("weight", device["weight"]).enable(), DigitalInput("stable", device["stable"]).enable()
        assert (weight.value.value, stable.value.value) == (12.5, True)
        scale.answers["P"] = "US,GS,-0.25 kg"
        cell.advance("20 ms")
        assert (weight.value.value, stable.value.value) == (-0.25, False)
        if serial:
            return  # a line whose other end is silent is waited for, in real time
        scale.stop()
        cell.advance("20 ms")
        assert weight.state == "fault"
        scale.start()
        cell.reset()
        assert weight.enable().value.value == -0.25


@pytest.mark.parametrize("serial", [False, True], ids=["tcp", "serial"])
def test_a_heater_is_told_what_changes(cell: gpac.System, serial: bool) -> None:
    with gpac.drivers.fake.text(end="\r", serial=serial) as heater:
        slow = cell.processor("rtp0").timer("slow", period="10 ms", priority=60)
        fields = {"heat": {"unit": "deg.C", "decimals": 1, "safe": 20.0}}
        driver = gpac.drivers.text(heater.address, writes=["SP {heat}"], fields=fields, end="\r")
        device = slow.processor.physical_device("heater", driver, exchange=slow)
        heat = AnalogOutput("heat", device["heat"], low=0.0, high=90.0, at_enable=20.0).enable()
        set_output(heat, 55.25)
        cell.advance("50 ms")
        heat.disable()
        cell.advance("20 ms")
        until(lambda: heater.heard == ["SP 20.0", "SP 55.2", "SP 20.0"], "each value once")


def test_a_code_is_a_state_vector_variable(cell: gpac.System, tmp_path: Path) -> None:
    (tmp_path / "read_code.c").write_text(READER)
    with gpac.drivers.fake.text(serial=True) as scanner:
        slow = cell.processor("rtp0").timer("slow", period="10 ms", priority=60)
        driver = gpac.drivers.text(scanner.address, reads=["{code}"], fields={"code": {"text": 16}})
        device = slow.processor.physical_device("scanner", driver, exchange=slow)
        reader = gpac.Verb(
            "reader",
            blocks={"read": cell.download(str(tmp_path / "read_code.c")).read_code},
            instantiation_parameters={"scanner": "read.channel", "code": "read.y"},
            command_lists={"start": [activate("read", every="10 ms")]},
        )
        code = cell.svv("code", "uint8_t[16]")
        reader.on(slow).asynch(scanner=device["code"], code=code)
        scanner.say("4006381333931")

        def read() -> bytes:
            cell.advance("10 ms")
            return bytes(code.value).rstrip(b"\0")

        until(lambda: read() == b"4006381333931", "the code has come")
        scanner.say("A-7")
        until(lambda: read() == b"A-7", "the next one, with nothing left of the longer one")


def test_what_is_wrong_in_a_declaration_is_named(cell: gpac.System) -> None:
    slow = cell.processor("rtp0").timer("slow", period="10 ms", priority=60)
    with pytest.raises(gpac.Error, match=r"option 'fields': 'wieght' is in none of the texts; did you mean 'weight'\?"):
        made = gpac.drivers.text("tcp/127.0.0.1:1", reads=["{weight} kg"], fields={"wieght": {"unit": "kg"}})
        slow.processor.physical_device("scale", made, exchange=slow)
    with pytest.raises(gpac.CallError, match="field 'weight' must be a dictionary, not 3"):
        gpac.drivers.text("tcp/127.0.0.1:1", reads=["{weight} kg"], fields={"weight": 3})  # type: ignore[dict-item]


def test_a_line_that_is_too_long_is_dropped_whole(cell: gpac.System) -> None:
    with gpac.drivers.fake.text(end="\r") as scale:
        slow = cell.processor("rtp0").timer("slow", period="10 ms", priority=60)
        driver = gpac.drivers.text(scale.address, reads=["{weight}"], fields={"weight": {}}, end="\r")
        device = slow.processor.physical_device("scale", driver, exchange=slow)
        weight = AnalogInput("weight", device["weight"]).enable()
        for length in (1024, 2000, 2048, 5000):
            before = device.counters["damaged"]
            # The tail of this line alone would be a valid weight.
            scale.say("9" * length + "77")
            scale.say(f"{length}.5")

            seen = [weight.value.value]
            until(lambda seen=seen, last=length + 0.5: seen_next(cell, weight, seen) == last, "the next line has come")
            assert set(seen) == {seen[0], length + 0.5}, "nothing of the long line was taken"
            assert device.counters["damaged"] == before + 1


def seen_next(cell: gpac.System, weight: AnalogInput, seen: list[float]) -> float:
    """Returns the value one period later, and adds it to those seen."""
    cell.advance("10 ms")
    seen.append(float(weight.value.value))
    return seen[-1]


def test_who_has_just_connected_hears_what_is_said() -> None:
    end = TcpEnd(lambda came, _: came.clear())
    end.start()
    try:
        for _ in range(50):
            with socket.create_connection(("127.0.0.1", end.port), timeout=30) as line:
                end.send(b"x")
                assert line.recv(1) == b"x"
    finally:
        end.close()
