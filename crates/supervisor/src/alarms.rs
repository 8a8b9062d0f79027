// SPDX-License-Identifier: Apache-2.0
//! Alarms: what a person has to know of, until it is gone and acknowledged.
//!
//! The states are those of IEC 62682: active or returned, unacknowledged or acknowledged. An alarm that is active cannot be
//! acknowledged away: it stays, acknowledged, until its cause is gone. One that is both returned and acknowledged goes into the
//! history. The same alarm (code and source) that comes again is counted, and is unacknowledged again.
//!
//! What raises one: the end of a device's own verb that nobody asked for (active until the device is enabled or reset), a lost
//! physical device (active as long as it is lost), a lost processor (until the reset), the emergency stop (until the reset), an end of another verb that is not
//! normal (returned at once: the end is the event), a condition that names an alarm, and the programming system. Ends that
//! follow from one of these have no alarm of their own, so that one cause is one line.
use crate::core::Core;
use crate::refuse::{refuse, unknown};
use crate::report::Report;
use crate::system::System;
use indexmap::IndexMap;
use model::plan::Plan;
use model::refusal::{Class, Refusals};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::VecDeque;
use std::time::{SystemTime, UNIX_EPOCH};

/// How urgent an alarm is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    Low,
    Medium,
    #[default]
    High,
    Critical,
}

/// What is said of an alarm of one code.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AlarmText {
    pub text: String,
    #[serde(default)]
    pub remedy: String,
    #[serde(default)]
    pub severity: Severity,
}

/// One alarm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Alarm {
    /// Counts the alarms of the system.
    pub number: u64,
    pub code: String,
    /// The verb, device or channel that it comes from.
    pub source: String,
    /// The block that reported it, if one did.
    pub block: Option<String>,
    pub text: String,
    pub remedy: String,
    pub severity: Severity,
    pub active: bool,
    pub acknowledged: bool,
    /// How often it came.
    pub count: u64,
    /// When it came last, on the system's clock and on the wall (ns since 1970; under the virtual clock the system's own).
    pub time_ns: i64,
    pub wall_ns: i64,
    pub returned_ns: Option<i64>,
    pub acknowledged_ns: Option<i64>,
    #[serde(skip)]
    pub(crate) cause: Cause,
}

/// What keeps an alarm active.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Cause {
    /// Nothing: it was an event, or the programming system says when.
    #[default]
    Event,
    /// A logical device that is in the state `fault`.
    Fault,
    /// The emergency stop.
    Latch,
    /// A physical device that is lost, until it is open again.
    Loss,
    /// A processor that is lost, until a reset.
    Processor,
}

/// What is raised, before the texts are looked up.
pub(crate) struct Raised<'a> {
    pub code: &'a str,
    pub source: &'a str,
    pub block: Option<&'a str>,
    pub text: String,
    pub remedy: &'a str,
    pub severity: Severity,
    pub cause: Cause,
}

/// Alarms that wait for a person; more come from different sources than any person could read.
const CURRENT_MAX: usize = 1000;
/// Alarms of the past.
const HISTORY_MAX: usize = 1000;

/// All alarms of a system.
#[derive(Default)]
pub(crate) struct Alarms {
    texts: IndexMap<String, AlarmText>,
    current: Vec<Alarm>,
    history: VecDeque<Alarm>,
    last: u64,
    /// Alarms that had to leave before they were over, because there was no place for another.
    dropped: u64,
    /// The wall clock may be asked.
    pub has_wall: bool,
}

impl Alarms {
    fn wall_ns(&self, now_ns: i64) -> i64 {
        let wall = || SystemTime::now().duration_since(UNIX_EPOCH).ok().and_then(|d| i64::try_from(d.as_nanos()).ok());
        if self.has_wall { wall().unwrap_or(now_ns) } else { now_ns }
    }

