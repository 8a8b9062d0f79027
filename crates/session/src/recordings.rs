// SPDX-License-Identifier: Apache-2.0
//! Calls on recordings: begin one, look at it, end it.
use crate::arguments::{Answer, Arguments, told};
use model::refusal::{Class, Refusal, Refusals};
use recorder::{Options, Recorder, Summary};
use serde_json::json;
use std::path::PathBuf;
use std::time::Duration;
use supervisor::System;

/// How long the end of a recording is waited for in one call: what waits for a slow disk may take longer.
const END_MAX: Duration = Duration::from_millis(500);

pub(crate) fn recordings(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "record" => {
            let path = a.take::<PathBuf>("path")?;
            told(json!({ "recording": record(system, &path, a.whole::<Options>()?)? }))
        }
        "recording" | "stop_recording" => {
            let number = a.take::<u64>("recording")?;
            a.none_left()?;
            told(if name == "recording" { of(system, number)?.summary() } else { end(system, number, END_MAX)? })
        }
        _ => Ok(None),
    }
}

/// Begins a recording; its number in the system.
pub fn record(system: &System, path: &std::path::Path, options: Options) -> Result<u64, Refusals> {
    Recorder::start(system, path, &options).map(|(number, _)| number)
}

/// How a recording stands.
pub fn recording(system: &System, number: u64) -> Result<Summary, Refusals> {
    Ok(of(system, number)?.summary())
}

/// Ends a recording, and waits at most so long until it has ended: `running` tells.
pub fn end_recording(system: &System, number: u64, patience: Duration) -> Result<Summary, Refusals> {
    end(system, number, patience)
}

fn end(system: &System, number: u64, patience: Duration) -> Result<Summary, Refusals> {
    Ok(of(system, number)?.stop_within(patience))
}

fn of(system: &System, number: u64) -> Result<std::sync::Arc<Recorder>, Refusals> {
    let found = system.companion(number).and_then(|companion| companion.as_any().downcast::<Recorder>().ok());
    found.ok_or_else(|| vec![Refusal::new(Class::UnknownName, format!("there is no recording {number}")).remedy("take the number that 'record' gave")])
}
