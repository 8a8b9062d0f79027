# SPDX-License-Identifier: Apache-2.0
"""Summary at the end of `make test`: the times of its strands and longest tests, each runner's counts, and for each failure its name and
the end of its output. A picture of the strands is in out/strands.svg.

python tests/closing.py out/rust.log out/pytest.log out/beside.log
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

LINES_MAX = 40
"""Maximum number of lines shown of one failure: its last ones."""

COUNTED = re.compile(r"test result: \w+\. (\d+) passed; (\d+) failed")
CARGO_BLOCK = re.compile(r"^---- (.+) stdout ----\n(.*?)(?=^---- .+ stdout ----$|^failures:$|^test result:)", re.DOTALL | re.MULTILINE)
PYTEST_BLOCK = re.compile(r"^_{3,} (.+?) _{3,}\n(.*?)(?=^_{3,} .+? _{3,}$|^={3,} )", re.DOTALL | re.MULTILINE)
PYTEST_NAMED = re.compile(r"^(?:FAILED|ERROR) (?:.*?::|[^ ]+$).*", re.MULTILINE)
PYTEST_ENDS = re.compile(r"^=* ?(\d+ (?:passed|failed|errors?)\b.* in [\d.]+s.*?)=*$", re.MULTILINE)
LONGEST = 10
"""Number of tests listed by duration, and by processor time."""
COLOURS = re.compile(r"\x1b\[[0-9;]*m")


def closing(text: str) -> Iterator[str]:
    """Yields the summary of one log, line by line."""
    text = COLOURS.sub("", text)
    for pattern in (CARGO_BLOCK, PYTEST_BLOCK):
        for name, output in pattern.findall(text):
            lines = output.strip().splitlines()
            yield f"---- {name}"
            yield from lines[-LINES_MAX:]
    yield from dict.fromkeys(PYTEST_NAMED.findall(text))
    if counts := COUNTED.findall(text):
        yield f"{sum(int(passed) for passed, _ in counts)} passed; {sum(int(failed) for _, failed in counts)} failed"
    yield from (line.strip() for line in PYTEST_ENDS.findall(text))


def longest(notes: list[dict[str, Any]], key: str) -> Iterator[str]:
    """Yields the tests with the longest `lasted_s` or `processor_s`, longest first, with these seconds."""
    for note in sorted(notes, key=lambda note: -note[key])[:LONGEST]:
        yield f"{note[key]:7.1f} s  {note['test']}"


def noted(file: Path) -> list[dict[str, Any]]:
    """Returns the entries of a JSON Lines file; none if there is no file."""
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def strands(notes: list[dict[str, Any]]) -> Iterator[str]:
    """Yields the start and end of each strand, in seconds of the run, and its processor time, in the order of the starts."""
    first = min((note["began"] for note in notes), default=0.0)
    for note in sorted(notes, key=lambda note: note["began"]):
        began, ended = note["began"] - first, note["ended"] - first
        failed = "" if note["status"] == 0 else "  failed"
        yield f"{began:7.0f} to {ended:5.0f} s  {note['processor_s']:6.0f} s of processor time  {note['strand']}{failed}"
    if notes:
        lasted, used = max(note["ended"] for note in notes) - first, sum(note["processor_s"] for note in notes)
        yield f"{lasted:15.0f} s  {used:6.0f} s of processor time  in all"


def draw(notes: list[dict[str, Any]], picture: Path) -> None:
    """Draws the strands as bars along the time of the run; does nothing without the package matplotlib."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return
    first = min(note["began"] for note in notes)
    names = list(dict.fromkeys(note["strand"] for note in sorted(notes, key=lambda note: note["began"])))
    figure = Figure(figsize=(10, 0.6 + 0.3 * len(names)), layout="constrained")
    axes = figure.add_subplot()
    for note in notes:
        lasted = note["ended"] - note["began"]
        busy = min(1.0, note["processor_s"] / lasted) if lasted else 0.0
        axes.barh(note["strand"], lasted, left=note["began"] - first, color="#c8d0d8")
        axes.barh(
            note["strand"], lasted * busy, left=note["began"] - first, height=0.3, color="#30506e" if note["status"] == 0 else "#b03030"
        )
    axes.invert_yaxis()
    axes.set_xlabel("s; dark: processor time, of one processor (red: failed)")
    figure.savefig(picture)


def main() -> None:
    """Prints the summary; reports missing logs."""
    out = Path(__file__).parent.parent / "out"
    if notes := noted(out / "strands.jsonl"):
        draw(notes, out / "strands.svg")
        print("==== strands (out/strands.svg)", *strands(notes), sep="\n")
    if tests := noted(out / "tests.jsonl"):
        print("==== longest tests", *longest(tests, "lasted_s"), sep="\n")
        print("==== tests that took the most processor time (out/tests.jsonl)", *longest(tests, "processor_s"), sep="\n")
        alone = [note["lasted_s"] for note in tests if note["alone"]]
        print(f"Tests that must run alone came last: {len(alone)} in {sum(alone):.0f} s.")
    for log in map(Path, sys.argv[1:]):
        print(f"==== {log.name}")
        print("\n".join(closing(log.read_text(errors="replace"))) if log.exists() else "it was not made")


if __name__ == "__main__":
    main()