    /// Gives back the alarm that had to leave for this one, if one did.
    fn raise(&mut self, raised: Raised<'_>, now_ns: i64) -> Option<Alarm> {
        let wall_ns = self.wall_ns(now_ns);
        let said = self.texts.get(raised.code);
        let text = match said {
            Some(said) if raised.text.is_empty() => said.text.clone(),
            Some(said) => format!("{}: {}", said.text, raised.text),
            None => raised.text,
        };
        let remedy = said.map_or(raised.remedy, |said| &said.remedy).to_owned();
        let severity = said.map_or(raised.severity, |said| said.severity);
        let block = raised.block.map(str::to_owned);
        if let Some(known) = self.current.iter_mut().find(|a| a.code == raised.code && a.source == raised.source) {
            known.count += 1;
            (known.active, known.acknowledged, known.cause) = (true, false, raised.cause);
            (known.time_ns, known.wall_ns, known.returned_ns, known.acknowledged_ns) = (now_ns, wall_ns, None, None);
            (known.text, known.block, known.remedy, known.severity) = (text, block, remedy, severity);
            return None;
        }
        let dropped = (self.current.len() == CURRENT_MAX).then(|| self.drop_one()).flatten();
        self.last += 1;
        self.current.push(Alarm {
            number: self.last,
            code: raised.code.to_owned(),
            source: raised.source.to_owned(),
            block,
            text,
            remedy,
            severity,
            active: true,
            acknowledged: false,
            count: 1,
            time_ns: now_ns,
            wall_ns,
            returned_ns: None,
            acknowledged_ns: None,
            cause: raised.cause,
        });
        dropped
    }

    /// The alarm that a person misses least: one that has returned before one that is active, a less severe one before others, the oldest.
    fn drop_one(&mut self) -> Option<Alarm> {
        let least = (0..self.current.len()).min_by_key(|&at| (self.current[at].active, self.current[at].severity))?;
        let gone = self.current.remove(least);
        self.dropped += 1;
        self.archive(gone.clone());
        Some(gone)
    }

    /// The cause is gone, of every alarm that `of` picks. How many.
    fn clear(&mut self, now_ns: i64, of: impl Fn(&Alarm) -> bool) -> usize {
        let mut cleared = 0;
        for alarm in self.current.iter_mut().filter(|a| a.active && of(a)) {
            (alarm.active, alarm.returned_ns) = (false, Some(now_ns));
            cleared += 1;
        }
        self.sweep();
        cleared
    }

    /// A person has seen every alarm that `of` picks. How many.
    fn acknowledge(&mut self, now_ns: i64, of: impl Fn(&Alarm) -> bool) -> usize {
        let mut seen = 0;
        for alarm in self.current.iter_mut().filter(|a| !a.acknowledged && of(a)) {
            (alarm.acknowledged, alarm.acknowledged_ns) = (true, Some(now_ns));
            seen += 1;
        }
        self.sweep();
        seen
    }

    /// What is returned and acknowledged is history.
    fn sweep(&mut self) {
        let is_over = |a: &Alarm| !a.active && a.acknowledged;
        let (over, current) = std::mem::take(&mut self.current).into_iter().partition(is_over);
        self.current = current;
        let over: Vec<Alarm> = over;
        over.into_iter().for_each(|alarm| self.archive(alarm));
    }

    fn archive(&mut self, alarm: Alarm) {
        if self.history.len() == HISTORY_MAX {
            self.history.pop_front();
        }
        self.history.push_back(alarm);
    }
}

/// Ends that follow from something that has an alarm, or that somebody asked for.
const FOLLOWS: [&str; 6] = ["emergency_stop", "device_lost", "processor_lost", "device_disabled", "halted", "aborted"];

/// Of those, what has an alarm of its own, which the fault of a logical device only repeats.
const TOLD: [&str; 2] = ["device_lost", "processor_lost"];

impl Core {
    pub(crate) fn raise(&mut self, raised: Raised<'_>) {
        let now_ns = self.host.now_ns();
        self.log.add(now_ns, "alarm", raised.source, format!("{}: {}", raised.code, raised.text));
        if let Some(gone) = self.alarms.raise(raised, now_ns) {
            let text = format!("there is no place for more than {CURRENT_MAX} alarms: '{}' of '{}' left before it was over", gone.code, gone.source);
            self.log.add(now_ns, "lost", &gone.source, text);
        }
    }

    /// Conditions of a source were lost: its kernel had no place for them.
    pub(crate) fn alarm_events_lost(&mut self, source: &str, count: u64) {
        let text = format!("{count} conditions or other events of source '{source}' were lost: more came than there is room for");
        let remedy = "report less often, or spread the verbs over more sources";
        self.raise(Raised { code: "events_lost", source, block: None, text, remedy, severity: Severity::High, cause: Cause::Event });
        self.alarm_returns("events_lost", source);
    }

