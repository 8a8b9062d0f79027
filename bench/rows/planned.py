# SPDX-License-Identifier: Apache-2.0
"""A complete installation from Python: a verb of many blocks is defined (checked), and an instance of it is created (planned, placed in
memory, its table made) in a running system. The kernel's share alone is the group `install`."""

from __future__ import annotations

import itertools
import json
import time as clock
from collections.abc import Iterator

from lines import Line, median, time

from opengpac.system.realtime import EmbeddedSystem

SIZES = (1, 1_000, 10_000)


def measure(quick: bool) -> Iterator[Line]:
    """Measures a chain of gains driven by one activation."""
    native = EmbeddedSystem("bench", "monotonic", "{}")
    try:
        native.processor("r")
        native.source("r", "soft", "software", 50)
        for size in SIZES[:2] if quick else SIZES:
            native.define_verb(chain(f"warm{size}", size))
            turns = [_once(native, f"chain{size}_{turn}", size) for turn in range(2 if size > 1_000 or quick else 5)]
            defined, created, deleted = (median([turn[part] for turn in turns]) / size for part in range(3))
            note = f"define_verb {time(defined)}, delete {time(deleted)} a block; instances made from JSON"
            yield Line(
                "plan",
                f"create of {size:,} block{'s' if size > 1 else ''}, from Python",
                f"{time(created)} a block",
                "",
                created,
                time(created),
                note=note,
            )
    finally:
        native.close()


def _once(native: EmbeddedSystem, name: str, size: int) -> tuple[float, float, float]:
    verb = json.dumps(chain(name, size))
    application = json.dumps({"verb": name, "arguments": {}, "placement": {"*": "r.soft"}})
    marks = [clock.perf_counter_ns()]
    native.call("define_verb", verb)
    marks.append(clock.perf_counter_ns())
    instance = int(native.call("create", application))
    marks.append(clock.perf_counter_ns())
    native.delete(instance)
    marks.append(clock.perf_counter_ns())
    defined, created, deleted = (float(later - earlier) for earlier, later in itertools.pairwise(marks))
    return defined, created, deleted


def chain(name: str, size: int) -> dict[str, object]:
    """Returns a verb of `size` gains, each driven by the previous one."""
    gain = {"block": {"subroutine": "library.gain"}}
    blocks: dict[str, object] = {f"g{i}": gain for i in range(size)}
    cells = {f"c{i}": [f"g{i}.y", f"g{i + 1}.u"] for i in range(size - 1)}
    blocks["wave"] = {"block": {"subroutine": "library.signal_generator"}}
    cells["head"] = ["wave.y", "g0.u"]
    commands = [{"command": "activate", "block": "wave"}, *({"command": "activate", "block": f"g{i}"} for i in range(size))]
    return {"name": name, "blocks": blocks, "cells": cells, "command_lists": {"start": {"commands": commands}}, "conditions": {}}
