# SPDX-License-Identifier: Apache-2.0
"""Compliant motion: the tool of a UR5e yields to a push like a spring, and returns.

The arm is position-controlled and stiff. The verb `comply` turns the force measured at the wrist into a deviation along a line, as a
mass on a spring with a damper would move: an admittance. The arm is pushed at several stiffnesses and must yield by force over
stiffness; at zero stiffness it stays where it was pushed. The exit code is 0 only if it does so.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import opengpac as gpac
import programs
from opengpac import activate, deactivate, on, wait
from opengpac import library as lib
from opengpac.robots import Joint
from programs import BLOCKS, Account, Trace

EVERY = "1 ms"
FORCE = 30.0
"""Force with which the tool is pushed, N."""


def comply(admittance: gpac.Module, line: gpac.Module) -> gpac.Verb[..., Any]:
    """comply(arm, force, yielded, stiffness, damping, mass, seconds): yields along the x axis of the tool. N/m; N.s/m; kg; s."""
    return gpac.Verb(
        "comply",
        doc="Gives way to a force at the tool as a mass on a spring does.",
        blocks={
            "sensor": lib.block("read_vector"),
            "admittance": admittance.admittance,
            "line": line.tool_line,
            "clock": lib.block("time_limit"),
        },
        objects={"arm": gpac.each(Joint)},
        instantiation_parameters={
            "arm.commanded": ["line.start", "line.setpoint"],
            "force": "sensor.channel",
            "yielded": ["admittance.along", "line.along"],
            "pushed": "admittance.pushed",
        },
        cells={"sensed_force": ["sensor.y", "admittance.force"]},
        input_parameters={
            "stiffness": gpac.input("admittance.stiffness", default=1000.0, tunable=True),
            "damping": gpac.input("admittance.damping", default=200.0, tunable=True),
            "mass": gpac.input("admittance.mass", default=5.0),
            "seconds": gpac.input("clock.limit", default=4.0),
        },
        output_values={"yielded_at_end": "admittance.along"},
        command_lists={
            "start": [
                activate("sensor", every=EVERY),
                activate("admittance", every=EVERY),
                activate("line"),
                activate("clock", every=EVERY),
            ]
        },
        conditions={"over": on("clock.expired", returns=["yielded_at_end"])},
    )


def push() -> gpac.Verb[..., Any]:
    """push(tool, force): pushes the simulated tool, after 0.2 s and for 1.5 s. N, in the world frame."""
    return gpac.Verb(
        "push",
        blocks={"write": lib.block("write_vector")},
        instantiation_parameters={"tool": "write.channel"},
        input_parameters={"force": "write.u"},
        modes={"write.u": "asynchronous"},
        command_lists={"start": [wait("0.2 s"), activate("write", every=EVERY), wait("1.5 s"), deactivate("write")]},
    )


def perform(cell: gpac.System, arm: gpac.Group[Joint], account: Account) -> Trace:
    """Pushes the tool along its own x axis, which is the y axis of the world, at three stiffnesses."""
    machine = cell.physical_devices["ur5e"]
    yielded, pushed = cell.svv("yielded", unit="m", history=20_000), cell.svv("pushed", unit="N", history=20_000)
    trace = Trace(yielded, pushed, arm["shoulder_pan"].sensed)
    verb = comply(cell.download(BLOCKS / "admittance.c"), cell.download(BLOCKS / "tool_line.c"))
    for stiffness in (2000.0, 750.0, 0.0):
        account.begin(f"pushed with {FORCE:.0f} N at a stiffness of {stiffness:.0f} N/m")
        begun = cell.now
        pushing = push().asynch(machine["tool.push"], force=[0.0, FORCE, 0.0])
        report = verb(arm, machine["tool.force"], yielded, pushed, stiffness=stiffness, time_limit="10 s")
        pushing.wait()
        trace.collect()
        account.end("comply", report, "over")
        times, distance = trace.of(yielded)
        at = float(distance[np.searchsorted(times, begun + 1.65)]) * 1e3
        end = report.yielded_at_end * 1e3
        if stiffness:
            wanted = FORCE / stiffness * 1e3
            account.expect("gives way by force over stiffness", abs(at - wanted) < 0.05 * wanted, f"{at:.2f} mm of {wanted:.2f} mm")
            account.expect("comes back", abs(end) < 0.2, f"{end:.3f} mm")
        else:
            account.expect("stays where it was pushed to", end >= at > 50.0, f"{at:.1f} mm, then {end:.1f} mm")
    return trace


def main() -> int:
    """Runs the program; returns 0 if the arm yielded like a spring."""
    options = programs.parser(__doc__).parse_args()
    account = Account()
    with programs.system("compliant_motion", options) as cell:
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        arm = gpac.robots.load("ur5e", on=fast)
        cell.place({"*": fast})
        with arm.enabled():
            perform(cell, arm, account).save(options.trace, every=0.05)
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