    /// An alarm of `code` from `source` has no cause any more.
    pub(crate) fn alarm_returns(&mut self, code: &str, source: &str) {
        let now_ns = self.host.now_ns();
        self.alarms.clear(now_ns, |a| a.code == code && a.source == source);
    }

    /// The emergency stop was tripped, by an input or by a call (`system`).
    pub(crate) fn alarm_emergency(&mut self, source: &str, reason: &str) {
        let (text, remedy) = (format!("emergency stop: {reason}"), "remove the cause, then reset");
        self.raise(Raised { code: "emergency_stop", source, block: None, text, remedy, severity: Severity::Critical, cause: Cause::Latch });
    }

    /// The reset: neither the emergency stop, a logical device's fault nor a lost processor is there any more.
    pub(crate) fn alarm_reset(&mut self) {
        let now_ns = self.host.now_ns();
        self.alarms.clear(now_ns, |a| matches!(a.cause, Cause::Latch | Cause::Fault | Cause::Processor));
    }

    /// A physical device was lost.
    pub(crate) fn alarm_lost(&mut self, device: &str, message: &str) {
        let (text, remedy) = (format!("physical device '{device}' was lost: {message}"), "look at its power and cable, then open it again");
        self.raise(Raised { code: "device_lost", source: device, block: None, text, remedy, severity: Severity::Critical, cause: Cause::Loss });
    }

    /// A processor was lost: one alarm, however many sources, verbs and devices go with it. `place`: the process where several share one.
    pub(crate) fn alarm_processor(&mut self, place: &str, message: &str) {
        if self.alarms.current.iter().any(|a| a.active && a.cause == Cause::Processor && a.source == place) {
            return;
        }
        let (text, remedy) = (message.to_owned(), "see the log for why, then call reset()");
        self.raise(Raised { code: "processor_lost", source: place, block: None, text, remedy, severity: Severity::Critical, cause: Cause::Processor });
    }

    /// A recording has ended before its time: an event, which a person is to see.
    pub(crate) fn alarm_recording(&mut self, why: &str) {
        let (code, source, remedy) = ("recording_failed", "system", "make room on the disk, and record into a new file");
        self.raise(Raised { code, source, block: None, text: why.to_owned(), remedy, severity: Severity::Medium, cause: Cause::Event });
        self.alarm_returns(code, source);
    }

    /// A lost physical device was closed, or is open again.
    pub(crate) fn alarm_closed(&mut self, device: &str) {
        let now_ns = self.host.now_ns();
        self.alarms.clear(now_ns, |a| a.cause == Cause::Loss && a.source == device);
    }

    /// A logical device is enabled again, or gone: what made it a fault is.
    pub(crate) fn alarm_enabled(&mut self, device: &str) {
        let now_ns = self.host.now_ns();
        self.alarms.clear(now_ns, |a| a.cause == Cause::Fault && a.source == device);
    }

    /// A condition with an alarm of its own has come.
    pub(crate) fn alarm_of_condition(&mut self, id: u64, condition: usize, block: Option<&str>, message: &str) {
        let Some(instance) = self.instances.get(&id) else { return };
        let Some(code) = instance.plan.conditions.get(condition).and_then(|c| c.alarm.clone()) else { return };
        let (verb, name) = (instance.plan.verb.clone(), instance.plan.conditions[condition].name.clone());
        let source = instance.owner.clone().unwrap_or(verb);
        let text = if message.is_empty() { format!("'{name}' of '{}'", instance.name) } else { message.to_owned() };
        self.raise(Raised { code: &code, source: &source, block, text, remedy: "", severity: Severity::High, cause: Cause::Event });
        self.alarm_returns(&code, &source);
    }

    /// A verb has ended otherwise than it should. `owner`: the device that it kept going, where nobody asked for that end.
    pub(crate) fn alarm_of_end(&mut self, report: &Report, owner: Option<&str>, has_own: bool) {
        let text = match (&report.block, report.message.is_empty()) {
            (_, false) => format!("'{}' ended with '{}': {}", report.instance, report.condition, report.message),
            (Some(block), true) => format!("'{}' ended with '{}', reported by '{block}'", report.instance, report.condition),
            (None, true) => format!("'{}' ended with '{}'", report.instance, report.condition),
        };
        let block = report.block.as_deref();
        if let Some(device) = owner {
            if !TOLD.contains(&report.condition.as_str()) {
                let remedy = "remove the cause, then enable the device again";
                self.raise(Raised { code: &report.condition, source: device, block, text, remedy, severity: Severity::High, cause: Cause::Fault });
            }
        } else if !report.normal && !has_own && !FOLLOWS.contains(&report.condition.as_str()) {
            self.raise(Raised { code: &report.condition, source: &report.verb, block, text, remedy: "", severity: Severity::Medium, cause: Cause::Event });
            // The end is the event: what is left is to be seen by a person.
            self.alarm_returns(&report.condition, &report.verb);
        }
    }

