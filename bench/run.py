# SPDX-License-Identifier: Apache-2.0
"""Benchmarks: one table of ratios, taken in one run, with the bars of DESIGN.md section 5. It fails if a bar is missed that is not
listed in `open_bars.py`.

    make bench                                     all of it, some minutes
    .venv/bin/python bench/run.py --quick          fewer rounds, to see that it works
    .venv/bin/python bench/run.py --only dispatch  one group, or several
    .venv/bin/python bench/run.py --json FILE      also as JSON

Everything is measured in turns (A B A B …) on the same core, at real-time priorities if permitted; the result is the median over the
rounds of the ratio in each. Other load shows in the figures: run it on a quiet machine.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import lines
import open_bars
from rows import (
    episodes,
    ethercat,
    fmus,
    hal,
    hosts,
    jitter,
    kernel,
    planned,
    policies,
    processes,
    python_blocks,
    queues,
    recording,
    remote,
    servos,
    verbs,
    virtual_clock,
)


@dataclass(frozen=True)
class Options:
    """Settings of a run."""

    rounds: int
    quick: bool


GROUPS: dict[str, Callable[[Options], Iterator[lines.Line]]] = {
    "dispatch": lambda options: kernel.measure("dispatch", options.rounds, 1 if options.quick else 5),
    "hal": lambda options: hal.measure(options.quick),
    "reader": lambda options: kernel.measure("reader", options.rounds),
    "transition": lambda options: kernel.measure("transition", options.rounds),
    "install": lambda options: kernel.measure("install", options.rounds),
    "plan": lambda options: planned.measure(options.quick),
    "crossing": lambda options: kernel.measure("crossing", options.rounds),
    "processes": lambda options: processes.measure(options.rounds),
    "jitter": lambda options: jitter.measure(options.rounds, options.quick),
    "verb": lambda options: verbs.measure(options.rounds, options.quick),
    "recording": lambda options: recording.measure(options.rounds, options.quick),
    "remote": lambda options: remote.measure(options.rounds, options.quick),
    "hosts": lambda options: hosts.measure(options.rounds),
    "ethercat": lambda options: ethercat.measure(options.rounds, options.quick),
    "servos": lambda options: servos.measure(options.rounds, options.quick),
    "python": lambda options: python_blocks.measure(options.rounds),
    "fmu": lambda options: fmus.measure(options.rounds),
    "virtual": lambda options: virtual_clock.measure(options.rounds),
    "episodes": lambda options: episodes.measure(options.rounds, options.quick),
    "policy": lambda options: policies.measure(options.rounds, options.quick),
    "queue": lambda options: queues.measure(options.quick),
}


def main() -> int:
    """Runs the groups; returns 0 if each was measured and every bar holds that is not marked as open (`open_bars.py`). With few rounds
    bars are not judged."""
    options = arguments()
    chosen = options.only or list(GROUPS)
    settings = Options(rounds=2 if options.quick else 7, quick=options.quick)
    print(machine())
    print(lines.heading())
    measured: list[lines.Line] = []
    failed: list[str] = []
    for group in chosen:
        before = ""
        try:
            for line in GROUPS[group](settings):
                line.open = open_bars.reason(line)
                print(lines.row(line, before), flush=True)
                before = line.row
                measured.append(line)
        except Exception:
            # The other groups are useful all the same.
            traceback.print_exc()
            failed.append(group)
    verdicts = [line.verdict for line in measured]
    held, missed, opened, without = (verdicts.count(verdict) for verdict in ("holds", "misses", "open", ""))
    print(f"\n{held} bars hold, {missed} are missed, {opened} are open, {without} rows have none or could not be taken")
    for line in measured:
        if line.verdict in ("misses", "open"):
            print(f"{line.verdict}: {line.row}, {line.what}: {line.shown} ({line.bar_text}){f': {line.open}' if line.open else ''}")
    if failed:
        print(f"could not be taken: {', '.join(failed)}")
    if options.json:
        report = {"machine": machine(), "lines": [line.as_dict() for line in measured]}
        Path(options.json).write_text(json.dumps(report, indent=1, ensure_ascii=False) + "\n")
    return 1 if failed or (missed and not options.quick) else 0


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds, to see that it works")
    parser.add_argument(
        "--only", action="append", choices=list(GROUPS), metavar="NAME", help=f"one of {', '.join(GROUPS)}; may be repeated"
    )
    parser.add_argument("--json", metavar="FILE", help="also write the lines to a file")
    return parser.parse_args()


def machine() -> str:
    """Returns one line about the machine."""
    cpu = next(
        (text.split(":")[1].strip() for text in Path("/proc/cpuinfo").read_text().splitlines() if text.startswith("model name")), "?"
    )
    rights = "real-time rights" if jitter.may_run_in_real_time() else "no real-time rights: ordinary priorities throughout"
    return f"{cpu}, {os.cpu_count()} cores, Linux {platform.release()}, load {os.getloadavg()[0]:.1f}, {rights}"


if __name__ == "__main__":
    sys.exit(main())
