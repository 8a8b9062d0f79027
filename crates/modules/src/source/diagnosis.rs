// SPDX-License-Identifier: Apache-2.0
//! First error reported by a compiler, in plain words and at the user's line.

use super::languages::is_cxx;
use super::names::{TakenName, taken_name};
use std::path::{Path, PathBuf};

/// An error found in the output of a compiler.
pub struct Diagnosis {
    pub message: String,
    pub file: PathBuf,
    /// Line number; 0 if there is none (an error of the linker).
    pub line: u32,
}

/// Finds the first error that a compiler reported for `source`. Errors in declarations are reported in the header, behind macros; the
/// position is then that of the macro call in the user's file, or of the item that the message quotes. If the error is caused by a name
/// that is taken, the message says so.
pub fn first_error(text: &str, source: &Path, header: &Path) -> Diagnosis {
    let found = compiler_error(text, source, header);
    let declared = std::fs::read_to_string(&found.file).ok();
    match declared.and_then(|declared| taken_name(&declared, found.line, is_cxx(&found.file))) {
        Some(TakenName { message, line }) => Diagnosis { message, line, ..found },
        None => found,
    }
}

fn compiler_error(text: &str, source: &Path, header: &Path) -> Diagnosis {
    let mut lines = text.lines().filter_map(place);
    let Some((file, line, message)) = lines.by_ref().find(|(_, _, message)| error_text(message).is_some()) else {
        return Diagnosis { message: linker_error(text), file: source.to_path_buf(), line: 0 };
    };
    let message = plain(error_text(message).unwrap_or(message));
    let is_ours = |file: &str| Path::new(file).parent() == header.parent();
    if !is_ours(file) {
        return Diagnosis { line: item_line(&message, file, line).unwrap_or(line), message, file: PathBuf::from(file) };
    }
    // Only the notes of this error; subsequent ones concern an earlier declaration.
    let call = lines.take_while(|(_, _, message)| message.contains(" of macro ")).filter(|(file, ..)| !is_ours(file)).last();
    match call {
        Some((file, line, _)) => Diagnosis { line: item_line(&message, file, line).unwrap_or(line), message, file: PathBuf::from(file) },
        None => Diagnosis { message, file: source.to_path_buf(), line: 0 },
    }
}

/// Parses `file:line:column: message`.
fn place(line: &str) -> Option<(&str, u32, &str)> {
    let (head, message) = line.split_once(": ")?;
    let mut parts = head.rsplitn(3, ':');
    let (last, middle) = (parts.next()?, parts.next()?);
    match (parts.next(), middle.parse(), last.parse::<u32>()) {
        (Some(file), Ok(line), Ok(_)) => Some((file, line, message)),
        (None, _, Ok(line)) => Some((middle, line, message)),
        _ => None,
    }
}

fn error_text(message: &str) -> Option<&str> {
    message.strip_prefix("error: ").or_else(|| message.strip_prefix("fatal error: "))
}

/// Returns the message without the text that the compiler adds around it, such as the name of a warning option.
fn plain(message: &str) -> String {
    let text = match message.strip_prefix("static assertion failed due to requirement '") {
        Some(requirement) => requirement.split_once("': ").map_or(message, |(_, text)| text),
        None => message.strip_prefix("static assertion failed: ").unwrap_or(message),
    };
    let text = text.strip_prefix('"').and_then(|text| text.strip_suffix('"')).unwrap_or(text);
    let text = unescaped(text);
    match text.rfind(" [-W") {
        Some(end) => text[..end].to_string(),
        None => text,
    }
}

/// Returns the contents of a literal: `\'in(\"rad\")\'` is `'in("rad")'`.
fn unescaped(literal: &str) -> String {
    let mut text = String::new();
    let mut letters = literal.chars();
    while let Some(c) = letters.next() {
        text.extend(if c == '\\' { letters.next() } else { Some(c) });
    }
    text
}

/// Searches from line `from` on for the first item that the message quotes, `'in(double, q[6], "…")' …`; returns its line.
fn item_line(message: &str, file: &str, from: u32) -> Option<u32> {
    let quoted = message.strip_prefix('\'')?;
    let bare = |text: &str| text.chars().filter(|c| !c.is_whitespace()).collect::<String>();
    let head = bare(quoted.splitn(3, ',').take(2).collect::<Vec<_>>().join(",").split(")'").next()?);
    let text = std::fs::read_to_string(file).ok()?;
    let found = text.lines().enumerate().skip(from.saturating_sub(1) as usize).find(|(_, line)| bare(line).contains(&head))?;
    u32::try_from(found.0 + 1).ok()
}

/// Returns the symbol that the linker did not find; otherwise the first line.
fn linker_error(text: &str) -> String {
    let missing = text.lines().find_map(|line| line.split_once("undefined reference to ").or_else(|| line.split_once("undefined symbol: ")));
    match missing {
        Some((_, name)) => format!("the function '{}' is declared and called but not defined: add the file that defines it", name.trim_matches(['`', '\''])),
        None => text.lines().find(|line| !line.trim().is_empty()).unwrap_or("the compiler failed without a message").to_string(),
    }
}
