// SPDX-License-Identifier: Apache-2.0
//! Lasting calls. Each runs in slices, so that the caller can be interrupted, and returns the call that continues it.
use crate::answered::Outcome;
use model::refusal::{Class, Refusal, Refusals};
use serde_json::{Value as Json, json};
use std::time::{Duration, Instant};
use supervisor::{System, WaitResult};

/// Virtual time that elapses between two checks of the slice, ns.
const ADVANCE_SLICE_NS: i64 = 10_000_000;

/// Returns the deadline of a wait on the system's clock: `until_ns`, or `timeout_ns` relative to now.
pub(crate) fn until(system: &System, timeout_ns: Option<i64>, until_ns: Option<i64>) -> Result<Option<i64>, Refusals> {
    match (timeout_ns, until_ns) {
        (Some(_), Some(_)) => Err(vec![Refusal::new(Class::CallError, "a wait cannot have both timeout_ns and until_ns; give one of them")]),
        (Some(timeout_ns), None) => Ok(Some(system.now_ns().saturating_add(timeout_ns))),
        (None, until_ns) => Ok(until_ns),
    }
}

/// Converts the result of a wait to an outcome. If the slice expired first, the outcome contains the call that continues the wait: `call`
/// with `arguments`.
pub(crate) fn lasting<T, U: From<T>>(waited: WaitResult<T>, timed_out: U, call: &'static str, arguments: impl FnOnce() -> Json) -> Outcome<U> {
    match waited {
        WaitResult::Done(result) => Outcome::Done(result.into()),
        WaitResult::TimedOut => Outcome::Done(timed_out),
        WaitResult::Slice => Outcome::GoesOn { call, arguments: arguments() },
    }
}

pub(crate) fn paused(system: &System, ids: &[u64], names: Vec<String>, slice: Duration) -> Result<Outcome<Vec<String>>, Refusals> {
    Ok(match system.paused(ids, slice)? {
        WaitResult::Slice => Outcome::GoesOn { call: "paused", arguments: json!({ "instances": ids, "names": names }) },
        WaitResult::Done(()) | WaitResult::TimedOut => Outcome::Done(names),
    })
}

pub(crate) fn advance(system: &System, duration_ns: i64, slice: Duration) -> Result<Outcome<()>, Refusals> {
    let begun = Instant::now();
    let mut left_ns = duration_ns;
    loop {
        let step_ns = left_ns.min(ADVANCE_SLICE_NS);
        system.advance(step_ns)?;
        left_ns -= step_ns;
        if left_ns == 0 {
            return Ok(Outcome::Done(()));
        }
        if begun.elapsed() >= slice {
            return Ok(Outcome::GoesOn { call: "advance", arguments: json!({ "duration_ns": left_ns }) });
        }
    }
}
