# SPDX-License-Identifier: Apache-2.0
"""Independent EtherCAT main device, SOEM through pysoem, on the interface `ec0`: the time of its exchange."""

from __future__ import annotations

import statistics
import time

import pysoem

PATIENCE_US = 10_000_000
CONTROL, MODE = 0, 12
VELOCITY = 9


def soem(times: int) -> float:
    """Returns the median time of `times` exchanges, ns, with all drives in operation."""
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
