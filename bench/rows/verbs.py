# SPDX-License-Identifier: Apache-2.0
"""A verb from Python: create, start, wait, delete, embedded, monotonic clock. Overhead is the time of the four calls; for the
verb that waits for a release, less the time from its start to the release at which it ended."""

from __future__ import annotations

import itertools
import json
import time as clock
from collections.abc import Callable, Iterator

from lines import Line, median, time

import opengpac as gpac
from opengpac import _native, activate, execute, on
from rows.kernel import C

BAR_NS = 100_000


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Two verbs, through the compiled core and through the package."""
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
            yield _line(f"{what}, by the package", [_by_package(verb.on(source), times) for _ in range(rounds)])
    native = _native.System("bench", "monotonic", "{}")
    try:
        native.processor("r", None, False, False, None)
        native.source("r", "soft", "software", 0, 50, 0)
        native.source("r", "fast", "timer", 1_000_000, 80, 0)
        native.download(str(C / "blocks.c"), "bench_blocks")
        for name, command in (
            ("at_once", {"command": "execute", "block": "b"}),
            ("first", {"command": "activate", "block": "b", "every_ns": 1_000_000}),
        ):
            conditions = {"completed": {"returns": []}} if name == "at_once" else {"done": {"on": ["b.done"], "returns": []}}
            verb = {"name": name, "blocks": {"b": {"block": {"subroutine": "bench_blocks.at_once"}}}, "conditions": conditions}
            native.define_verb(json.dumps({**verb, "command_lists": {"start": {"commands": [command]}}}))
        for what, verb, source in (
            ("execute on a software source", "at_once", "r.soft"),
            ("execute on a timer's source", "at_once", "r.fast"),
            ("ends at its first firing, 1 kHz", "first", "r.fast"),
        ):
            yield _line(f"{what}, by the core", [_by_core(native, verb, source, times) for _ in range(rounds)])
    finally:
        native.close()


def _line(what: str, turns: list[list[list[float]]]) -> Line:
    """`turns`: of each round and call, ns of create, start, wait, delete and of the verb itself."""
    calls = [call for turn in turns for call in turn]
    waits = "firing" in what
    overhead = median([median([sum(call[:4]) - call[4] * waits for call in turn]) for turn in turns])
    parts = [time(median([call[part] for call in calls])) for part in range(4)]
    own = median([call[4] for call in calls])
    note = f"create {parts[0]}, start {parts[1]}, wait {parts[2]}, delete {parts[3]}; the verb itself {time(own)}"
    return Line("verb", what, time(overhead), "", overhead, time(overhead), BAR_NS, "≤ 100 µs", note)


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


def _by_core(native: _native.System, verb: str, source: str, times: int) -> list[list[float]]:
    application = json.dumps({"verb": verb, "arguments": {}, "placement": {"*": source}})

    def wait(instance: int) -> tuple[float, float]:
        report = json.loads(native.wait(instance, None, 0) or "{}")
        return report["started_s"], report["time_s"]

    return [_four(lambda: native.create(application), lambda i: native.start(i, "{}", "{}"), wait, native.delete) for _ in range(times)]
