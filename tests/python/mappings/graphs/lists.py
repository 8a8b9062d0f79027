# SPDX-License-Identifier: Apache-2.0
"""Command lists: transitions, faults, single executions, waits, ending lists, suspension, and concurrent verbs."""

from __future__ import annotations

from typing import Any

import opengpac as gpac
from mappings.graph import LENGTH, Graph, Model, Stage, graph, scattered
from opengpac import activate, deactivate, execute, on, wait
from opengpac import library as lib


def _two_lists(stage: Stage, second: str) -> Graph:
    """Returns two lists, each with its own writer and reader; the first leads to the second when its writer has counted."""
    return Graph(
        blocks={
            "count": stage.code.counted,
            "wave": stage.code.scatter(seed=71),
            "a": lib.block("gain")(k=1.0),
            "b": lib.block("gain")(k=1.0),
        },
        cells={"c": ["count.y", "a.u"], "w": ["wave.y", "b.u"]},
        inputs={"limit": "count.enough"},
        values={"limit": 230},
        place={"count": "0.fast", "wave": second, "a": "1.soft", "b": "2.soft"},
        record={"a": "a.y", "b": "b.y"},
        lists={
            "first": [activate("record_a"), activate("a"), activate("count", every="2 ms")],
            "second": [activate("record_b"), activate("b"), activate("wave", every="2 ms")],
        },
        conditions={"enough": on("count.enough")},
        transitions={("first", "enough"): "second"},
    )


def _of_both_lists() -> Model:
    return {"a": [float(k) for k in range(LENGTH)], "b": scattered(71)}


@graph(_of_both_lists, left_by_count=True)
def transition_within_a_source(stage: Stage) -> Graph:
    """A condition of one source starts blocks of the same source; the readers are on other processors."""
    return _two_lists(stage, "0.fast")


@graph(_of_both_lists, left_by_count=True)
def transition_to_another_processor(stage: Stage) -> Graph:
    """A condition on one processor starts a list on another."""
    return _two_lists(stage, "1.fast")


@graph(lambda: {"y": [float(k + 1) for k in range(LENGTH)]})
def fault_that_leads_on(stage: Stage) -> Graph:
    """Every 50th invocation is not a number: it stores nothing, and τ restarts the list; the reader elsewhere misses nothing."""
    return Graph(
        blocks={"bad": stage.code.bad_at_times, "pass": lib.block("gain")(k=1.0)},
        cells={"u": ["bad.y", "pass.u"]},
        place={"bad": "0.fast", "pass": "1.soft"},
        record={"y": "pass.y"},
        lists={"start": [activate("record_y"), activate("pass"), activate("bad", every="2 ms")]},
        transitions={("start", "fault"): "start"},
    )


@graph(lambda: {"y": [2.0 * u for u in scattered(length=LENGTH)]})
def two_hundred_executions(stage: Stage) -> Graph:
    """A list of 200 `execute` commands, each followed by a wait of 2 ms: each runs one invocation, which drives one elsewhere."""
    return Graph(
        blocks={"wave": stage.code.scatter, "gain": lib.block("gain")(k=2.0)},
        cells={"u": ["wave.y", "gain.u"]},
        place={"wave": "0.fast", "gain": "1.soft"},
        record={"y": "gain.y"},
        start=[activate("gain"), *(command for _ in range(LENGTH) for command in (execute("wave"), wait("2 ms")))],
    )


@graph(lambda: {"a": [float(k) for k in range(LENGTH)], "b": scattered(72)})
def one_after_the_other(stage: Stage) -> Graph:
    """A list waits for one writer's count, stops the writer, and starts another on the next processor."""
    return Graph(
        blocks={
            "count": stage.code.counted,
            "wave": stage.code.scatter(seed=72),
            "a": lib.block("gain")(k=1.0),
            "b": lib.block("gain")(k=1.0),
        },
        cells={"c": ["count.y", "a.u"], "w": ["wave.y", "b.u"]},
        inputs={"limit": "count.enough"},
        values={"limit": LENGTH - 1},
        place={"count": "0.fast", "wave": "1.fast", "a": "2.soft", "b": "2.soft"},
        record={"a": "a.y", "b": "b.y"},
        start=[
            activate("a"),
            activate("b"),
            activate("count", every="2 ms"),
            wait("count.enough"),
            deactivate("count"),
            activate("wave", every="2 ms"),
        ],
    )


