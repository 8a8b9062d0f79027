# SPDX-License-Identifier: Apache-2.0
"""A fault campaign: breaks a running application in every way that it must survive, and accounts for the consequences.

    python tests/faults/campaign.py                       all kinds, as often as they must be shown
    python tests/faults/campaign.py --bounded             a few of each, as the tests do
    python tests/faults/campaign.py --only segfault --seed 7

It writes a table and `out/campaign.json`, and fails if a requirement did not hold. Ctrl-C ends it with the results so far.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import random
import statistics
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import leftovers
from kinds import KINDS
from opengpac import _native
from rounds import Kind, Round

HERE = Path(__file__).parent
OUT = HERE.parent.parent / "out" / "campaign.json"

Found = dict[str, list[Round]]
"""Rounds of each kind, by its name."""


def rounds_of(kind: Kind, count: int, seed: int, blocks: str) -> Iterator[Round]:
    """Makes `count` faults of a kind, one after the other; the same seed and round make the same fault."""
    return (kind.make(random.Random(f"{seed} {kind.name} {number}"), blocks) for number in range(count))


def built(folder: str) -> str:
    """Builds the module of failing blocks."""
    return _native.build([str(HERE / "blocks.c")], str(Path(folder) / "faulty.so"))


def spread(times: Iterable[float | None]) -> dict[str, float] | None:
    """Returns the median and 99th percentile, ms; `None` if nothing was measured."""
    ordered = sorted(time for time in times if time is not None)
    if not ordered:
        return None
    return {"median_ms": statistics.median(ordered) * 1e3, "p99_ms": ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))] * 1e3}


def summary(rounds: list[Round]) -> dict[str, Any]:
    """Returns the consequences of a kind."""
    return {
        "rounds": len(rounds),
        "held": sum(not one.wrong for one in rounds),
        "end_report": spread(one.reported_s for one in rounds),
        "safe_outputs": spread(one.safe_s for one in rounds),
    }


def table(found: Found) -> str:
    """Returns the consequences of every kind, one line each."""

    def words(of: dict[str, float] | None) -> str:
        return "—" if of is None else f"{of['median_ms']:.1f} / {of['p99_ms']:.1f} ms"

    lines = [f"{'fault':38}{'rounds':>8}{'all held':>10}   {'end report, median / p99':28}safe outputs, median / p99"]
    for name, rounds in found.items():
        led = summary(rounds)
        lines.append(f"{name:38}{led['rounds']:8}{led['held']:10}   {words(led['end_report']):28}{words(led['safe_outputs'])}")
    return "\n".join(lines)


def written(found: Found) -> None:
    """Writes the report."""
    OUT.parent.mkdir(exist_ok=True)
    report = {name: {**summary(rounds), "each": [asdict(one) for one in rounds]} for name, rounds in found.items()}
    OUT.write_text(json.dumps(report, indent=1) + "\n")


def break_it(options: argparse.Namespace, found: Found) -> None:
    """Makes all the faults; `found` contains the consequences of each as soon as they are known."""
    kinds = [kind for kind in KINDS.values() if options.only in kind.name]
    with tempfile.TemporaryDirectory() as folder:
        blocks = built(folder)
        for kind in kinds:
            count, begin = kind.bounded if options.bounded else kind.full, time.monotonic()
            rounds = found.setdefault(kind.name, [])
            for one in rounds_of(kind, count, options.seed, blocks):
                rounds.append(one)
                wrong = sum(bool(each.wrong) for each in rounds)
                told = f"{kind.name}: {len(rounds)} of {count}, {wrong} did not hold, {time.monotonic() - begin:.0f} s"
                print(f"\r{told}", end="", file=sys.stderr, flush=True)
                for text in one.wrong:
                    print(f"\n{kind.name}, round {len(rounds) - 1}: {text}", file=sys.stderr, flush=True)
            print(file=sys.stderr)
            written(found)


def main() -> int:
    parser = argparse.ArgumentParser(description="Breaks a running application in every way that it must survive.")
    parser.add_argument("--bounded", action="store_true", help="a few faults of each kind")
    parser.add_argument("--only", default="", help="kinds whose name contains this")
    parser.add_argument("--seed", type=int, default=1, help="which instants are chosen")
    options = parser.parse_args()
    leftovers.enter_alone([str(Path(__file__).resolve()), *sys.argv[1:]])
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    found: Found = {}
    is_whole = True
    try:
        break_it(options, found)
    except KeyboardInterrupt:
        is_whole = False
        print("\ninterrupted: this is what was found so far", file=sys.stderr)
    written(found)
    print(table(found))
    alone = bool(os.environ.get(leftovers.ALONE))
    print("Processes and shared memory were counted", "in namespaces of their own." if alone else "among those of this machine.")
    wrong = [(name, number, text) for name, rounds in found.items() for number, one in enumerate(rounds) for text in one.wrong]
    for name, number, text in wrong:
        print(f"{name}, round {number}: {text}")
    return 130 if not is_whole else 1 if wrong or not found else 0


if __name__ == "__main__":
    sys.exit(main())
