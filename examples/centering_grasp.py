# SPDX-License-Identifier: Apache-2.0
"""Centering grasp: a UR5e with two fingers grasps a block that is not where it was taught, without pushing it away.

The fingers close. The arm yields to the finger that touches first until the other touches too; then they squeeze, and the verb
returns the width of the block. The arm lifts the block, puts it down and releases it. With `--driver ur` the driver of the arm's
controller commands the arm, and the hand, which has its own controller, is on Modbus; both are emulated. The exit code is 0 only if
the block hardly moved.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

import grasping
import opengpac as gpac
import programs
from grasping import EVERY
from opengpac import activate
from opengpac import library as lib
from programs import SCENES, Account, Trace

TOOL = "two_finger"
"""Gripper at the arm's flange."""

PUSHED_MAX = 0.002
"""Maximum displacement of the block by the grasp, m."""


def centering_grasp(blocks: grasping.Blocks) -> gpac.ComposedVerb:
    """centering_grasp(hand, arm, closing, gain, grip, firm): approaches, centers and squeezes, with no Python in between."""
    return gpac.compose(
        "centering_grasp",
        {"approach": grasping.approach(blocks), "center": grasping.center(blocks), "squeeze": grasping.squeeze(blocks)},
        transitions={("approach", "contact"): "center", ("center", "centred"): "squeeze"},
        doc="Grasps what is between the fingers without pushing it away; returns its width.",
    )


class Workcell:
    """Workcell: the arm, its hand, the block on the bench, and the verbs; `robot` is the controller that moves the arm, if there is one."""

    def __init__(self, cell: gpac.System, robot: gpac.drivers.fake.ur | None = None) -> None:
        rtp = cell.processor("rtp0")
        self.cell = cell
        self.fast = rtp.timer("fast", period="1 ms", priority=80)
        self.arm = gpac.robots.load("ur5e", rtp, on=self.fast, tool=TOOL, scene=SCENES / "bench.xml", driver=programs.commanding(robot))
        self.robot, self.machine = robot, cell.physical_devices["ur5e"]
        hand = self.machine
        if robot is not None:
            hand = rtp.physical_device("hand", robot.gripper.driver(period="1 ms", answer="5 s", age_max="5 s"), exchange=self.fast)
        self.hand = gpac.robots.gripper(hand, name="ur5e.hand")
        self.place: gpac.SVV[Any] = cell.svv("object", "double[3]", unit="m", history=20_000)
        self.blocks = grasping.download(cell)
        cell.place({"*": self.fast})
        watched = [self.place] if robot is None else []
        self.trace = Trace(*watched, *(svv for finger in self.hand for svv in (finger.sensed, finger.force)))

    def block(self) -> np.ndarray:
        """Returns the true position of the block, m; no verb of the grasp has access to it."""
        return np.array(self.place.value if self.robot is None else self.robot.sensor("object"))

    def watch(self) -> AbstractContextManager[Any]:
        """Keeps the SVV `place` up to date in the simulation. An emulated controller, like a real one, does not know the block."""
        if self.robot is not None:
            return nullcontext()
        watching = gpac.Verb(
            "watch",
            blocks={"camera": lib.block("read_vector")},
            instantiation_parameters={"channel": "camera.channel", "place": "camera.y"},
            command_lists={"start": [activate("camera", every=EVERY)]},
        )
        return watching.asynch(self.machine["sensor.object"], self.place)


def perform(work: Workcell, offset: float, account: Account) -> None:
    """Grasps the block with the arm off its centre by `offset` metres, lifts it, and puts it back."""
    shift, release = grasping.shift(work.blocks), grasping.release(work.blocks)
    grasp = centering_grasp(work.blocks)
    if offset:
        account.begin(f"shift: the arm is {offset * 1e3:.0f} mm beside the block")
        account.end("shift", shift(work.arm, distance=offset), "there")

    account.begin("centering grasp")
    before = work.block()
    report = grasp(work.hand, work.arm, time_limit="20 s")
    account.end("centering grasp", report, "gripped", f", {report.width * 1e3:.2f} mm wide")
    left, right = work.hand.values("sensed")
    account.expect("the block is in the middle of the hand", abs(left - right) < 0.001, f"{abs(left - right) * 1e3:.2f} mm beside it")
    pushed = float(np.hypot(*(work.block() - before)[:2]))
    account.expect("the block is not pushed away", pushed < PUSHED_MAX, f"it moved {pushed * 1e3:.3f} mm")

    account.begin("lift")
    account.end("lift", shift(work.arm, distance=0.05, direction=(0.0, 0.0, -1.0)), "there")
    risen = float(work.block()[2] - before[2])
    account.expect("the block is in the hand", risen > 0.045, f"it rose {risen * 1e3:.1f} mm")

    account.begin("put down, and let go")
    account.end("put down", shift(work.arm, distance=0.05, direction=(0.0, 0.0, 1.0)), "there")
    account.end("release", release(work.hand), "open")


def main() -> int:
    """Runs the program; returns 0 if every verb ended as expected and the block was not pushed away."""
    parser = programs.parser(__doc__)
    programs.add_driver(parser)
    parser.add_argument("--offset", type=float, default=15.0, help="how far the arm is beside the block, mm, -20 to 20 (default 15)")
    options = parser.parse_args()
    with (
        programs.controller(options, tool=TOOL, scene=SCENES / "bench.xml") as robot,
        programs.system("centering_grasp", options) as cell,
    ):
        work = Workcell(cell, robot)
        account = Account(work.trace)
        with work.arm.enabled(), work.hand.enabled(), work.watch():
            perform(work, options.offset * 1e-3, account)
        work.trace.save(options.trace, every=0.05)
    return account.verdict()


if __name__ == "__main__":
    programs.run(main)
