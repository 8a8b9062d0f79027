# SPDX-License-Identifier: Apache-2.0
"""The application that `peers.py` attacks: three processors, two of them processes, with connections between each pair.

It answers each line of its input with one line: `look` with the counts that have moved, `close` with the time that closing took,
after which it ends.
"""

from __future__ import annotations

import json
import logging
import sys
import time

import opengpac as gpac
from opengpac import activate
from opengpac import library as lib

PROCESSORS = ("near", "hostile", "beside")


def main() -> None:
    """Serves its input."""
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    cell = gpac.System("peers", progress=False)
    processors = {name: cell.processor(name, process=name != "near") for name in PROCESSORS}
    timers = {name: one.timer(f"{name}_fast", period="2 ms", priority=50) for name, one in processors.items()}
    steps = {name: one.software(f"{name}_steps") for name, one in processors.items()}
    own = {}
    for name, timer in timers.items():
        own[name] = cell.svv(f"own_{name}")
        counting = gpac.Verb(
            f"own_{name}",
            blocks={"wave": lib.signal_generator(shape=1, frequency=3.0)},
            instantiation_parameters={"y": "wave.y"},
            command_lists={"start": [activate("wave", every="2 ms")]},
        )
        counting.on(timer).asynch(own[name])
    # Values as they are, and rows one by one, around the ring.
    for writer, reader in zip(PROCESSORS, PROCESSORS[1:] + PROCESSORS[:1], strict=True):
        carries = gpac.Verb(
            f"{writer}_to_{reader}",
            blocks={"wave": lib.signal_generator(shape=1, frequency=2.0), "takes": lib.gain, "follows": lib.gain},
            instantiation_parameters={"y": "takes.y", "z": "follows.y"},
            cells={"value": ["wave.y", "takes.u", "follows.u"]},
            modes={"takes.u": "asynchronous"},
            command_lists={"start": [activate("wave", every="2 ms"), activate("takes", every="2 ms"), activate("follows")]},
        )
        places = {"wave": timers[writer], "takes": timers[reader], "follows": steps[reader]}
        carries.on(places).asynch(cell.svv(f"asynchronous_{reader}"), cell.svv(f"row_{reader}"))
    print("ready", flush=True)
    for line in sys.stdin:
        if line.strip() == "close":
            began = time.monotonic()
            cell.close()
            print(json.dumps({"close_s": time.monotonic() - began}), flush=True)
            return
        moved = {}
        for name, svv in own.items():
            before, until = svv.value, time.monotonic() + 3.0
            while svv.value == before and time.monotonic() < until:
                time.sleep(0.005)
            moved[name] = svv.value != before
        unconnected = [entry["text"] for entry in cell.log() if entry["kind"] == "unconnected"]
        print(json.dumps({"moved": moved, "unconnected": unconnected}), flush=True)


if __name__ == "__main__":
    main()
