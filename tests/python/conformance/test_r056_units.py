# SPDX-License-Identifier: Apache-2.0
"""Units: unknown ones are refused, those of constants and arguments are checked, those of values pass through blocks."""

from __future__ import annotations

import pytest

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from rig import Rig


@pytest.mark.parametrize("unit", ["Nm", "furlong", "N.m.", "rad/"])
def test_r056_an_unknown_unit_is_refused(memory_rig: Rig, unit: str) -> None:
    said = "did you mean 'N.m'" if unit == "Nm" else "unit"
    with pytest.raises(gpac.UnitMismatch, match=said):
        memory_rig.cell.svv("torque", unit=unit)
    with pytest.raises(gpac.UnitMismatch, match=said):
        gpac.Verb(
            "given",
            blocks={"w": lib.signal_generator},
            input_parameters={"a": gpac.input("w.amplitude", unit=unit)},
            command_lists={"start": [activate("w", every="1 ms")]},
        )


def test_r056_a_constant_is_checked_where_it_stands(memory_rig: Rig) -> None:
    with pytest.raises(gpac.UnitMismatch, match="'50 rad' to Hz"):
        gpac.Graph("wave", blocks={"w": lib.signal_generator(frequency="50 rad")}, outputs={"y": "w.y"})
    assert gpac.Graph("wave", blocks={"w": lib.signal_generator(frequency="0.05 kHz")}, outputs={"y": "w.y"}).run().y.shape == (1,)


def through(rig: Rig, block: gpac.BlockUse, unit: str) -> None:
    angle, after = rig.cell.svv("angle", unit="rad"), rig.cell.svv("after", unit=unit)
    verb = gpac.Verb(
        "through",
        blocks={"b": block},
        instantiation_parameters={"angle": "b.u", "after": "b.y"},
        modes={"b.u": "asynchronous"},
        command_lists={"start": [activate("b", every="1 ms")]},
    )
    verb.on(rig.fast).new_instance([angle] if block.block.name == "library.sum" else angle, after)


@pytest.mark.parametrize("name", ["gain", "sum", "lowpass", "limit", "bias", "median"])
def test_r056_a_unit_passes_through_a_block(memory_rig: Rig, name: str) -> None:
    block = lib.block(name)()
    with pytest.raises(gpac.UnitMismatch, match=r"cannot bind SVV 'after' \(double, N.m\) to output 'b.y' \(double, rad\)"):
        through(memory_rig, block, "N.m")


@pytest.mark.parametrize(("k", "unit"), [("80 N.m/rad", "N.m"), (80.0, "rad"), ("2 s", "rad.s")])
def test_r056_a_factor_with_a_unit_converts(memory_rig: Rig, k: object, unit: str) -> None:
    through(memory_rig, lib.gain(k=k), unit)


def test_r056_a_channel_has_the_unit_of_what_is_read(memory_rig: Rig) -> None:
    drive = memory_rig.rtp.physical_device("drive", gpac.drivers.loopback("x"), exchange=memory_rig.fast)
    reading = gpac.Verb(
        "reading",
        blocks={"read": lib.read_channel},
        instantiation_parameters={"channel": "read.channel", "q": "read.y"},
        command_lists={"start": [activate("read", every="1 ms")]},
    )
    with pytest.raises(gpac.UnitMismatch, match=r"N\.m"):
        reading.on(memory_rig.fast).new_instance(drive["x"].position, memory_rig.cell.svv("wrong", unit="N.m"))
    reading.on(memory_rig.fast).new_instance(drive["x"].position, memory_rig.cell.svv("right", unit="rad"))
