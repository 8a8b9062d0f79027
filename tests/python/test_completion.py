# SPDX-License-Identifier: Apache-2.0
"""Tab completion in IPython: blocks, ports, parameters of calls, devices of groups, channels, types."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from IPython.core.completer import IPCompleter, provisionalcompleter
from traitlets.config import Config

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib


class Prompt:
    """Prompt with these names, and the completions at the end of a line."""

    def __init__(self, **names: Any) -> None:
        config = Config()
        # jedi analyses files; here the objects themselves must be inspected.
        config.IPCompleter.use_jedi = False
        self.completer = IPCompleter(shell=None, namespace=names, global_namespace={}, config=config)

    def tab(self, line: str) -> set[str]:
        with provisionalcompleter():
            found = [*self.completer.completions(line, len(line))]
        return {line[: c.start][len(line) :] + c.text for c in found}


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("cell", clock="virtual") as system:
        yield system


class Axis(gpac.LogicalDevice):
    """Axis without a verb."""

    sensed: gpac.SVV[float] = gpac.svv(unit="rad")
    speed = gpac.parameter(1.0, unit="rad/s")


def wave() -> gpac.Verb[..., Any]:
    return gpac.Verb(
        "wave",
        blocks={"wave": lib.signal_generator},
        instantiation_parameters={"y": ["wave.y"]},
        input_parameters={"amplitude": gpac.input("wave.amplitude", default=1.0), "offset": gpac.input("wave.offset", default=0.0)},
        command_lists={"start": [activate("wave", every="1 ms")]},
    )


def ends(found: set[str]) -> set[str]:
    return {text.rsplit(".", 1)[-1].strip("\"'[]") for text in found}


def test_blocks_of_the_library_and_of_code_modules(cell: gpac.System) -> None:
    prompt = Prompt(lib=lib, code=cell.download(Path(__file__).parent.parent / "blocks" / "count.c"))
    assert {"lowpass", "lookup_table", "limit"} <= ends(prompt.tab("lib.l"))
    assert ends(prompt.tab("code.co")) == {"count"}
    assert "count" in ends(prompt.tab('code["co'))


def test_ports_of_a_labelled_block_and_blocks_in_a_labelled_graph() -> None:
    graph = gpac.Graph("smooth", blocks={"gain": lib.gain}, inputs={"u": "gain.u"}, outputs={"y": "gain.y"})
    prompt = Prompt(planner=lib.trajectory_planner.labelled("planner"), law=graph.labelled("law"))
    assert {"goal", "speed", "start"} <= ends(prompt.tab("planner."))
    assert ends(prompt.tab("law.")) >= {"u", "y", "gain"}


def test_devices_of_a_group_behind_a_dot_and_as_keys(cell: gpac.System) -> None:
    arm = gpac.Group("arm", *(Axis(name, system=cell) for name in ("shoulder", "elbow", "wrist")))
    prompt = Prompt(arm=arm, elbow=arm.elbow)
    assert ends(prompt.tab("arm.el")) == {"elbow"}
    assert ends(prompt.tab('arm["')) == {"shoulder", "elbow", "wrist"}
    assert {"sensed", "speed", "enable"} <= ends(prompt.tab("elbow."))
    assert "values" in ends(prompt.tab("arm.va"))


def test_parts_and_channels_of_a_physical_device(cell: gpac.System) -> None:
    fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
    device = fast.processor.physical_device("loop", gpac.drivers.loopback("elbow", "wrist"), exchange=fast)
    prompt = Prompt(device=device, elbow=device["elbow"])
    assert ends(prompt.tab("device.el")) == {"elbow"}
    assert ends(prompt.tab('device["w')) >= {"wrist"}
    assert ends(prompt.tab("elbow.")) >= {"position", "effort"}


def test_names_of_parameters_in_calls() -> None:
    prompt = Prompt(wave=wave(), lib=lib, pid=lib.pid)
    assert {"amplitude=", "offset=", "time_limit="} <= prompt.tab("wave(")
    assert prompt.tab("wave(of") == {"offset="}
    assert {"kp=", "ki="} <= prompt.tab("pid(k")
    # The classes keep the signatures of their constructors.
    assert {"command_lists=", "transitions="} <= Prompt(gpac=gpac).tab("gpac.Verb(")


def test_codes_of_alarms_and_outputs_of_reports(cell: gpac.System) -> None:
    cell.alarms.define("E101", "the magazine is empty")
    cell.alarms.trip("E101")
    trial = lib.pid.run(kp=2.0, setpoint=1.0, measured=0.25)
    prompt = Prompt(alarms=cell.alarms, trial=trial)
    assert ends(prompt.tab('alarms["')) == {"E101"}
    assert ends(prompt.tab("trial.ef")) == {"effort"}


def test_asking_makes_nothing(cell: gpac.System) -> None:
    before = cell.names
    prompt = Prompt(cell=cell, lib=lib)
    assert {"svv", "statistics", "top", "block_times"} <= ends(prompt.tab("cell."))
    assert cell.names == before
