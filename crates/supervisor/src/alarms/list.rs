// SPDX-License-Identifier: Apache-2.0
//! List of alarms: everything that an operator must know about, until it has returned and been acknowledged.
//!
//! The states are those of IEC 62682: active or returned, unacknowledged or acknowledged. Acknowledging does not remove an active alarm:
//! it remains in the list, acknowledged, until its cause no longer exists. An alarm that is both returned and acknowledged moves to the
//! history. If the same alarm (code and source) recurs, it is counted and becomes unacknowledged again.
use crate::alarms::shelving::Shelving;
use indexmap::IndexMap;
use model::wording::printable;
use serde::{Deserialize, Serialize};
use std::collections::{BinaryHeap, VecDeque};
use std::time::{SystemTime, UNIX_EPOCH};

/// Urgency of an alarm.
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

/// Text of an alarm code.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct AlarmText {
    pub text: String,
    #[serde(default)]
    pub remedy: String,
    #[serde(default)]
    pub severity: Severity,
}

/// An alarm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Alarm {
    /// Number of the alarm, unique within the system.
    pub number: u64,
    pub code: String,
    /// Verb, device or channel that raised the alarm.
    pub source: String,
    /// Block that reported the alarm, if any.
    pub block: Option<String>,
    pub text: String,
    pub remedy: String,
    pub severity: Severity,
    pub active: bool,
    pub acknowledged: bool,
    /// Number of occurrences.
    pub count: u64,
    /// Time of the last occurrence, on the system's clock and on the wall clock (ns since the Unix epoch; if the system's clock is
    /// virtual, its time is used for both).
    pub time_ns: i64,
    pub wall_ns: i64,
    pub returned_ns: Option<i64>,
    pub acknowledged_ns: Option<i64>,
    /// True if the alarm can be shelved. Emergency stops, losses, critical alarms, and alarms from an earlier run stay in the list.
    #[serde(default)]
    pub shelvable: bool,
    /// Shelvings of the alarm, most recent last.
    #[serde(default)]
    pub shelvings: Vec<Shelving>,
    #[serde(skip)]
    pub(crate) cause: Cause,
}

impl Alarm {
    /// Makes the texts of the alarm safe for a terminal, because they come from a program's own file.
    pub(crate) fn printable(self) -> Alarm {
        let (code, source, text, remedy) = (printable(self.code), printable(self.source), printable(self.text), printable(self.remedy));
        let shelvings = self.shelvings.into_iter().map(Shelving::printable).collect();
        Alarm { code, source, text, remedy, shelvings, ..self }
    }
}

/// Cause that keeps an alarm active.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Cause {
    /// No cause: the alarm is an event, or the programming system clears it.
    #[default]
    Event,
    /// A logical device in the state `fault`.
    Fault,
    /// The latched emergency stop.
    Latch,
    /// A lost physical device, until it is reopened.
    Loss,
    /// A lost processor, until a reset.
    Processor,
    /// A forced signal, until it is released.
    Forced,
}

/// Alarm to be raised; its texts have not been looked up yet.
pub(crate) struct RaisedAlarm<'a> {
    pub code: &'a str,
    pub source: &'a str,
    pub block: Option<&'a str>,
    pub text: String,
    pub remedy: &'a str,
    pub severity: Severity,
    pub cause: Cause,
}

/// Maximum number of current alarms, more than any person could read.
pub(crate) const CURRENT_MAX: usize = 1000;
/// Maximum number of past alarms; [`Alarms::trim`] drops the rest.
pub(crate) const HISTORY_MAX: usize = 1000;

/// Alarms of a system, as returned by a call.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Alarms"))]
pub struct AlarmList {
    /// Alarms that are active or not acknowledged, newest last.
    pub current: Vec<Alarm>,
    /// Alarms that an operator has removed from the list of current alarms for a limited time.
    pub shelved: Vec<Alarm>,
    /// Past alarms, oldest first.
    pub history: Vec<Alarm>,
    /// Text of each code.
    pub texts: IndexMap<String, AlarmText>,
    /// Number of current alarms that were dropped because the list was full.
    pub dropped: u64,
}

/// Alarms of a system.
#[derive(Default)]
pub(crate) struct Alarms {
    pub texts: IndexMap<String, AlarmText>,
    pub current: Vec<Alarm>,
    pub history: VecDeque<Alarm>,
    pub last: u64,
    /// Number of current alarms that were dropped because the list was full.
    pub dropped: u64,
    /// True if the wall clock may be read.
    pub has_wall: bool,
}

impl Alarms {
    pub(crate) fn wall_ns(&self, now_ns: i64) -> i64 {
        let wall = || SystemTime::now().duration_since(UNIX_EPOCH).ok().and_then(|d| i64::try_from(d.as_nanos()).ok());
        if self.has_wall { wall().unwrap_or(now_ns) } else { now_ns }
    }

