// SPDX-License-Identifier: Apache-2.0
//! Process in which a driver is checked: it executes the order in its first frame, and reports each check as it begins and ends.
use super::all::checks;
use super::check::{CheckResult, PassedCheck};
use super::kept;
use super::orders::LINK;
use super::phases::{self, Phase};
use super::report::Verdict;
use super::sanitized;
use super::subject::Subject;
use device::{Class, DeclaredServices, DriverError};
use interconnect::Link;
use process_kit::{UnixLink, inherited};
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

/// Time limit for receiving the order from the parent process.
const ORDER: Duration = Duration::from_secs(60);

/// Executes the order for this process: the checks of a driver, or one phase of its life cycle in which it is to be killed.
///
/// # Errors
/// Fails with a human-readable message if the process was not started for this purpose.
pub fn serve() -> Result<(), String> {
    let gone = |_| "the process that started it has exited".to_owned();
    let link = UnixLink::from_descriptor(inherited(LINK).map_err(|why| why.to_string())?).map_err(|why| why.to_string())?;
    kept::remember();
    let order = link.receive(ORDER).map_err(gone)?.ok_or("it received no order")?;
    let order: Value = serde_json::from_slice(&order).map_err(|why| why.to_string())?;
    let tell = |news: Value| link.send_with(news.to_string().as_bytes(), &[], None).map_err(gone);
    let subject = match subject(&order) {
        Ok(subject) => subject,
        Err(why) => return tell(json!({ "unknown": why.to_string() })),
    };
    if let Some(phase) = order["phase"].as_str().and_then(Phase::of) {
        return phases::live(&subject, phase, &link);
    }
    if order["sanitized"].as_bool() == Some(true) {
        return tell(told(tried(sanitized::exchange, &subject)));
    }
    let from = usize::try_from(order["from"].as_u64().unwrap_or(0)).unwrap_or(usize::MAX);
    for check in checks().into_iter().skip(from) {
        tell(json!({ "begins": check.name }))?;
        tell(told(tried(check.run, &subject)))?;
    }
    Ok(())
}

fn subject(order: &Value) -> Result<Subject, DriverError> {
    let kind = order["kind"].as_str().unwrap_or_default().to_owned();
    let mut of = device::find(&kind)?;
    // A driver that represents others learns their services and counters when it is made.
    if of.class == Class::Process
        && let Ok((_, about)) = device::open(&kind, &order["options"])
    {
        of = DeclaredServices::read(&about).map_err(DriverError::Failed)?.declare(of);
    }
    Ok(Subject { of, kind, options: order["options"].clone(), exchanges: order["exchanges"].as_u64().unwrap_or(0) })
}

fn told(verdict: Verdict) -> Value {
    match verdict {
        Verdict::Passed => json!({ "passed": "" }),
        Verdict::Failed(cause) => json!({ "failed": cause }),
        Verdict::NotApplicable(why) => json!({ "not_applicable": why }),
    }
}

fn tried(run: fn(&Subject) -> CheckResult, subject: &Subject) -> Verdict {
    match catch_unwind(AssertUnwindSafe(|| run(subject))) {
        Ok(Ok(PassedCheck::Yes)) => Verdict::Passed,
        Ok(Ok(PassedCheck::NotApplicable(why))) => Verdict::NotApplicable(why.to_owned()),
        Ok(Err(cause)) => Verdict::Failed(cause),
        Err(panicked) => {
            let text = panicked.downcast_ref::<String>().cloned().or_else(|| panicked.downcast_ref::<&str>().map(|text| (*text).to_owned()));
            Verdict::Failed(format!("it panicked: {}", text.unwrap_or_default()))
        }
    }
}
