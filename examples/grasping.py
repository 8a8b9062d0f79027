# SPDX-License-Identifier: Apache-2.0
"""Simple verbs of which a centering grasp is composed, each useful alone: shift, approach, center, squeeze, release.

They are made of the blocks in `blocks/grasp.c`, `blocks/glide.c` and `blocks/tool_line.c`. None refers to a processor, an arm's name
or another verb.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import opengpac as gpac
from opengpac import activate, on
from opengpac.robots import Finger, Joint
from programs import BLOCKS

EVERY = "1 ms"
"""Interval at which the fingers move and sense, and the arm yields."""


class NothingGrasped(gpac.Terminated):
    """Raised if the fingers met with nothing between them."""


@dataclass(frozen=True)
class Blocks:
    """Blocks downloaded into a system."""

    grasp: gpac.Module
    glide: gpac.Module
    line: gpac.Module


def download(cell: gpac.System) -> Blocks:
    """Downloads the blocks into a system."""
    return Blocks(*(cell.download(BLOCKS / file) for file in ("grasp.c", "glide.c", "tool_line.c")))


def shift(blocks: Blocks) -> gpac.Verb[..., Any]:
    """shift(arm, distance, direction, speed): moves the tool along a line with constant orientation. m; in the tool's frame; m/s."""
    return gpac.Verb(
        "shift",
        doc="Moves the tool along a line in its own frame, its orientation held.",
        blocks={"glide": blocks.glide.glide, "line": blocks.line.tool_line},
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={"arm.commanded": ["line.start", "line.setpoint"]},
        cells={"along": ["glide.along", "line.along"]},
        input_parameters={
            "distance": "glide.distance",
            "direction": gpac.input("line.direction", default=(1.0, 0.0, 0.0)),
            "speed": gpac.input("glide.speed", default=0.05),
        },
        command_lists={"start": [activate("glide", every=EVERY), activate("line")]},
        conditions={"there": on("glide.there", returns=[])},
    )


def _hand(fingers: str, touch: str) -> dict[str, Any]:
    """Returns the bindings of the fingers' SVVs to the blocks that move the fingers and sense with them."""
    return {
        "hand.commanded": [f"{fingers}.start", f"{fingers}.setpoint"],
        "hand.force_max": f"{fingers}.force_max",
        "hand.force": [f"{touch}.force"],
        "hand.sensed": f"{touch}.position",
    }


def approach(blocks: Blocks) -> gpac.Verb[..., Any]:
    """approach(hand, closing): closes the fingers until one touches; `contact` returns the difference of the forces. m/s."""
    return gpac.Verb(
        "approach",
        doc="Closes the fingers, with little force, until one touches.",
        blocks={"fingers": blocks.grasp.fingers, "touch": blocks.grasp.touch},
        objects={"hand": gpac.each(Finger)},
        instantiation_parameters=_hand("fingers", "touch"),
        input_parameters={"closing": gpac.input("fingers.speed", default=-0.02)},
        output_values={"difference": "touch.difference", "width": "touch.width"},
        command_lists={"start": [activate("fingers", every=EVERY), activate("touch", every=EVERY)]},
        conditions={
            "contact": on("touch.one", returns=["difference"]),
            "empty": on("fingers.at_limit", raises=NothingGrasped),
        },
    )


def center(blocks: Blocks) -> gpac.Verb[..., Any]:
    """center(hand, arm, closing, gain): keeps closing while the arm yields to the finger with the larger force. m/s; m/s per N."""
    chi = _hand("fingers", "touch")
    chi["hand.force"] += ["yielding.force"]
    return gpac.Verb(
        "center",
        doc="Goes on closing while the arm yields to the finger that feels more, until both feel the same.",
        blocks={
            "fingers": blocks.grasp.fingers,
            "touch": blocks.grasp.touch,
            "yielding": blocks.grasp.yielding,
            "line": blocks.line.tool_line,
        },
        objects={"hand": gpac.each(Finger), "arm": gpac.each(Joint)},
        instantiation_parameters={**chi, "arm.commanded": ["line.start", "line.setpoint"]},
        cells={"along": ["yielding.along", "line.along"]},
        input_parameters={"closing": gpac.input("fingers.speed", default=-0.02), "gain": gpac.input("yielding.gain", default=0.1)},
        output_values={"width": "touch.width", "yielded": "yielding.along"},
        command_lists={
            "start": [
                activate("fingers", every=EVERY),
                activate("touch", every=EVERY),
                activate("yielding", every=EVERY),
                activate("line"),
            ]
        },
        conditions={
            "centred": on("touch.both", returns=["width", "yielded"]),
            "empty": on("fingers.at_limit", raises=NothingGrasped),
        },
    )


def squeeze(blocks: Blocks) -> gpac.Verb[..., Any]:
    """squeeze(hand, grip, firm): closes with the force `grip` until both fingers sense `firm`; returns the width. N."""
    return gpac.Verb(
        "squeeze",
        doc="Closes with force until both fingers are firm; returns the distance between them.",
        blocks={
            "fingers": blocks.grasp.fingers(speed=-0.1, least=-0.2),
            "touch": blocks.grasp.touch(balance=1.0),
        },
        objects={"hand": gpac.each(Finger)},
        instantiation_parameters=_hand("fingers", "touch"),
        input_parameters={"grip": gpac.input("fingers.force", default=10.0), "firm": gpac.input("touch.both", default=9.0)},
        output_values={"width": "touch.width"},
        command_lists={"start": [activate("fingers", every=EVERY), activate("touch", every=EVERY)]},
        conditions={
            "gripped": on("touch.both", returns=["width"]),
            "empty": on("fingers.at_limit", raises=NothingGrasped),
        },
    )


def release(blocks: Blocks) -> gpac.Verb[..., Any]:
    """release(hand, opening): opens the fingers. m/s."""
    return gpac.Verb(
        "release",
        doc="Opens the fingers.",
        blocks={"fingers": blocks.grasp.fingers(most=0.048)},
        objects={"hand": gpac.each(Finger)},
        instantiation_parameters={"hand.commanded": ["fingers.start", "fingers.setpoint"], "hand.force_max": "fingers.force_max"},
        input_parameters={"opening": gpac.input("fingers.speed", default=0.1)},
        command_lists={"start": [activate("fingers", every=EVERY)]},
        conditions={"open": on("fingers.at_limit", returns=[])},
    )
