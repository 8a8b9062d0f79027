// SPDX-License-Identifier: Apache-2.0
//! Values in the options of a driver that reach beyond its device: files, code, other drivers. They are found at every nesting depth,
//! based on the declarations of the drivers, before any driver uses them.
use crate::accepted::accepted;
use crate::option_word::{OptionWord, Reach};
use crate::registry::find;
use serde_json::Value;

/// A value of an option that reaches beyond the driver's device.
pub struct ReachingValue<'v> {
    /// Path of the option: `driver.options.path`.
    pub option: &'v str,
    /// [`Reach::File`] or [`Reach::Code`].
    pub reach: Reach,
    pub value: &'v mut Value,
}

/// Visits each value in the options of the driver `kind` that names a file or code, including the options of nested drivers. If the kind
/// includes a file, it is visited as the option `kind`, and the file is not loaded, because its declaration is not known here.
///
/// # Errors
/// Returns the first error of `visit`.
pub fn each_reach<E>(kind: &str, options: &mut Value, visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>) -> Result<(), E> {
    within("", kind, options, visit)
}

/// Visits each argument of a service of the driver `kind` that names a file or code. A driver with a nested driver has the services of
/// both.
///
/// # Errors
/// Returns the first error of `visit`.
pub fn each_reach_of_service<E>(
    (kind, options): (&str, &Value),
    service: &str,
    arguments: &mut Value,
    visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>,
) -> Result<(), E> {
    if kind.contains('@') {
        return Ok(());
    }
    let Ok(of) = find(kind) else { return Ok(()) };
    for word in of.services.iter().filter(|word| word.name == service).flat_map(|word| word.arguments) {
        of_word("", word, arguments, visit)?;
    }
    for word in accepted(of).filter(|word| word.reach == Reach::Driver) {
        let inner = &options[word.name];
        each_reach_of_service((inner["kind"].as_str().unwrap_or(""), &inner["options"]), service, arguments, visit)?;
    }
    Ok(())
}

fn within<E>(at: &str, kind: &str, options: &mut Value, visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>) -> Result<(), E> {
    if kind.contains('@') {
        return visit(ReachingValue { option: &format!("{at}kind"), reach: Reach::Code, value: &mut Value::String(kind.to_owned()) });
    }
    // An unknown kind does not open anything.
    let Ok(of) = find(kind) else { return Ok(()) };
    accepted(of).try_for_each(|word| of_word(at, word, options, visit))
}

fn of_word<E>(at: &str, word: &OptionWord, table: &mut Value, visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>) -> Result<(), E> {
    match table.get_mut(word.name).filter(|value| !value.is_null()) {
        Some(value) => one(&format!("{at}{}", word.name), word.reach, value, visit),
        None => Ok(()),
    }
}

fn one<E>(option: &str, reach: Reach, value: &mut Value, visit: &mut dyn FnMut(ReachingValue<'_>) -> Result<(), E>) -> Result<(), E> {
    match reach {
        Reach::Device => Ok(()),
        Reach::File | Reach::Code => visit(ReachingValue { option, reach, value }),
        Reach::Driver => {
            let kind = value["kind"].as_str().unwrap_or("").to_owned();
            match value.get_mut("options") {
                Some(options) => within(&format!("{option}.options."), &kind, options, visit),
                None => within(&format!("{option}.options."), &kind, &mut Value::Null, visit),
            }
        }
        Reach::Entries(words) => {
            let entries: Box<dyn Iterator<Item = (String, &mut Value)>> = match value {
                Value::Array(rows) => Box::new(rows.iter_mut().enumerate().map(|(index, row)| (index.to_string(), row))),
                Value::Object(rows) => Box::new(rows.iter_mut().map(|(name, row)| (name.clone(), row))),
                _ => return Ok(()),
            };
            for (name, entry) in entries {
                for (word, reach) in words {
                    if let Some(value) = entry.get_mut(*word).filter(|value| !value.is_null()) {
                        one(&format!("{option}.{name}.{word}"), *reach, value, visit)?;
                    }
                }
            }
            Ok(())
        }
    }
}
