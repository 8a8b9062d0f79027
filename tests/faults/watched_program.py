# SPDX-License-Identifier: Apache-2.0
"""The program whose watchers and processors a campaign kills and stops: one drive that is pushed, by threads or in a process of its own.

python watched_program.py JSON: `plant` (its name), `process`, `timeout` (the plant's own), `lost_after`, `if_cut_off`. It writes
`ready`, and executes each line that it reads: `end` (the condition with which the push ended), `look` (the same, if it has ended),
`told` (texts of alarms by code and source, and of late sources), `reset`, `push`, `lose BLOCK` (a block of lost.c runs in addition),
`close`.
"""

from __future__ import annotations

import json
import logging
import sys
import time
from pathlib import Path
from typing import Any

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib
from plant import LINGER

PUSH = 1.0
PERIOD = "2 ms"
PAUSE_S = 0.001


def main(told: dict[str, Any]) -> None:
    """Runs until a `close`, or until it is killed."""
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    with gpac.System(told["plant"], progress=False) as cell:
        cell.processor("rtp0").timer("beside", period="10 ms", priority=60)
        rtp = cell.processor("rtp1", process=told["process"], lost_after=told.get("lost_after"))
        fast = rtp.timer("fast", period=PERIOD, priority=80)
        driver = gpac.drivers.plant_process(gpac.drivers.loopback("x"), name=told["plant"], linger=LINGER, timeout=told.get("timeout"))
        drive = rtp.physical_device("drive", driver, exchange=fast)
        pushing = gpac.Verb(
            "pushing",
            blocks={"push": lib.block("write_channel")},
            instantiation_parameters={"effort": "push.channel"},
            input_parameters={"u": "push.u"},
            modes={"push.u": "asynchronous"},
            command_lists={"start": [activate("push", every=PERIOD)]},
            if_cut_off=told.get("if_cut_off"),
        )

        def push() -> gpac.VerbInstance[Any]:
            """Pushes and waits for the drive to move; until then there is no command that would have to be made safe."""
            pushed = pushing.on(fast).asynch(drive["x"].effort, u=PUSH)
            while not (pushed.done or cell.read(drive["x"].velocity)[0]):
                time.sleep(PAUSE_S)
            return pushed

        pushed = push()
        print("ready", flush=True)
        for line in sys.stdin:
            if line in ("end\n", "look\n"):
                print(json.dumps(ended(pushed, "20 s" if line == "end\n" else "50 ms")), flush=True)
            elif line == "told\n":
                alarms = {f"{alarm.code} {alarm.source}": alarm.text for alarm in cell.alarms}
                print(json.dumps([alarms, [entry["text"] for entry in cell.log() if entry["kind"] == "late"]]), flush=True)
            elif line == "reset\n":
                cell.reset()
                print("reset", flush=True)
            elif line == "push\n":
                try:
                    pushed = push()
                    print("pushed", flush=True)
                except gpac.Error as refused:
                    print(json.dumps(str(refused)), flush=True)
            elif line.startswith("lose "):
                lose(cell, fast, line.split()[1])
                print("lost", flush=True)
            else:
                return


def lose(cell: gpac.System, source: gpac.Source, block: str) -> None:
    """Runs a block that takes its thread from the source."""
    y = cell.svv("y")
    verb = gpac.Verb("losing", blocks={"b": cell.download(Path(__file__).parent / "lost.c")[block]}, instantiation_parameters={"y": "b.y"},
                     command_lists={"start": [activate("b", every=PERIOD)]})  # fmt: skip
    verb.on(source).asynch(y)


def ended(pushed: gpac.VerbInstance[Any], within: str) -> list[str]:
    """Returns the condition with which the push ended, and its reason; nothing if it continues."""
    try:
        return [pushed.wait(timeout=within).condition, ""]
    except gpac.Terminated as end:
        return [end.condition, end.message]
    except TimeoutError:
        return []


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
