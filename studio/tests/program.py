# SPDX-License-Identifier: Apache-2.0
"""The system of the page's tests: an arm of which two joints sway, and verbs that the page can start. `opengpac studio` serves it.

Its time is virtual and follows the clock on the wall, so that a machine that stands still for a while stops no servo; with the
argument `real` it is the real one, for pictures.
"""

import sys
import time

import opengpac as gpac
from opengpac import activate, motion, on
from opengpac import library as lib
from opengpac.robots import Joint

SWAY = gpac.Verb(
    "sway",
    doc="Lets a joint sway about its place; the command list says on which side it is.",
    blocks={"wave": lib.signal_generator, "side": lib.comparator},
    objects={"joint": Joint},
    instantiation_parameters={"joint.commanded": ["wave.y", "side.u"]},
    input_parameters={
        "place": gpac.input(["wave.offset", "side.reference"], unit="rad"),
        "amplitude": gpac.input("wave.amplitude", default=0.4, unit="rad", within=(0.0, 1.0), tunable=True),
        "frequency": gpac.input("wave.frequency", default=0.25, unit="Hz", within=(0.0, 1.0)),
    },
    modes={"side.u": "asynchronous"},
    command_lists={
        "near": [activate("wave", every="20 ms"), activate("side", every="20 ms")],
        "far": [activate("wave", every="20 ms"), activate("side", every="20 ms")],
    },
    initial="near",
    conditions={"rose": on("side.rose", during="near"), "fell": on("side.fell", during="far")},
    transitions={("near", "rose"): "far", ("far", "fell"): "near"},
)

REAL = "real" in sys.argv[1:]
STEP_S = 0.02

cell = gpac.System("bench", clock="monotonic" if REAL else "virtual")
rtp = cell.processor("rtp0")
fast = rtp.timer("fast", period="1 ms", priority=80)
slow = rtp.timer("slow", period="20 ms", priority=60)
arm = gpac.robots.load("ur5e", rtp, on=fast)
arm.enable()
drives = rtp.physical_device("drives", gpac.drivers.loopback("x"), exchange=slow)

# What the page starts: verbs enter the system with their first instance.
move = motion.move_absolute.on(slow).new_instance(arm)
button = cell.svv("studio.heartbeat", int)
jog = motion.jog.on(slow).new_instance(arm["wrist_2"], button)

for joint in (arm["shoulder_pan"], arm["wrist_1"]):
    SWAY.on(slow).asynch(joint, place=joint.sensed.value)

while not REAL:
    cell.advance(STEP_S)
    time.sleep(STEP_S)
