# SPDX-License-Identifier: Apache-2.0
"""The application in a process of its own, which a campaign kills. It writes a line `count N` whenever its count has changed.

python victim.py JSON: `blocks`, `doomed`, `plant` (its name); `url` and `policies` if the system is a daemon's.
"""

from __future__ import annotations

import json
import logging
import sys
from typing import Any

import application
import opengpac as gpac
from plant import Plant


def main(told: dict[str, Any]) -> None:
    """Runs until it is killed."""
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    opened = gpac.connect(told["url"], name="victim", progress=False) if "url" in told else gpac.System("campaign", progress=False)
    with opened as cell:
        plant, policies = Plant(told["plant"]), told.get("policies", {})
        made = application.run(cell, told["blocks"], "counts", at=0, doomed=told["doomed"], plant=plant, policies=policies)
        while True:
            try:
                made.healthy.wait(timeout="2 ms")
            except TimeoutError:
                print("count", made.count.value, flush=True)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
