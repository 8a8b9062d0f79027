# SPDX-License-Identifier: Apache-2.0
"""A small system for tests, on each interconnect, under the virtual clock; and the C blocks of `tests/blocks`, built once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import opengpac as gpac
from opengpac import _native, activate, on

BLOCKS = Path(__file__).parent.parent / "blocks"

INTERCONNECTS: dict[str, Any] = {
    "memory": {"kind": "memory"},
    "message": {
        "kind": "message",
        "seed": 7,
        "delay_ns": [0, 100_000],
        "drop": 0.02,
        "repeat": 0.02,
        "reorder": 0.02,
        "corrupt": 0.01,
    },
}


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The paths of the compiled C blocks, by file name."""
    folder = tmp_path_factory.mktemp("blocks")
    return {f.stem: _native.build([str(f)], str(folder / f"{f.stem}.so")) for f in sorted(BLOCKS.glob("*.c"))}


class Rig:
    """A system with one processor: `fast` (1 ms, priority 80), `slow` (10 ms, priority 60), a trigger, and C blocks by name."""

    def __init__(self, cell: gpac.System, built: dict[str, str]) -> None:
        self.cell = cell
        self.built = built
        self.rtp = cell.processor("rtp0")
        self.fast = self.rtp.timer("fast", period="1 ms", priority=80)
        self.slow = self.rtp.timer("slow", period="10 ms", priority=60)
        self._modules: dict[str, gpac.Module] = {}

    def block(self, name: str) -> gpac.Block:
        """A block of `tests/blocks` by its name: `count.count`."""
        module, block = name.split(".")
        if module not in self._modules:
            self._modules[module] = self.cell.download(self.built[module], module)
        return self._modules[module][block]

    def svvs(self, *names: str, **options: Any) -> list[gpac.SVV[Any]]:
        """SVVs of type double."""
        return [self.cell.svv(name, **options) for name in names]

    def counting(self, name: str = "counting", every: str = "1 ms", **changes: Any) -> gpac.Verb[..., Any]:
        """A verb that counts into its SVV `y` and ends with `enough` when it comes to `limit`."""
        definition: dict[str, Any] = {
            "blocks": {"count": self.block("count.count")},
            "instantiation_parameters": {"y": "count.y"},
            "input_parameters": {"limit": "count.enough"},
            "output_values": {"last": "count.y"},
            "command_lists": {"start": [activate("count", every=every)]},
            "conditions": {"enough": on("count.enough", returns=["last"])},
        }
        return gpac.Verb(name, **{**definition, **changes})


@pytest.fixture(params=list(INTERCONNECTS))
def cell(request: pytest.FixtureRequest) -> Iterator[gpac.System]:
    """A system under the virtual clock, on each interconnect."""
    with gpac.System("cell", clock="virtual", seed=1, interconnect=INTERCONNECTS[request.param]) as made:
        yield made


@pytest.fixture
def rig(cell: gpac.System, built: dict[str, str]) -> Rig:
    """A small system, on each interconnect."""
    return Rig(cell, built)


@pytest.fixture
def memory_rig(built: dict[str, str]) -> Iterator[Rig]:
    """A small system on the memory interconnect only, where a test is not about connections."""
    with gpac.System("cell", clock="virtual", seed=1) as made:
        yield Rig(made, built)
