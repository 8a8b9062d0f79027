# SPDX-License-Identifier: Apache-2.0
"""A system with a processor in a process of its own, for tests, and its traces visible from outside."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import opengpac as gpac
from opengpac import _native, activate, library, on

DEADLINE_S = 120.0
"""Time limit of a condition: a safety net for busy machines, not a measure."""


def until(holds: Callable[[], Any], what: str) -> Any:
    """Waits until `holds` returns a true value, and returns it; fails with `what` after the deadline."""
    end = time.monotonic() + DEADLINE_S
    while not (found := holds()):
        assert time.monotonic() < end, f"not within {DEADLINE_S} s: {what}"
        time.sleep(0.002)
    return found


def children(entry: str, of: int | None = None) -> list[int]:
    """Returns the child processes that were started for `entry`, of this process or another one."""
    found = []
    for thread in (Path("/proc") / str(of or os.getpid()) / "task").iterdir():
        with contextlib.suppress(OSError):
            for pid in (thread / "children").read_text().split():
                if (Path("/proc") / pid / "cmdline").read_bytes().endswith(f"\0{entry}\0".encode()):
                    found.append(int(pid))
    return sorted(found)


def resident_kb(pid: int) -> int:
    """Returns the resident memory of a process, kB."""
    line = next(line for line in (Path("/proc") / str(pid) / "status").read_text().splitlines() if line.startswith("VmRSS"))
    return int(line.split()[1])


def processor_time_s(pid: int) -> float:
    """Returns the processor time that a process has used, s."""
    fields = (Path("/proc") / str(pid) / "stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def shared_memory(word: str) -> list[str]:
    """Returns the names in shared memory that contain the word."""
    # Folders of other systems may vanish meanwhile; `walk` skips them.
    found = (os.path.join(folder, name) for folder, folders, files in os.walk("/dev/shm") for name in (*folders, *files))
    return sorted(path for path in found if word in path)


class Afar:
    """System with timers of 2 ms: `here` on `rtp0`, a thread; `there` on `rtp1`, a process of its own or a named one."""

    def __init__(self, cell: gpac.System, built: dict[str, str], process: bool | str = True) -> None:
        self.cell = cell
        self.built = built
        self.rtp0 = cell.processor("rtp0")
        self.rtp1 = cell.processor("rtp1", process=process)
        self.here = self.rtp0.timer("fast", period="2 ms", priority=80)
        self.there = self.rtp1.timer("fast", period="2 ms", priority=80)
        self._modules: dict[str, gpac.Module] = {}

    def block(self, name: str) -> gpac.Block:
        """Returns a block of `tests/blocks` by name: `count.count`."""
        module, block = name.split(".")
        if module not in self._modules:
            self._modules[module] = self.cell.download(self.built[module], module)
        return self._modules[module][block]

    def counting(self, name: str = "counting", **changes: Any) -> gpac.Verb[..., Any]:
        """Returns a verb that counts into its SVV `y` and ends with `enough` at `limit`."""
        definition: dict[str, Any] = {
            "blocks": {"count": self.block("count.count")},
            "instantiation_parameters": {"y": "count.y"},
            "input_parameters": {"limit": gpac.input("count.enough", default=0)},
            "output_values": {"last": "count.y"},
            "command_lists": {"start": [activate("count", every="2 ms")]},
            "conditions": {"enough": on("count.enough", returns=["last"])},
        }
        return gpac.Verb(name, **{**definition, **changes})

    def failing(self, block: str, **activation: Any) -> gpac.Verb[..., Any]:
        """Returns a verb with a block that fails at invocation 3."""
        return gpac.Verb(
            f"failing_{block.split('.')[1]}",
            blocks={"bad": self.block(block)},
            instantiation_parameters={"y": "bad.y"},
            command_lists={"start": [activate("bad", every="2 ms", **activation)]},
        )

    def process(self) -> int:
        """Returns the process of `rtp1`."""
        (pid,) = children("run_processor")
        return pid

    def end(self, by: signal.Signals = signal.SIGKILL) -> None:
        """Sends a signal to the process of `rtp1`."""
        os.kill(self.process(), by)

    def goes_on(self, counter: gpac.SVV[Any]) -> None:
        """Waits until a counter has advanced."""
        before = counter.value
        until(lambda: counter.value > before, f"'{counter.name}' goes on")

    def log(self, kind: str) -> list[dict[str, Any]]:
        """Returns the log entries of one kind."""
        return [entry for entry in self.cell.log() if entry["kind"] == kind]


class Guarded:
    """Device, on `rtp1` by default, whose plant has a process of its own and so outlives the processor."""

    def __init__(self, afar: Afar, rtp: gpac.Processor | None = None, source: gpac.Source | None = None, number: int = 0) -> None:
        self.name = f"plant-{os.getpid()}-{number}"
        self.source = source or afar.there
        self.device = (rtp or afar.rtp1).physical_device(
            f"drives{number}", gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=self.name), exchange=self.source
        )

    def state(self) -> dict[str, Any]:
        """Returns the state of the plant."""
        text = _native.plant_state(self.name)
        assert text is not None, "there is a plant"
        return json.loads(text)


pushing = gpac.Verb(
    "pushing",
    blocks={"write": library.write_channel},
    instantiation_parameters={"effort": "write.channel"},
    input_parameters={"u": "write.u"},
    modes={"write.u": "asynchronous"},
    command_lists={"start": [activate("write", every="2 ms")]},
)
"""Writes `u` into a channel until it is ended."""

looking = gpac.Verb(
    "looking",
    blocks={"read": library.read_channel},
    instantiation_parameters={"channel": "read.channel", "q": "read.y"},
    command_lists={"start": [activate("read", every="2 ms")]},
)
"""Keeps the value of a channel in `q`."""
