# SPDX-License-Identifier: Apache-2.0
"""A small motion for tests: a joint of a plant that follows its commands exactly, and a verb that moves it for a while."""

from __future__ import annotations

from typing import Any

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from opengpac.robots import Joint


def build(cell: gpac.System) -> Joint:
    """Builds the hardware: `rtp0` with `fast` (1 ms) and `slow` (20 ms), the drive `drives`, and the joint `axis`."""
    rtp = cell.processors.get("rtp0") or cell.processor("rtp0")
    fast = cell.sources.get("rtp0.fast") or rtp.timer("fast", period="1 ms", priority=80)
    if "rtp0.slow" not in cell.sources:
        rtp.timer("slow", period="20 ms", priority=60)
    drives = rtp.physical_device("drives", gpac.drivers.loopback("x"), exchange=fast)
    return Joint("axis", drive=drives["x"], on=fast, kp=50.0, kd=0.0)


def swing(name: str = "swing", **more: Any) -> gpac.Verb[..., Any]:
    """swing(joint, seconds): swings the joint for `seconds`."""
    definition: dict[str, Any] = {
        "blocks": {"wave": lib.signal_generator(shape=1, amplitude=0.2, frequency=1.0), "clock": lib.time_limit},
        "objects": {"joint": Joint},
        "instantiation_parameters": {"joint.commanded": "wave.y"},
        "input_parameters": {"seconds": "clock.limit"},
        "output_values": {"commanded": "wave.y"},
        "command_lists": {"start": [activate("wave", every="20 ms"), activate("clock", every="20 ms")]},
        "conditions": {"over": on("clock.expired", returns=["commanded"])},
    }
    return gpac.Verb(name, **{**definition, **more})
