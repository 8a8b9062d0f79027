// SPDX-License-Identifier: Apache-2.0
//! Requesting side of the check under the real-time sanitizer: starts a process that runs the exchanges.
use super::check::{CheckResult, PassedCheck};
use super::orders::{LIMIT, LINK, tell};
use super::report::{Outcome, Verdict};
use super::runtime::passes_of;
use super::sanitized::SAID;
use super::settings::Settings;
use interconnect::Link;
use process_kit::{Launch, UnixLink};
use serde_json::{Value, json};
use std::io::Read;

/// Returns the result of the check.
pub(super) fn outcome(kind: &str, options: &Value, settings: &Settings) -> Outcome {
    let verdict = match exchanged(kind, options, settings) {
        Ok(PassedCheck::Yes) => Verdict::Passed,
        Ok(PassedCheck::NotApplicable(why)) => Verdict::NotApplicable(why.to_owned()),
        Err(cause) => Verdict::Failed(cause),
    };
    Outcome {
        check: "sanitizer".to_owned(),
        sentence: "the real-time sanitizer finds no call that may block in an inline exchange and its safe state".to_owned(),
        verdict,
    }
}

fn exchanged(kind: &str, options: &Value, settings: &Settings) -> CheckResult {
    let Some(sanitizer) = &settings.sanitizer else {
        return Ok(PassedCheck::NotApplicable("it was not checked: no compiler here has the sanitizer, as clang 20 and Rust have"));
    };
    let (link, theirs) = UnixLink::pair().map_err(|why| why.to_string())?;
    let (mut said, says) = std::io::pipe().map_err(|why| why.to_string())?;
    let launch = Launch::new(settings.command.iter().cloned()).descriptor(LINK, theirs).descriptor(SAID, says.into());
    let passes = format!("suppressions='{}'", passes_of(sanitizer).display());
    let child = launch.variable("LD_PRELOAD", sanitizer).variable("RTSAN_OPTIONS", passes).start().map_err(|why| why.to_string())?;
    tell(&link, &json!({ "kind": kind, "options": options, "sanitized": true }), &[])?;
    let news: Value = match link.receive(settings.limit) {
        Ok(Some(news)) => serde_json::from_slice(&news).map_err(|why| why.to_string())?,
        Ok(None) => {
            child.kill();
            return Err(format!("it did not return within {} s", settings.limit.as_secs()));
        }
        Err(_) => {
            child.wait(LIMIT).ok_or("its process does not end")?;
            let mut text = Vec::new();
            said.read_to_end(&mut text).map_err(|why| why.to_string())?;
            return Err(blamed(&String::from_utf8_lossy(&text)));
        }
    };
    child.wait(LIMIT).ok_or("its process does not end")?;
    match (news["failed"].as_str().or_else(|| news["unknown"].as_str()), news["not_applicable"].as_str()) {
        (Some(cause), _) => Err(cause.to_owned()),
        (_, Some(_)) => Ok(PassedCheck::NotApplicable("it is not inline")),
        _ => Ok(PassedCheck::Yes),
    }
}

/// Returns the offending call on one line: the function and its caller.
fn blamed(said: &str) -> String {
    let called = said.lines().find_map(|line| line.split_once("real-time unsafe function `")?.1.split('`').next());
    // The first frame is in the sanitizer.
    let from = said.lines().filter(|line| line.trim_start().starts_with('#')).nth(1).and_then(|line| line.split_once(" in ")).map(|(_, place)| place.trim());
    match (called, from) {
        (Some(called), Some(from)) => format!("it calls {called}, from {from}"),
        _ => format!("it ended its process: {}", said.lines().last().unwrap_or_default()),
    }
}
