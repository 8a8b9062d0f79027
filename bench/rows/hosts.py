# SPDX-License-Identifier: Apache-2.0
"""Values and groups between hosts, compared with bare zenoh: rows of the example `bench` of the crate `hosts`, which is built here
(building zenoh takes minutes the first time). Network namespaces are created, which requires root and a kernel that permits it."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator

from lines import Line

from rows.kernel import example, printed_by


def measure(rounds: int) -> Iterator[Line]:
    """Yields the lines, those over loopback first."""
    try:
        yield from printed_by([example("hosts", "bench"), str(rounds)], "hosts")
    except RuntimeError:
        why = _no_namespaces()
        if not why:
            raise
        yield Line("hosts", "between network namespaces", note=f"not taken: {why}")


def _no_namespaces() -> str:
    """Returns why no network namespace can be created here; empty if one can."""
    if shutil.which("ip") is None:
        return "there is no `ip` (apt install iproute2)"
    name = f"ogbench{os.getpid() % 100_000}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True, text=True)
    if made.returncode:
        return f"this machine makes no network namespaces: {' '.join(made.stderr.split())[:120] or 'ip netns add failed'}"
    try:
        cable = subprocess.run(
            ["ip", "link", "add", f"ogb{os.getpid() % 100_000}", "type", "veth", "peer", "name", "eth0", "netns", name],
            capture_output=True,
            text=True,
        )
        return "" if cable.returncode == 0 else f"this machine makes no veth pairs: {' '.join(cable.stderr.split())[:120]}"
    finally:
        subprocess.run(["ip", "netns", "del", name], capture_output=True)
