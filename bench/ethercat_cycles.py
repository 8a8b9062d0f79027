# SPDX-License-Identifier: Apache-2.0
"""Compares eight EtherCAT axes at 1 kHz with cyclictest, and the exchange with SOEM (pysoem) on one emulated segment: lateness, exchange
time, allocations; also switches the power of an axis off and on.

    python bench/ethercat_cycles.py --minutes 10

As root the segment is on a veth pair in its own network namespace; otherwise it is on a local socket, and SOEM is left out.
cyclictest runs at the same time, at the same priority and period. The exit code is 0 if no cycle allocated, the axes moved, the
exchange took at most 1.5 times SOEM's, and the axis was back in OP within 2 s and stood still until it was enabled.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import shutil
import statistics
import subprocess
import sys
import time as clock
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

from rows import jitter, kernel

import opengpac as gpac
from opengpac.drivers import fake

AXES = 8
PRIORITY = 80
BAR = 1.5
# Maximum time for which a real-time thread may compute without blocking, µs: a runaway thread is ended before it stops the machine.
RTTIME_US = 5_000_000
# The goals of the axes are 0.2 rad to either side.
MOVED = 0.39
# Maximum time from the return of an axis's power to OP, s.
BACK_S = 2.0


def measured(seconds: int, rounds: int, times: int) -> dict[str, Any]:
    """Returns the measurements of one run, ns; `peer` and `ours` are median exchange times taken in turns, `cyclictest` is None if it
    could not run."""
    may = jitter.may_run_in_real_time()
    missing = "cyclictest is missing (apt install rt-tests)" if shutil.which("cyclictest") is None else ""
    missing = missing or ("" if may else "no right to real-time scheduling (rtprio in limits.conf)")
    resource.setrlimit(resource.RLIMIT_RTTIME, (RTTIME_US, resource.getrlimit(resource.RLIMIT_RTTIME)[1]))
    is_root = os.geteuid() == 0
    if is_root:
        for words in ("link add ec0 type veth peer name ec1", "link set ec0 up", "link set ec1 up"):
            subprocess.run(["ip", *words.split()], check=True)
    drives = ({"name": f"d{number}", "watchdog": False} for number in range(AXES))
    found: dict[str, Any] = {"ours": None, "peer": None, "cyclictest": None, "missing": missing, "load_before": os.getloadavg()[0]}
    with fake.ethercat(*drives, interface="ec1" if is_root else None) as segment:
        interface = "ec0" if is_root else segment.interface
        if is_root:
            found |= _exchanges(kernel.example("ethercat", "exchange"), rounds, times)
        # Everything that runs is in this list; other load on the machine shows in the lateness of cyclictest, too.
        beside = None if missing else subprocess.Popen(_cyclictest(seconds), stdout=subprocess.PIPE, text=True)
        command = [kernel.example("ethercat", "cycles"), interface, str(AXES), str(seconds), str(PRIORITY if may else 0)]
        try:
            found |= json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
        finally:
            said = beside.communicate()[0] if beside else ""
    found["load_after"] = os.getloadavg()[0]
    if beside:
        greatest, average = (re.search(rf"{word}:\s*(\d+)", said) for word in ("Max", "Avg"))
        if greatest is None or average is None:
            raise RuntimeError(f"cyclictest says nothing of its latencies: {said}")
        found["cyclictest"] = {"average": float(average[1]) * 1e3, "maximum": float(greatest[1]) * 1e3}
    return found


def _exchanges(program: str, rounds: int, times: int) -> dict[str, float]:
    """Measures exchanges with the segment in turns, by SOEM and by our main device."""
    from ethercat_peer import soem

    peer, ours = [], []
    for _ in range(rounds):
        peer.append(soem(times))
        run = subprocess.run([program, "ec0", str(AXES), str(times)], check=True, capture_output=True, text=True)
        ours.append(float(run.stdout))
    return {"ours": statistics.median(ours), "peer": statistics.median(peer)}


def _cyclictest(seconds: int) -> list[str]:
    return ["cyclictest", "-q", "-m", "-t", "1", "-p", str(PRIORITY), "-i", "1000", "-l", str(seconds * 1000)]


def power_cycled() -> dict[str, Any]:
    """Returns the time from an axis's power return to OP, s, and the counts by which the axis moved before it was enabled."""
    victim = 3
    with (
        fake.ethercat(*({"name": f"d{number}", "watchdog": False} for number in range(AXES))) as segment,
        gpac.System("cell", progress=False) as cell,
    ):
        rtp = cell.processor("rtp0")
        fast = rtp.timer("fast", period="1 ms", priority=PRIORITY)
        axes = {f"a{number}": {"counts": 10_000, "speed_max": 5.0} for number in range(AXES)}
        line = rtp.physical_device("line", gpac.drivers.ethercat(segment.interface, axes, lost_after=500), exchange=fast)
        part = line[f"a{victim}"]
        joint = gpac.robots.Joint("j", drive=part, on=fast, verb=gpac.robots.joint_follower, max_following_error=100.0).enable()
        gpac.motion.move_absolute(gpac.Group("arm", joint), goal=[0.3])
        segment.power(victim, False)
        _until(lambda: cell.statistics["physical_devices"]["line"]["lost"] is not None, "the device is lost")
        why = str(cell.statistics["physical_devices"]["line"]["lost"])
        before = segment.drives()[victim].position
        segment.power(victim, True)
        begun = clock.monotonic()
        cell.reset()
        _until(lambda: segment.drives()[victim].state == "OP", "the axis is in OP")
        back_s = clock.monotonic() - begun
        cycles = line.counters["cycles"]
        _until(lambda: line.counters["cycles"] > cycles + 500, "cycles go on")
        drive = segment.drives()[victim]
        moved, off = abs(drive.position - before), drive.drive
        joint.enable()
        _until(lambda: segment.drives()[victim].drive == "operation enabled", "the axis is in operation")
    return {"back_s": back_s, "moved_counts": moved, "off": off, "why": why}


