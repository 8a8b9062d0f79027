# SPDX-License-Identifier: Apache-2.0
"""Lint of the project's English: `words.py [room …]` prints file, line and a better form for each finding in doc comments and messages.

A room is a crate, `python` (the package) or `studio` (the page). Rules are word lists, so that the check takes a second and needs no model
of the language: openings that stand for a noun, sentences without a verb, words that the field has a better one for, and types that are
bare participles. Messages are the texts in the code of the package and the page: exceptions, output of commands, labels.
"""

# ruff: noqa: SIM905 (a list of words is read as a text)
from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]

# Opening words of a relative clause that stands for a noun, and how the sentence may begin instead.
OPENINGS = {
    r"what": 'name the thing: "Content of …", "State of …"; a function: "Returns the …"',
    r"how (many|often)": '"Number of …"; a function: "Returns the number of …"',
    r"how long": '"Duration of …" or "Time limit for …"',
    r"how (old)": '"Age of …"',
    r"how (far|much|fast|large|big)": '"Distance", "Amount", "Speed", "Size of …"',
    r"how": 'name it: "Way", "Mode", "Form", "State of …"; a function: the verb that it does',
    r"where(?! .*, )": '"Location", "Path", "Offset", "Position of …"; a function: "Returns the …"',
    r"whether": 'a value: "True if …"; a function: "Returns whether …"',
    r"(who|whom|whose)": 'name the subject: "Client that …", "Owner of …"',
    r"which": 'name the thing: "Index of …", "Set of …"; a function: "Returns the …"',
    r"why": '"Reason for …", "Cause of …"',
    r"when(?! .*, )": '"Time of …", "Time at which …"',
    r"that(?= (is|was|are|were|one|of|which|it|there|much|many|no|a|an|the)\b)|that(?=\.)": "name the thing that is meant",
    r"(one|another|others?|ones)(?= (that|who|which|in|one|of them)\b|[.:,])": "name the thing that is counted",
    r"from now on(?=\.)": "say what begins",
    r"by (itself|themselves)(?=[.,])": "say what it does",
}
OPENING = [(re.compile(rf"{pattern}\b(?!-)", re.IGNORECASE), better) for pattern, better in OPENINGS.items()]

# Words that the field has a better one for.
BANNED = {
    r"greatest": "maximum",
    r"afar": "remote",
    r"for ever": "forever, indefinitely",
    r"from now on": "say what begins: starts recording, is expected in each cycle",
    r"any more": "no longer",
    r"whoever": "name the subject",
    r"anew": "again",
    r"errands?": "request, service call",
    r"(?<!time )(?<!code )stretch(es)?(?! (goal|of time))": "segment",
    r"an? (one|other one) (that|who|which)": "name the thing",
    r"begins? again|comes? again": "restarts, recurs, retries",
    r"(that|which) (is|are|was|were) there": "existing, present, connected",
    r"looks? whether": "checks whether",
    r"hangs? (on|at)": "is attached to",
    r"(none|nothing|null) where": "None if",
    r"is over": "has ended, has elapsed",
    r"thereof|therein|whereof|wherein|hereby|hither|thither": "say it in plain words",
}
WORDS = [(re.compile(rf"\b({pattern})\b", re.IGNORECASE), better) for pattern, better in BANNED.items()]

# Turns of phrase in messages that an engineer of the field would not use.
MESSAGES = {
    r"(?<!there )(is|are|was|were) no (?!longer|more\b|sooner)": '"is not a …", "does not exist"',
    r"(is|are|was|were) none(?! of)": '"is not one", or say what it is',
    r"looks? at": "check, view",
    r"mend(s|ed)?": "fix",
    r"anew": "again",
    r"of (its|your|their|his) own\b": "separate, its own",
    r"(knows|takes|tells|serves) no": '"does not know a …", "does not accept a …"',
    r"(is|are|was|were|be) (told|heard)": "reported, received",
    r"(is|are) given": '"must be …, not …"',
    r"(has|have) to be|(is|are) to be": "must be",
    r"(is|are) not known": "is unknown",
    r"(goes|go) on": "continue, resume, keep running",
    r"for ever\b": "forever",
    r"way-points?": "waypoint",
    r"said of": "name the entries",
    r"(which|that) ('[^']*'|\{\}|it|FMI 2) has not": '"which … does not have"',
    r"(stands?|lies?) (there|here|behind|beside)": "is shown, follows, is next to",
}
PHRASES = [(re.compile(rf"\b({pattern})", re.IGNORECASE), better) for pattern, better in MESSAGES.items()]
# Texts in other languages, and one that quotes a controller.
OTHER_TEXTS = re.compile(r"\n.*\n|^<|^[#./]|[;{]$|Cannot unlock protective stop", re.DOTALL)

