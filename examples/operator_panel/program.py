# SPDX-License-Identifier: Apache-2.0
"""A joint with an operator's panel: run `opengpac studio examples/operator_panel/program.py`, then append `#/panel/joint` to the
address.

The panel is the file `joint.workspace.json` beside this program. Its buttons start only the verb instances that they name, the three
that are created here. With `--clock virtual` time stands still until somebody advances it from the page.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import opengpac as gpac
from opengpac import activate, motion, on
from opengpac import library as lib
from opengpac.robots import Joint

PANEL = Path(__file__).parent / "joint.workspace.json"

sway = gpac.Verb(
    "sway",
    doc="Lets a joint sway about its place; the command list says on which side it is.",
    blocks={"wave": lib.signal_generator(shape=1), "side": lib.comparator},
    objects={"joint": Joint},
    instantiation_parameters={"joint.commanded": ["wave.y", "side.u"]},
    input_parameters={"amplitude": "wave.amplitude", "frequency": "wave.frequency"},
    modes={"side.u": "asynchronous"},
    command_lists={
        "near": [activate("wave", every="20 ms"), activate("side", every="20 ms")],
        "far": [activate("wave", every="20 ms"), activate("side", every="20 ms")],
    },
    initial="near",
    conditions={"rose": on("side.rose", during="near"), "fell": on("side.fell", during="far")},
    transitions={("near", "rose"): "far", ("far", "fell"): "near"},
)


def make(clock: str) -> gpac.System:
    """Returns the system: a joint on a simulated drive, the verb instances for its panel, an alarm of its own, and the panel."""
    cell = gpac.System("bench", clock=clock)
    rtp = cell.processor("rtp0")
    fast = rtp.timer("fast", period="1 ms", priority=80)
    slow = rtp.timer("slow", period="20 ms", priority=60)
    drives = rtp.physical_device("drives", gpac.drivers.loopback("elbow"), exchange=fast)
    elbow = Joint("elbow", drive=drives["elbow"], on=fast, kp=50.0, kd=0.0).enable()
    motion.move_absolute.on(slow).named("home").new_instance(elbow)
    motion.move_absolute.on(slow).named("reach out").new_instance(elbow)
    sway.on(slow).named("sway").new_instance(elbow)
    cell.alarms.define("E101", "the grease of the elbow is low", remedy="fill it up", severity="low")
    cell.workspaces.ship(PANEL)
    return cell


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clock", choices=["monotonic", "virtual"], default="monotonic")
    make(parser.parse_args().clock)
