// SPDX-License-Identifier: Apache-2.0
//! Calls for recordings on disk: they list the recordings, and return the state at a given time or the data over a span.
use crate::values::Reading;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use indexmap::IndexMap;
use model::refusal::Refusals;
use recorder::{RecordedMessage, RecordingContents, RecordingFile, Samples, Sums, opened};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Maximum number of chunks, about 1 MiB each, that one call reads; longer answers are continued by further calls.
const CHUNKS_MAX: usize = 96;
/// Maximum number of columns per channel.
const COLUMNS_MAX: u32 = 10_000;

/// State of a recording at a given time.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedAt")]
struct At {
    /// Most recently stored values; null if there was none yet.
    values: IndexMap<String, Option<Reading>>,
    /// Most recent messages of other channels, with their times; null if there was none yet. Messages that the caller already has are
    /// omitted.
    messages: IndexMap<String, Option<RecordedMessage>>,
}

/// Messages of a channel, in order.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedMessages")]
struct Messages {
    messages: Vec<RecordedMessage>,
    /// Number of the next message if there may be more; pass it as `since`.
    next: Option<usize>,
}

/// Data of several channels over a span.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedSpan")]
struct Span {
    channels: Vec<Trace>,
    /// Value of `since` for the call that continues this answer, if it is incomplete. The samples of the continuation follow these, and
    /// its sums must be added to these.
    next: Option<usize>,
}

/// Data of one channel over a span.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedTrace")]
struct Trace {
    /// Samples: the last value stored before the span, then for each column the first value, the last value, and the values with the
    /// minimum and maximum of each component, all as complete values with their own times. Base64, little-endian: (i64 time in ns, u64
    /// number) of all samples, then the components as f64.
    samples: String,
    /// Sums for each component, over all values of the span.
    sums: Vec<Sums>,
}

crate::calls! {
    /// Calls for recordings on disk.
    pub(super) const RECORDED about "recordings" = [
        /// Returns the recordings in a folder, newest first.
        Observe recordings(
            /// Folder; over the control interface it is the daemon's own folder and must be omitted.
            may folder: PathBuf,
        ) -> Vec<RecordingFile>: costs, record_folder("folder")
            => |_system| recorder::recordings(&folder);
        /// Returns a description of a recording: its time span, its contents and its ends. If the recording is still in progress, the
        /// description covers the part that is on disk.
        Observe recorded(must path: PathBuf) -> RecordingContents: costs, record_path("path")
            => |_system| opened(&path)?.about();
        /// Returns the state of a recording at a given time.
        Observe recorded_at(
            must path: PathBuf,
            /// Time on the system's clock.
            must time_ns: i64,
            /// Names of SVVs and cells.
            may names: Vec<String>,
            /// Names of other channels, such as `/installed`, `/statistics`, `/alarms`.
            may topics: Vec<String>,
            /// Times of the messages that the caller already has, by channel; these messages are omitted.
            may known: HashMap<String, i64>,
        ) -> At: costs, record_path("path")
            => |_system| at(&path, time_ns, names, topics, &known);
        /// Returns messages of a channel that carries no values, such as `/log` or `/ends`.
        Observe recorded_messages(
            must path: PathBuf,
            must topic: String,
            /// Number of the first message.
            may since: usize,
        ) -> Messages: costs, record_path("path")
            => |_system| opened(&path)?.records(&topic, since, CHUNKS_MAX).map(|(messages, next)| Messages { messages, next });
        /// Returns SVVs and cells over a span of a recording, condensed into columns, with exact sums.
        Observe recorded_span(
            must path: PathBuf,
            must names: Vec<String>,
            must from_ns: i64,
            must to_ns: i64,
            /// Number of columns per channel, at most 10,000; the values within a column are condensed.
            must columns: u32,
            /// `next` of the previous answer.
            may since: usize,
        ) -> Span: costs, record_path("path")
            => |_system| span(&path, &names, (from_ns, to_ns), columns, since);
        /// Returns the time, in a recording, of the next (or previous) firing that stored a value; null if there is none.
        Observe recorded_firing(
            must path: PathBuf,
            must time_ns: i64,
            /// True for the previous firing.
            may back: bool,
        ) -> Option<i64>: costs, record_path("path")
            => |_system| opened(&path)?.firing(time_ns, !back);
    ];
}

fn at(path: &Path, time_ns: i64, names: Vec<String>, topics: Vec<String>, known: &HashMap<String, i64>) -> Result<At, Refusals> {
    let archive = opened(path)?;
    let mut values = IndexMap::new();
    for name in names {
        let found = archive.reading_at(&name, time_ns)?;
        let reading = found.map(|(value, number, time_ns)| Reading { value: Some(value), bytes: None, number, time_ns });
        values.insert(name, reading);
    }
    let mut messages = IndexMap::new();
    for topic in topics {
        let found = archive.record_at(&topic, time_ns)?;
        if found.as_ref().is_none_or(|found| known.get(&topic) != Some(&found.time_ns)) {
            messages.insert(topic, found);
        }
    }
    Ok(At { values, messages })
}

fn span(path: &Path, names: &[String], times: (i64, i64), columns: u32, since: usize) -> Result<Span, Refusals> {
    let found = opened(path)?.span(names, times, columns.clamp(1, COLUMNS_MAX) as usize, since, CHUNKS_MAX)?;
    let channels = found.traces.into_iter().map(|trace| Trace { samples: packed(&trace.samples), sums: trace.sums }).collect();
    Ok(Span { channels, next: found.next })
}

fn packed(samples: &Samples) -> String {
    let mut bytes = Vec::with_capacity(16 * samples.len() + 8 * samples.values.len());
    for (time_ns, number) in samples.times_ns.iter().zip(&samples.numbers) {
        bytes.extend_from_slice(&time_ns.to_le_bytes());
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    samples.values.iter().for_each(|value| bytes.extend_from_slice(&value.to_le_bytes()));
    STANDARD.encode(bytes)
}
