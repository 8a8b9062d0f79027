# SPDX-License-Identifier: Apache-2.0
"""Centering grasp: a UR5e with two fingers grasps a block that is not where it was taught, without pushing it away.

The fingers close; the arm gives way to the finger that touches first, until the other touches too; then they squeeze, and the verb
says how wide the block is. The arm lifts it, puts it down and lets it go. The exit code is 0 only if the block was hardly moved.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import grasping
import opengpac as gpac
import programs
from grasping import EVERY
from opengpac import activate
from opengpac import library as lib
from programs import SCENES, Account, Trace

PUSHED_MAX = 0.002
"""How far the block may be moved by being grasped, m."""


def centering_grasp(blocks: grasping.Blocks) -> gpac.ComposedVerb:
    """centering_grasp(hand, arm, closing, gain, grip, firm): approach, center, squeeze, with no Python between them."""
    return gpac.compose(
        "centering_grasp",
        {"approach": grasping.approach(blocks), "center": grasping.center(blocks), "squeeze": grasping.squeeze(blocks)},
        transitions={("approach", "contact"): "center", ("center", "centred"): "squeeze"},
        doc="Grasps what is between the fingers without pushing it away; returns its width.",
    )


class Workcell:
    """The arm, its hand, the block on the bench, and the verbs."""

    def __init__(self, cell: gpac.System) -> None:
        rtp = cell.processor("rtp0")
        self.cell = cell
        self.fast = rtp.timer("fast", period="1 ms", priority=80)
        self.arm = gpac.robots.load("ur5e", rtp, on=self.fast, tool="two_finger", scene=SCENES / "bench.xml")
        self.machine = cell.physical_devices["ur5e"]
        self.hand = gpac.robots.gripper(self.machine)
        self.place: gpac.SVV[Any] = cell.svv("object", "double[3]", unit="m", history=20_000)
        self.blocks = grasping.download(cell)
        cell.place({"*": self.fast})
        self.trace = Trace(self.place, *(svv for finger in self.hand for svv in (finger.sensed, finger.force)))

    def watch(self) -> gpac.VerbInstance[Any]:
        """Keeps the SVV `place`: where the block really is, which no verb of the grasp knows."""
        watching = gpac.Verb(
            "watch",
            blocks={"camera": lib.block("read_vector")},
            instantiation_parameters={"channel": "camera.channel", "place": "camera.y"},
            command_lists={"start": [activate("camera", every=EVERY)]},
        )
        return watching.asynch(self.machine["sensor.object"], self.place)


def perform(work: Workcell, offset: float, account: Account) -> None:
    """Grasps the block with the arm `offset` metres beside it, lifts it, and puts it back."""
    shift, release = grasping.shift(work.blocks), grasping.release(work.blocks)
    grasp = centering_grasp(work.blocks)
    if offset:
        account.begin(f"shift: the arm is {offset * 1e3:.0f} mm beside the block")
        account.end("shift", shift(work.arm, distance=offset), "there")

    account.begin("centering grasp")
    before = np.array(work.place.value)
    report = grasp(work.hand, work.arm, time_limit="20 s")
    account.end("centering grasp", report, "gripped", f", {report.width * 1e3:.2f} mm wide")
    left, right = work.hand.values("sensed")
    account.expect("the block is in the middle of the hand", abs(left - right) < 0.001, f"{abs(left - right) * 1e3:.2f} mm beside it")
    pushed = float(np.hypot(*(np.array(work.place.value) - before)[:2]))
    account.expect("the block is not pushed away", pushed < PUSHED_MAX, f"it moved {pushed * 1e3:.3f} mm")

    account.begin("lift")
    account.end("lift", shift(work.arm, distance=0.05, direction=(0.0, 0.0, -1.0)), "there")
    risen = float(work.place.value[2] - before[2])
    account.expect("the block is in the hand", risen > 0.045, f"it rose {risen * 1e3:.1f} mm")

    account.begin("put down, and let go")
    account.end("put down", shift(work.arm, distance=0.05, direction=(0.0, 0.0, 1.0)), "there")
    account.end("release", release(work.hand), "open")


def main() -> int:
    """Runs the program; 0 where every verb ended as it should, and the block was not pushed away."""
    parser = programs.parser(__doc__)
    parser.add_argument("--offset", type=float, default=15.0, help="how far the arm is beside the block, mm, -20 to 20 (default 15)")
    options = parser.parse_args()
    with programs.system("centering_grasp", options) as cell:
        work = Workcell(cell)
        account = Account(work.trace)
        with work.arm.enabled(), work.hand.enabled(), work.watch():
            perform(work, options.offset * 1e-3, account)
        work.trace.save(options.trace, every=0.05)
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
