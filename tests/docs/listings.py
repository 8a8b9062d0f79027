# SPDX-License-Identifier: Apache-2.0
"""Listings of a Markdown page, and their execution.

The Python listings of a page are one program, in order, under the virtual clock, in a folder of its own. A comment in the line before
a fence says more, `<!-- program; file: first.py -->`:

    program              a new program begins: no names, no systems
    file: lowpass.c      the listing is written into the folder as that file; equal to the repository's if it exists there
    output               what the listings before it have printed since the last output; `…` stands for any text
    raises: CoverError   the listing raises that; the exception counts as printed
    pytest               the listing is a file of tests, and they pass
    run                  the lines `$ opengpac …` are run, and must print the lines below them
    daemon               from here a real-time system is a daemon, with the virtual clock and the socket `cell.sock` in the folder
    prose                it is not run

A C listing is compiled; a Rust listing is the `src/lib.rs` of `examples/rust-module` and is built with cargo, offline.
"""

from __future__ import annotations

import contextlib
import io
import linecache
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from opengpac.system import open_systems

ROOT = Path(__file__).parent.parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "docs" / "drivers").glob("*.md"))]
_FENCE = re.compile(r"(?:<!-- (?P<words>[^>]*?) -->\n)?^```(?P<language>\w+)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Listing:
    """Fenced block: its language, its text, the line of its first line in the page, and the options in the comment before it."""

    page: Path
    line: int
    language: str
    text: str
    words: Mapping[str, str]

    @property
    def file(self) -> str:
        """Name of the listing's file in its folder."""
        return Path(self.words.get("file", "program.py" if self.language == "python" else f"listing_{self.line}.{self.language}")).name

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"


def listings(page: Path) -> Iterator[Listing]:
    """Yields every listing of a page, in order."""
    text = page.read_text()
    for found in _FENCE.finditer(text):
        words = (word.strip().partition(":") for word in (found["words"] or "").split(";") if word.strip())
        line = text.count("\n", 0, found.start("text")) + 1
        yield Listing(page, line, found["language"], found["text"], {name: value.strip() for name, _, value in words})


class Program:
    """Python listings of a page, run in one namespace, and their output."""

    def __init__(self) -> None:
        self.names: dict[str, Any] = {}
        self.printed = ""

    def run(self, listing: Listing) -> None:
        """Runs one listing; messages refer to its file, or to `program.py`, with the line numbers of the listing itself."""
        if "program" in listing.words:
            self.close()
        self.names.setdefault("__name__", "__main__")
        # As in a notebook: code that reads the source of a function finds it.
        linecache.cache[listing.file] = (len(listing.text), None, listing.text.splitlines(keepends=True), listing.file)
        code = compile(listing.text, listing.file, "exec")
        raises = listing.words.get("raises")
        with contextlib.redirect_stdout(io.StringIO()) as out:
            try:
                exec(code, self.names)
            except Exception as error:
                if type(error).__name__ != raises:
                    error.add_note(f"in the listing at {listing}")
                    raise
                print(f"{raises}: {error}")
            else:
                assert raises is None, f"the listing at {listing} does not raise {raises}"
        self.printed += out.getvalue()

    def close(self) -> None:
        """Ends the program, as a process does at its exit."""
        self.names = {}
        for made in open_systems.systems():
            made.close()

    def check(self, listing: Listing) -> None:
        """Compares an output listing with the text printed since the last one."""
        printed, self.printed = self.printed, ""
        assert_prints(listing, listing.text, printed)


def assert_prints(listing: Listing, expected: str, printed: str) -> None:
    """Asserts that `printed` is the text shown in a page, where `…` stands for any text within a line, and a line of it for any lines."""
    pattern = "".join(
        ".*?" if part == "\n…\n" else "[^\n]*" if part == "…" else re.escape(part)
        for part in re.split(r"(\n…\n|…)", "\n".join(line.rstrip() for line in expected.strip().splitlines()))
    )
    given = "\n".join(line.rstrip() for line in printed.strip().splitlines())
    assert re.fullmatch(pattern, given, re.DOTALL), f"{listing} shows\n{expected}\nbut the program prints\n{given}"