# Finite verbs that do not end in s or ed, and enough of the base forms that follow a plural or "to".
VERBS = frozenset(
    "am are be been can cannot could did do may might must need ought shall should will would had have let were "
    "began brought built came caught chose cost drew fell felt found gave got grew held kept knew lay led left lent lost made meant met "
    "paid put ran rang read rose said sat saw sent set shut slept sold spent split spoke stood stuck swung taught thought threw told "
    "took went won wore wrote won't don't can't doesn't isn't aren't didn't i.e "
    "add allow answer apply ask become begin belong bring call carry change check close come command compare contain convert copy count "
    "create cut decide delete depend describe drop end enter equal fail fall follow form get give go grow hold join keep know last lead "
    "leave lie live look lose make mean meet move name note open own pass pause point prefer press print publish push raise reach refer "
    "refuse remain report rest return ring run say see send serve share show sleep stand start stay stop store take tell think throw "
    "touch try turn use wait want work write".split()
)
# Notes that stand behind a sentence as they are.
NOTES = re.compile(r"Idempotent\.|Real-time safe\.|(Not on|Not for|Off) the real-time path\.")
PARTICIPLES = frozenset(
    "told held seen kept given sent lent made known found left heard gone done taken drawn written shown thrown lost met paid put read "
    "understood begun borne broken brought built bought caught chosen fallen felt forgotten got grown hidden hung laid led meant ridden "
    "risen said shut spoken spent split stood struck sworn thought won worn standing leaving waiting running going coming".split()
)
NOUNS = frozenset("seed speed feed need bed shed reed embed weed breed bleed".split())


@dataclass(frozen=True)
class Finding:
    """One fault of a text, where it is, and what may stand there instead."""

    path: str
    line: int
    rule: str
    text: str
    better: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.rule}: {self.text!r}; better: {self.better}"


@dataclass(frozen=True)
class Doc:
    """A doc comment: its line, its text in one line, and the line of code that it describes."""

    path: str
    line: int
    text: str
    item: str


def sentences(text: str) -> list[str]:
    """Splits a text where a sentence ends and a capital follows; code, lists and headings end it."""
    prose = re.split(r"\n\s*\n|```|\n\s*[-*#|]|\n\s*\d+\. ", text)[0]
    prose = re.sub(r"\s+", " ", prose).strip()
    return [part for part in re.split(r"(?<=[.;!?])\s+(?=[A-Z\"'`])", prose) if part]


def has_verb(sentence: str) -> bool:
    """Returns whether any word of a sentence may be a finite verb; a name in backticks may stand for one."""
    words = re.findall(r"[A-Za-z][A-Za-z.']*[A-Za-z]|\w", re.sub(r"`[^`]*`", "x", sentence))
    return any(w.lower() in VERBS or re.search(r"[a-rt-z]s$|ed$|'s$", w.lower()) for w in words)


def judge(doc: Doc) -> Iterator[Finding]:
    """Yields the faults of one doc comment."""
    parts = sentences(doc.text)
    bare = re.sub(r"`[^`]*`", "", doc.text)
    for at, sentence in enumerate(parts):
        if at == 0:
            opening = next((better for pattern, better in OPENING if pattern.match(sentence)), None)
            if opening is not None:
                yield Finding(doc.path, doc.line, "opening", sentence, opening)
                bare = bare.partition(".")[2]
        elif NOTES.fullmatch(sentence) is None and sentence.endswith(".") and re.match(r"[A-Z][a-z]", sentence) and not has_verb(sentence):
            yield Finding(doc.path, doc.line, "no verb", sentence, "write a sentence with subject and verb, or leave it out")
    for pattern, better in WORDS:
        if found := pattern.search(bare):
            yield Finding(doc.path, doc.line, "word", found.group(), better)


def judge_message(message: Doc) -> Iterator[Finding]:
    """Yields the faults of one message."""
    if OTHER_TEXTS.search(message.text) is None:
        for pattern, better in PHRASES:
            if found := pattern.search(message.text):
                yield Finding(message.path, message.line, "message", found.group(), better)


def is_participle(name: str) -> bool:
    """Returns whether a type's name is a bare participle: one capitalised word such as `Told` or `Shared`."""
    word = name.lower()
    one = re.fullmatch(r"[A-Z][a-z]+", name) is not None
    return one and (word in PARTICIPLES or (word.endswith("ed") and word not in NOUNS))


RUST_TYPE = re.compile(r"^\s*(?:pub(?:\([a-z ]+\))? )?(?:struct|enum|trait|type|union) (\w+)", re.MULTILINE)
PYTHON_TYPE = re.compile(r"^\s*class (\w+)", re.MULTILINE)
STUDIO_TYPE = re.compile(r"^\s*(?:export )?(?:abstract )?(?:class|interface|type|enum) (\w+)", re.MULTILINE)


def rust_docs(path: str, text: str) -> Iterator[Doc]:
    """Yields the doc comments of a Rust source, those of private items too."""
    block: list[str] = []
    begin = 0
    lines = text.splitlines()
    for number, line in enumerate([*lines, ""], 1):
        if found := re.match(r"\s*//(/|!)(?!/) ?(.*)", line):
            begin = begin if block else number
            block.append(found.group(2))
        elif block:
            code = next((after.strip() for after in lines[number - 1 :] if after.strip() and not after.strip().startswith("#[")), "")
            yield Doc(path, begin, "\n".join(block), code)
            block = []


