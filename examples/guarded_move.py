# SPDX-License-Identifier: Apache-2.0
"""A guarded move: the tool of a UR5e moves down until it meets something, and slows to a stop.

The distance to the mat is unknown. The move is one verb with two command lists: `go` moves and watches the force; when the force
exceeds its limit, the transition to `stop` decelerates from the present speed, within the same millisecond. The exit code is 0 only
if the tool stopped gently at the mat.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import opengpac as gpac
import programs
from opengpac import activate, on
from opengpac import library as lib
from opengpac.robots import Joint
from programs import BLOCKS, SCENES, Account, Trace

EVERY = "1 ms"


@dataclass(frozen=True)
class Blocks:
    """Blocks downloaded into a system."""

    glide: gpac.Module
    line: gpac.Module


def guarded_move(blocks: Blocks) -> gpac.Verb[..., Any]:
    """guarded_move(arm, force, magnitude, distance, direction, speed, force_max, deceleration): moves until contact. m; m/s; N; m/s^2."""
    return gpac.Verb(
        "guarded_move",
        doc="Moves the tool along a line until it meets a force, and slows to a stop.",
        blocks={
            "sensor": lib.block("read_vector"),
            "guard": lib.block("force_guard"),
            "glide": blocks.glide.glide,
            "brake": blocks.glide.brake,
            "line": blocks.line.tool_line,
        },
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={
            "arm.commanded": ["line.start", "line.setpoint"],
            "force": "sensor.channel",
            "magnitude": "guard.magnitude",
        },
        cells={
            "along": ["glide.along", "brake.was_along", "brake.along", "line.along"],
            "sensed_force": ["sensor.y", "guard.force"],
            "rate": ["glide.rate", "brake.was_rate"],
        },
        input_parameters={
            "distance": "glide.distance",
            "direction": gpac.input("line.direction", default=(0.0, 0.0, 1.0)),
            "speed": gpac.input("glide.speed", default=0.03),
            "force_max": gpac.input("guard.above", default=5.0),
            "deceleration": gpac.input("brake.deceleration", default=0.5),
        },
        output_values={"met": "brake.began", "stopped_at": "brake.along", "force_met": "guard.above"},
        modes={"line.along": "asynchronous"},
        command_lists={
            "go": [activate(label, every=EVERY) for label in ("sensor", "guard", "glide", "line")],
            "stop": [activate(label, every=EVERY) for label in ("sensor", "guard", "brake", "line")],
        },
        initial="go",
        conditions={
            "contact": on("guard.above", during="go", priority=1),
            "stopped": on("brake.stopped", returns=["met", "stopped_at", "force_met"], during="stop"),
            "arrived": on("glide.there", returns=[], during="go"),
        },
        transitions={("go", "contact"): "stop"},
    )


def perform(cell: gpac.System, arm: gpac.Group[Joint], blocks: Blocks, account: Account) -> Trace:
    """Moves down to the mat twice; the second time it presses harder."""
    force = cell.physical_devices["ur5e"]["tool.force"]
    magnitude = cell.svv("magnitude", unit="N", history=20_000)
    trace = Trace(magnitude, *(svv for joint in arm for svv in (joint.commanded, joint.sensed)))
    verb = guarded_move(blocks)
    for limit in (5.0, 20.0):
        account.begin(f"down, until the tool meets {limit:.0f} N")
        report = verb(arm, force, magnitude, distance=0.1, force_max=limit, time_limit="10 s")
        trace.collect()
        after = (report.stopped_at - report.met) * 1e3
        account.end("guarded move", report, "stopped", f", met at {report.met * 1e3:.2f} mm, stopped {after:.2f} mm later")
        pressed = float(magnitude.value)
        account.expect("it stops gently", limit < pressed < limit + 25.0, f"it presses with {pressed:.1f} N")
        account.begin("up again")
        report = verb(arm, force, magnitude, distance=-report.stopped_at, force_max=1000.0, time_limit="10 s")
        account.end("up", report, "arrived")
        account.expect("the tool is free", float(magnitude.value) < 1.0, f"{float(magnitude.value):.2f} N")
    return trace


def main() -> int:
    """Runs the program; returns 0 if the tool stopped gently at the mat."""
    parser = programs.parser(__doc__)
    programs.add_driver(parser)
    options = parser.parse_args()
    account = Account()
    with programs.controller(options, scene=SCENES / "mat.xml") as robot, programs.system("guarded_move", options) as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        arm = gpac.robots.load("ur5e", on=fast, scene=SCENES / "mat.xml", driver=programs.commanding(robot))
        blocks = Blocks(cell.download(BLOCKS / "glide.c"), cell.download(BLOCKS / "tool_line.c"))
        cell.place({"*": fast})
        with arm.enabled():
            perform(cell, arm, blocks, account).save(options.trace, every=0.05)
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
