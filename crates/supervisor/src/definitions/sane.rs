// SPDX-License-Identifier: Apache-2.0
//! Checks of values that have the right type but are not sensible: names that cannot be shown on one line of a log, sizes that exceed the
//! memory of any machine.
use crate::refuse::refuse;
use model::definition::SvvSpecification;
use model::refusal::{Class, Refusals};

/// Maximum number of characters in a name.
const CHARACTERS_MAX: usize = 256;

/// Maximum size of one value of an SVV, bytes.
const VALUE_MAX: usize = 16 << 20;

/// Maximum size of the history of an SVV, bytes.
const PAST_MAX: u64 = 1 << 30;

/// Size of the number and time stored with each value in the history, bytes.
const STAMP: u64 = 16;

/// Checks a name: 1 to 256 characters, not all blank, that can be shown on one line of a log. `what` is the kind of name, as in "the name
/// of an SVV".
///
/// # Errors
/// [`Class::CallError`] with the violated rule.
pub fn check_name(what: &str, name: &str) -> Result<(), Refusals> {
    let refused = |why: String, remedy: String| Err(refuse(Class::CallError, format!("{what} is {why}"), remedy));
    if name.trim().is_empty() {
        return refused(format!("'{}'", name.escape_debug()), "give a name, for example 'cell'".to_owned());
    }
    if name.chars().any(is_hidden) {
        let shown: String = name.chars().take(80).collect();
        return refused(
            format!("'{}', which contains characters that cannot be printed", shown.escape_debug()),
            "remove line breaks and control characters".to_owned(),
        );
    }
    if name.chars().nth(CHARACTERS_MAX).is_some() {
        return refused(format!("{} characters long", name.chars().count()), format!("give a name of at most {CHARACTERS_MAX}"));
    }
    Ok(())
}

/// Returns true for control characters, line and paragraph separators, and format characters, which have zero width or control the
/// writing direction.
fn is_hidden(character: char) -> bool {
    character.is_control() || matches!(character, '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

/// Checks the specification of an SVV whose values have `size` bytes.
pub(crate) fn svv(called: &str, asked: &SvvSpecification, size: usize) -> Result<(), Refusals> {
    check_name("the name of an SVV", called)?;
    if size > VALUE_MAX {
        let message = format!("a value of SVV '{called}' ({}) would have {size} bytes", asked.type_text);
        return Err(refuse(Class::ValueRefused, message, format!("use a shorter array: at most {VALUE_MAX} bytes are possible")));
    }
    let row = size as u64 + STAMP;
    if u64::from(asked.history) * row > PAST_MAX {
        let message = format!("a history of {} values of SVV '{called}' would take {} MB", asked.history, u64::from(asked.history) * row / 1_000_000);
        return Err(refuse(Class::ValueRefused, message, format!("ask for at most {}, or record the values: cell.record(...)", PAST_MAX / row)));
    }
    Ok(())
}
