# SPDX-License-Identifier: Apache-2.0
"""Exchanges of our main device and of SOEM (pysoem) with one emulated segment, in turns. Runs in a network namespace of its own, where it
makes a veth pair: `unshare --net python ethercat_peer.py EXCHANGE DRIVES ROUNDS TIMES` prints a list of rounds, ns."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time

import pysoem

from opengpac.drivers import fake

PATIENCE_US = 10_000_000
CONTROL, MODE = 0, 12
VELOCITY = 9


def soem(times: int) -> float:
    """The median exchange of a main device that nobody here wrote, its drives in operation."""
    main = pysoem.Master()
    main.open("ec0")
    main.config_init()
    main.config_map()
    main.state_check(pysoem.SAFEOP_STATE, PATIENCE_US)
    main.state = pysoem.OP_STATE
    main.send_processdata()
    main.receive_processdata(PATIENCE_US)
    main.write_state()
    for word in (0x80, 0x06, 0x07, 0x0F):
        for device in main.slaves:
            output = bytearray(13)
            output[CONTROL], output[MODE] = word, VELOCITY
            device.output = bytes(output)
        main.send_processdata()
        main.receive_processdata(PATIENCE_US)
    spans: list[int] = []
    for _ in range(times):
        begun = time.perf_counter_ns()
        main.send_processdata()
        counter = main.receive_processdata(PATIENCE_US)
        spans.append(time.perf_counter_ns() - begun)
        assert counter == main.expected_wkc, "all drives take their process data"
    main.state = pysoem.INIT_STATE
    main.write_state()
    main.close()
    return statistics.median(spans)


def main() -> None:
    exchange, drives, rounds, times = sys.argv[1], *map(int, sys.argv[2:])
    for words in ("link add ec0 type veth peer name ec1", "link set ec0 up", "link set ec1 up"):
        subprocess.run(["ip", *words.split()], check=True)
    measured: list[dict[str, float]] = []
    with fake.ethercat(*({"name": f"d{number}", "watchdog": False} for number in range(drives)), interface="ec1"):
        for _ in range(rounds):
            peer = soem(times)
            run = subprocess.run([exchange, "ec0", str(drives), str(times)], check=True, capture_output=True, text=True)
            measured.append({"ours": float(run.stdout), "peer": peer})
    print(json.dumps(measured))


if __name__ == "__main__":
    main()
