// SPDX-License-Identifier: Apache-2.0
//! Readable messages for malformed JSON. They replace the messages of the JSON parser, which use Rust terms.

/// Maximum length of quoted input; longer text is truncated.
const SHOWN_MAX: usize = 80;

/// Rewrites a `serde_json` error in plain words, without its position, which refers to text that the user never sees.
pub fn plain(error: &str) -> String {
    let text = error.split(" at line ").next().unwrap_or(error);
    if let Some((given, wanted)) = cut(text, "invalid type: ").or_else(|| cut(text, "invalid value: ")) {
        return format!("{} is given where {} is expected", thing(given), kind(wanted));
    }
    if let Some((given, wanted)) = cut(text, "invalid length ") {
        return format!("{given} elements are given where {} is expected", kind(wanted));
    }
    if let Some((given, wanted)) = cut(text, "unknown variant ").or_else(|| cut(text, "unknown field ")) {
        return format!("there is no {} here: there are {}", shown(&given.replace('`', "'")), wanted.replace("one of ", "").replace('`', "'"));
    }
    if let Some(name) = text.strip_prefix("missing field ") {
        return format!("{} is missing", name.replace('`', "'"));
    }
    if text.starts_with("data did not match any variant") {
        return "it has none of the accepted forms".to_owned();
    }
    let is_syntax = ["expected value", "invalid number", "unexpected end of hex escape", "lone leading surrogate", "invalid unicode", "number out of range"];
    if is_syntax.iter().any(|said| text.starts_with(said)) {
        return "it contains a number that is not finite, or text that is not valid Unicode".to_owned();
    }
    shown(text)
}

/// Rewrites an error that follows a prefix added by this project, as [`plain`] does.
pub fn plain_within(text: &str) -> String {
    const BEGINNINGS: [&str; 7] =
        ["invalid type: ", "invalid value: ", "invalid length ", "unknown variant ", "unknown field ", "missing field ", "data did not match any variant"];
    match BEGINNINGS.iter().filter_map(|beginning| text.find(beginning)).min() {
        Some(at) => format!("{}{}", &text[..at], plain(&text[at..])),
        None => text.to_owned(),
    }
}

/// Makes external text safe for a terminal: control characters (except newlines and tabs) and bidirectional formatting characters are
/// replaced with U+FFFD.
pub fn printable(text: impl Into<String>) -> String {
    let text = text.into();
    let turns = |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let is_shown = |c: char| !turns(c) && (!c.is_control() || matches!(c, '\n' | '\t'));
    if text.chars().all(is_shown) { text } else { text.chars().map(|c| if is_shown(c) { c } else { '\u{fffd}' }).collect() }
}

fn cut<'a>(text: &'a str, begin: &str) -> Option<(&'a str, &'a str)> {
    text.strip_prefix(begin)?.rsplit_once(", expected ")
}

/// Returns the value that was passed, in plain words.
fn thing(given: &str) -> String {
    let given = match given {
        "null" => "nothing",
        "map" => "an object",
        "sequence" => "a list",
        other => ["integer ", "floating point ", "boolean ", "string "].iter().find_map(|kind| other.strip_prefix(kind)).unwrap_or(other),
    };
    shown(&given.replace('`', ""))
}

/// Returns the kind of value that was expected, in plain words.
fn kind(wanted: &str) -> String {
    let said = match wanted {
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of 0 or more",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "a string" | "a borrowed string" => "a string",
        "a sequence" => "a list",
        "a map" => "an object with names",
        other if other.starts_with("struct ") => "an object with names",
        other => return other.replace("a tuple of size", "a list of").replace('`', "'"),
    };
    said.to_owned()
}

pub(crate) fn shown(text: &str) -> String {
    let text = text.replace('\n', " ");
    match text.char_indices().nth(SHOWN_MAX) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of<T: serde::de::DeserializeOwned + std::fmt::Debug>(json: &str) -> String {
        plain(&serde_json::from_str::<T>(json).unwrap_err().to_string())
    }

    #[test]
    fn what_drives_a_terminal_is_not_shown() {
        assert_eq!(printable("\u{1b}[2J\u{1b}]0;x\u{7}done\r\u{9b}1m \u{202e}txt"), "\u{fffd}[2J\u{fffd}]0;x\u{fffd}done\u{fffd}\u{fffd}1m \u{fffd}txt");
        assert_eq!(printable("two\n\tlines, 3 µm ≤ 4"), "two\n\tlines, 3 µm ≤ 4");
    }

    #[test]
    fn it_says_what_is_given_and_what_belongs_there() {
        assert_eq!(of::<u64>("-1"), "-1 is given where a whole number of 0 or more is expected");
        assert_eq!(of::<u64>("null"), "nothing is given where a whole number of 0 or more is expected");
        assert_eq!(of::<f64>("\"five\""), "\"five\" is given where a number is expected");
        assert_eq!(of::<bool>("0.5"), "0.5 is given where true or false is expected");
        assert_eq!(of::<(f64, f64)>("[1]"), "1 elements are given where a list of 2 is expected");
        assert_eq!(of::<Vec<u64>>("3"), "3 is given where a list is expected");
        assert_eq!(of::<f64>("NaN"), "it contains a number that is not finite, or text that is not valid Unicode");
        assert_eq!(of::<String>("\"\\ud800\""), "it contains a number that is not finite, or text that is not valid Unicode");
        assert!(of::<u64>(&format!("\"{}\"", "x".repeat(100_000))).len() < 200);
    }
}
