# SPDX-License-Identifier: Apache-2.0
"""Fifty kill -9 of what commands an arm of Universal Robots, and fifty of its controller, at random instants of motions.

Whoever commanded it is gone: its own program brings the arm to rest and ends. The controller is gone: the verb ends with `device_lost`, and
what commands goes on. The exit code is 0 only if that was so each time.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from random import Random

import opengpac as gpac

KILLS = int(os.environ.get("OPENGPAC_UR_KILLS", "50"))
WITHIN = 60.0

COMMANDER = """
import sys
import opengpac as gpac
arm = gpac.robots.load("ur5e", driver=gpac.drivers.ur(sys.argv[1], silence="10 s", timeout="1 s"))
for joint in arm:
    joint.max_following_error = 0.0
arm.enable()
print("ready", flush=True)
while True:
    for goal in ([20, -90, 90, -90, -90, 0], [-20, -80, 80, -80, -80, 30]):
        gpac.motion.move_absolute(arm, gpac.deg(goal), speed="60 %")
"""

CONTROLLER = """
import sys, time
import opengpac as gpac
robot = gpac.drivers.fake.ur(gpac.deg([0, -90, 90, -90, -90, 0]), lockstep=False)
print(robot.host, flush=True)
time.sleep(3600)
"""


def started(program: str, *words: str) -> tuple[subprocess.Popen[str], str]:
    """A process, and the first line that it prints."""
    process = subprocess.Popen([sys.executable, "-c", program, *words], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, process.stdout.readline().strip()


def holds(what: Callable[[], bool]) -> bool:
    """Whether something comes to hold within a minute."""
    until = time.monotonic() + WITHIN
    while not what():
        if time.monotonic() > until:
            return False
        time.sleep(0.01)
    return True


def commander_killed(random: Random) -> str | None:
    """Kills what commands while the arm moves; what was wrong then."""
    with gpac.drivers.fake.ur(gpac.deg([0, -90, 90, -90, -90, 0]), lockstep=False) as robot:
        process, said = started(COMMANDER, robot.host)
        time.sleep(random.uniform(0.0, 1.0))
        process.send_signal(signal.SIGKILL)
        process.wait()
        if said != "ready":
            return f"it did not begin: {said!r}"
        if not holds(lambda: robot.program is None):
            return "the program on the controller goes on"
        if any(robot.do(lambda: robot.arm.velocity)) or robot.step_max > gpac.drivers.fake.LEAP_MAX:
            return f"the arm moves, or leapt: {robot.step_max} rad"
    return None


def controller_killed(random: Random) -> str | None:
    """Kills the controller while the arm moves; what was wrong then."""
    process, host = started(CONTROLLER)
    arm = gpac.robots.load("ur5e", driver=gpac.drivers.ur(host, silence="10 s", timeout="1 s"))
    try:
        for joint in arm:
            joint.max_following_error = 0.0
        arm.enable()
        vi = gpac.motion.move_absolute.asynch(arm, gpac.deg([120, -60, 60, -90, -90, 90]), speed="20 %")
        time.sleep(random.uniform(0.0, 1.0))
        process.send_signal(signal.SIGKILL)
        process.wait()
        try:
            vi.wait()
        except gpac.Terminated as ended:
            return None if ended.condition == "device_lost" else f"it ended with {ended.condition}"
        return "the motion ended as if nothing had been"
    finally:
        process.kill()
        arm.system.close()


def main() -> int:
    """Both, each as often as asked for."""
    random, wrong = Random(1), 0
    for name, kill in (("commander", commander_killed), ("controller", controller_killed)):
        for number in range(1, KILLS + 1):
            found = kill(random)
            if found is not None:
                wrong += 1
                print(f"{name} {number}: {found}", flush=True)
        print(f"{KILLS} {name}s killed", flush=True)
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
