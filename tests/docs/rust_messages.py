# SPDX-License-Identifier: Apache-2.0
"""Lint of messages in Rust and in C headers: `rust_messages.py` prints file, line and a better form for each turn of phrase that is not
English.

A message is a string literal outside tests: errors, refusals and their remedies, alarms, log lines, descriptions of options. Reasons of
`expect`, of assertions and of `allow` are for developers, and are not checked. Rules are word lists, as those of `words.py`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator

from words import ROOT, Finding

# A turn of phrase, and what may stand in its place.
PHRASES = {
    r"(?<!there )(is|are) no(?= (?!longer\b|more than\b))": "is not a …",
    r"(?<!there )(is|are|was|were) none": "is not a …, or is missing",
    r"(is|are) not there": "does not exist, is missing",
    r"(is|are) there (already|twice)": "already exists, appears twice",
    r"anew": "again; to start anew: to restart",
    r"look at": "check",
    r"mend": "fix",
    r"any more": "no longer",
    r"for ever": "forever, without limit",
    r"(is|are) asked for": "must be …, is expected",
    r"(for|after|within) so long": "for this time, after this time",
    r"(has|have) to be": "must be",
    r"takes no": "does not accept, cannot have",
    r"knows no": "does not have",
    r"greatest": "maximum",
    r"written over": "overwritten",
    r"as (long|often|far) as it (is|has)": "name the condition",
    r"behind (its|the) (end|last|first|safe|reading|opening)": "after, beyond",
    r"(an?|of) other one(s)?|another one than": "name the thing",
    r"for why": "for the reason",
    r"there is an? [^.;:]{1,40} already": "there is already a …",
    r"goes on under|goes on with(?!out)": "continues",
    r"(gets|takes|has) a \w+ of its own": "has its own …",
    r"(?<!not )say (which|where|what|at what|too)": "name …, give …",
}
RULES = [(re.compile(rf"(?<![\w-])({pattern})(?![\w-])"), better) for pattern, better in PHRASES.items()]

TOKEN = re.compile(
    r"""//[^\n]*|/\*.*?\*/|\br(#*)"(?P<raw>.*?)"\1|b?c?"(?P<text>(?:[^"\\]|\\.)*)"|b?'(?:[^'\\]|\\[^u]|\\u\{[0-9a-fA-F]+\}|\\x..)'""",
    re.DOTALL,
)
TEST = re.compile(r"#\[cfg\((?:all\()?test\b[^\]]*\]\s*(?:#\[[^\]]*\]\s*)*(?:pub(?:\([a-z]+\))? )?(?:mod|fn|impl|use|struct)[^;{]*([;{])")
# What stands before a literal that no user reads.
DEVELOPERS = re.compile(r"(expect|expect_err|assert\w*!|debug_assert\w*!|panic!|unreachable!|reason =|doc =)\W*[^;{}]*$")
# A tool of developers, and a program for tests.
APART = re.compile(r"/(tests|examples|benches)(/|\.rs)|/(simulator|fuzz-targets)/|_tests\.rs|/bin/stand_in\.rs|/any_bytes\.rs|/damaged\.rs")


def tests_of(text: str) -> list[tuple[int, int]]:
    """Returns the parts of a Rust source that are compiled only for tests."""
    found = []
    for start in TEST.finditer(text):
        depth, at = 0, start.end() - 1
        while start.group(1) == "{" and at < len(text):
            token = TOKEN.match(text, at)
            depth += {"{": 1, "}": -1}.get(text[at], 0) if token is None else 0
            at = at + 1 if token is None else token.end()
            if depth == 0:
                found.append((start.start(), at))
                break
    return found


def messages(text: str) -> Iterator[tuple[int, str]]:
    """Yields the offset and the content of each string literal that users may read."""
    tests = tests_of(text)
    for token in TOKEN.finditer(text):
        content = token.group("raw") or token.group("text")
        if content is None or " " not in content or any(begin <= token.start() < end for begin, end in tests):
            continue
        if DEVELOPERS.search(text[max(0, token.start() - 60) : token.start()]) is None:
            yield token.start(), re.sub(r"\\\n\s*", "", content)


def lint(path: str, text: str) -> list[Finding]:
    """Returns the faults of the messages of one source."""
    return [
        Finding(path, text.count("\n", 0, at) + 1, "message", content, better)
        for at, content in messages(text)
        for pattern, better in RULES
        if pattern.search(content)
    ]


def lint_all() -> list[Finding]:
    """Returns the faults of the messages of all crates."""
    sources = sorted(path for end in ("*.rs", "*.h") for path in (ROOT / "crates").rglob(end))
    named = [(path, path.relative_to(ROOT).as_posix()) for path in sources]
    return [finding for path, name in named if not APART.search(f"/{name}") for finding in lint(name, path.read_text())]


if __name__ == "__main__":
    found = lint_all()
    print(*found, f"{len(found)} findings", sep="\n")
    sys.exit(bool(found))