@graph(lambda: {"y": scattered(73)})
def ending_list_elsewhere(stage: Stage) -> Graph:
    """When the verb ends, an ending list counts to three on another processor; the recorded values persist."""
    return Graph(
        blocks={"wave": stage.code.scatter(seed=73), "last": stage.code.counted, "pass": lib.block("gain")(k=1.0)},
        cells={"u": ["wave.y", "pass.u"]},
        inputs={"limit": "last.enough"},
        values={"limit": 3},
        place={"wave": "0.fast", "pass": "1.soft", "last": "2.fast"},
        record={"y": "pass.y"},
        lists={
            "start": [activate("record_y"), activate("pass"), activate("wave", every="2 ms")],
            "end": [activate("last", every="2 ms"), wait("last.enough"), deactivate("last")],
        },
        ending="end",
    )


@graph(lambda: {"y": [u + 1.0 for u in scattered(74)]})
def suspended_and_resumed(stage: Stage) -> Graph:
    """The programming system suspends and resumes the verb three times: values in transit arrive, and none is lost or duplicated."""

    def pause(instance: gpac.VerbInstance[Any]) -> None:
        for _ in range(3):
            stage.run_for(instance, "20 ms")
            instance.suspend()
            instance.resume()

    return Graph(
        blocks={"wave": stage.code.scatter(seed=74), "bias": lib.block("bias")(b=1.0), "pass": lib.block("gain")(k=1.0)},
        cells={"u": ["wave.y", "bias.u"], "v": ["bias.y", "pass.u"]},
        place={"wave": "0.fast", "bias": "1.soft", "pass": "2.soft"},
        record={"y": "pass.y"},
        start=[activate("pass"), activate("bias"), activate("wave", every="2 ms")],
        during=pause,
    )


@graph(lambda: {"y": [2.0 * u for u in scattered(75)]})
def writer_in_another_verb(stage: Stage) -> Graph:
    """The writer is a separate verb, started later, on another processor."""
    shared, begun = stage.svv("shared"), stage.svv("begun")
    writing = gpac.Verb(
        "writing",
        blocks={"wave": stage.code.scatter(seed=75)},
        instantiation_parameters={"y": "wave.y"},
        command_lists={"start": [activate("wave", every="2 ms")]},
    )
    writer = writing.on(stage.source("0.fast")).new_instance(shared)

    def follow(instance: gpac.VerbInstance[Any]) -> None:
        """Starts the writer once the reader has executed: a start returns before its list is entered on a remote processor."""
        while begun.value != 1.0:
            stage.run_for(instance, "2 ms")
        writer.start()

    return Graph(
        blocks={"gain": lib.block("gain")(k=2.0), "begin": stage.code.ramp(first=1.0)},
        cells={},
        objects={"shared": "gain.u", "begun": "begin.y"},
        arguments={"shared": shared, "begun": begun},
        place={"gain": "1.soft", "begin": "1.soft"},
        record={"y": "gain.y"},
        start=[activate("gain"), execute("begin")],
        beside=[writer],
        during=follow,
    )


@graph(lambda: {"y": [3.0 * u + 0.5 for u in scattered(76)]})
def values_of_the_start(stage: Stage) -> Graph:
    """Parameters set at the start reach blocks on two processors."""
    return Graph(
        blocks={"wave": stage.code.scatter(seed=76), "gain": lib.block("gain"), "bias": lib.block("bias")},
        cells={"u": ["wave.y", "gain.u"], "v": ["gain.y", "bias.u"]},
        inputs={"k": "gain.k", "b": "bias.b"},
        values={"k": 3.0, "b": 0.5},
        place={"wave": "0.fast", "gain": "1.soft", "bias": "2.soft"},
        record={"y": "bias.y"},
        start=[activate("bias"), activate("gain"), activate("wave", every="2 ms")],
    )


@graph()
def relaxed_mode(stage: Stage) -> Graph:
    """An input made asynchronous by its use reads a constant value; the other input drives."""
    return Graph(
        blocks={"wave": stage.code.scatter(seed=77), "add": stage.code.add},
        cells={"u": ["wave.y", "add.a"]},
        inputs={"offset": "add.b"},
        values={"offset": 0.125},
        modes={"add.b": "asynchronous"},
        place={"wave": "0.fast", "add": "1.soft"},
        record={"y": "add.y"},
        start=[activate("add"), activate("wave", every="2 ms")],
    )
