# SPDX-License-Identifier: Apache-2.0
"""Rows of values and groups between hosts, beside bare zenoh: the example `bench` of the crate `hosts`, which is built here (zenoh takes
minutes the first time). It makes network namespaces, which needs root."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

from lines import Line

ROOT = Path(__file__).resolve().parents[2]


def measure(rounds: int) -> Iterator[Line]:
    """The lines, those over loopback first."""
    command = ["cargo", "build", "--release", "--quiet", "-p", "hosts", "--example", "bench", "--message-format=json"]
    messages = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    artifacts = [json.loads(message) for message in messages.splitlines()]
    program = next(a["executable"] for a in artifacts if a.get("target", {}).get("name") == "bench" and a.get("executable"))
    with subprocess.Popen([program, str(rounds)], stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        for text in running.stdout:
            yield Line(**json.loads(text))
    if running.returncode:
        yield Line("hosts", "not taken", note=f"the benchmark of hosts ended with {running.returncode}; network namespaces need root")
