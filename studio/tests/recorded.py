# SPDX-License-Identifier: Apache-2.0
"""Makes the recordings of the page's tests in the folder of the argument, and says what `gpac.open_recording` reads in `run.mcap`.

In `later.mcap` the same happens 0.7 s later. An arm of which one joint sways for 12 s of virtual time, with an alarm in between.
"""

import json
import sys
from pathlib import Path

import numpy as np

import opengpac as gpac
from opengpac import activate, on
from opengpac import library as lib
from opengpac.robots import Joint

SWAY = gpac.Verb(
    "sway",
    doc="Lets a joint sway about its place; the command list says on which side it is.",
    blocks={"wave": lib.signal_generator, "side": lib.comparator},
    objects={"joint": Joint},
    instantiation_parameters={"joint.commanded": ["wave.y", "side.u"]},
    input_parameters={"place": ["wave.offset", "side.reference"], "amplitude": "wave.amplitude", "frequency": "wave.frequency"},
    modes={"side.u": "asynchronous"},
    command_lists={
        "near": [activate("wave", every="20 ms"), activate("side", every="20 ms")],
        "far": [activate("wave", every="20 ms"), activate("side", every="20 ms")],
    },
    initial="near",
    conditions={"rose": on("side.rose", during="near"), "fell": on("side.fell", during="far")},
    transitions={("near", "rose"): "far", ("far", "fell"): "near"},
)
SENSED = "ur5e.shoulder_pan.sensed"


def record(path: Path, waits: str) -> None:
    """Records one run; the verb starts after `waits` of virtual time."""
    with gpac.System("bench", clock="virtual") as cell:
        rtp = cell.processor("rtp0")
        fast, slow = rtp.timer("fast", period="1 ms", priority=80), rtp.timer("slow", period="20 ms", priority=60)
        arm = gpac.robots.load("ur5e", rtp, on=fast).enable()
        cell.alarms.define("hot", "the drive is too warm", severity="medium")
        with cell.record(path, cells=True):
            cell.advance(waits)
            joint = arm["shoulder_pan"]
            sway = SWAY.on(slow).asynch(joint, place=joint.sensed.value, amplitude=0.4, frequency=0.25)
            for _ in range(6):
                cell.advance("1 s")
            cell.alarms.trip("hot", source="ur5e")
            for _ in range(6):
                cell.advance("1 s")
            sway.halt()
            cell.advance("0.5 s")


path = Path(sys.argv[1]) / "run.mcap"
record(path, "0 s")
record(path.with_name("later.mcap"), "0.7 s")
recorded = gpac.open_recording(path)
taken = recorded[SENSED]
moments = [float(taken["time"][0]) + offset for offset in (1.2345, 4.0, 7.77, 11.0)]
said = {
    "name": SENSED,
    "count": len(taken),
    "min": float(taken["value"].min()),
    "max": float(taken["value"].max()),
    "conditions": [entry for entry in recorded.log if entry["kind"] == "condition"],
    "at": [[moment, float(taken["value"][np.searchsorted(taken["time"], moment, side="right") - 1])] for moment in moments],
}
print("said:", json.dumps(said))