def _until(holds: Callable[[], bool], what: str) -> None:
    end = clock.monotonic() + 60
    while not holds():
        if clock.monotonic() > end:
            raise TimeoutError(what)
        clock.sleep(0.005)


def problems(found: dict[str, Any]) -> list[str]:
    """Returns the requirements that do not hold."""
    wrong: list[str] = []
    if found["allocations"]:
        wrong.append(f"{found['allocations']} allocations in {found['cycles']} cycles")
    if found["moved"] < MOVED:
        wrong.append(f"the first axis moved by {found['moved']} rad only")
    cycled = found["power_cycled"]
    if cycled["back_s"] > BACK_S or cycled["moved_counts"] or cycled["off"] != "switch on disabled":
        wrong.append(f"a power-cycled axis was not back and at rest: {cycled}")
    if found["peer"] and found["ours"] > BAR * found["peer"]:
        wrong.append(f"an exchange took {found['ours'] / found['peer']:.2f} times SOEM's")
    return wrong


def show(found: dict[str, Any]) -> None:
    """Prints the figures."""
    us = lambda ns: f"{ns * 1e-3:.1f} µs"  # noqa: E731
    late, took = found["lateness"], found["exchange"]
    print(f"{AXES} axes, {found['cycles']} cycles of 1 ms; load {found['load_before']:.1f} before, {found['load_after']:.1f} after")
    print(f"allocations in the cycles  {found['allocations']}")
    print(f"lateness of a cycle        median {us(late['median'])}, 99.9 % {us(late['p999'])}, maximum {us(late['maximum'])}")
    beside = found["cyclictest"]
    text = f"average {us(beside['average'])}, maximum {us(beside['maximum'])}" if beside else f"not run: {found['missing']}"
    print(f"cyclictest beside it       {text}")
    print(f"read and write of a cycle  median {us(took['median'])}, 99.9 % {us(took['p999'])}, maximum {us(took['maximum'])}")
    if found["peer"]:
        share = found["ours"] / found["peer"]
        print(f"exchange there and back    median {us(found['ours'])}, pysoem {us(found['peer'])}: {share:.2f} × (at most {BAR})")
    else:
        print("exchange there and back    not compared with pysoem: no right to make a network namespace (run it as root)")
    counters = ", ".join(f"{name} {count}" for name, count in found["counters"].items())
    cycled = found["power_cycled"]
    print(f"an axis switched off       {cycled['why']}")
    back = f"{cycled['back_s']:.2f} s (at most {BACK_S} s)"
    print(f"and on: in OP after        {back}; moved by {cycled['moved_counts']} counts, {cycled['off']}")
    print(f"releases skipped {found['skipped']}; counters: {counters}")


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--minutes", type=float, default=1.0, help="how long the axes move (1)")
    parser.add_argument("--rounds", type=int, default=5, help="turns of exchanges with SOEM (5)")
    parser.add_argument("--times", type=int, default=2_000, help="exchanges in a turn (2000)")
    parser.add_argument("--json", action="store_true", help="print the figures as one line of JSON")
    options = parser.parse_args()
    if os.geteuid() == 0 and os.environ.get("OPENGPAC_OWN_NETWORK") != "yes":
        environment = {**os.environ, "OPENGPAC_OWN_NETWORK": "yes"}
        return subprocess.run(["unshare", "--net", sys.executable, *sys.argv], env=environment, check=False).returncode
    found = measured(round(options.minutes * 60), options.rounds, options.times)
    found["power_cycled"] = power_cycled()
    if options.json:
        print(json.dumps(found))
    else:
        show(found)
    wrong = problems(found)
    for each in wrong:
        print(f"WRONG: {each}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
