// SPDX-License-Identifier: Apache-2.0
//! Calls that last. Each is made slice by slice, so that whoever asks can be interrupted, and says how it goes on.
use crate::arguments::{Arguments, told};
use model::refusal::{Class, Refusal, Refusals};
use serde_json::{Value as Json, json};
use std::time::{Duration, Instant};
use supervisor::{System, Waited};

/// What a call has come to.
#[derive(Clone, Debug, PartialEq)]
pub enum Answered {
    /// It is over, with this result.
    Done(Json),
    /// Its slice is over: it goes on with this call and these arguments.
    Waiting { call: &'static str, arguments: Json },
}

/// The calls that last.
pub const WAITS: [&str; 7] = ["wait", "halt", "wait_enabled", "disable", "pause", "paused", "advance"];

/// Virtual time between two looks at the slice, ns.
const ADVANCE_SLICE_NS: i64 = 10_000_000;

/// Makes a call that lasts, for `slice` of real time at the most; nothing where it is none.
pub(crate) fn wait(system: &System, name: &str, a: &mut Arguments, slice: Duration) -> Result<Option<Answered>, Refusals> {
    let answered = match name {
        "wait" | "halt" => {
            let (instance, until_ns) = (a.take::<u64>("instance")?, until(system, a)?);
            a.none_left()?;
            if name == "halt" {
                system.halt(instance)?;
            }
            let arguments = json!({ "instance": instance, "until_ns": until_ns });
            answered(system.wait(instance, until_ns, slice)?, Json::Null, "wait", arguments)?
        }
        "wait_enabled" => {
            let (device, until_ns) = (a.take::<String>("name")?, until(system, a)?);
            a.none_left()?;
            answered(system.wait_enabled(&device, until_ns, slice)?, json!(false), "wait_enabled", json!({ "name": device, "until_ns": until_ns }))?
        }
        "disable" => {
            let device = a.take::<String>("name")?;
            a.none_left()?;
            answered(system.disable(&device, slice)?, Json::Null, "disable", json!({ "name": device }))?
        }
        "pause" => {
            let devices = a.or::<Option<Vec<String>>>("devices")?;
            a.none_left()?;
            let (ids, names): (Vec<u64>, Vec<String>) = system.pause(devices.as_deref())?.into_iter().unzip();
            paused(system, &ids, names, slice)?
        }
        "paused" => {
            let (ids, names) = (a.take::<Vec<u64>>("instances")?, a.take::<Vec<String>>("names")?);
            a.none_left()?;
            paused(system, &ids, names, slice)?
        }
        "advance" => {
            let duration_ns = a.take("duration_ns")?;
            a.none_left()?;
            advance(system, duration_ns, slice)?
        }
        _ => return Ok(None),
    };
    Ok(Some(answered))
}

/// When a wait gives up, on the system's clock: `until_ns`, or `timeout_ns` from now.
fn until(system: &System, a: &mut Arguments) -> Result<Option<i64>, Refusals> {
    match (a.or::<Option<i64>>("timeout_ns")?, a.or::<Option<i64>>("until_ns")?) {
        (Some(_), Some(_)) => Err(vec![Refusal::new(Class::CallError, "a wait has timeout_ns or until_ns, not both")]),
        (Some(timeout_ns), None) => Ok(Some(system.now_ns().saturating_add(timeout_ns))),
        (None, until_ns) => Ok(until_ns),
    }
}

fn answered<T: serde::Serialize>(waited: Waited<T>, timed_out: Json, call: &'static str, arguments: Json) -> Result<Answered, Refusals> {
    Ok(match waited {
        Waited::Done(result) => Answered::Done(told(result)?.unwrap_or_default()),
        Waited::TimedOut => Answered::Done(timed_out),
        Waited::Slice => Answered::Waiting { call, arguments },
    })
}

fn paused(system: &System, ids: &[u64], names: Vec<String>, slice: Duration) -> Result<Answered, Refusals> {
    Ok(match system.paused(ids, slice)? {
        Waited::Slice => Answered::Waiting { call: "paused", arguments: json!({ "instances": ids, "names": names }) },
        Waited::Done(()) | Waited::TimedOut => Answered::Done(json!(names)),
    })
}

fn advance(system: &System, duration_ns: i64, slice: Duration) -> Result<Answered, Refusals> {
    let begun = Instant::now();
    let mut left_ns = duration_ns.max(0);
    loop {
        let step_ns = left_ns.min(ADVANCE_SLICE_NS);
        system.advance(step_ns)?;
        left_ns -= step_ns;
        if left_ns == 0 {
            return Ok(Answered::Done(Json::Null));
        }
        if begun.elapsed() >= slice {
            return Ok(Answered::Waiting { call: "advance", arguments: json!({ "duration_ns": left_ns }) });
        }
    }
}
