# SPDX-License-Identifier: Apache-2.0
"""kill -9 of each driver's commander, of the driver's process, and of the device, at random instants of a verb.

    python tests/faults/driver_kills.py                   50 of each for each driver: make faults
    python tests/faults/driver_kills.py --rounds 3 --only servos

The verb must have its end report, the outputs must be as the driver promises, and nothing may be left behind. The exit code is 0 only
if all this held.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import logging
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import leftovers
import opengpac as gpac
from driver_benches import BENCHES, apart, kind_of, opened, told
from leftovers import Before
from opengpac import activate
from opengpac import library as lib
from plant import until
from rounds import PROCESS, THREAD, Round, started

COMMANDER = "import sys; sys.path.insert(0, sys.argv[1]); import driver_kills; driver_kills.command(sys.argv[2])"


def pushing(cell: gpac.System, channel: str, value: float, driver: gpac.drivers.Driver, where: Mapping[str, Any]) -> Any:
    """Starts a verb that commands a device, on a processor of the given kind."""
    rtp = cell.processor("rtp0", **where)
    fast = rtp.timer("fast", period="5 ms", priority=50)
    device: Any = rtp.physical_device("device", driver, exchange=fast)
    for name in channel.split("."):
        device = device[name] if device is not None and name == channel.split(".")[0] else getattr(device, name)
    push = gpac.Verb(
        "push",
        blocks={"write": lib.block("write_channel")},
        instantiation_parameters={"channel": "write.channel"},
        input_parameters={"u": "write.u"},
        modes={"write.u": "asynchronous"},
        command_lists={"start": [activate("write", every="5 ms")]},
    )
    return push.asynch(channel=device, u=value)


def command(words: str) -> None:
    """Commands a device until the process is killed."""
    channel, value, driver = opened(words)
    cell = gpac.System("commander", progress=False)
    pushing(cell, channel, value, driver, THREAD)
    print("commands", flush=True)
    time.sleep(3600)


def of_its_commander(found: Round, _: Before, chosen: random.Random, name: str) -> None:
    """kill -9 of programming system, supervisor and driver at once."""
    with BENCHES[name]() as bench:
        here = str(Path(__file__).parent)
        words = [sys.executable, "-c", COMMANDER, here, told(name, bench.address)]
        commander = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        assert commander.stdout is not None
        if commander.stdout.readline().strip() != "commands":
            found.wrong.append("the commander has not begun")
        until(bench.commanded, "nothing is commanded")
        time.sleep(chosen.uniform(0.0, 0.1))
        killed_ns = time.monotonic_ns()
        commander.kill()
        commander.wait()
        # The plant's process has inherited this pipe, and may keep it open for a while.
        commander.stdout.close()
        safe(found, bench.safe, killed_ns)


def of_its_process(found: Round, before: Before, chosen: random.Random, name: str) -> None:
    """kill -9 of the processor in which the driver runs."""
    with BENCHES[name]() as bench, gpac.System("campaign", progress=False) as cell:
        instance = pushing(cell, bench.channel, bench.value, bench.driver(), PROCESS)
        until(bench.commanded, "nothing is commanded")
        time.sleep(chosen.uniform(0.0, 0.1))
        (processor,) = started(before, "run_processor")
        killed_ns = time.monotonic_ns()
        os.kill(processor, signal.SIGKILL)
        found.expect_end(instance, "processor_lost")
        found.time_from(killed_ns)
        safe(found, bench.safe, killed_ns)


def of_its_counterpart(found: Round, _: Before, chosen: random.Random, name: str) -> None:
    """kill -9 of the device; if the driver starts its process, of that process."""
    with contextlib.ExitStack() as stack:
        kind = kind_of(name)
        address: str
        if kind.host is not None:
            bench = stack.enter_context(BENCHES[name]())
            kill, address = None, bench.address
        else:
            process, address = stack.enter_context(apart(name))
            kill = process.kill
        begun = Before()
        cell = stack.enter_context(gpac.System("campaign", progress=False))
        channel, value, driver = opened(told(name, address))
        instance = pushing(cell, channel, value, driver, THREAD)
        until(lambda: kind.met(cell.physical_devices["device"]), "the driver has not met its counterpart")
        time.sleep(chosen.uniform(0.0, 0.1))
        if kill is None:
            (process_of_it,) = started(begun, kind.host or "")
            os.kill(process_of_it, signal.SIGKILL)
        else:
            kill()
        killed_ns = time.monotonic_ns()
        found.expect_end(instance, "device_lost")
        found.time_from(killed_ns)


def safe(found: Round, holds: Callable[[], bool | None], killed_ns: int) -> None:
    """Checks that the outputs become as the driver promises for its killed process."""
    if holds() is None:
        return
    try:
        until(lambda: bool(holds()), "the outputs are not safe")
        found.safe_s = (time.monotonic_ns() - killed_ns) * 1e-9
    except TimeoutError as why:
        found.wrong.append(str(why))


KILLS = {"commander": of_its_commander, "process": of_its_process, "counterpart": of_its_counterpart}


def one(name: str, victim: str, number: int, seed: int = 1) -> Round:
    """Makes a kill and accounts for the consequences; the same numbers repeat it."""
    found, before = Round(), Before()
    try:
        KILLS[victim](found, before, random.Random(f"{seed} {name} {victim} {number}"), name)
    except Exception as why:
        found.wrong.append(f"the round broke off: {type(why).__name__}: {why}")
    gc.collect()
    found.wrong += before.left_over()
    return found


def median_ms(times: list[float]) -> str:
    """Returns the median and the maximum as text, ms."""
    return f"{sorted(times)[len(times) // 2] * 1e3:7.1f} / {max(times) * 1e3:7.1f} ms" if times else "—"


def main() -> int:
    parser = argparse.ArgumentParser(description="Kills what commands devices, and devices.")
    parser.add_argument("--rounds", type=int, default=50, help="of each victim, for each driver")
    parser.add_argument("--only", default="", help="drivers or victims whose names contain this")
    parser.add_argument("--seed", type=int, default=1, help="which instants are chosen")
    options = parser.parse_args()
    leftovers.enter_alone([str(Path(__file__).resolve()), *sys.argv[1:]])
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    wrong = 0
    print(f"{'driver':14}{'killed':14}{'held':>9}   {'end report, median / longest':32}safe outputs")
    for name in BENCHES:
        for victim in KILLS:
            if options.only not in f"{name} {victim}":
                continue
            rounds = [one(name, victim, number, options.seed) for number in range(options.rounds)]
            held = sum(not each.wrong for each in rounds)
            wrong += len(rounds) - held
            reported, safe_after = [[t for t in of if t is not None] for of in ([r.reported_s for r in rounds], [r.safe_s for r in rounds])]
            print(f"{name:14}{victim:14}{held:3} of {len(rounds):3}   {median_ms(reported):32}{median_ms(safe_after)}", flush=True)
            for number, each in enumerate(rounds):
                for text in each.wrong:
                    print(f"    {name}, {victim} {number}: {text}", flush=True)
    return min(wrong, 1)


if __name__ == "__main__":
    sys.exit(main())
