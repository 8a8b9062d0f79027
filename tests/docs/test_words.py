# SPDX-License-Identifier: Apache-2.0
"""Doc comments open with a verb or a noun and use the field's words: the lint of `words.py` finds nothing in rooms that are done.

A room that is done is not in `NOT_YET`, and finds nothing. The others may have as many findings as stand there: the number only shrinks.
`PARTICIPLES` has the types of each room whose names are bare participles, which only shrink too: a new type is a noun with its subject.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from words import ROOT, files, is_participle, lint, lint_room, rooms

NOT_YET: dict[str, int] = {}

PARTICIPLES: dict[str, int] = {
    "python": 9,
}

RUST = [
    ("/// What runs there.\nconst SOFTWARE: u8 = 1;", "opening"),
    ("/// What serves one who commands.\npub struct Agent {", "opening"),
    ("/// How a start gets what it needs.\npub(crate) enum Admission {", "opening"),
    ("/// How often it has come since.\nrepeats: u64,", "opening"),
    ("/// Where the reference is and where it goes.\npub struct Reference {", "opening"),
    ("/// Whether a guard that does not end is held stopped.\nfn is_stopped() -> bool {", "opening"),
    ("/// Who published a group.\npub struct Publisher {", "opening"),
    ("/// Whose script it was that a kernel acknowledges.\nowner: u64,", "opening"),
    ("/// Another one in each package: where it stays, nobody commands.\npub beat: i32,", "opening"),
    ("/// From now on. Refused where the system has interrupt sources already.\nfn begin() {", "opening"),
    ("/// By itself, with this status.\nExited(i32),", "opening"),
    ("/// One that was made and never opened leaves no process behind either.\nfn drop() {", "opening"),
    ("    /// which of them it is\n    #[param]\n    which: u8,", "opening"),
    ("//! When the next packet arrives.\n", "opening"),
    ("/// Counts its calls. Never more than one.\nfn count() {", "no verb"),
    ("/// The greatest age.\npub age_ns: i64,", "word"),
]
PYTHON = [
    ('class CanOpenDrive:\n    """How an emulated drive is."""', "opening"),
    ('def _got():\n    """What an output value is in Python."""', "opening"),
]
STUDIO = [
    ("/** What a list is called in its part. */\nexport function shortName() {", "opening"),
    ("// SPDX-License-Identifier: Apache-2.0\n// Where the boxes of a diagram lie.\n", "opening"),
]
MESSAGES = [
    ('refuse(CallError, f"\'{name}\' is no verb", "give a verb")', ".py"),
    ("refuse(CallError, f\"group '{name}' is given {device!r}\")", ".py"),
    ('print("the file has two heads: mend it first")', ".py"),
    ('parser.add_argument("--all", help="go on after a check that failed")', ".py"),
    ('warn(f"joint {name}: the limit is to be more than 0")', ".py"),
    ('remedy = "give each part a name of its own"', ".py"),
    ('log("block %s begins anew: its type differs")', ".py"),
    ("const wrong = `'${text}' is no ratio: write a whole number`;", ".ts"),
    ('const said = "what is known of it is told elsewhere";', ".ts"),
    ("  return <p>Look at the table beside it.</p>;", ".tsx"),
]
PLANTED = [(f"planted{end}", *case) for end, cases in ((".rs", RUST), (".py", PYTHON), (".ts", STUDIO)) for case in cases]


@pytest.mark.parametrize(("path", "text", "rule"), PLANTED)
def test_a_planted_sentence_is_found_with_a_better_form(path: str, text: str, rule: str) -> None:
    found, _ = lint(path, text)
    assert [(finding.path, finding.rule) for finding in found] == [(path, rule)]
    assert found[0].line in (1, 2) and found[0].better
    assert str(found[0]).startswith(f"{path}:{found[0].line}: {rule}: ")


@pytest.mark.parametrize(("text", "end"), MESSAGES)
def test_a_planted_message_is_found_with_a_better_form(text: str, end: str) -> None:
    found, _ = lint(f"planted{end}", text)
    assert [(finding.line, finding.rule) for finding in found] == [(1, "message")] and found[0].better


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ('refuse(CallError, f"\'{name}\' must be a verb, not {given!r}", "pass a verb")', ".py"),
        ("remedy = f\"file '{path}' does not exist, or it is no longer there\"", ".py"),
        ('"""There is no state in a docstring that is read as a message."""', ".py"),
        ("// What is told here is no message.\nconst said = `part '${name}' already exists here`;", ".ts"),
    ],
)
def test_a_good_message_is_left_alone(text: str, end: str) -> None:
    assert [finding for finding in lint(f"good{end}", text)[0] if finding.rule == "message"] == []


def test_twenty_sentences_are_planted() -> None:
    assert len(PLANTED) == 20


@pytest.mark.parametrize(
    "text",
    [
        "/// A firing of a source, in order: latch connections, read devices, run the steps that are due.\nfn fire() {",
        "/// Returns whether an acceleration is within ± `limit`.\nfn within() -> bool {",
        "/// Where the file is missing, returns none.\nfn read() {",
        "/// Another start of the same verb, queued behind it.\nqueued: u32,",
        "/// Stops the source. Idempotent.\nfn stop() {",
        "/// Minimum, maximum and mean:\n///\n/// | What | is a column |\nstruct Table;",
    ],
)
def test_a_good_sentence_is_left_alone(text: str) -> None:
    assert lint("good.rs", text)[0] == []


def test_bare_participles_are_told_from_nouns() -> None:
    bare = ["Asked", "Told", "Held", "Seen", "Shared", "Given"]
    assert [name for name in [*bare, "Seed", "Speed", "HeldMotion", "OpenRequest", "Reading"] if is_participle(name)] == bare
    assert lint("a.py", "class Kept:\n    pass\n")[1] == ["Kept"] and lint("a.ts", "export interface Kept {\n")[1] == ["Kept"]


@pytest.mark.parametrize("room", rooms())
def test_a_room_that_is_done_stays_done(room: str) -> None:
    found, participles = lint_room(room)
    if len(found) > NOT_YET.get(room, 0):
        pytest.fail(f"{len(found)} findings, {NOT_YET.get(room, 0)} before:\n" + "\n".join(map(str, found)))
    more = f"a type is a noun with its subject (`OpeningRequest`, not `Asked`); of {room} these are bare participles: {participles}"
    assert len(participles) <= PARTICIPLES.get(room, 0), more


def test_the_lists_name_rooms_and_every_room_has_sources() -> None:
    assert {*NOT_YET, *PARTICIPLES} <= {*rooms()}
    assert all(files(room) for room in rooms())
    assert Path(__file__).is_relative_to(ROOT)
