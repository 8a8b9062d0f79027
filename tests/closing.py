# SPDX-License-Identifier: Apache-2.0
"""The last words of `make test`: what each runner counted, and of what failed its name and the end of its output.

python tests/closing.py out/rust.log out/pytest.log out/beside.log
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

LINES_MAX = 40
"""Lines shown of one failure: its last ones."""

COUNTED = re.compile(r"test result: \w+\. (\d+) passed; (\d+) failed")
CARGO_BLOCK = re.compile(r"^---- (.+) stdout ----\n(.*?)(?=^---- .+ stdout ----$|^failures:$|^test result:)", re.DOTALL | re.MULTILINE)
PYTEST_BLOCK = re.compile(r"^_{3,} (.+?) _{3,}\n(.*?)(?=^_{3,} .+? _{3,}$|^={3,} )", re.DOTALL | re.MULTILINE)
PYTEST_NAMED = re.compile(r"^(?:FAILED|ERROR) (?:.*?::|[^ ]+$).*", re.MULTILINE)
PYTEST_ENDS = re.compile(r"^=* ?(\d+ (?:passed|failed|errors?)\b.* in [\d.]+s.*?)=*$", re.MULTILINE)
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


def main() -> None:
    """The command; a log that is not there says so."""
    for log in map(Path, sys.argv[1:]):
        print(f"==== {log.name}")
        print("\n".join(closing(log.read_text(errors="replace"))) if log.exists() else "it was not made")


if __name__ == "__main__":
    main()
