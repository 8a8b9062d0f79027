# SPDX-License-Identifier: Apache-2.0
"""A fault campaign: breaks a running application in every way that it must survive, and accounts for what followed.

    python tests/faults/campaign.py                       all kinds, as often as they must be shown
    python tests/faults/campaign.py --bounded             a few of each, as the tests do
    python tests/faults/campaign.py --only segfault --seed 7

It writes a table and `out/faults.json`, and fails if anything did not hold.
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
from dataclasses import asdict
from pathlib import Path

import leftovers
from kinds import KINDS, Kind, Round
from opengpac import _native

HERE = Path(__file__).parent
OUT = HERE.parent.parent / "out" / "faults.json"


def rounds_of(kind: Kind, count: int, seed: int, blocks: str) -> list[Round]:
    """That many faults of a kind; a seed and a round make the same fault again."""
    return [kind.make(random.Random(f"{seed} {kind.name} {number}"), blocks) for number in range(count)]


def built(folder: str) -> str:
    """The module of the blocks that fail."""
    return _native.build([str(HERE / "blocks.c")], str(Path(folder) / "faulty.so"))


def milliseconds(times: list[float]) -> str:
    """Median and 99th percentile, in words."""
    if not times:
        return "—"
    ordered = sorted(times)
    return f"{statistics.median(ordered) * 1e3:.1f} / {ordered[min(len(ordered) - 1, int(0.99 * len(ordered)))] * 1e3:.1f} ms"


def table(found: dict[str, list[Round]]) -> str:
    """What every kind led to, one line each."""
    lines = [f"{'fault':34}{'rounds':>8}{'all held':>10}   {'end report, median / p99':28}safe outputs, median / p99"]
    for name, rounds in found.items():
        held = sum(not one.wrong for one in rounds)
        reported = milliseconds([one.reported_s for one in rounds if one.reported_s is not None])
        safe = milliseconds([one.safe_s for one in rounds if one.safe_s is not None])
        lines.append(f"{name:34}{len(rounds):8}{held:10}   {reported:28}{safe}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description="Breaks a running application in every way that it must survive.")
    parser.add_argument("--bounded", action="store_true", help="a few faults of each kind")
    parser.add_argument("--only", default="", help="kinds whose name contains this")
    parser.add_argument("--seed", type=int, default=1, help="which instants are chosen")
    options = parser.parse_args()
    leftovers.enter_alone([str(Path(__file__).resolve()), *sys.argv[1:]])
    logging.getLogger("opengpac").setLevel(logging.ERROR)
    found: dict[str, list[Round]] = {}
    with tempfile.TemporaryDirectory() as folder:
        blocks = built(folder)
        for kind in KINDS.values():
            if options.only in kind.name:
                found[kind.name] = rounds_of(kind, kind.bounded if options.bounded else kind.full, options.seed, blocks)
                print(f"{kind.name}: {len(found[kind.name])} rounds", file=sys.stderr, flush=True)
    print(table(found))
    alone = bool(os.environ.get(leftovers.ALONE))
    print("Processes and shared memory were counted", "in namespaces of their own." if alone else "among those of this machine.")
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps({name: [asdict(one) for one in rounds] for name, rounds in found.items()}, indent=1) + "\n")
    wrong = [(name, number, text) for name, rounds in found.items() for number, one in enumerate(rounds) for text in one.wrong]
    for name, number, text in wrong:
        print(f"{name}, round {number}: {text}")
    return 1 if wrong or not found else 0


if __name__ == "__main__":
    sys.exit(main())
