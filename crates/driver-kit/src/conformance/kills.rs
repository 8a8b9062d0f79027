// SPDX-License-Identifier: Apache-2.0
//! kill -9 in each phase of a driver's life cycle: checks that the handles of the guard then work, and that the next process can open the
//! device.
use super::check::{CheckResult, PassedCheck};
use super::orders::{LIMIT, LINK, tell};
use super::phases::{PHASES, Phase};
use super::report::{Outcome, Verdict};
use super::safe_state::write;
use super::settings::Settings;
use device::SafeHandle;
use process_kit::{Launch, UnixLink};
use serde_json::{Value, json};

/// Returns the outcomes of all phases in order.
pub(super) fn outcomes(kind: &str, options: &Value, settings: &Settings) -> impl Iterator<Item = Outcome> {
    let outcome = move |(_, name, sentence): &(Phase, &str, &str)| Outcome {
        check: (*name).to_owned(),
        sentence: (*sentence).to_owned(),
        verdict: match killed(kind, options, name, settings) {
            Ok(PassedCheck::Yes) => Verdict::Passed,
            Ok(PassedCheck::NotApplicable(why)) => Verdict::NotApplicable(why.to_owned()),
            Err(cause) => Verdict::Failed(cause),
        },
    };
    PHASES.iter().map(outcome)
}

/// Kills a process in that phase, carries out the guard's writes, and has another process open the device.
fn killed(kind: &str, options: &Value, phase: &str, settings: &Settings) -> CheckResult {
    let handles = reached(kind, options, phase, settings)?;
    handles.into_iter().try_for_each(write).map_err(|why| format!("a handle of the guard: {why}"))?;
    reached(kind, options, "kill-engaged", settings).map_err(|why| format!("the next process: {why}"))?;
    Ok(PassedCheck::Yes)
}

/// Starts a process that runs up to a phase, and kills it there. Returns the handles that the guard has at that time.
fn reached(kind: &str, options: &Value, phase: &str, settings: &Settings) -> Result<Vec<SafeHandle>, String> {
    let (link, theirs) = UnixLink::pair().map_err(|why| why.to_string())?;
    let child = Launch::new(settings.command.iter().cloned()).descriptor(LINK, theirs).start().map_err(|why| why.to_string())?;
    tell(&link, &json!({ "kind": kind, "options": options, "phase": phase }), &[])?;
    let frame = link.receive_with(LIMIT).map_err(|_| format!("its process ended: {}", ended(&child)))?;
    let (bytes, descriptors) = frame.ok_or_else(|| format!("it did not reach this point within {} s", LIMIT.as_secs()))?;
    child.kill();
    child.wait(LIMIT).ok_or("its process does not end when it is killed")?;
    let news: Value = serde_json::from_slice(&bytes).map_err(|why| why.to_string())?;
    if let Some(why) = news["failed"].as_str().or_else(|| news["unknown"].as_str()) {
        return Err(why.to_owned());
    }
    let writes: Vec<Vec<(u64, Vec<u8>)>> = serde_json::from_value(news["reached"].clone()).map_err(|why| why.to_string())?;
    Ok(descriptors.into_iter().zip(writes).map(|(descriptor, writes)| SafeHandle { descriptor, writes, latches: false }).collect())
}

fn ended(child: &process_kit::Child) -> String {
    child.wait(LIMIT).map_or_else(|| "it has not ended".to_owned(), |status| status.to_string())
}
