// SPDX-License-Identifier: Apache-2.0
//! Checks of the promises of a declaration: life cycle, safe state, services, counters, privileges.
use super::check::{Check, CheckResult, PassedCheck, holds, none_of};
use super::declaration::{line, lines, wrong_line, wrong_name, wrong_unit};
use super::subject::Subject;
use device::SafeBy;

pub(super) const CHECKS: &[Check] = &[
    Check { name: "life-waits", sentence: "it waits for its device for at most an hour", run: life_waits },
    Check { name: "life-lost", sentence: "a lost device is reported within a declared time of at most a minute", run: life_lost },
    Check { name: "safe-doc", sentence: "its safe state is described in one line", run: safe_doc },
    Check { name: "safe-by", sentence: "its safe state has at least one means, and each means is named once", run: safe_by },
    Check { name: "safe-time", sentence: "its safe state is reached within a declared time of at most 10 s", run: safe_time },
    Check { name: "service-words", sentence: "its services have unique names and a line each", run: service_words },
    Check { name: "service-arguments", sentence: "the arguments of each service are declared as options are", run: service_arguments },
    Check { name: "counter-words", sentence: "its counters have unique names and a line each", run: counter_words },
    Check { name: "rights", sentence: "each required privilege is named with the way to grant it: 'raw sockets: cap_net_raw'", run: rights },
];

fn life_waits(subject: &Subject) -> CheckResult {
    let ns = subject.of.life.waits_ns;
    holds((0..=3_600_000_000_000).contains(&ns), || format!("it waits for {ns} ns"))
}

fn life_lost(subject: &Subject) -> CheckResult {
    let ns = subject.of.life.lost_within_ns;
    holds((0..=60_000_000_000).contains(&ns), || format!("it is {ns} ns"))
}

fn safe_doc(subject: &Subject) -> CheckResult {
    line(subject.of.safe_state.doc)
}

fn safe_by(subject: &Subject) -> CheckResult {
    let by: &[SafeBy] = subject.of.safe_state.by;
    holds(!by.is_empty(), || "it has no means".to_owned())?;
    none_of((1..by.len()).filter(|i| by[..*i].contains(&by[*i])).map(|i| format!("'{}' appears twice", by[i])))
}

fn safe_time(subject: &Subject) -> CheckResult {
    let ns = subject.of.safe_state.within_ns;
    holds((0..=10_000_000_000).contains(&ns), || format!("it is {ns} ns"))
}

fn service_words(subject: &Subject) -> CheckResult {
    let services = subject.of.services;
    wrong_name(services.iter().map(|word| word.name)).map_or(Ok(()), Err)?;
    lines(services.iter().map(|word| (word.name, word.doc)))
}

fn service_arguments(subject: &Subject) -> CheckResult {
    for service in subject.of.services {
        let arguments = service.arguments.iter();
        let wrong = wrong_name(arguments.clone().map(|word| word.name)).or_else(|| arguments.clone().find_map(wrong_unit));
        wrong.or_else(|| arguments.clone().find_map(|word| wrong_line(word.doc))).map_or(Ok(()), |wrong| Err(format!("'{}': {wrong}", service.name)))?;
    }
    Ok(if subject.of.services.is_empty() { PassedCheck::NotApplicable("it has no services") } else { PassedCheck::Yes })
}

fn counter_words(subject: &Subject) -> CheckResult {
    wrong_name(subject.of.counters.iter().map(|word| word.name)).map_or(Ok(()), Err)?;
    lines(subject.of.counters.iter().map(|word| (word.name, word.doc)))
}

fn rights(subject: &Subject) -> CheckResult {
    let wrong = |right: &&&str| !right.split_once(": ").is_some_and(|(what, how)| !what.trim().is_empty() && !how.trim().is_empty());
    none_of(subject.of.rights.iter().filter(wrong).map(|right| format!("'{right}'")))
}
