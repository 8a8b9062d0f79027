# SPDX-License-Identifier: Apache-2.0
"""Release jitter at 1 kHz compared with cyclictest: the same core, priority and number of releases, in turns."""

from __future__ import annotations

import os
import resource
import shutil
from collections.abc import Iterator

from lines import Line

from rows import kernel


def measure(rounds: int, quick: bool) -> Iterator[Line]:
    """Yields the median, the 99th percentile and the maximum, or the reason why there are none."""
    if shutil.which("cyclictest") is None:
        yield Line("jitter", "release jitter at 1 kHz", bar_text="≤ 1 ×", note="not taken: cyclictest is missing (apt install rt-tests)")
        return
    if not may_run_in_real_time():
        yield Line(
            "jitter",
            "release jitter at 1 kHz",
            bar_text="≤ 1 ×",
            note="not taken: no right to real-time scheduling (rtprio in limits.conf)",
        )
        return
    yield from kernel.measure("jitter", min(rounds, 2 if quick else 5))


def may_run_in_real_time() -> bool:
    """Returns whether a thread of this process may take a real-time priority, without taking one."""
    return os.geteuid() == 0 or resource.getrlimit(resource.RLIMIT_RTPRIO)[0] > 0
