// SPDX-License-Identifier: Apache-2.0
//! Alarms: what a person has to know of, until it is gone and acknowledged.
//!
//! The states are those of IEC 62682: active or returned, unacknowledged or acknowledged. An alarm that is active cannot be
//! acknowledged away: it stays, acknowledged, until its cause is gone. One that is both returned and acknowledged goes into the
//! history. The same alarm (code and source) that comes again is counted, and is unacknowledged again.
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

/// Text of an alarm of one code.
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
    /// Number of times that it came.
    pub count: u64,
    /// When it came last, on the system's clock and on the wall (ns since 1970; under the virtual clock the system's own).
    pub time_ns: i64,
    pub wall_ns: i64,
    pub returned_ns: Option<i64>,
    pub acknowledged_ns: Option<i64>,
    /// True if it can be shelved. An emergency stop, a loss and a critical alarm stay in the list; so does one of an earlier life.
    #[serde(default)]
    pub shelvable: bool,
    /// Shelvings of it, the latest last.
    #[serde(default)]
    pub shelvings: Vec<Shelving>,
    #[serde(skip)]
    pub(crate) cause: Cause,
}

impl Alarm {
    /// Returns the same in texts that may be shown in a terminal: it comes from a program's own file.
    pub(crate) fn printable(self) -> Alarm {
        let (code, source, text, remedy) = (printable(self.code), printable(self.source), printable(self.text), printable(self.remedy));
        let shelvings = self.shelvings.into_iter().map(Shelving::printable).collect();
        Alarm { code, source, text, remedy, shelvings, ..self }
    }
}

/// Cause that keeps an alarm active.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Cause {
    /// No cause: it was an event, or the programming system says when.
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

/// Alarm that is raised, before the texts are looked up.
pub(crate) struct RaisedAlarm<'a> {
    pub code: &'a str,
    pub source: &'a str,
    pub block: Option<&'a str>,
    pub text: String,
    pub remedy: &'a str,
    pub severity: Severity,
    pub cause: Cause,
}

/// Alarms that wait for a person; more come from different sources than any person could read.
pub(crate) const CURRENT_MAX: usize = 1000;
/// Alarms of the past; of more, see [`Alarms::trim`].
pub(crate) const HISTORY_MAX: usize = 1000;

/// The alarms of a system, as a call tells them.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "Alarms"))]
pub struct AlarmList {
    /// Alarms that are active or not acknowledged, newest last.
    pub current: Vec<Alarm>,
    /// Alarms that an operator has taken out of that list for a time.
    pub shelved: Vec<Alarm>,
    /// Alarms of the past, oldest first.
    pub history: Vec<Alarm>,
    /// Text of each code.
    pub texts: IndexMap<String, AlarmText>,
    /// Alarms that had to leave before they were over, because there was no place for another.
    pub dropped: u64,
}

/// Alarms of a system.
#[derive(Default)]
pub(crate) struct Alarms {
    pub texts: IndexMap<String, AlarmText>,
    pub current: Vec<Alarm>,
    pub history: VecDeque<Alarm>,
    pub last: u64,
    /// Alarms that had to leave before they were over, because there was no place for another.
    pub dropped: u64,
    /// The wall clock may be asked.
    pub has_wall: bool,
}

impl Alarms {
    pub(crate) fn wall_ns(&self, now_ns: i64) -> i64 {
        let wall = || SystemTime::now().duration_since(UNIX_EPOCH).ok().and_then(|d| i64::try_from(d.as_nanos()).ok());
        if self.has_wall { wall().unwrap_or(now_ns) } else { now_ns }
    }

    /// Gives back the alarm that had to leave for this one, if one did.
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

    /// Drops one alarm and returns it: returned ones before active ones, of those the mildest, of those the oldest.
    fn drop_one(&mut self, now_ns: i64) -> Option<Alarm> {
        let mildest = (0..self.current.len()).min_by_key(|&at| (self.current[at].active, self.current[at].severity))?;
        let mut gone = self.current.remove(mildest);
        gone.unshelve(now_ns, "");
        self.dropped += 1;
        self.archive(gone.clone());
        Some(gone)
    }

    /// Clears the cause of every alarm that `of` picks. Returns the number of them.
    pub fn clear(&mut self, now_ns: i64, of: impl Fn(&Alarm) -> bool) -> usize {
        let mut cleared = 0;
        for alarm in self.current.iter_mut().filter(|a| a.active && of(a)) {
            (alarm.active, alarm.returned_ns) = (false, Some(now_ns));
            cleared += 1;
        }
        self.sweep();
        cleared
    }

    /// Acknowledges every alarm that `of` picks. Returns the number of them.
    pub fn acknowledge(&mut self, now_ns: i64, of: impl Fn(&Alarm) -> bool) -> usize {
        let mut seen = 0;
        for alarm in self.current.iter_mut().filter(|a| !a.acknowledged && of(a)) {
            (alarm.acknowledged, alarm.acknowledged_ns) = (true, Some(now_ns));
            seen += 1;
        }
        self.sweep();
        seen
    }

    /// Moves alarms that have returned and are acknowledged to the history, unless they are shelved.
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

    /// Keeps the history within its bound: where it has more, the oldest leave of the code that has the most. One that chatters does not push the
    /// others out.
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