    /// Raises an alarm. Returns the alarm that was dropped to make space for it, if any.
    pub fn raise(&mut self, raised: RaisedAlarm<'_>, now_ns: i64) -> Option<Alarm> {
        let wall_ns = self.wall_ns(now_ns);
        let said = self.texts.get(raised.code);
        let text = match said {
            Some(said) if raised.text.is_empty() => said.text.clone(),
            Some(said) => format!("{}: {}", said.text, raised.text),
            None => raised.text,
        };
        let text = printable(text);
        let remedy = printable(said.map_or(raised.remedy, |said| &said.remedy));
        let severity = said.map_or(raised.severity, |said| said.severity);
        let block = raised.block.map(str::to_owned);
        if let Some(known) = self.current.iter_mut().find(|a| a.code == raised.code && a.source == printable(raised.source)) {
            known.count += 1;
            (known.active, known.acknowledged, known.cause) = (true, false, raised.cause);
            (known.time_ns, known.wall_ns, known.returned_ns, known.acknowledged_ns) = (now_ns, wall_ns, None, None);
            (known.text, known.block, known.remedy, known.severity) = (text, block, remedy, severity);
            known.judge_shelvable(now_ns);
            return None;
        }
        let dropped = (self.current.len() == CURRENT_MAX).then(|| self.drop_one(now_ns)).flatten();
        self.last += 1;
        let mut alarm = Alarm {
            number: self.last,
            code: raised.code.to_owned(),
            source: printable(raised.source),
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
            shelvable: false,
            shelvings: Vec::new(),
            cause: raised.cause,
        };
        alarm.judge_shelvable(now_ns);
        self.current.push(alarm);
        dropped
    }

    /// Drops one alarm and returns it: returned alarms before active ones, then the least severe one, then the oldest.
    fn drop_one(&mut self, now_ns: i64) -> Option<Alarm> {
        let mildest = (0..self.current.len()).min_by_key(|&at| (self.current[at].active, self.current[at].severity))?;
        let mut gone = self.current.remove(mildest);
        gone.unshelve(now_ns, "");
        self.dropped += 1;
        self.archive(gone.clone());
        Some(gone)
    }

    /// Clears the cause of every alarm that `of` selects. Returns the number of alarms cleared.
    pub fn clear(&mut self, now_ns: i64, of: impl Fn(&Alarm) -> bool) -> usize {
        let mut cleared = 0;
        for alarm in self.current.iter_mut().filter(|a| a.active && of(a)) {
            (alarm.active, alarm.returned_ns) = (false, Some(now_ns));
            cleared += 1;
        }
        self.sweep();
        cleared
    }

    /// Acknowledges every alarm that `of` selects. Returns the number of alarms acknowledged.
    pub fn acknowledge(&mut self, now_ns: i64, of: impl Fn(&Alarm) -> bool) -> usize {
        let mut seen = 0;
        for alarm in self.current.iter_mut().filter(|a| !a.acknowledged && of(a)) {
            (alarm.acknowledged, alarm.acknowledged_ns) = (true, Some(now_ns));
            seen += 1;
        }
        self.sweep();
        seen
    }

    /// Moves returned and acknowledged alarms to the history, unless they are shelved.
    pub(crate) fn sweep(&mut self) {
        let is_over = |a: &Alarm| !a.active && a.acknowledged && !a.is_shelved();
        let (over, current) = std::mem::take(&mut self.current).into_iter().partition(is_over);
        self.current = current;
        let over: Vec<Alarm> = over;
        over.into_iter().for_each(|alarm| self.archive(alarm));
    }

    fn archive(&mut self, alarm: Alarm) {
        self.history.push_back(alarm);
        self.trim();
    }

    /// Trims the history to its limit by dropping the oldest entries of the most frequent code, so that a chattering alarm does not
    /// displace the others.
    pub fn trim(&mut self) {
        let over = self.history.len().saturating_sub(HISTORY_MAX);
        if over == 0 {
            return;
        }
        let mut counts: IndexMap<&str, usize> = IndexMap::new();
        self.history.iter().for_each(|alarm| *counts.entry(&alarm.code).or_default() += 1);
        let mut most: BinaryHeap<(usize, &str)> = counts.into_iter().map(|(code, count)| (count, code)).collect();
        let mut leaving: IndexMap<String, usize> = IndexMap::new();
        for _ in 0..over {
            let Some((count, code)) = most.pop() else { break };
            *leaving.entry(code.to_owned()).or_default() += 1;
            most.push((count - 1, code));
        }
        self.history.retain(|alarm| match leaving.get_mut(&alarm.code) {
            Some(left) if *left > 0 => {
                *left -= 1;
                false
            }
            _ => true,
        });
    }
}
