# SPDX-License-Identifier: Apache-2.0
"""Blocks of the library in a real-time system: closed loops, sized blocks, conditions, time that stands still."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib


@pytest.fixture
def cell() -> Iterator[gpac.System]:
    with gpac.System("library", clock="virtual") as system:
        system.processor("rtp0")
        yield system


def fast(cell: gpac.System) -> gpac.Source:
    return gpac.Processor(cell, "rtp0").timer("fast", period="1 ms", priority=80)


def test_a_loop_settles_and_a_timer_says_when(cell: gpac.System) -> None:
    """A PID drives a lag to its set-point; after 50 ms without a break in the band, on_delay ends the verb."""
    verb = gpac.Verb(
        "settle",
        blocks={
            "pid": lib.pid(kp=4.0, ki=60.0, limit=5.0, anti_windup=1, tracking_time=0.05),
            "plant": lib.first_order_lag(k=2.0, time=0.05),
            "size": lib.absolute,
            "outside": lib.comparator(reference=0.015, hysteresis=0.005),
            "inside": lib.logic_not,
            "settled": lib.on_delay(delay="50 ms"),
        },
        instantiation_parameters={"setpoint": "pid.setpoint", "measured": ["plant.y", "pid.measured"]},
        cells={
            "effort": ["pid.effort", "plant.u"],
            "error": ["pid.error", "size.u"],
            "size": ["size.y", "outside.u"],
            "out": ["outside.above", "inside.u"],
            "in": ["inside.y", "settled.u"],
        },
        modes={"pid.setpoint": "asynchronous", "pid.measured": "asynchronous"},
        output_values={"measured": "plant.y"},
        command_lists={"start": [activate("pid", every="1 ms"), *(activate(b) for b in ("plant", "size", "outside", "inside", "settled"))]},
        conditions={"settled": on("settled.done", returns=["measured"])},
    )
    setpoint, measured = cell.svv("setpoint", initial=3.0), cell.svv("measured")
    report = verb.on(fast(cell))(setpoint, measured, time_limit="5 s")
    assert report.condition == "settled"
    assert abs(report.measured - 3.0) < 0.02
    assert 0.06 < report.time < 1.0


def test_sized_blocks_take_lists_and_matrices(cell: gpac.System) -> None:
    a, b, c = np.array([[0.9, 0.1], [-0.2, 0.8]]), [0.0, 1.0], [1.0, 0.0]
    verb = gpac.Verb(
        "sized",
        blocks={
            "wave": lib.signal_generator(shape=0, offset=1.0),
            "plant": lib.state_space(n=2, a=lib.padded(a), b=b, c=c),
            "all": lib.logic_and,
            "one": lib.multiplexer(index=2),
        },
        instantiation_parameters={
            "y": "plant.y",
            "x": "plant.x",
            "flags": "all.u",
            "choices": "one.u",
            "every_flag": "all.y",
            "chosen": "one.y",
        },
        cells={"u": ["wave.y", "plant.u"]},
        modes={"all.u": "asynchronous", "one.u": "asynchronous"},
        command_lists={
            "start": [activate("wave", every="1 ms"), activate("plant"), activate("all", every="1 ms"), activate("one", every="1 ms")]
        },
    )
    y, x = cell.svv("y"), cell.svv("x", "double[2]")
    flags = [cell.svv(f"flag{k}", "bool", initial=True) for k in range(3)]
    choices = [cell.svv(f"choice{k}", initial=10.0 * k) for k in range(3)]
    every_flag, chosen = cell.svv("every_flag", "bool"), cell.svv("chosen")
    verb.on(fast(cell)).asynch(y=y, x=x, flags=flags, choices=choices, every_flag=every_flag, chosen=chosen)
    cell.advance("20 ms")
    count = 20
    _, expected, states = signal.dlsim((a, np.c_[b], np.r_[[c]], [[0.0]], 1), np.ones(count))
    assert_allclose(y.value, expected[-1, 0], rtol=1e-9)
    assert_allclose(x.value, states[-1], rtol=1e-9)
    assert (every_flag.value, chosen.value) == (True, 20.0)
    flags[1].value = False
    cell.advance("2 ms")
    assert every_flag.value is False


def test_time_stands_still_while_a_verb_is_suspended(cell: gpac.System) -> None:
    """An integrator of 1 is the running time: it does not jump after a suspension, whatever the clock does."""
    verb = gpac.Verb(
        "runs",
        blocks={"one": lib.signal_generator(shape=0, offset=1.0), "sum": lib.integrator},
        instantiation_parameters={"y": "sum.y"},
        cells={"u": ["one.y", "sum.u"]},
        command_lists={"start": [activate("one", every="1 ms"), activate("sum")]},
    )
    y = cell.svv("y")
    instance = verb.on(fast(cell)).asynch(y)
    cell.advance("100 ms")
    before = y.value
    instance.suspend()
    cell.advance("2 s")
    instance.resume()
    cell.advance("50 ms")
    assert_allclose(y.value, before + 0.05, atol=0.003)
