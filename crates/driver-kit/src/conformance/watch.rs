// SPDX-License-Identifier: Apache-2.0
//! The side that asks: it starts the process of the checks, and another one where that ends or does not come back.
use super::all::checks;
use super::kills;
use super::orders::LINK;
use super::report::{Outcome, Report, Verdict};
use super::sanitizing;
use super::settings::Settings;
use interconnect::Link;
use process_kit::{Child, Launch, UnixLink};
use serde_json::{Value, json};
use std::time::Duration;

/// What came of a process of checks.
enum Ran {
    ToItsEnd,
    /// The process ended in the check that was begun last.
    Ended(String),
}

/// Checks a driver with these options.
pub fn check(kind: &str, options: &Value, settings: &Settings) -> Report {
    let mut report = Report { driver: kind.split('@').next().unwrap_or(kind).to_owned(), outcomes: Vec::new() };
    let all = checks().len();
    while report.outcomes.len() < all {
        let before = report.outcomes.len();
        match run(kind, options, settings, &mut report.outcomes) {
            Ok(Ran::ToItsEnd) if report.outcomes.len() > before => {}
            Ok(Ran::ToItsEnd) => report.outcomes.push(failed(before, "its process said nothing".to_owned())),
            Ok(Ran::Ended(cause)) => report.outcomes.push(failed(report.outcomes.len(), cause)),
            // Nothing can be checked: it is no driver, or no process can be started.
            Err(why) => {
                report.outcomes.push(failed(report.outcomes.len(), why));
                return report;
            }
        }
    }
    report.outcomes.push(sanitizing::outcome(kind, options, settings));
    report.outcomes.extend(kills::outcomes(kind, options, settings));
    report
}

fn failed(index: usize, cause: String) -> Outcome {
    let check = checks()[index];
    Outcome { check: check.name.to_owned(), sentence: check.sentence.to_owned(), verdict: Verdict::Failed(cause) }
}

/// Has a process do the checks that are not done yet.
fn run(kind: &str, options: &Value, settings: &Settings, outcomes: &mut Vec<Outcome>) -> Result<Ran, String> {
    let (link, theirs) = UnixLink::pair().map_err(|why| why.to_string())?;
    let mut launch = Launch::new(settings.command.iter().cloned()).descriptor(LINK, theirs);
    if let Some(counting) = &settings.counting {
        launch = launch.variable("LD_PRELOAD", counting);
    }
    let child = launch.start().map_err(|why| format!("no process to check it in: {why}"))?;
    let order = json!({ "kind": kind, "options": options, "exchanges": settings.exchanges, "from": outcomes.len() });
    link.send_with(order.to_string().as_bytes(), &[], Some(settings.limit)).map_err(|_| "the process to check it in ended at once".to_owned())?;
    let all = checks();
    while outcomes.len() < all.len() {
        match link.receive(settings.limit) {
            Err(_) => return Ok(Ran::Ended(format!("it ended its process: {}", ended(&child)))),
            Ok(None) => {
                child.kill();
                return Ok(Ran::Ended(format!("it did not come back within {} s", settings.limit.as_secs())));
            }
            Ok(Some(bytes)) => {
                let news: Value = serde_json::from_slice(&bytes).map_err(|why| why.to_string())?;
                if let Some(why) = news["unknown"].as_str() {
                    return Err(why.to_owned());
                }
                if let Some(verdict) = verdict(&news) {
                    let check = all[outcomes.len()];
                    outcomes.push(Outcome { check: check.name.to_owned(), sentence: check.sentence.to_owned(), verdict });
                }
            }
        }
    }
    if child.wait(settings.limit).is_none() {
        child.kill();
    }
    Ok(Ran::ToItsEnd)
}

fn verdict(news: &Value) -> Option<Verdict> {
    let text = |name: &str| news[name].as_str().map(str::to_owned);
    text("failed").map(Verdict::Failed).or_else(|| text("not_applicable").map(Verdict::NotApplicable)).or_else(|| text("passed").map(|_| Verdict::Passed))
}

fn ended(child: &Child) -> String {
    child.wait(Duration::from_secs(60)).map_or_else(|| "it closed its link".to_owned(), |status| status.to_string())
}
