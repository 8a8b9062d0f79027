// SPDX-License-Identifier: Apache-2.0
//! Causes of alarms, and how long each keeps its alarm active:
//!
//! - the end of a device's own verb without a command: until the device is enabled or reset
//! - a lost physical device: as long as it is lost
//! - a lost processor, and the emergency stop: until the reset
//! - an abnormal end of another verb: not at all, because the end is an event; the alarm returns at once
//! - a forced signal: until it is released
//! - a condition that names an alarm
//! - the programming system
//!
//! Ends that follow from one of these raise no alarm of their own, so that each cause has a single entry.
use crate::alarms::list::{CURRENT_MAX, Cause, RaisedAlarm, Severity};
use crate::core::Core;
use crate::ending::report::Report;
use crate::refuse::unknown;
use model::plan::Plan;
use model::refusal::Refusals;

/// Code of the alarm of a forced signal.
pub(crate) const FORCED: &str = "forced";

/// Conditions with which a verb ends as a consequence of another alarm or of a command.
const FOLLOWS: [&str; 6] = ["emergency_stop", "device_lost", "processor_lost", "device_disabled", "halted", "aborted"];

/// Conditions that have their own alarm, which the fault of a logical device would only repeat.
const TOLD: [&str; 2] = ["device_lost", "processor_lost"];

pub(crate) fn raise(core: &mut Core, raised: RaisedAlarm<'_>) {
    let now_ns = core.host.now_ns();
    core.observation.log.add(now_ns, "alarm", raised.source, format!("{}: {}", raised.code, raised.text));
    if let Some(gone) = core.safety.alarms.raise(raised, now_ns) {
        let text = format!("the alarm list is full ({CURRENT_MAX} alarms): '{}' of '{}' was dropped before it was cleared", gone.code, gone.source);
        core.observation.log.add(now_ns, "lost", &gone.source, text);
    }
}

/// Raises the alarm for conditions of a source that were lost because the queue of its kernel was full.
pub(crate) fn alarm_events_lost(core: &mut Core, source: &str, count: u64) {
    let text = format!("{count} conditions or other events of source '{source}' were lost, because their queue was full");
    let remedy = "report less often, or spread the verbs over more sources";
    raise(core, RaisedAlarm { code: "events_lost", source, block: None, text, remedy, severity: Severity::High, cause: Cause::Event });
    alarm_returns(core, "events_lost", source);
}

/// Records that the cause of an alarm of `code` from `source` no longer exists.
pub(crate) fn alarm_returns(core: &mut Core, code: &str, source: &str) {
    let now_ns = core.host.now_ns();
    core.safety.alarms.clear(now_ns, |a| a.code == code && a.source == source);
}

/// Raises the alarm for an emergency stop that was tripped by an input or by a call (`system`).
pub(crate) fn alarm_emergency(core: &mut Core, source: &str, reason: &str) {
    let (text, remedy) = (format!("emergency stop: {reason}"), "remove the cause, then reset");
    raise(core, RaisedAlarm { code: "emergency_stop", source, block: None, text, remedy, severity: Severity::Critical, cause: Cause::Latch });
}

/// Clears the causes removed by a reset: the emergency stop, the faults of logical devices, and the lost processors.
pub(crate) fn alarm_reset(core: &mut Core) {
    let now_ns = core.host.now_ns();
    core.safety.alarms.clear(now_ns, |a| matches!(a.cause, Cause::Latch | Cause::Fault | Cause::Processor));
}

/// Raises the alarm for a lost physical device.
pub(crate) fn alarm_lost(core: &mut Core, device: &str, message: &str) {
    let (text, remedy) = (format!("physical device '{device}' was lost: {message}"), "check its power and cable, then open it again");
    raise(core, RaisedAlarm { code: "device_lost", source: device, block: None, text, remedy, severity: Severity::Critical, cause: Cause::Loss });
}

/// Raises one alarm for a lost processor, however many sources, verbs and devices are lost with it. `place` is the process, if several
/// processors share one.
pub(crate) fn alarm_processor(core: &mut Core, place: &str, message: &str) {
    if core.safety.alarms.current.iter().any(|a| a.active && a.cause == Cause::Processor && a.source == place) {
        return;
    }
    let (text, remedy) = (message.to_owned(), "see the log for the reason, then call reset()");
    raise(core, RaisedAlarm { code: "processor_lost", source: place, block: None, text, remedy, severity: Severity::Critical, cause: Cause::Processor });
}

