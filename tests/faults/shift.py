# SPDX-License-Identifier: Apache-2.0
"""Long shift: after 10,000 motions of a simulated arm memory is level, and the last start costs as much as the first.

    python tests/faults/shift.py                   10,000 motions
    python tests/faults/shift.py --motions 600     fewer

Each motion is a verb instance that is created, writes the joints' histories, and is deleted. The processor time of a start and the
resident memory are reported every tenth of the shift, and are in `out/shift.json`. It fails if memory grows by more than 16 MB after
the first tenth (in which log, end reports and alarms fill up to their bounds), or if a start in the last tenth costs more than twice
one in the first.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

import opengpac as gpac

OUT = Path(__file__).parent.parent.parent / "out" / "shift.json"
GROWTH_MB_MAX = 16.0
SLOWER_MAX = 2.0
REACH_RAD = 0.02


def resident_mb() -> float:
    """Returns the resident memory of this process."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1000.0


def tenth(arm: gpac.Group[gpac.robots.Joint], home: np.ndarray, rng: np.random.Generator, motions: int) -> dict[str, float]:
    """Runs `motions` motions; returns the mean processor time of a start, and the memory after them."""
    starting_s = 0.0
    for _ in range(motions):
        instance = gpac.robots.move.new_instance(arm)
        begun = time.process_time()
        instance.start(list(home + rng.uniform(-REACH_RAD, REACH_RAD, len(home))))
        starting_s += time.process_time() - begun
        instance.wait()
        instance.delete()
    return {"start_ms": starting_s / motions * 1e3, "resident_mb": resident_mb()}


def main() -> int:
    """Runs the shift; returns 0 if it ends as it began."""
    parser = argparse.ArgumentParser(description="Moves a simulated arm for a whole shift, and looks whether anything grows.")
    parser.add_argument("--motions", type=int, default=10_000)
    options = parser.parse_args()
    arm = gpac.robots.load("ur5e", clock="virtual").enable()
    home, rng = np.array(arm.values("home")), np.random.default_rng(0)
    tenths = []
    for number in range(1, 11):
        tenths.append(tenth(arm, home, rng, max(1, options.motions // 10)))
        print(f"{number} of 10: a start {tenths[-1]['start_ms']:.2f} ms, {tenths[-1]['resident_mb']:.0f} MB", flush=True)
    first, last = tenths[0], tenths[-1]
    grown_mb, slower = last["resident_mb"] - first["resident_mb"], last["start_ms"] / first["start_ms"]
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps({"motions": options.motions, "tenths": tenths}))
    print(f"{options.motions} motions: memory grew by {grown_mb:.1f} MB, a start costs {slower:.2f} times what it did")
    return int(grown_mb > GROWTH_MB_MAX or slower > SLOWER_MAX)


if __name__ == "__main__":
    sys.exit(main())