    /// The alarms that a verb's conditions name have texts.
    pub(crate) fn check_alarms(&self, plan: &Plan) -> Result<(), Refusals> {
        let codes = plan.conditions.iter().filter_map(|c| Some((c, c.alarm.as_ref()?)));
        let known = || self.alarms.texts.keys().map(String::as_str);
        let wrong: Refusals = codes
            .filter(|(_, code)| !self.alarms.texts.contains_key(*code))
            .flat_map(|(condition, code)| {
                unknown("alarm", code, known()).into_iter().map(|refusal| refusal.for_what(&format!("condition '{}' of verb '{}'", condition.name, plan.verb)))
            })
            .collect();
        if wrong.is_empty() { Ok(()) } else { Err(wrong) }
    }
}

impl System {
    /// Says what an alarm of this code is; again changes it for alarms to come.
    pub fn define_alarm(&self, code: &str, said: AlarmText) -> Result<(), Refusals> {
        if code.is_empty() || said.text.is_empty() {
            return Err(refuse(Class::DefinitionError, format!("alarm '{code}' has no code or no text"), "give both"));
        }
        self.shared.command(|core| {
            core.alarms.texts.insert(code.to_owned(), said);
            Ok(())
        })
    }

    /// Raises an alarm that is defined; active until it is cleared.
    pub fn raise_alarm(&self, code: &str, source: &str, text: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            core.known_alarm(code)?;
            core.raise(Raised { code, source, block: None, text: text.to_owned(), remedy: "", severity: Severity::High, cause: Cause::Event });
            Ok(())
        })
    }

    /// The cause of an alarm that the programming system raised is gone. False where it was not active.
    pub fn clear_alarm(&self, code: &str, source: Option<&str>) -> Result<bool, Refusals> {
        self.shared.command(|core| {
            core.known_alarm(code)?;
            let now_ns = core.host.now_ns();
            Ok(core.alarms.clear(now_ns, |a| a.code == code && source.is_none_or(|source| a.source == source)) > 0)
        })
    }

    /// Acknowledges one alarm by its number, or all. How many were not yet.
    pub fn acknowledge_alarms(&self, number: Option<u64>) -> Result<usize, Refusals> {
        self.shared.command(|core| {
            if let Some(number) = number.filter(|n| !core.alarms.current.iter().any(|a| a.number == *n)) {
                let known: Vec<String> = core.alarms.current.iter().map(|a| a.number.to_string()).collect();
                return Err(unknown("alarm", &number.to_string(), known.iter().map(String::as_str)));
            }
            let now_ns = core.host.now_ns();
            Ok(core.alarms.acknowledge(now_ns, |a| number.is_none_or(|n| a.number == n)))
        })
    }

    /// The present alarms, newest last, those of the past, and the texts (JSON).
    pub fn alarms_json(&self) -> serde_json::Value {
        let core = self.shared.locked();
        json!({ "current": core.alarms.current, "history": core.alarms.history, "texts": core.alarms.texts, "dropped": core.alarms.dropped })
    }

    /// Takes over the history of an earlier life of the system; its numbers are not given again.
    pub fn restore_alarms(&self, history: Vec<Alarm>) -> Result<(), Refusals> {
        self.shared.command(|core| {
            let last = history.iter().map(|a| a.number).max().unwrap_or(0);
            core.alarms.last = core.alarms.last.max(last);
            history.into_iter().rev().for_each(|alarm| core.alarms.history.push_front(alarm));
            let over = core.alarms.history.len().saturating_sub(HISTORY_MAX);
            core.alarms.history.drain(..over);
            Ok(())
        })
    }
}

impl Core {
    fn known_alarm(&self, code: &str) -> Result<(), Refusals> {
        if self.alarms.texts.contains_key(code) {
            return Ok(());
        }
        Err(unknown("alarm", code, self.alarms.texts.keys().map(String::as_str)))
    }
}