/// Raises the alarm of a forced signal. `to` describes the value and who forces it.
pub(crate) fn alarm_forced(core: &mut Core, signal: &str, is_output: bool, to: &str) {
    let (text, remedy) = (format!("{} '{signal}' is forced {to}", if is_output { "output" } else { "input" }), "release it as soon as it is not needed");
    raise(core, RaisedAlarm { code: FORCED, source: signal, block: None, text, remedy, severity: Severity::High, cause: Cause::Forced });
}

/// Raises the alarm for a recording that ended prematurely. It is an event that an operator must see.
pub(crate) fn alarm_recording(core: &mut Core, why: &str) {
    let (code, source, remedy) = ("recording_failed", "system", "free up disk space, and record into a new file");
    raise(core, RaisedAlarm { code, source, block: None, text: why.to_owned(), remedy, severity: Severity::Medium, cause: Cause::Event });
    alarm_returns(core, code, source);
}

/// Clears the alarm for a lost physical device that was closed or reopened.
pub(crate) fn alarm_closed(core: &mut Core, device: &str) {
    let now_ns = core.host.now_ns();
    core.safety.alarms.clear(now_ns, |a| a.cause == Cause::Loss && a.source == device);
}

/// Clears the alarm for a logical device that was re-enabled or deleted.
pub(crate) fn alarm_enabled(core: &mut Core, device: &str) {
    let now_ns = core.host.now_ns();
    core.safety.alarms.clear(now_ns, |a| a.cause == Cause::Fault && a.source == device);
}

/// Raises the alarm that a condition specifies.
pub(crate) fn alarm_of_condition(core: &mut Core, id: u64, condition: usize, block: Option<&str>, message: &str) {
    let Some(instance) = core.instances.get(&id) else { return };
    let Some(code) = instance.plan.conditions.get(condition).and_then(|c| c.alarm.clone()) else { return };
    let (verb, name) = (instance.plan.verb.clone(), instance.plan.conditions[condition].name.clone());
    let source = instance.owner.clone().unwrap_or(verb);
    let text = if message.is_empty() { format!("'{name}' of '{}'", instance.name) } else { message.to_owned() };
    raise(core, RaisedAlarm { code: &code, source: &source, block, text, remedy: "", severity: Severity::High, cause: Cause::Event });
    alarm_returns(core, &code, &source);
}

/// Raises the alarm for a verb that ended abnormally. `owner` is the device whose own verb ended, if the end was not caused by a command.
pub(crate) fn alarm_of_end(core: &mut Core, report: &Report, owner: Option<&str>, has_own: bool) {
    let text = match (&report.block, report.message.is_empty()) {
        (_, false) => format!("'{}' ended with '{}': {}", report.instance, report.condition, report.message),
        (Some(block), true) => format!("'{}' ended with '{}', reported by '{block}'", report.instance, report.condition),
        (None, true) => format!("'{}' ended with '{}'", report.instance, report.condition),
    };
    let block = report.block.as_deref();
    if let Some(device) = owner {
        if !TOLD.contains(&report.condition.as_str()) {
            let remedy = "remove the cause, then enable the device again";
            raise(core, RaisedAlarm { code: &report.condition, source: device, block, text, remedy, severity: Severity::High, cause: Cause::Fault });
        }
    } else if !report.normal && !has_own && !FOLLOWS.contains(&report.condition.as_str()) {
        raise(core, RaisedAlarm { code: &report.condition, source: &report.verb, block, text, remedy: "", severity: Severity::Medium, cause: Cause::Event });
        // The end is the event; it only remains for a person to see it.
        alarm_returns(core, &report.condition, &report.verb);
    }
}

/// Checks that texts are defined for all alarms that the verb's conditions specify.
pub(crate) fn check_alarms(core: &Core, plan: &Plan) -> Result<(), Refusals> {
    let codes = plan.conditions.iter().filter_map(|c| Some((c, c.alarm.as_ref()?)));
    let known = || core.safety.alarms.texts.keys().map(String::as_str);
    let wrong: Refusals = codes
        .filter(|(_, code)| !core.safety.alarms.texts.contains_key(*code))
        .flat_map(|(condition, code)| {
            unknown("alarm", code, known()).into_iter().map(|refusal| refusal.for_what(&format!("condition '{}' of verb '{}'", condition.name, plan.verb)))
        })
        .collect();
    if wrong.is_empty() { Ok(()) } else { Err(wrong) }
}

pub(crate) fn known_alarm(core: &Core, code: &str) -> Result<(), Refusals> {
    if core.safety.alarms.texts.contains_key(code) {
        return Ok(());
    }
    Err(unknown("alarm", code, core.safety.alarms.texts.keys().map(String::as_str)))
}
