# SPDX-License-Identifier: Apache-2.0
"""An arm takes parts from a belt and stacks them on a pallet: one queue of moves for each part, with blends, and a gripper that is
switched at places of the path. The program is recorded, and the recording is replayed to the same bits."""

import sys
import tempfile
from pathlib import Path

import opengpac as gpac
from opengpac import motion

LAYERS, ROWS, COLUMNS = 1, 2, 2
STEP = 0.08
"""Distance of parts on the pallet, m."""


def places(corner: gpac.Pose) -> list[gpac.Pose]:
    """Returns the places of the pallet, layer by layer."""
    grid = [(column, row, layer) for layer in range(LAYERS) for row in range(ROWS) for column in range(COLUMNS)]
    return [gpac.Pose((STEP * column, STEP * row, 0.05 * layer)) @ corner for column, row, layer in grid]


def palletise(arm: gpac.robots.Arm, gripper: gpac.cell.DigitalOutput) -> list[float]:
    """Stacks the parts; returns the time for each, s."""
    home = gpac.deg([0, -90, 90, -90, -90, 0])
    motion.move_absolute(arm, home, speed="50 %")
    above_belt = arm.forward(home)
    belt, corner = gpac.Pose((0, 0, "-150 mm")) @ above_belt, gpac.Pose(("50 mm", "250 mm", "-150 mm")) @ above_belt
    times = []
    for place in places(corner):
        begun = arm.system.now
        above = gpac.Pose((0, 0, "120 mm")) @ place
        with arm.queue(outputs=[gripper]) as moves:
            # The valve needs 40 ms: it is switched that much before the part is reached.
            moves.linear(belt, speed="300 mm/s", marks=[motion.at(gripper, True, ahead="40 ms")])
            moves.linear(above_belt, speed="500 mm/s", acceleration=3.0, blend="60 mm")
            moves.linear(above, speed="800 mm/s", acceleration=3.0, blend="60 mm")
            moves.linear(place, speed="300 mm/s", marks=[motion.at(gripper, False)])
            moves.linear(above, speed="500 mm/s", acceleration=3.0, blend="60 mm")
            moves.linear(above_belt, speed="800 mm/s", acceleration=3.0)
        times.append(arm.system.now - begun)
    return times


def main() -> int:
    """Runs the program, replays its recording, and returns 0 if both went as expected."""
    record = Path(tempfile.mkdtemp()) / "palletising.mcap"
    with gpac.System("palletising", clock="virtual") as cell:
        cell.record(record, replay=True)
        fast = cell.processor("rtp0").timer("fast", period="1 ms", priority=80)
        cell.processor("rtp0").timer("slow", period="20 ms", priority=60)
        arm = gpac.robots.load("ur5e", on=fast)
        # A fieldbus would be here.
        valve = {"name": "valve", "direction": "write", "type": "bool"}
        io = cell.processor("rtp0").physical_device("io", gpac.drivers.scripted([valve], []), exchange=fast)
        gripper = gpac.cell.DigitalOutput("gripper", io["valve"])
        with arm.enabled(), gripper.enabled():
            times = palletise(arm, gripper)
    print(f"{len(times)} parts, {sum(times) / len(times):.2f} s each")
    is_same = gpac.replay(record, trust=True).same
    print("the replay is", "the same, bit for bit" if is_same else "different")
    return 0 if is_same else 1


if __name__ == "__main__":
    sys.exit(main())
