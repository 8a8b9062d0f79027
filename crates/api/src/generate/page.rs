// SPDX-License-Identifier: Apache-2.0
//! Documentation page of the calls.
use super::{answer, by_subject, ordered, signature, word, wrapped};
use crate::Call;

const HEAD: &str = "# The calls

<!-- Made from the declarations in crates/api: do not edit. -->

This page lists every call on a real-time system. A C program makes these calls directly
([opengpac_ps.h](../crates/c-package/include/opengpac_ps.h)), the control interface transmits them
([control.md](control.md)), and the Python package uses them internally.

A call has a name and a JSON object of arguments, and returns JSON. Arguments in brackets may be omitted; an argument after
three dots consists of all remaining members of the object. Names of sources are `processor.source`, times are in ns.
";

/// Returns the text of the page.
pub fn page<'a>(calls: impl Iterator<Item = &'a Call>) -> String {
    let subjects = by_subject(calls).into_iter().map(|(subject, calls)| {
        let (first, rest) = subject.split_at(1);
        format!("\n## {}{rest}\n{}", first.to_uppercase(), calls.into_iter().map(one).collect::<String>())
    });
    HEAD.to_owned() + &subjects.collect::<String>()
}

fn one(call: &Call) -> String {
    let returns = answer(call).map_or(String::new(), |answer| format!(" -> {answer}"));
    let mut text = format!("\n### {}\n\n`{}({}){returns}`\n\n{}", call.name, call.name, signature(call), wrapped(&call.words(), "", 110));
    text += &format!("\n{}", wrapped(&properties(call), "", 110));
    let arguments = ordered(call);
    if !arguments.is_empty() {
        text.push('\n');
    }
    for argument in arguments {
        let words = if argument.words.is_empty() { String::new() } else { format!(": {}", argument.words) };
        text += &format!("- `{}` ({}){words}\n", argument.name, word(&argument.schema));
    }
    text
}

/// Returns the role of a call and its other properties, one sentence for each.
fn properties(call: &Call) -> String {
    let role = format!("Role: {}{}.", call.role.word(), if call.free { ", without command" } else { "" });
    let more = [
        (call.lasts, "A long wait is divided into slices."),
        (call.stops, "This call is a stop, so it is not queued behind other calls."),
        (call.moves, "The machine may begin to move, so a call with `OpenGPAC-As-Of` is refused if it arrives late."),
        (call.costs, "Only a few such calls run at a time."),
        (call.local, "The control interface does not offer this call."),
    ];
    let more = more.into_iter().filter(|(is, _)| *is).map(|(_, words)| format!(" {words}"));
    role + &more.collect::<String>()
}
