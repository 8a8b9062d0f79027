# SPDX-License-Identifier: Apache-2.0
"""Truth values over time: edges, counters, flip-flops, state machines, and triggers raised by a counter."""

from __future__ import annotations

import opengpac as gpac
from mappings.graph import LENGTH, Graph, Model, Stage, graph
from opengpac import activate
from opengpac import library as lib


def _lamps() -> Model:
    phase = here = rounds = 0
    phases, all_rounds = [], []
    for k in range(LENGTH):
        car = k // 13 % 2 != 0
        longest = {0: 4 if car else 11, 2: 9}.get(phase, 2)
        here += 1
        if here >= longest:
            here, phase = 0, (phase + 1) % 4
            rounds += phase == 2
        phases.append(phase)
        all_rounds.append(rounds)
    return {"phase": phases, "rounds": all_rounds}


@graph(_lamps)
def state_machine_elsewhere(stage: Stage) -> Graph:
    """A lamp whose phases depend on a signal of another processor."""
    return Graph(
        blocks={"car": stage.code.square(half=13), "lamp": stage.code.lamp},
        cells={"car": ["car.y", "lamp.car"]},
        place={"car": "0.fast", "lamp": "1.soft", "record_rounds": "2.soft"},
        record={"phase": "lamp.phase", "rounds": "lamp.rounds"},
        recorder={"phase": "record_integer", "rounds": "record_integer"},
        start=[activate("lamp"), activate("car", every="2 ms")],
    )


@graph(lambda: {"q": [k // 5 % 2 == 1 and (k - 1) // 5 % 2 == 0 for k in range(LENGTH)]})
def edge_elsewhere(stage: Stage) -> Graph:
    """The rising edges of a wave."""
    return Graph(
        blocks={"wave": stage.code.square(half=5), "edge": lib.block("rising_edge")},
        cells={"u": ["wave.y", "edge.u"]},
        place={"wave": "0.fast", "edge": "1.soft"},
        record={"q": "edge.y"},
        recorder={"q": "record_bool"},
        start=[activate("edge"), activate("wave", every="2 ms")],
    )


@graph()
def flip_flop_of_two_processors(stage: Stage) -> Graph:
    """A flip-flop that a wave of one processor sets and one of another resets."""
    return Graph(
        blocks={
            "set": stage.code.square(half=3),
            "reset": stage.code.square(half=8),
            "flip": lib.block("flip_flop_sr"),
            "not": lib.block("logic_not"),
        },
        cells={"s": ["set.y", "flip.set"], "r": ["reset.y", "flip.reset"], "q": ["flip.q", "not.u"]},
        place={"set": "0.fast", "reset": "1.fast", "flip": "2.soft", "not": "0.soft"},
        record={"q": "flip.q", "not_q": "not.y"},
        recorder={"q": "record_bool", "not_q": "record_bool"},
        start=[activate("not"), activate("flip"), activate("set", every="2 ms"), activate("reset", every="2 ms")],
    )


@graph()
def comparator_with_hysteresis(stage: Stage) -> Graph:
    """A comparison with a constant reference, with hysteresis, then edges of the result."""
    return Graph(
        blocks={
            "wave": stage.code.scatter(seed=61),
            "low": lib.block("lowpass")(alpha=0.5),
            "above": lib.block("comparator")(hysteresis=0.1),
            "fell": lib.block("falling_edge"),
        },
        cells={"u": ["wave.y", "low.u"], "l": ["low.y", "above.u"], "a": ["above.above", "fell.u"]},
        inputs={"reference": "above.reference"},
        values={"reference": 0.05},
        place={"wave": "0.fast", "low": "1.soft", "above": "2.soft", "fell": "0.soft"},
        record={"above": "above.above", "fell": "fell.y"},
        recorder={"above": "record_bool", "fell": "record_bool"},
        start=[activate("fell"), activate("above"), activate("low"), activate("wave", every="2 ms")],
    )


@graph(lambda: {"y": [0.5 * k for k in range(LENGTH)]})
def trigger_that_a_counter_raises(stage: Stage) -> Graph:
    """A light blinks through a device; each time it turns on it raises a trigger of another processor, which runs one step of a ramp."""
    panel = stage.processor(0).physical_device(stage.name("panel"), gpac.drivers.loopback("lamp"), exchange=stage.source("0.fast"))
    channel = panel["lamp"]
    channel.velocity.raises(stage.source("1.trigger"))
    return Graph(
        blocks={
            "blink": stage.code.blink,
            "out": lib.block("write_channel"),
            "ramp": stage.code.ramp(step=0.5),
            "pass": lib.block("gain")(k=1.0),
        },
        cells={"lit": ["blink.y", "out.u"], "u": ["ramp.y", "pass.u"]},
        objects={"channel": "out.channel"},
        arguments={"channel": channel.effort},
        place={"blink": "0.fast", "out": "0.fast", "ramp": "1.trigger", "pass": "2.soft"},
        record={"y": "pass.y"},
        start=[activate("pass"), activate("ramp"), activate("out"), activate("blink", every="2 ms")],
    )
