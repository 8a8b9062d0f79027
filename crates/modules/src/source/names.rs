// SPDX-License-Identifier: Apache-2.0
//! Detection of names in a declaration that are already used by C, C++ or a header. The compiler's messages about them mention only
//! tokens, so the names are searched for on the line that failed.
use super::c_words::{is_keyword, is_keyword_of_cxx, is_macro};

/// Words whose first argument is a name, followed by words whose second argument is a name.
const NAMES_FIRST: [&str; 4] = ["FUNCTION_BLOCK", "TYPE", "condition", "size"];
const NAMES_SECOND: [&str; 15] = [
    "in",
    "in_async",
    "in_ratio",
    "in_history",
    "in_default",
    "in_async_default",
    "out",
    "out_async",
    "out_ratio",
    "out_nonfinite",
    "state",
    "state_keep",
    "param",
    "device",
    "field",
];
const CONDITIONS: [&str; 2] = ["condition_of", "condition_of_default"];

/// A name that is already used, with its description and line.
pub(super) struct TakenName {
    pub message: String,
    pub line: u32,
}

/// Returns the taken name of an item on `line`, or of the block or type whose declaration begins there.
pub(super) fn taken_name(text: &str, line: u32, is_cxx: bool) -> Option<TakenName> {
    let mut declared = ("", 0, "");
    for (at, word, arguments) in calls(text) {
        let is_whole = matches!(word, "FUNCTION_BLOCK" | "TYPE");
        let place = usize::from(!NAMES_FIRST.contains(&word));
        let Some(name) = arguments.split(',').nth(place).map(|name| name.split('[').next().unwrap_or(name).trim()) else { continue };
        if is_whole {
            declared = (if word == "TYPE" { "type" } else { "block" }, at, name);
        }
        let Some(why) = reason(name, is_cxx).filter(|_| at == line || declared.1 == line) else { continue };
        let of = if is_whole { format!("a {}", declared.0) } else { format!("an item of {} '{}'", declared.0, declared.2) };
        return Some(TakenName { message: format!("'{name}' cannot be the name of {of}: it is {why}; give it another name"), line: at });
    }
    None
}

fn reason(name: &str, is_cxx: bool) -> Option<&'static str> {
    match name {
        _ if is_keyword(name) => Some("a keyword of C"),
        _ if is_cxx && is_keyword_of_cxx(name) => Some("a keyword of C++"),
        _ if is_macro(name) => Some("a macro of a header that blocks include"),
        _ => None,
    }
}

/// Yields each declaration keyword that is followed by an opening bracket: its line number, the keyword, and the text from the bracket up
/// to the description.
fn calls(text: &str) -> impl Iterator<Item = (u32, &str, &str)> {
    text.lines().zip(1..).flat_map(|(line, number)| {
        let code = line.split("//").next().unwrap_or(line);
        code.match_indices('(').filter_map(move |(open, _)| {
            let before = code[..open].trim_end();
            let begin = before.rfind(|c: char| !(c.is_alphanumeric() || c == '_')).map_or(0, |at| at + 1);
            let word = &before[begin..];
            let is_word = NAMES_FIRST.contains(&word) || NAMES_SECOND.contains(&word) || CONDITIONS.contains(&word);
            is_word.then(|| (number, word, code[open + 1..].split('"').next().unwrap_or_default()))
        })
    })
}
