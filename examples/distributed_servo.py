# SPDX-License-Identifier: Apache-2.0
"""A servo whose encoder and drive are wired to different real-time processors: the same graph and verb, placed differently.

The drive moves an axis; an encoder measures it. The first servo has both wired to one processor, the second to two: only the hardware
section and the placement differ. The exit code is 0 only if both servos reach their goal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import opengpac as gpac
import programs
from opengpac import activate, on
from opengpac import library as lib
from programs import Account, Trace

GOAL = 0.5
"""Goal of the axis, rad."""

ENCODER = [
    {"name": "shaft", "direction": "write", "type": "double", "unit": "rad"},
    {"name": "position", "direction": "read", "type": "double", "unit": "rad", "loop_of": "shaft"},
]
"""Encoder on the shaft of the axis."""


def servo() -> gpac.Graph:
    """Returns the graph of encoder, controller and drive, independent of processors."""
    return gpac.Graph(
        "servo",
        doc="Brings an axis to its set-point.",
        blocks={
            "encoder": lib.block("read_channel"),
            "pid": lib.block("pid")(kp=20.0, limit=2.0),
            "drive": lib.block("write_channel"),
        },
        inputs={"setpoint": "pid.setpoint"},
        outputs={"angle": ["encoder.y", "pid.measured"]},
        cells={"speed": ["pid.effort", "drive.u"]},
        modes={"pid.setpoint": "asynchronous", "drive.u": "asynchronous"},
    )


def go() -> gpac.Verb[..., Any]:
    """go(encoder, drive, setpoint, angle): closes the loop for one second and returns the position of the axis."""
    return gpac.Verb(
        "go",
        doc="Closes the loop for a second.",
        blocks={"goal": lib.block("signal_generator")(shape=0, offset=GOAL), "servo": servo(), "clock": lib.block("time_limit")(limit=1.0)},
        instantiation_parameters={
            "encoder": "servo.encoder.channel",
            "drive": "servo.drive.channel",
            "setpoint": ["goal.y", "servo.setpoint"],
            "angle": "servo.angle",
        },
        output_values={"reached": "servo.encoder.y"},
        command_lists={"start": [activate(label, every="1 ms") for label in ("goal", "servo", "clock")]},
        conditions={"over": on("clock.expired", returns=["reached"])},
    )


def turning() -> gpac.Verb[..., Any]:
    """turning(axis, shaft): simulates the world, not the controller: the encoder's shaft turns with the axis."""
    return gpac.Verb(
        "turning",
        blocks={"axis": lib.block("read_channel"), "shaft": lib.block("write_channel")},
        instantiation_parameters={"axis": "axis.channel", "shaft": "shaft.channel"},
        cells={"angle": ["axis.y", "shaft.u"]},
        modes={"shaft.u": "asynchronous"},
        command_lists={"start": [activate("axis", every="1 ms"), activate("shaft", every="1 ms")]},
    )


@dataclass(frozen=True)
class Wiring:
    """Hardware of one of the two servos, and the sources that serve its encoder (`here`) and its drive (`there`)."""

    encoder: gpac.PhysicalDevice
    drive: gpac.PhysicalDevice
    here: gpac.Source
    there: gpac.Source


def wire(cell: gpac.System, name: str, sensing: gpac.Processor, acting: gpac.Processor) -> Wiring:
    """Wires an encoder to one processor, and a drive to the same or another one."""
    sources = {
        processor.name: cell.sources.get(f"{processor.name}.fast") or processor.timer("fast", period="1 ms", priority=80)
        for processor in (sensing, acting)
    }
    here, there = sources[sensing.name], sources[acting.name]
    encoder = sensing.physical_device(f"{name}_encoder", gpac.drivers.scripted(ENCODER), exchange=here)
    drive = acting.physical_device(f"{name}_drive", gpac.drivers.loopback("axis"), exchange=there)
    return Wiring(encoder, drive, here, there)


def perform(cell: gpac.System, name: str, wiring: Wiring, account: Account) -> Trace:
    """Closes one loop; reports where its blocks ran and where the axis went."""
    setpoint, angle = (cell.svv(f"{name}.{what}", unit="rad", history=3000) for what in ("setpoint", "angle"))
    verb = go().on({"servo.drive": wiring.there, "*": wiring.here})
    world = turning().on({"axis": wiring.there, "*": wiring.here})
    with world.asynch(wiring.drive["axis.position"], wiring.encoder["shaft"]):
        instance = verb.new_instance(wiring.encoder["position"], wiring.drive["axis.effort"], setpoint, angle)
        with instance:
            print(*(f"     {line.strip()}" for line in repr(instance).splitlines() if "servo." in line), sep="\n")
            report = instance.start().wait()
    account.end(name, report, "over", f", the axis is at {report.reached:.6f} rad")
    trace = Trace(setpoint, angle)
    trace.collect()
    angles = trace.of(angle)[1]
    account.expect(f"{name} arrives", abs(report.reached - GOAL) < 1e-4, f"{abs(report.reached - GOAL) * 1e6:.1f} urad from the goal")
    account.expect(f"{name} does not overshoot", float(angles.max()) < GOAL + 1e-3, f"at most {float(angles.max()):.4f} rad")
    return trace


def main() -> int:
    """Runs the program; returns 0 if both servos reach their goal."""
    options = programs.parser(__doc__).parse_args()
    account = Account()
    with programs.system("distributed_servo", options) as cell:
        one, two = cell.processor("rtp0"), cell.processor("rtp1")
        account.begin("encoder and drive on one processor")
        together = perform(cell, "together", wire(cell, "together", one, one), account)
        account.begin("the encoder on one processor, the drive on another")
        apart = perform(cell, "apart", wire(cell, "apart", one, two), account)
        if options.trace is not None:
            options.trace.write_text(together.table(every=0.02) + apart.table(every=0.02))
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
