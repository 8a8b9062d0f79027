# SPDX-License-Identifier: Apache-2.0
"""Messages of Rust and of the C headers are written in English; what the lint knows, it finds, and at its line."""

from __future__ import annotations

import pytest
from rust_messages import lint, lint_all

PLANTED = [
    "'{}' is no command",
    "the block '{}', which is not there",
    "there is a source '{}' already",
    "look at its power and its cable",
    "mend the block and call reset()",
    "it is closed; open the device anew",
    "the controller sends nothing any more",
    "{} is asked for, and {value} is none",
    "a byte takes no scale",
    "a plant that makes no step for so long is lost",
    "the memory was written over",
    "see the log for why, then call reset()",
    "goals that the greatest speed held back",
    "output '{}' gets a cell of its own",
    "say which with .on()",
]


def test_no_message_has_a_foreign_turn_of_phrase() -> None:
    assert [str(finding) for finding in lint_all()] == []


@pytest.mark.parametrize("message", PLANTED)
def test_a_planted_message_is_found(message: str) -> None:
    found = lint("a.rs", f'fn f() {{\n    refuse("{message}")\n}}\n')
    assert found and {finding.line for finding in found} == {2}


def test_texts_for_developers_and_of_tests_are_left_alone() -> None:
    source = """
// It is no command.
fn f() -> &'static str { given.expect("it is no command"); assert!(is_so, "is no command"); "it is a command" }
#[cfg(test)]
mod tests { fn f() { refuse("is no command { nor a block"); } }
fn g() { refuse("a command that is no command"); }
"""
    assert [finding.line for finding in lint("a.rs", source)] == [6]


def test_a_message_over_several_lines_is_read_as_one() -> None:
    assert lint("a.rs", 'fn f() { refuse("it is \\\n        no command") }')
