// SPDX-License-Identifier: Apache-2.0
//! Sources of messages other than values: the log, end reports, statistics of the interrupt sources, and the inputs needed for a replay.
use crate::page::{ChannelId, Page};
use crate::{ENDS, LOG};
use model::refusal::Refusals;
use serde::Serialize;
use serde_json::{Value as Json, json};
use std::collections::BTreeMap;
use supervisor::{End, Entry, System};

/// Source of messages. The recorder's thread drains it about every 20 ms, and once more at the end.
pub(crate) trait Source: Send {
    /// Appends the new messages.
    fn drain(&mut self, page: &mut Page);
}

fn put_json(page: &mut Page, channel: ChannelId, time_s: f64, sequence: u64, message: &impl Serialize) {
    #[allow(clippy::cast_possible_truncation, reason = "ns of a clock that has run for less than a century")]
    let time_ns = (time_s * 1e9).round() as i64;
    page.put(channel, time_ns, sequence, |out| serde_json::to_writer(out, message).expect("a record of the supervisor has a JSON form"));
}

/// Source of numbered records that the supervisor keeps for some time, such as log entries and end reports.
pub(crate) struct NumberedRecords<T> {
    system: System,
    next: u64,
    channel: Option<ChannelId>,
    topic: &'static str,
    schema: (&'static str, Json),
    since: fn(&System, u64) -> Vec<T>,
    /// Function that returns the number of a record and its time in seconds.
    place: fn(&T) -> (u64, f64),
}

impl NumberedRecords<Entry> {
    /// Creates the source of log entries (conditions, faults, transitions, starts, commands), starting with the next entry.
    pub fn log(system: System) -> NumberedRecords<Entry> {
        let text = || json!({"type": "string"});
        let properties = json!({"sequence": {"type": "integer"}, "time_s": {"type": "number"}, "kind": text(), "about": text(), "text": text()});
        let schema = ("opengpac.log", json!({"type": "object", "properties": properties}));
        NumberedRecords { system, next: 0, channel: None, topic: LOG, schema, since: System::log_since, place: |entry| (entry.sequence, entry.time_s) }.begun()
    }
}

impl NumberedRecords<End> {
    /// Creates the source of end reports, starting with the next one.
    pub fn ends(system: System) -> NumberedRecords<End> {
        let schema = ("opengpac.end", json!({"type": "object"}));
        NumberedRecords { system, next: 0, channel: None, topic: ENDS, schema, since: System::ends_since, place: |end| (end.number, end.report.time_s) }.begun()
    }
}

impl<T> NumberedRecords<T> {
    fn begun(mut self) -> NumberedRecords<T> {
        self.next = (self.since)(&self.system, 0).last().map_or(0, |last| (self.place)(last).0 + 1);
        self
    }

    /// Returns the number of the next record.
    pub fn next(&self) -> u64 {
        self.next
    }
}

impl<T: Serialize> Source for NumberedRecords<T> {
    fn drain(&mut self, page: &mut Page) {
        let (name, schema) = &self.schema;
        let channel = *self.channel.get_or_insert_with(|| page.channel(self.topic, (name, schema), BTreeMap::new()));
        for one in (self.since)(&self.system, self.next) {
            let (number, time_s) = (self.place)(&one);
            page.lost(channel, number - self.next);
            self.next = number + 1;
            put_json(page, channel, time_s, number, &one);
        }
    }
}

/// Firings, jitter, durations and overruns of each interrupt source, once a second of the system's clock, or at each drain if drains are
/// less frequent.
pub(crate) struct Timing {
    system: System,
    next_ns: i64,
    channels: BTreeMap<String, ChannelId>,
}

const SECOND_NS: i64 = 1_000_000_000;

impl Timing {
    pub fn new(system: System) -> Timing {
        Timing { next_ns: system.now_ns(), system, channels: BTreeMap::new() }
    }
}

impl Source for Timing {
    fn drain(&mut self, page: &mut Page) {
        let now_ns = self.system.now_ns();
        if now_ns < self.next_ns {
            return;
        }
        self.next_ns = now_ns + SECOND_NS;
        let statistics = self.system.statistics();
        for (name, source) in &statistics.sources {
            let channel = *self
                .channels
                .entry(name.clone())
                .or_insert_with(|| page.channel(&format!("/timing/{name}"), ("opengpac.timing", &json!({"type": "object"})), BTreeMap::new()));
            #[allow(clippy::cast_precision_loss, reason = "a time in seconds")]
            put_json(page, channel, now_ns as f64 * 1e-9, 0, source);
        }
    }
}

/// All external inputs of the interrupt sources, and all scripts. Together they are the input of a replay.
pub(crate) struct Inputs {
    system: System,
    recording: replay::Recording,
    items: Vec<replay::Item>,
    channel: Option<ChannelId>,
    /// Number of the next item; readers use it to detect losses.
    next: u64,
    time_ns: i64,
}

impl Inputs {
    /// Starts recording inputs. Fails if the system already has interrupt sources.
    pub fn begin(system: &System) -> Result<Inputs, Refusals> {
        let recording = replay::Recording::begin(|names| system.record(names))?;
        Ok(Inputs { system: system.observer(), recording, items: Vec::new(), channel: None, next: 0, time_ns: system.now_ns() })
    }
}

impl Source for Inputs {
    fn drain(&mut self, page: &mut Page) {
        let channel = *self.channel.get_or_insert_with(|| page.channel_of_bytes(replay::TOPIC, replay::ENCODING));
        self.recording.take(&mut self.items);
        for item in self.items.drain(..) {
            if let Some(why) = item.broken() {
                self.system.note("recorder", "system", &format!("cannot be replayed from here on: {why}"));
            }
            self.time_ns = item.time_ns().unwrap_or(self.time_ns);
            page.put(channel, self.time_ns, self.next, |out| out.extend_from_slice(&item.bytes()));
            self.next += 1;
        }
    }
}
