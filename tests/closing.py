# SPDX-License-Identifier: Apache-2.0
"""The last words of `make test`: how long its strands and its longest tests took, what each runner counted, and of what failed its
name and the end of its output. A picture of the strands is in out/strands.svg.

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
"""Lines shown of one failure: its last ones."""

COUNTED = re.compile(r"test result: \w+\. (\d+) passed; (\d+) failed")
CARGO_BLOCK = re.compile(r"^---- (.+) stdout ----\n(.*?)(?=^---- .+ stdout ----$|^failures:$|^test result:)", re.DOTALL | re.MULTILINE)
PYTEST_BLOCK = re.compile(r"^_{3,} (.+?) _{3,}\n(.*?)(?=^_{3,} .+? _{3,}$|^={3,} )", re.DOTALL | re.MULTILINE)
PYTEST_NAMED = re.compile(r"^(?:FAILED|ERROR) (?:.*?::|[^ ]+$).*", re.MULTILINE)
PYTEST_ENDS = re.compile(r"^=* ?(\d+ (?:passed|failed|errors?)\b.* in [\d.]+s.*?)=*$", re.MULTILINE)
PYTEST_LASTED = re.compile(r"^ *([\d.]+)s (?:call|setup|teardown) +(\S.*?) *$", re.MULTILINE)
LONGEST = 10
"""Number of tests that are named for their length."""
COLOURS = re.compile(r"\x1b\[[0-9;]*m")


def closing(text: str) -> Iterator[str]:
    """What one log says at its end, line by line."""
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


def longest(text: str) -> Iterator[str]:
    """The longest tests of a log of pytest, longest first, with their seconds."""
    lasted = sorted(((float(s), name) for s, name in PYTEST_LASTED.findall(COLOURS.sub("", text))), reverse=True)
    yield from (f"{s:7.1f} s  {name}" for s, name in lasted[:LONGEST])


def noted(file: Path) -> list[dict[str, Any]]:
    """The lines of a file of JSON lines; none where there is no file."""
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def strands(notes: list[dict[str, Any]]) -> Iterator[str]:
    """When each strand began and ended, in seconds of the run, and the processor time that it took, in the order of their beginnings."""
    first = min((note["began"] for note in notes), default=0.0)
    for note in sorted(notes, key=lambda note: note["began"]):
        began, ended = note["began"] - first, note["ended"] - first
        failed = "" if note["status"] == 0 else "  failed"
        yield f"{began:7.0f} to {ended:5.0f} s  {note['processor_s']:6.0f} s of processor time  {note['strand']}{failed}"
    if notes:
        lasted, used = max(note["ended"] for note in notes) - first, sum(note["processor_s"] for note in notes)
        yield f"{lasted:15.0f} s  {used:6.0f} s of processor time  in all"


def draw(notes: list[dict[str, Any]], picture: Path) -> None:
    """Draws the strands as bars along the time of the run; nothing without the package matplotlib."""
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
    """The command; a log that is not there says so."""
    out = Path(__file__).parent.parent / "out"
    if notes := noted(out / "strands.jsonl"):
        draw(notes, out / "strands.svg")
        print("==== strands (out/strands.svg)", *strands(notes), sep="\n")
    waited = sum(note["waited_s"] for note in noted(out / "turns.jsonl"))
    pytest_log = out / "pytest.log"
    if pytest_log.exists() and (lines := [*longest(pytest_log.read_text(errors="replace"))]):
        print("==== longest tests", *lines, sep="\n")
        print(f"Its processes waited {waited:.0f} s in all for tests that have to be alone.")
    for log in map(Path, sys.argv[1:]):
        print(f"==== {log.name}")
        print("\n".join(closing(log.read_text(errors="replace"))) if log.exists() else "it was not made")


if __name__ == "__main__":
    main()
