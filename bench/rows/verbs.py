# SPDX-License-Identifier: Apache-2.0
"""A verb from Python, embedded, monotonic clock: a call, which is one request; and create, start, wait and delete one by one. The
overhead is the total time; for the verb that waits for a release, the time from its start to the release at which it ended is
subtracted."""

from __future__ import annotations

import itertools
import json
import time as clock
from collections.abc import Callable, Iterator

from lines import Line, median, time

import opengpac as gpac
from opengpac import activate, execute, on
from opengpac.system.realtime import EmbeddedSystem
from rows.kernel import C

PACKAGE_NS = 100_000
CORE_NS = 60_000


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Measures two verbs, through the compiled core and through the package."""
    times = 50 if quick else 200
    with gpac.System("bench") as cell:
        rtp = cell.processor("rtp0")
        soft = rtp.software("soft", priority=50)
        fast = rtp.timer("fast", period="1 ms", priority=80)
        block = cell.download(str(C / "blocks.c"), "bench_blocks")["at_once"]
        at_once = gpac.Verb("at_once", blocks={"b": block}, command_lists={"start": [execute("b")]}, conditions={"completed": on()})
        first = gpac.Verb(
            "first",
            blocks={"b": block},
            command_lists={"start": [activate("b", every="1 ms")]},
            conditions={"done": on("b.done", returns=[])},
        )
        for what, verb, source in (
            ("execute on a software source", at_once, soft),
            ("execute on a timer's source", at_once, fast),
            ("ends at its first firing, 1 kHz", first, fast),
        ):
            yield _called(f"{what}, a call by the package", [_calls(verb.on(source), times) for _ in range(rounds)], PACKAGE_NS)
            yield _line(f"{what}, four calls by the package", [_by_package(verb.on(source), times) for _ in range(rounds)])
    native = EmbeddedSystem("bench", "monotonic", "{}")
    try:
        native.processor("r")
        native.source("r", "soft", "software", 50)
        native.source("r", "fast", "timer", 80, 1_000_000)
        native.download(str(C / "blocks.c"), "bench_blocks")
        for name, command in (
            ("at_once", {"command": "execute", "block": "b"}),
            ("first", {"command": "activate", "block": "b", "every_ns": 1_000_000}),
        ):
            conditions = {"completed": {"returns": []}} if name == "at_once" else {"done": {"on": ["b.done"], "returns": []}}
            verb = {"name": name, "blocks": {"b": {"block": {"subroutine": "bench_blocks.at_once"}}}, "conditions": conditions}
            native.define_verb({**verb, "command_lists": {"start": {"commands": [command]}}})
        for what, verb, source in (
            ("execute on a software source", "at_once", "r.soft"),
            ("execute on a timer's source", "at_once", "r.fast"),
            ("ends at its first firing, 1 kHz", "first", "r.fast"),
        ):
            yield _called(f"{what}, a call by the core", [_calls_of_core(native, verb, source, times) for _ in range(rounds)], CORE_NS)
            yield _line(f"{what}, four calls by the core", [_by_core(native, verb, source, times) for _ in range(rounds)])
    finally:
        native.close()


def _line(what: str, turns: list[list[list[float]]]) -> Line:
    """Returns a line of four calls. `turns` contains per round and call the times of create, start, wait, delete and of the verb itself,
    ns."""
    calls = [call for turn in turns for call in turn]
    waits = "firing" in what
    overhead = median([median([sum(call[:4]) - call[4] * waits for call in turn]) for turn in turns])
    parts = [time(median([call[part] for call in calls])) for part in range(4)]
    own = median([call[4] for call in calls])
    note = f"create {parts[0]}, start {parts[1]}, wait {parts[2]}, delete {parts[3]}; the verb itself {time(own)}"
    return Line("verb", what, time(overhead), "", overhead, time(overhead), note=note)


def _called(what: str, turns: list[list[list[float]]], bar_ns: float) -> Line:
    """Returns a line of one call. `turns` contains per round and call its time and that of the verb itself, ns."""
    waits = "firing" in what
    overhead = median([median([whole - own * waits for whole, own in turn]) for turn in turns])
    own = median([own for turn in turns for _, own in turn])
    return Line("verb", what, time(overhead), "", overhead, time(overhead), bar_ns, f"≤ {time(bar_ns)}", f"the verb itself {time(own)}")


def _calls(verb: gpac.Verb[..., gpac.Report], times: int) -> list[list[float]]:
    def call() -> list[float]:
        begun = clock.perf_counter_ns()
        report = verb()
        return [float(clock.perf_counter_ns() - begun), report.time * 1e9]

    return [call() for _ in range(times)]


def _calls_of_core(native: EmbeddedSystem, verb: str, source: str, times: int) -> list[list[float]]:
    application = json.dumps({"verb": verb, "arguments": {}, "placement": {"*": source}})

    def call() -> list[float]:
        begun = clock.perf_counter_ns()
        text = native.performing(application, [], 1_000_000_000)
        took = float(clock.perf_counter_ns() - begun)
        report = json.loads(text or "{}")
        return [took, max(0.0, (report["time_s"] - report["started_s"]) * 1e9)]

    return [call() for _ in range(times)]


def _four(
    create: Callable[[], object], start: Callable[..., object], wait: Callable[..., tuple[float, float]], delete: Callable[..., object]
) -> list[float]:
    marks = [clock.perf_counter_ns()]
    instance = create()
    marks.append(clock.perf_counter_ns())
    start(instance)
    marks.append(clock.perf_counter_ns())
    started_s, ended_s = wait(instance)
    marks.append(clock.perf_counter_ns())
    delete(instance)
    marks.append(clock.perf_counter_ns())
    return [float(later - earlier) for earlier, later in itertools.pairwise(marks)] + [max(0.0, (ended_s - started_s) * 1e9)]


def _by_package(verb: gpac.Verb[..., gpac.Report], times: int) -> list[list[float]]:
    def wait(instance: gpac.VerbInstance[gpac.Report]) -> tuple[float, float]:
        report = instance.wait()
        return 0.0, report.time

    return [_four(verb.new_instance, lambda i: i.start(), wait, lambda i: i.delete()) for _ in range(times)]


def _by_core(native: EmbeddedSystem, verb: str, source: str, times: int) -> list[list[float]]:
    application = json.dumps({"verb": verb, "arguments": {}, "placement": {"*": source}})

    def wait(instance: int) -> tuple[float, float]:
        report = native.wait(instance) or {}
        return report["started_s"], report["time_s"]

    return [_four(lambda: int(native.call("create", application)), native.start, wait, native.delete) for _ in range(times)]
