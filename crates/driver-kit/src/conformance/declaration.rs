// SPDX-License-Identifier: Apache-2.0
//! Checks of the declaration: its name, its text, its options.
use super::check::{Check, CheckResult, PassedCheck, holds, none_of};
use super::subject::Subject;
use device::{Class, Kind, OptionWord};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "name", sentence: "its name consists of lower-case letters, digits and _", run: name },
    Check { name: "doc", sentence: "it describes in one line what it drives", run: doc },
    Check { name: "option-names", sentence: "its options have unique names, of lower-case letters, digits and _", run: option_names },
    Check { name: "option-docs", sentence: "each option is described in one line", run: option_docs },
    Check { name: "option-units", sentence: "only numbers and lists have a unit, and an option that ends in _ns is a whole number in ns", run: option_units },
    Check { name: "option-defaults", sentence: "each option declares its default, or that it is required", run: option_defaults },
    Check { name: "option-of-class", sentence: "no option has the name of one that every driver of its class has", run: option_of_class },
];

const LINE_MAX: usize = 200;

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_lowercase()) && text.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

/// Returns the problem with a line; `None` if it is valid.
pub(super) fn wrong_line(text: &str) -> Option<String> {
    if text.trim().is_empty() {
        return Some("it is empty".to_owned());
    }
    if text.contains('\n') {
        return Some("it is more than one line".to_owned());
    }
    (text.chars().count() > LINE_MAX).then(|| format!("it has more than {LINE_MAX} characters"))
}

/// Returns the first name that is invalid or duplicated.
pub(super) fn wrong_name<'a>(names: impl Iterator<Item = &'a str>) -> Option<String> {
    let names: Vec<&str> = names.collect();
    let at = |i: usize| match names[i] {
        name if !is_name(name) => Some(format!("'{name}' is not a valid name")),
        name if names[..i].contains(&name) => Some(format!("'{name}' appears twice")),
        _ => None,
    };
    (0..names.len()).find_map(at)
}

/// Checks that a text is a single line.
pub(super) fn line(text: &str) -> CheckResult {
    wrong_line(text).map_or(Ok(PassedCheck::Yes), Err)
}

/// Checks that each of these names has a description of one line.
pub(super) fn lines<'a>(words: impl Iterator<Item = (&'a str, &'a str)>) -> CheckResult {
    none_of(words.filter_map(|(name, doc)| wrong_line(doc).map(|wrong| format!("'{name}': {wrong}"))))
}

fn name(subject: &Subject) -> CheckResult {
    holds(is_name(subject.of.kind), || format!("it is '{}'", subject.of.kind))
}

fn doc(subject: &Subject) -> CheckResult {
    line(subject.of.doc)
}

fn option_names(subject: &Subject) -> CheckResult {
    wrong_name(subject.of.options.iter().map(|word| word.name)).map_or(Ok(PassedCheck::Yes), Err)
}

fn option_docs(subject: &Subject) -> CheckResult {
    lines(subject.of.options.iter().map(|word| (word.name, word.doc)))
}

/// Returns the problem with the unit of an option; `None` if it is valid.
pub(super) fn wrong_unit(word: &OptionWord) -> Option<String> {
    if !word.unit.is_empty() && !matches!(word.kind, Kind::Number | Kind::Whole | Kind::List | Kind::Table) {
        return Some(format!("'{}' is not a number but has the unit {}", word.name, word.unit));
    }
    if word.unit.contains(char::is_whitespace) {
        return Some(format!("'{}' has the unit '{}', which is not known", word.name, word.unit));
    }
    let is_time = word.name.ends_with("_ns");
    (is_time && (word.unit, word.kind) != ("ns", Kind::Whole)).then(|| format!("'{}' is not a whole number in ns", word.name))
}

fn option_units(subject: &Subject) -> CheckResult {
    none_of(subject.of.options.iter().filter_map(wrong_unit))
}

fn option_defaults(subject: &Subject) -> CheckResult {
    let words = subject.of.options.iter().filter_map(|word| Some((word.name, word.default?)));
    none_of(words.filter_map(|(name, text)| wrong_line(text).map(|wrong| format!("the default of '{name}': {wrong}"))))
}

fn option_of_class(subject: &Subject) -> CheckResult {
    let of_class = if subject.of.class == Class::Worker { &["period_ns", "age_max_ns", "in_place"][..] } else { &[] };
    none_of(subject.of.options.iter().filter(|word| of_class.contains(&word.name)).map(|word| format!("'{}' does", word.name)))
}
