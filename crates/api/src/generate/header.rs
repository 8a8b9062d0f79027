// SPDX-License-Identifier: Apache-2.0
//! List of calls in `opengpac_ps.h`.
use super::{answer, by_subject, ordered, signature, wrapped};
use crate::Call;

/// Lines that delimit the list.
const BEGIN: &str = " * ---- the calls, generated from their declarations in crates/api ----\n";
const END: &str = " * ---- end of the calls ----\n";

/// Returns the list of calls as lines of a C comment.
pub fn header<'a>(calls: impl Iterator<Item = &'a Call>) -> String {
    by_subject(calls).into_iter().map(|(subject, calls)| format!(" * {subject}\n{}", calls.into_iter().map(one).collect::<String>())).collect()
}

fn one(call: &Call) -> String {
    let returns = answer(call).map_or(String::new(), |answer| format!(" -> {answer}"));
    let mut text = wrapped(&format!("{}({}){returns}", call.name, signature(call)), " *   ", 110);
    text += &wrapped(&call.words(), " *       ", 110);
    for argument in ordered(call).iter().filter(|argument| !argument.words.is_empty()) {
        text += &wrapped(&format!("{}: {}", argument.name, argument.words), " *         ", 110);
    }
    text.replace("*/", "* /")
}

/// Returns a header in which this list replaces the previous one; `None` if the header has no place for a list.
pub fn in_header(header: &str, list: &str) -> Option<String> {
    let (before, rest) = header.split_once(BEGIN)?;
    let (_, after) = rest.split_once(END)?;
    Some(format!("{before}{BEGIN}{list}{END}{after}"))
}
