// SPDX-License-Identifier: Apache-2.0
//! Requesting side: starts the process that runs the checks, and a new one if it exits or hangs.
use super::all::checks;
use super::kills;
use super::orders::LINK;
use super::report::{Outcome, Report, Verdict};
use super::sanitizing;
use super::settings::Settings;
use interconnect::Link;
use process_kit::{Child, Launch, UnixLink};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::time::Duration;

/// Reason why a process that runs checks has ended.
enum Ran {
    ToItsEnd,
    /// The receiver of the outcomes has stopped the checks.
    Enough,
    /// The process exited during the most recently started check.
    Ended(String),
}

/// Outcomes so far, and the callback that receives each of them.
struct Outcomes<'a> {
    known: Vec<Outcome>,
    hear: &'a mut dyn FnMut(&Outcome) -> ControlFlow<()>,
}

impl Outcomes<'_> {
    fn push(&mut self, outcome: Outcome) -> ControlFlow<()> {
        let goes_on = (self.hear)(&outcome);
        self.known.push(outcome);
        goes_on
    }
}

/// Checks a driver with these options. `hear` receives each outcome as it arrives, and can stop the checks by breaking.
pub fn check(kind: &str, options: &Value, settings: &Settings, hear: &mut dyn FnMut(&Outcome) -> ControlFlow<()>) -> Report {
    let mut outcomes = Outcomes { known: Vec::new(), hear };
    // A break means that `hear` wants no more, which the report shows by its length.
    let _ended_early = check_all(kind, options, settings, &mut outcomes);
    Report { driver: kind.split('@').next().unwrap_or(kind).to_owned(), outcomes: outcomes.known }
}

fn check_all(kind: &str, options: &Value, settings: &Settings, outcomes: &mut Outcomes<'_>) -> ControlFlow<()> {
    let all = checks().len();
    while outcomes.known.len() < all {
        let before = outcomes.known.len();
        let cause = match run(kind, options, settings, outcomes) {
            Ok(Ran::Enough) => return ControlFlow::Break(()),
            Ok(Ran::ToItsEnd) if outcomes.known.len() > before => continue,
            Ok(Ran::ToItsEnd) => "its process reported nothing".to_owned(),
            Ok(Ran::Ended(cause)) => cause,
            // Nothing can be checked: the driver cannot be made, or no process can be started.
            Err(why) => return outcomes.push(failed(before, why)),
        };
        outcomes.push(failed(outcomes.known.len(), cause))?;
    }
    outcomes.push(sanitizing::outcome(kind, options, settings))?;
    kills::outcomes(kind, options, settings).try_for_each(|outcome| outcomes.push(outcome))
}

fn failed(index: usize, cause: String) -> Outcome {
    let check = checks()[index];
    Outcome { check: check.name.to_owned(), sentence: check.sentence.to_owned(), verdict: Verdict::Failed(cause) }
}

/// Makes a process run the remaining checks.
fn run(kind: &str, options: &Value, settings: &Settings, outcomes: &mut Outcomes<'_>) -> Result<Ran, String> {
    let (link, theirs) = UnixLink::pair().map_err(|why| why.to_string())?;
    let mut launch = Launch::new(settings.command.iter().cloned()).descriptor(LINK, theirs);
    if let Some(counting) = &settings.counting {
        launch = launch.variable("LD_PRELOAD", counting);
    }
    let child = launch.start().map_err(|why| format!("cannot start a process in which to check it: {why}"))?;
    let order = json!({ "kind": kind, "options": options, "exchanges": settings.exchanges, "from": outcomes.known.len() });
    link.send_with(order.to_string().as_bytes(), &[], Some(settings.limit)).map_err(|_| "the process in which it is checked ended at once".to_owned())?;
    let all = checks();
    while outcomes.known.len() < all.len() {
        match link.receive(settings.limit) {
            Err(_) => return Ok(Ran::Ended(format!("it ended its process: {}", ended(&child)))),
            Ok(None) => {
                child.kill();
                return Ok(Ran::Ended(format!("it did not return within {} s", settings.limit.as_secs())));
            }
            Ok(Some(bytes)) => {
                let news: Value = serde_json::from_slice(&bytes).map_err(|why| why.to_string())?;
                if let Some(why) = news["unknown"].as_str() {
                    return Err(why.to_owned());
                }
                if let Some(verdict) = verdict(&news) {
                    let check = all[outcomes.known.len()];
                    let outcome = Outcome { check: check.name.to_owned(), sentence: check.sentence.to_owned(), verdict };
                    if outcomes.push(outcome).is_break() {
                        child.kill();
                        return Ok(Ran::Enough);
                    }
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
