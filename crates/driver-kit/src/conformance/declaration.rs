// SPDX-License-Identifier: Apache-2.0
//! Checks of the declaration: what a manual says before a driver is made.
use super::check::{Check, Passed, Tried, holds, none_of};
use super::subject::Subject;
use device::{Class, Kind, OptionWord, SafeBy};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "name", sentence: "its name is lower-case letters, digits and _", run: name },
    Check { name: "doc", sentence: "one line says what it drives", run: doc },
    Check { name: "option-names", sentence: "its options have names of their own, of lower-case letters, digits and _", run: option_names },
    Check { name: "option-docs", sentence: "one line says what each option is", run: option_docs },
    Check { name: "option-units", sentence: "only numbers and lists have a unit, and what ends with _ns is whole and in ns", run: option_units },
    Check { name: "option-defaults", sentence: "each option says what it is where it is left out, or that it is needed", run: option_defaults },
    Check { name: "option-of-class", sentence: "no option takes the name of one that each driver of its class has", run: option_of_class },
    Check { name: "life-waits", sentence: "it waits for its device for no time or some, and at most an hour", run: life_waits },
    Check { name: "life-lost", sentence: "a lost device is told within a declared time of at most a minute", run: life_lost },
    Check { name: "safe-doc", sentence: "one line says what its safe state is", run: safe_doc },
    Check { name: "safe-by", sentence: "its safe state is brought about by somebody, and by each once", run: safe_by },
    Check { name: "safe-time", sentence: "its safe state holds within a declared time of at most 10 s", run: safe_time },
    Check { name: "service-words", sentence: "its services have names of their own and a line each", run: service_words },
    Check { name: "service-arguments", sentence: "the arguments of each service are declared as options are", run: service_arguments },
    Check { name: "counter-words", sentence: "its counters have names of their own and a line each", run: counter_words },
    Check { name: "rights", sentence: "each right says what it is and how it is given: 'raw sockets: cap_net_raw'", run: rights },
];

const LINE_MAX: usize = 200;

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_lowercase()) && text.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
}

/// What is wrong with a line; none: nothing.
pub(super) fn wrong_line(text: &str) -> Option<String> {
    if text.trim().is_empty() {
        return Some("it is empty".to_owned());
    }
    if text.contains('\n') {
        return Some("it is more than one line".to_owned());
    }
    (text.chars().count() > LINE_MAX).then(|| format!("it has more than {LINE_MAX} letters"))
}

/// The first name that is none, or is there twice.
pub(super) fn wrong_name<'a>(names: impl Iterator<Item = &'a str>) -> Option<String> {
    let names: Vec<&str> = names.collect();
    let at = |i: usize| match names[i] {
        name if !is_name(name) => Some(format!("'{name}' is no name")),
        name if names[..i].contains(&name) => Some(format!("'{name}' is there twice")),
        _ => None,
    };
    (0..names.len()).find_map(at)
}

fn line(text: &str) -> Tried {
    wrong_line(text).map_or(Ok(Passed::Yes), Err)
}

fn lines<'a>(words: impl Iterator<Item = (&'a str, &'a str)>) -> Tried {
    none_of(words.filter_map(|(name, doc)| wrong_line(doc).map(|wrong| format!("'{name}': {wrong}"))))
}

fn name(subject: &Subject) -> Tried {
    holds(is_name(subject.of.kind), || format!("it is '{}'", subject.of.kind))
}

fn doc(subject: &Subject) -> Tried {
    line(subject.of.doc)
}

fn option_names(subject: &Subject) -> Tried {
    wrong_name(subject.of.options.iter().map(|word| word.name)).map_or(Ok(Passed::Yes), Err)
}

fn option_docs(subject: &Subject) -> Tried {
    lines(subject.of.options.iter().map(|word| (word.name, word.doc)))
}

fn wrong_unit(word: &OptionWord) -> Option<String> {
    if !word.unit.is_empty() && !matches!(word.kind, Kind::Number | Kind::Whole | Kind::List | Kind::Table) {
        return Some(format!("'{}' is no number and is in {}", word.name, word.unit));
    }
    if word.unit.contains(char::is_whitespace) {
        return Some(format!("'{}' is in '{}', which is no unit", word.name, word.unit));
    }
    let is_time = word.name.ends_with("_ns");
    (is_time && (word.unit, word.kind) != ("ns", Kind::Whole)).then(|| format!("'{}' is no whole number in ns", word.name))
}

fn option_units(subject: &Subject) -> Tried {
    none_of(subject.of.options.iter().filter_map(wrong_unit))
}

fn option_defaults(subject: &Subject) -> Tried {
    let words = subject.of.options.iter().filter_map(|word| Some((word.name, word.default?)));
    none_of(words.filter_map(|(name, text)| wrong_line(text).map(|wrong| format!("the default of '{name}': {wrong}"))))
}

fn option_of_class(subject: &Subject) -> Tried {
    let of_class = if subject.of.class == Class::Worker { &["period_ns", "age_max_ns", "in_place"][..] } else { &[] };
    none_of(subject.of.options.iter().filter(|word| of_class.contains(&word.name)).map(|word| format!("'{}' does", word.name)))
}

fn life_waits(subject: &Subject) -> Tried {
    let ns = subject.of.life.waits_ns;
    holds((0..=3_600_000_000_000).contains(&ns), || format!("it waits for {ns} ns"))
}

fn life_lost(subject: &Subject) -> Tried {
    let ns = subject.of.life.lost_within_ns;
    holds((0..=60_000_000_000).contains(&ns), || format!("it is {ns} ns"))
}

fn safe_doc(subject: &Subject) -> Tried {
    line(subject.of.safe_state.doc)
}

fn safe_by(subject: &Subject) -> Tried {
    let by: &[SafeBy] = subject.of.safe_state.by;
    holds(!by.is_empty(), || "by nobody".to_owned())?;
    none_of((1..by.len()).filter(|i| by[..*i].contains(&by[*i])).map(|i| format!("'{}' is there twice", by[i])))
}

fn safe_time(subject: &Subject) -> Tried {
    let ns = subject.of.safe_state.within_ns;
    holds((0..=10_000_000_000).contains(&ns), || format!("it is {ns} ns"))
}

fn service_words(subject: &Subject) -> Tried {
    let services = subject.of.services;
    wrong_name(services.iter().map(|word| word.name)).map_or(Ok(()), Err)?;
    lines(services.iter().map(|word| (word.name, word.doc)))
}

fn service_arguments(subject: &Subject) -> Tried {
    for service in subject.of.services {
        let arguments = service.arguments.iter();
        let wrong = wrong_name(arguments.clone().map(|word| word.name)).or_else(|| arguments.clone().find_map(wrong_unit));
        wrong.or_else(|| arguments.clone().find_map(|word| wrong_line(word.doc))).map_or(Ok(()), |wrong| Err(format!("'{}': {wrong}", service.name)))?;
    }
    Ok(if subject.of.services.is_empty() { Passed::NotApplicable("it has no services") } else { Passed::Yes })
}

fn counter_words(subject: &Subject) -> Tried {
    wrong_name(subject.of.counters.iter().map(|word| word.name)).map_or(Ok(()), Err)?;
    lines(subject.of.counters.iter().map(|word| (word.name, word.doc)))
}

fn rights(subject: &Subject) -> Tried {
    let wrong = |right: &&&str| !right.split_once(": ").is_some_and(|(what, how)| !what.trim().is_empty() && !how.trim().is_empty());
    none_of(subject.of.rights.iter().filter(wrong).map(|right| format!("'{right}'")))
}
