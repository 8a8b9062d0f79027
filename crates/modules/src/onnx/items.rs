// SPDX-License-Identifier: Apache-2.0
//! Items of a policy's block, as in its C declaration.
use super::meaning::Term;
use crate::source::is_taken_in_c;

/// Maximum number of items in a declaration.
const ITEMS_MAX: usize = 32;

#[derive(Default)]
pub(super) struct Items(Vec<String>);

impl Items {
    pub fn port(&mut self, term: &Term, word: &str, doc: &str) -> Result<(), String> {
        let unit = if term.unit.is_empty() { String::new() } else { format!(", {}", quoted(&term.unit)) };
        let names = if term.names.is_empty() { String::new() } else { format!(": {}", term.names.join(", ")) };
        let doc = quoted(&format!("{}{names}", if term.doc.is_empty() { doc } else { &term.doc }));
        self.0.push(format!("{word}(double[{}], {}, {doc}{unit})", term.size, identifier(&term.port)?));
        Ok(())
    }

    /// Adds a state of floats, and returns its name.
    pub fn state(&mut self, name: &str, len: usize, doc: &str) -> String {
        self.0.push(format!("state(float[{}], opengpac_{name}, 0, {})", len.max(1), quoted(doc)));
        format!("opengpac_{name}")
    }

    /// Adds an item of 64-bit numbers: a state, a condition, an input.
    pub fn whole(&mut self, word: &str, name: &str, more: &str, doc: &str) {
        self.0.push(format!("{word}(int64_t, {name}, {more}{})", quoted(doc)));
    }

    /// Returns all items as arguments of the declaration.
    pub fn declared(&self) -> Result<String, String> {
        match self.0.len() {
            count if count > ITEMS_MAX => Err(format!("its block would have {count} items, but at most {ITEMS_MAX} are possible: join ports")),
            _ => Ok(self.0.join(",\n    ")),
        }
    }
}

/// Formats numbers as the elements of a C array.
pub(super) fn numbers(values: &[f64]) -> String {
    let number = |x: &f64| match *x {
        x if x.is_finite() => format!("{x:e}"),
        x if x > 0.0 => "__builtin_inf()".to_string(),
        _ => "-__builtin_inf()".to_string(),
    };
    format!("{{{}}}", values.iter().map(number).collect::<Vec<_>>().join(", "))
}

pub(super) fn quoted(text: &str) -> String {
    let letters: String = text
        .chars()
        .map(|c| match c {
            '"' | '\\' => format!("\\{c}"),
            c if c.is_control() => " ".to_string(),
            c => c.to_string(),
        })
        .collect();
    format!("\"{letters}\"")
}

/// Checks that the name of a port or block is a valid C identifier.
///
/// # Errors
/// Fails if it contains other characters, or is a keyword of C or of a block's declaration.
pub(super) fn identifier(name: &str) -> Result<&str, String> {
    let is_one = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && name.starts_with(|c: char| c.is_ascii_alphabetic());
    if !is_one {
        return Err(format!("'{name}' cannot name a port or block: use letters, digits and _"));
    }
    if is_taken_in_c(name) { Err(format!("'{name}' is a reserved word of C or OpenGPAC: give the port or block another name")) } else { Ok(name) }
}
