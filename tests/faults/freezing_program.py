# SPDX-License-Identifier: Apache-2.0
"""The program whose machine a campaign freezes: a joint whose plant has a process of its own moves at a speed that was asked for.

python freezing_program.py JSON: `url` of a daemon, or `endpoint` where a host joins; `process`: the processor of the joint has a process of
its own. It writes `ready` when the joint moves, and does what each line that it reads says: `end` (what the motion ended with), `look` (the
same, where it has), `told` (alarms by code and source, the log by kind), `speed` (the highest one that was commanded), `again` (a motion
after `reset` and `enable`), `close`.
"""

from __future__ import annotations

import json
import logging
import sys
from typing import Any

import numpy as np

import opengpac as gpac
from opengpac.robots import Joint

ASKED = 0.05
"""rad/s."""
GOAL = 30.0
"""Ten minutes away, so that the motion goes on through every freeze."""
PERIOD_S = 0.001


def opened(told: dict[str, Any]) -> gpac.System:
    """The system: that of a daemon, or one of this program that another host joins."""
    if told["url"]:
        return gpac.connect(told["url"], name="operator")
    cell = gpac.System("frozen", progress=False)
    if told["endpoint"]:
        cell.listen(told["endpoint"], "cell-a")
    return cell


def machine(cell: gpac.System, told: dict[str, Any]) -> tuple[Joint, gpac.Source]:
    """The joint, enabled, and the source of its set-points: of another host where one joins."""
    rtp = cell.processor("rtp1", process=told["process"])
    fast = rtp.timer("fast", period=PERIOD_S, priority=80)
    # Set-points come from elsewhere where there is an elsewhere.
    afar = cell.processor("rtp2", host="cell-b") if told["endpoint"] else cell.processor("rtp0")
    slow = afar.timer("slow", period="20 ms", priority=60)
    driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=told["plant"], linger="1 s")
    drive = rtp.physical_device("drive", driver, exchange=fast)
    joint = Joint("axis", drive=drive["x"], on=fast, kp=50.0, kd=0.0, position_min=-100.0, position_max=100.0, max_following_error=0.5)
    return joint.enable(), slow


def moves(joint: Joint, slow: gpac.Source) -> gpac.VerbInstance[Any]:
    """Moves it, and waits until it has the speed that was asked for."""
    moving = gpac.motion.move_absolute.on(slow).asynch(joint, joint.commanded.value + GOAL, speed=ASKED)
    begun = joint.sensed.value
    while joint.sensed.value < begun + 0.01 and not moving.done:
        pass
    return moving


def speed(joint: Joint) -> float:
    """The highest one between two invocations of the servo that the history has, rad/s."""
    rows = joint.reference.history[:]
    return float(np.abs(np.diff(rows["value"])).max() / PERIOD_S)


def ended(moving: gpac.VerbInstance[Any], within: str) -> list[str]:
    """With what the motion ended, and why; nothing where it goes on."""
    try:
        return [moving.wait(timeout=within).condition, ""]
    except gpac.Terminated as end:
        return [end.condition, end.message]
    except TimeoutError:
        return []


def again(cell: gpac.System, joint: Joint, slow: gpac.Source) -> list[str]:
    """Moves it once more, a little: as soon as its servo has brought it to rest, which ends a motion that begins before."""
    cell.reset()
    joint.enable()
    end = ["time_lost"]
    while end[:1] == ["time_lost"]:
        end = ended(gpac.motion.move_absolute.on(slow).asynch(joint, joint.commanded.value + 0.02, speed=ASKED), "60 s")
    return end


def main(told: dict[str, Any]) -> None:
    """Runs until it is told to close, or killed."""
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    with opened(told) as cell:
        joint, slow = machine(cell, told)
        moving = moves(joint, slow)
        print("ready", flush=True)
        for line in sys.stdin:
            match line.strip():
                case "end" | "look" as how:
                    answer: Any = ended(moving, "30 s" if how == "end" else "200 ms")
                case "told":
                    alarms = {f"{alarm.code} {alarm.source}": alarm.text for alarm in cell.alarms}
                    answer = [alarms, [[entry["kind"], entry["text"]] for entry in cell.log()]]
                case "speed":
                    answer = speed(joint)
                case "again":
                    answer = again(cell, joint, slow)
                case _:
                    return
            print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
