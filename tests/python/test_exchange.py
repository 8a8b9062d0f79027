# SPDX-License-Identifier: Apache-2.0
"""The verb of a running axis is exchanged: a block inserted into a wire changes no other value."""

from __future__ import annotations

from typing import Annotated, Any

import pytest

import opengpac as gpac
from opengpac import activate, execute, ready
from opengpac import library as lib
from opengpac.python import Input, Output


class Axis:
    """Axis on a loopback drive with a servo, in a system of its own. `own` names which of error and effort are SVVs, not private cells."""

    def __init__(self, own: tuple[str, ...] = ("error", "effort")) -> None:
        self.own = own
        self.cell = gpac.System("exchange", clock="virtual", progress=False)
        rtp = self.cell.processor("rtp0")
        self.fast = rtp.timer("fast", period="1 ms", priority=80)
        drives = rtp.physical_device("drives", gpac.drivers.loopback("x", initial=[0.3]), exchange=self.fast)
        svvs: dict[str, Any] = {"sensed": gpac.svv(unit="rad", history=200), "commanded": gpac.svv(unit="rad", initial="sensed")}
        svvs |= {name: gpac.svv(history=200) for name in own}
        of = type(
            "Axis", (gpac.LogicalDevice,), {"__annotations__": dict.fromkeys(svvs, gpac.SVV[float]), **svvs}, verb=self.servo("plain")
        )
        self.x: Any = of("x", drive=drives["x"], on=self.fast).enable()

    def servo(self, name: str, middle: Any = None, order: tuple[str, ...] = ("read", "middle", "pid", "write")) -> gpac.Verb[..., Any]:
        """Returns a servo, with a block between encoder and controller if `middle` is set."""
        blocks = {"read": lib.read_channel, "middle": middle, "pid": lib.pid(limit=100.0, kp=60.0), "write": lib.write_channel}
        sensed, cells = (
            (["read.y", "pid.measured"], {}) if middle is None else (["read.y", "middle.u"], {"m": ["middle.y", "pid.measured"]})
        )
        data = {"sensed": sensed, "commanded": "pid.setpoint", "error": "pid.error", "effort": ["pid.effort", "write.u"]}
        private = {name: ports for name, ports in data.items() if name in ("error", "effort") and name not in self.own}
        present = [label for label in order if blocks[label] is not None]
        return gpac.Verb(
            name,
            blocks={label: blocks[label] for label in present},
            instantiation_parameters={
                "drive.position": "read.channel",
                "drive.effort": "write.channel",
                **{name: ports for name, ports in data.items() if name not in private},
            },
            cells={**cells, **private},
            modes={"pid.setpoint": "asynchronous"},
            command_lists={
                "start": [
                    execute("read"),
                    activate("read", every="1 ms"),
                    *(activate(label) for label in ("middle", "pid", "write") if label in present),
                    ready(),
                ]
            },
        )

    def values(self, name: str, last: int) -> list[float]:
        return getattr(self.x, name).history[-last:]["value"].tolist()


def moved(own: tuple[str, ...], order: tuple[str, ...] | None, middle: Any = None) -> list[dict[float, float]]:
    """Runs a motion, with an exchange if `order` names an order of the new blocks; returns the sensed positions by time, and the `own`
    SVVs."""
    axis = Axis(own)
    with axis.cell:
        axis.x.commanded = 0.5
        axis.cell.advance("5 ms")
        if order is not None:
            axis.x.exchange_verb(axis.servo("through", middle or lib.gain(k=1.0), order))
        axis.cell.advance("5 ms")
        axis.x.commanded = 0.4
        axis.cell.advance("20 ms")
        return [{round(row["time"], 6): row["value"] for row in getattr(axis.x, name).history[:]} for name in ("sensed", *own)]


@pytest.mark.parametrize("order", [("read", "middle", "pid", "write"), ("read", "pid", "write", "middle")])
@pytest.mark.parametrize("own", [("error", "effort"), ("effort",), ("error",), ()])
def test_a_transparent_block_in_a_running_servo_changes_no_value(own: tuple[str, ...], order: tuple[str, ...]) -> None:
    assert moved(own, order) == moved(own, None)


@gpac.block
def through(u: Annotated[float, Input("sensed", "rad|m")], y: Annotated[float, Output("the same", "rad|m")]):
    """y = u."""
    y = u  # noqa: F841


def test_a_block_in_python_comes_into_a_running_servo_and_no_cycle_is_missed() -> None:
    plain, exchanged = moved(("error",), None), moved(("error",), ("read", "middle", "pid", "write"), through)
    assert exchanged == plain
    times = [round(time * 1e3) for time in exchanged[1]]
    assert times == [*range(times[0], times[0] + len(times))] and len(times) >= 30
    assert len(set(exchanged[0].values())) > 20, "it moves meanwhile"


def test_exchanged_to_and_fro_and_enabled_again_the_controller_sees_the_present_value() -> None:
    axis = Axis()
    with axis.cell:
        plain, through = axis.servo("plain"), axis.servo("through", lib.gain(k=1.0))

        def controller_is_prompt(goal: float) -> None:
            axis.x.commanded = goal
            axis.cell.advance("20 ms")
            assert axis.values("error", 10) == [goal - sensed for sensed in axis.values("sensed", 10)]
            assert len(set(axis.values("sensed", 10))) > 5, "it moves meanwhile"

        axis.x.exchange_verb(through)
        controller_is_prompt(0.5)
        with axis.x.enabled():
            controller_is_prompt(0.7)
        axis.x.enable()
        controller_is_prompt(0.2)
        for verb in (plain, through, plain, through):
            axis.x.exchange_verb(verb)
        controller_is_prompt(0.6)
        axis.x.disable()


def test_a_filter_under_a_moving_axis_begins_at_what_flows() -> None:
    axis = Axis()
    with axis.cell:
        axis.x.commanded = 0.5
        axis.cell.advance("10 ms")
        before = axis.x.sensed.value
        axis.x.exchange_verb(axis.servo("filtered", lib.lowpass(alpha=0.25)))
        axis.cell.advance("3 ms")
        filtered = before
        for sensed, error in zip(axis.values("sensed", 3), axis.values("error", 3), strict=True):
            filtered += 0.25 * (sensed - filtered)
            assert error == pytest.approx(0.5 - filtered, abs=1e-15)
        assert abs(axis.x.sensed.value - before) > 1e-3, "it moves meanwhile"


def test_the_log_names_a_block_with_states_that_nobody_has_told_where_to_begin() -> None:
    axis = Axis()
    with axis.cell:
        for name, middle in (("notched", lib.second_order(kind=3, frequency=50.0)), ("filtered", lib.lowpass(alpha=0.25))):
            axis.x.exchange_verb(axis.servo(name, middle))
        told = [entry["text"] for entry in axis.cell.log() if entry["kind"] == "exchange"]
        assert told == ["its verb is now 'notched'; the states of 'middle' are back at their initial values", "its verb is now 'filtered'"]
