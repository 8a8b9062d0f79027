# SPDX-License-Identifier: Apache-2.0
"""The application in a process of its own, which a campaign kills. It writes a line `count N` whenever it has moved on."""

from __future__ import annotations

import json
import sys

import application
import opengpac as gpac


def main(blocks: str, doomed: str) -> None:
    """Runs until it is killed."""
    with gpac.System("campaign", progress=False) as cell:
        made = application.run(cell, blocks, "counts", at=0, doomed=json.loads(doomed))
        while True:
            try:
                made.healthy.wait(timeout="2 ms")
            except TimeoutError:
                print("count", made.count.value, flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