def python_docs(path: str, text: str) -> Iterator[Doc]:
    """Yields the docstrings of a Python source and the `#:` or bare comments above its constants."""
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str):
                code = "" if isinstance(node, ast.Module) else lines[node.lineno - 1].strip()
                yield Doc(path, first.lineno, first.value.value, code)


def studio_docs(path: str, text: str) -> Iterator[Doc]:
    """Yields the `/** … */` comments of a TypeScript source and the comment at its head."""
    for found in re.finditer(r"/\*\*(.*?)\*/[ \t]*\n?([^\n]*)", text, re.DOTALL):
        body = re.sub(r"\n\s*\* ?", "\n", found.group(1)).strip()
        yield Doc(path, text.count("\n", 0, found.start()) + 1, body, found.group(2).strip())
    head = re.match(r"// SPDX[^\n]*\n((?://[^\n]*\n)+)", text)
    if head:
        yield Doc(path, 2, re.sub(r"^// ?", "", head.group(1), flags=re.MULTILINE), "")


def python_messages(path: str, text: str) -> Iterator[Doc]:
    """Yields the texts in the code of a Python source that may be read by a user: several words, with `{}` for each value."""
    tree = ast.parse(text)
    inner: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            inner |= {id(part) for part in node.values}
        elif isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            inner |= {id(part.value) for part in node.body if isinstance(part, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            said = "".join(str(part.value) if isinstance(part, ast.Constant) else "{}" for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inner:
            said = node.value
        else:
            continue
        if len(said.split()) > 2:
            yield Doc(path, node.lineno, said, "")


STUDIO_TEXT = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|"(?P<double>[^"\n]*)"|`(?P<template>[^`]*)`|>\s*(?P<element>[A-Z][^<>{}=;]*)<""", re.DOTALL
)


def studio_messages(path: str, text: str) -> Iterator[Doc]:
    """Yields the texts in the code of a TypeScript source that may be read by a user: several words, with `{}` for each value."""
    for found in STUDIO_TEXT.finditer(text):
        said = re.sub(r"\$\{[^{}]*(\{[^{}]*\}[^{}]*)*\}", "{}", found["double"] or found["template"] or found["element"] or "")
        if len(said.split()) > 2:
            yield Doc(path, text.count("\n", 0, found.start()) + 1, re.sub(r"\s+", " ", said).strip(), "")


MESSAGE_READERS = {".py": python_messages, ".ts": studio_messages, ".tsx": studio_messages}
READERS = {
    ".rs": (rust_docs, RUST_TYPE),
    ".py": (python_docs, PYTHON_TYPE),
    ".ts": (studio_docs, STUDIO_TYPE),
    ".tsx": (studio_docs, STUDIO_TYPE),
}
# Written by a program from other texts.
GENERATED = re.compile(r"control/shapes\.ts$|\.pyi$|/schemas/")


def files(room: str) -> list[Path]:
    """Returns the sources of a room, without generated ones."""
    folder = {"python": ROOT / "python" / "opengpac", "studio": ROOT / "studio" / "src"}.get(room, ROOT / "crates" / room)
    found = [path for path in sorted(folder.rglob("*")) if path.suffix in READERS and "node_modules" not in path.parts]
    return [path for path in found if not GENERATED.search(path.as_posix())]


def lint(path: str, text: str) -> tuple[list[Finding], list[str]]:
    """Returns the faults of a source's doc comments and messages, and its types whose names are bare participles."""
    reader, types = READERS[Path(path).suffix]
    found = [finding for doc in reader(path, text) for finding in judge(doc)]
    messages = MESSAGE_READERS.get(Path(path).suffix)
    if messages is not None and not path.endswith(".test.ts"):
        found += [finding for message in messages(path, text) for finding in judge_message(message)]
    return found, [name for name in types.findall(text) if is_participle(name)]


def lint_room(room: str) -> tuple[list[Finding], list[str]]:
    """Returns the faults of a room's doc comments, and its types that are bare participles."""
    both = [lint(path.relative_to(ROOT).as_posix(), path.read_text()) for path in files(room)]
    return [finding for found, _ in both for finding in found], [name for _, names in both for name in names]


def rooms() -> list[str]:
    """Returns the crates, the Python package and the studio."""
    return [*sorted(path.parent.name for path in (ROOT / "crates").glob("*/Cargo.toml")), "python", "studio"]


def main(named: list[str]) -> int:
    """Prints the findings of the rooms that are named, or a table of all."""
    if named:
        for room in named:
            found, participles = lint_room(room)
            print(*found, f"{room}: {len(found)} findings; participles: {' '.join(participles) or 'none'}", sep="\n")
        return 0
    for room in rooms():
        found, participles = lint_room(room)
        by = {rule: sum(finding.rule == rule for finding in found) for rule in ("opening", "no verb", "word", "message")}
        counts = " ".join(f"{count:5} {rule}" for rule, count in by.items())
        print(f"{room:16} {counts} {len(participles):5} participles")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
