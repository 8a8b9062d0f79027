# SPDX-License-Identifier: Apache-2.0
"""Second level, concurrency: which blocks run together, and what ends them. Written by the machine's engineer.

Each function makes a simple verb of the blocks in `closed_loop.c`.
"""

from __future__ import annotations

from typing import Any

import opengpac as gpac
from opengpac import activate, on


def slide(code: gpac.Module) -> gpac.Verb[..., Any]:
    """Returns the verb that supports the slide as a device and keeps it running."""
    return gpac.Verb(
        "slide",
        blocks={"slide": code.slide},
        instantiation_parameters={"speed": "slide.speed", "position": "slide.position"},
        command_lists={"start": [activate("slide", every="1 ms"), gpac.ready()]},
    )


def advance(code: gpac.Module, device: type[gpac.LogicalDevice], name: str, speed: float) -> gpac.Verb[..., Any]:
    """Returns a verb that acts on the slide: it advances at `speed` until it reaches `to`."""
    return gpac.Verb(
        name,
        doc=f"Advances the slide to a position, at {speed} m/s.",
        blocks={"ramp": code.ramp(limit=speed), "stop": code.stop_at},
        objects={"slide": device},
        instantiation_parameters={"slide.speed": "ramp.speed", "slide.position": "stop.position"},
        input_parameters={"to": gpac.input("stop.there", unit="m")},
        output_values={"reached": "stop.reached"},
        command_lists={"start": [activate("ramp", every="1 ms"), activate("stop", every="1 ms")]},
        conditions={"there": on("stop.there", returns=["reached"])},
    )
