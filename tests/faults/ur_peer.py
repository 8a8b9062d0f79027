# SPDX-License-Identifier: Apache-2.0
"""A third-party client, `ur_rtde`, accepts the emulated controller as a real one and commands it with its own program.

That client waits in real time, with fixed limits of some seconds, and sometimes indefinitely: so it is tried several times, and is
not part of `make test`. The exit code is 0 only if one try was complete.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import opengpac as gpac

PEER = """
import json, sys
import dashboard_client, rtde_control, rtde_receive
host, goal = sys.argv[1], json.loads(sys.argv[2])
dashboard = dashboard_client.DashboardClient(host)
dashboard.connect()
receive = rtde_receive.RTDEReceiveInterface(host)
told = {"mode": dashboard.robotmode(), "remote": dashboard.isInRemoteControl(), "began": receive.getActualQ()}
told["pose"] = receive.getActualTCPPose()
control = rtde_control.RTDEControlInterface(host)
told["runs"] = control.isProgramRunning()
told["moved"] = control.moveJ(goal, 1.0, 1.4)
ends = [q + 0.05 for q in goal]
for k in range(1, 10001):
    begun = control.initPeriod()
    control.servoJ([q + min(0.0005 * k, 0.05) for q in goal], 0.0, 0.0, 0.002, 0.1, 300)
    control.waitPeriod(begun)
    if k > 100 and max(abs(q - end) for q, end in zip(receive.getActualQ(), ends)) < 1e-3:
        break
told["stopped"] = control.servoStop()
told["ended"] = receive.getActualQ()
control.stopScript()
print("\\ntold " + json.dumps(told), flush=True)
"""

GOAL = [0.2, -1.4, 0.3, -1.6, 0.1, 0.2]
UPRIGHT = [0.0, -0.2329, 1.0794]
"""Position of the flange of an upright UR5e, by the DH parameters that its maker publishes, m."""
TRIES = 6


def asked(host: str) -> dict[str, Any] | str:
    """Returns the peer's report of a controller, or why it gave up. The peer holds Python's lock while it waits, so it has its own
    process."""
    words = [sys.executable, "-c", PEER, host, json.dumps(GOAL)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    except subprocess.TimeoutExpired:
        return "it was not through after a minute"
    told = [line.removeprefix("told ") for line in done.stdout.splitlines() if line.startswith("told ")]
    return json.loads(told[0]) if told else done.stderr.strip()


def near(found: list[float], wanted: list[float], tolerance: float) -> bool:
    """Returns whether each number is within the tolerance."""
    return all(abs(a - b) <= tolerance for a, b in zip(found, wanted, strict=True))


def wrong(told: dict[str, Any], robot: gpac.drivers.fake.ur) -> list[str]:
    """Returns the faults in the peer's report."""
    holds = {
        "it receives": near(told["began"], gpac.drivers.fake.HOME, 1e-9) and near(told["pose"][:3], UPRIGHT, 1e-6),
        "it asks": "RUNNING" in told["mode"] and told["remote"],
        "its program runs": told["runs"],
        "moveJ": told["moved"],
        "servoJ": told["stopped"] and near(told["ended"], [q + 0.05 for q in GOAL], 2e-3),
        "stopScript": robot.program is None,
    }
    return [what for what, is_so in holds.items() if not is_so]


def main() -> int:
    """Runs the tries; returns 0 if one succeeded."""
    for number in range(1, TRIES + 1):
        with gpac.drivers.fake.ur(lockstep=False) as robot:
            told = asked(robot.host)
            found = [told] if isinstance(told, str) else wrong(told, robot)
        print(f"try {number}: {'; '.join(found) or 'ur_rtde receives from the emulated controller and commands it'}")
        if not found:
            return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
