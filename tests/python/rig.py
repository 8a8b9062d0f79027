# SPDX-License-Identifier: Apache-2.0
"""A small system for tests."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import opengpac as gpac
from afar import until
from opengpac import activate, on


class Rig:
    """System with one processor: `fast` (1 ms, priority 80), `slow` (10 ms, priority 60), a trigger, and C blocks by name."""

    def __init__(self, cell: gpac.System, built: dict[str, str]) -> None:
        self.cell = cell
        self.built = built
        self.rtp = cell.processor("rtp0")
        self.fast = self.rtp.timer("fast", period="1 ms", priority=80)
        self.slow = self.rtp.timer("slow", period="10 ms", priority=60)
        self._modules: dict[str, gpac.Module] = {}

    def block(self, name: str) -> gpac.Block:
        """Returns a block of `tests/blocks` by name: `count.count`."""
        module, block = name.split(".")
        if module not in self._modules:
            self._modules[module] = self.cell.download(self.built[module], module)
        return self._modules[module][block]

    def svvs(self, *names: str, **options: Any) -> list[gpac.SVV[Any]]:
        """Returns SVVs of type double."""
        return [self.cell.svv(name, **options) for name in names]

    def counting(self, name: str = "counting", every: str = "1 ms", **changes: Any) -> gpac.Verb[..., Any]:
        """Returns a verb that counts into its SVV `y` and ends with `enough` at `limit`."""
        definition: dict[str, Any] = {
            "blocks": {"count": self.block("count.count")},
            "instantiation_parameters": {"y": "count.y"},
            "input_parameters": {"limit": gpac.input("count.enough", default=0)},
            "output_values": {"last": "count.y"},
            "command_lists": {"start": [activate("count", every=every)]},
            "conditions": {"enough": on("count.enough", returns=["last"])},
        }
        return gpac.Verb(name, **{**definition, **changes})

    def until(self, holds: Callable[[], Any], what: str) -> Any:
        """Waits until `holds` returns a true value, and returns it; the virtual clock is advanced meanwhile, real time passes by itself."""
        if not getattr(self.cell, "is_virtual", True):
            return until(holds, what)
        for _ in range(10_000):
            if found := holds():
                return found
            self.cell.advance("1 ms")
        raise AssertionError(f"not within 10 s of the virtual clock: {what}")

    def sampling(self, name: str = "sampling", every: str = "1 ms") -> gpac.Verb[..., Any]:
        """Returns a verb that copies the newest value of `u` to `y`."""
        return gpac.Verb(
            name,
            blocks={"s": self.block("copy.sample")},
            instantiation_parameters={"u": "s.u", "y": "s.y"},
            command_lists={"start": [activate("s", every=every)]},
        )

    def copying(self, name: str = "copying") -> gpac.Verb[..., Any]:
        """Returns a verb that copies each value of `u` to `y`, and counts them in `n`."""
        return gpac.Verb(
            name,
            blocks={"copy": self.block("copy.copy")},
            instantiation_parameters={"u": "copy.u", "y": "copy.y", "n": "copy.n"},
            command_lists={"start": [activate("copy")]},
        )
