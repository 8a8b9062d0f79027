// SPDX-License-Identifier: Apache-2.0
//! What is of the right type and makes no sense: names that no line of a log can show, sizes that no machine has.
use crate::refuse::refuse;
use model::definition::{Initial, SvvSpecification};
use model::refusal::{Class, Refusals};

/// Signs of a name.
const NAME_MAX: usize = 256;

/// Bytes of one value of an SVV.
const VALUE_MAX: usize = 16 << 20;

/// Bytes of what an SVV keeps of its past.
const PAST_MAX: u64 = 1 << 30;

/// Bytes of a row of the past beside its value: number and time.
const STAMP: u64 = 16;

/// A name that can stand in a line. `what`: what is named so, "an SVV".
pub(crate) fn name(what: &str, name: &str) -> Result<(), Refusals> {
    let remedy = || "give a name, for example 'cell'";
    if name.trim().is_empty() {
        return Err(refuse(Class::CallError, format!("{what} cannot be named {name:?}"), remedy()));
    }
    if name.chars().any(char::is_control) {
        return Err(refuse(Class::CallError, format!("{what} cannot be named {:?}, which holds signs that cannot be shown", cut(name)), remedy()));
    }
    if name.chars().nth(NAME_MAX).is_some() {
        return Err(refuse(
            Class::CallError,
            format!("{what} cannot have a name of {} signs", name.chars().count()),
            format!("give one of at most {NAME_MAX}"),
        ));
    }
    Ok(())
}

fn cut(name: &str) -> String {
    name.chars().take(80).collect()
}

/// What is asked of an SVV, whose values have `size` bytes.
pub(crate) fn svv(called: &str, asked: &SvvSpecification, size: usize) -> Result<(), Refusals> {
    name("an SVV", called)?;
    if size > VALUE_MAX {
        let message = format!("a value of SVV '{called}' ({}) would have {size} bytes", asked.type_text);
        return Err(refuse(Class::ValueRefused, message, format!("at most {VALUE_MAX} are possible: take a shorter array")));
    }
    let row = size as u64 + STAMP;
    if u64::from(asked.history) * row > PAST_MAX {
        let message = format!("a history of {} values of SVV '{called}' would take {} MB", asked.history, u64::from(asked.history) * row / 1_000_000);
        return Err(refuse(Class::ValueRefused, message, format!("ask for at most {}, or record the values: cell.record(...)", PAST_MAX / row)));
    }
    if let Some((least, most)) = asked.within {
        if least > most {
            let message = format!("the range of SVV '{called}' is {least} to {most}");
            return Err(refuse(Class::ValueRefused, message, format!("give the lower end first: within=({most}, {least})")));
        }
        if let Some(Initial::Value(value)) = &asked.initial {
            crate::registry::ranges::within(called, value, least, most)?;
        }
    }
    Ok(())
}
