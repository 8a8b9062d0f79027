// SPDX-License-Identifier: Apache-2.0
//! Checks of options: each wrong option is refused, and the error names it.
use super::check::{Check, CheckResult, PassedCheck, holds};
use super::subject::{Subject, of_another_kind};
use device::{DriverError, Kind};
use serde_json::{Value, json};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "made", sentence: "it can be created from the options that it is checked with", run: made },
    Check { name: "wrong-kind", sentence: "a value of a wrong kind is refused with the name of its option", run: wrong_kind },
    Check { name: "missing", sentence: "a missing required option is refused with its name", run: missing },
    Check { name: "unknown", sentence: "an option that is not declared is refused with its name", run: unknown },
    Check { name: "null", sentence: "an option that is null counts as omitted", run: null },
    Check { name: "no-table", sentence: "options that are not a table of names and values are refused", run: no_table },
    Check { name: "odd-numbers", sentence: "absurdly large numbers are accepted or refused, and do not end its process", run: odd_numbers },
    Check { name: "virtual-time", sentence: "its replacement under the virtual clock can be created", run: virtual_time },
    Check { name: "geometry", sentence: "the shape of its machine is available without opening it", run: geometry },
    Check { name: "trial", sentence: "the files that its options name pass its own trial", run: trial },
];

fn made(subject: &Subject) -> CheckResult {
    subject.made().map(|_| PassedCheck::Yes)
}

/// Checks that an option is refused, and that the error names it.
fn refused(subject: &Subject, options: &Value, name: &str) -> Result<(), String> {
    match subject.with(options) {
        Ok(_) => Err(format!("'{name}' is accepted")),
        Err(DriverError::Option { option, .. }) if option == name => Ok(()),
        Err(other) if other.to_string().contains(&format!("'{name}'")) => Ok(()),
        Err(other) => Err(format!("'{name}' is refused as: {other}")),
    }
}

fn wrong_kind(subject: &Subject) -> CheckResult {
    for word in device::options_of(subject.of) {
        refused(subject, &subject.and(word.name, of_another_kind(word.kind)), word.name)?;
    }
    Ok(PassedCheck::Yes)
}

fn missing(subject: &Subject) -> CheckResult {
    let needed: Vec<_> = subject.of.options.iter().filter(|word| word.default.is_none()).collect();
    for word in &needed {
        refused(subject, &subject.and(word.name, Value::Null), word.name)?;
    }
    Ok(if needed.is_empty() { PassedCheck::NotApplicable("it needs none") } else { PassedCheck::Yes })
}

fn unknown(subject: &Subject) -> CheckResult {
    refused(subject, &subject.and("no_such_option", json!(1)), "no_such_option").map(|()| PassedCheck::Yes)
}

fn null(subject: &Subject) -> CheckResult {
    let left_out = device::options_of(subject.of).into_iter().filter(|word| subject.options.get(word.name).is_none());
    for word in left_out.filter(|word| word.default.is_some()) {
        subject.with(&subject.and(word.name, Value::Null)).map_err(|why| format!("'{}': {why}", word.name))?;
    }
    Ok(PassedCheck::Yes)
}

fn no_table(subject: &Subject) -> CheckResult {
    let taken = [json!([1]), json!("text"), json!(3)].into_iter().find(|options| subject.with(options).is_ok());
    holds(taken.is_none(), || format!("{} is accepted", taken.unwrap_or_default()))
}

fn odd_numbers(subject: &Subject) -> CheckResult {
    for word in device::options_of(subject.of) {
        let odd: &[Value] = match word.kind {
            Kind::Number => &[json!(-1.0), json!(0.0), json!(1e308), json!(-1e308), json!(5e-324)],
            Kind::Whole => &[json!(-1), json!(0), json!(i64::MIN), json!(i64::MAX), json!(u64::MAX)],
            Kind::Text => &[json!(""), json!("\u{0}"), json!("…")],
            Kind::List => &[json!([])],
            Kind::Bool | Kind::Table => &[],
        };
        for value in odd {
            // Acceptance and refusal are both valid; a panic or the end of the process is not.
            let _ = subject.with(&subject.and(word.name, value.clone()));
        }
    }
    Ok(PassedCheck::Yes)
}

fn virtual_time(subject: &Subject) -> CheckResult {
    let (kind, options) = device::in_virtual_time(&subject.kind, &subject.options);
    device::open(&kind, &options).map(|_| PassedCheck::Yes).map_err(|why| format!("'{kind}': {why}"))
}

fn geometry(subject: &Subject) -> CheckResult {
    match device::geometry(&subject.kind, &subject.options) {
        Ok(Some(_)) => Ok(PassedCheck::Yes),
        Ok(None) => Ok(PassedCheck::NotApplicable("its machine has no picture")),
        Err(why) => Err(why.to_string()),
    }
}

fn trial(subject: &Subject) -> CheckResult {
    if subject.of.trial.is_none() {
        return Ok(PassedCheck::NotApplicable("it declares none"));
    }
    device::try_options(&subject.kind, &subject.options).map(|()| PassedCheck::Yes).map_err(|why| why.to_string())
}
