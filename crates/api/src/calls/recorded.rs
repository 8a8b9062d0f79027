// SPDX-License-Identifier: Apache-2.0
//! Recordings on disk: which there are, what was at a time, what was over a span.
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

/// Chunks that one call reads, of 1 MiB each or so: what takes longer is asked for again.
const CHUNKS_MAX: usize = 96;
/// Columns of one channel.
const COLUMNS_MAX: u32 = 10_000;

/// State at a time of a recording.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedAt")]
struct At {
    /// Values that were stored last; null: there was none yet.
    values: IndexMap<String, Option<Reading>>,
    /// Messages of other channels that came last, with their times; null: there was none yet. What is known is left out.
    messages: IndexMap<String, Option<RecordedMessage>>,
}

/// Messages of a channel in their order.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedMessages")]
struct Messages {
    messages: Vec<RecordedMessage>,
    /// The number of the next one, where there may be more: to be asked for with `since`.
    next: Option<usize>,
}

/// Some channels over a span.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedSpan")]
struct Span {
    channels: Vec<Trace>,
    /// Where this is not all, `since` of the call that goes on: what that returns follows what is here, and its sums are more.
    next: Option<usize>,
}

/// One channel over a span.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "RecordedTrace")]
struct Trace {
    /// Value stored last before the span; of each column the first value, the last, and of each number the minimum and the maximum,
    /// whole values with their own times. In base64, little endian: (i64 time in ns, u64 number) of all, then the numbers as f64.
    samples: String,
    /// Sums of each number, over all values of the span.
    sums: Vec<Sums>,
}

crate::calls! {
    /// Recordings on disk.
    pub(super) const RECORDED about "recordings" = [
        /// Returns the recordings of a folder, the newest first.
        Observe recordings(
            /// Over the control interface it is the daemon's own, and is left out.
            may folder: PathBuf,
        ) -> Vec<RecordingFile>: costs, record_folder("folder")
            => |_system| recorder::recordings(&folder);
        /// Returns what a recording is: when, of what, how it ended. One that is under way is told as far as it is on the disk.
        Observe recorded(must path: PathBuf) -> RecordingContents: costs, record_path("path")
            => |_system| opened(&path)?.about();
        /// Returns what was at a time of a recording.
        Observe recorded_at(
            must path: PathBuf,
            /// Time on the system's clock.
            must time_ns: i64,
            /// Names of SVVs and cells.
            may names: Vec<String>,
            /// Names of other channels, `/installed`, `/statistics`, `/alarms`, …
            may topics: Vec<String>,
            /// Times of the messages that the caller has, by channel: they are not told again.
            may known: HashMap<String, i64>,
        ) -> At: costs, record_path("path")
            => |_system| at(&path, time_ns, names, topics, &known);
        /// Returns messages of a channel that has no values, `/log`, `/ends`, …
        Observe recorded_messages(
            must path: PathBuf,
            must topic: String,
            /// The number of the first one.
            may since: usize,
        ) -> Messages: costs, record_path("path")
            => |_system| opened(&path)?.records(&topic, since, CHUNKS_MAX).map(|(messages, next)| Messages { messages, next });
        /// Returns SVVs and cells over a span of a recording, drawn together into columns, with exact sums.
        Observe recorded_span(
            must path: PathBuf,
            must names: Vec<String>,
            must from_ns: i64,
            must to_ns: i64,
            /// Columns of each channel, at most 10,000: as many values as lie in one are drawn together.
            must columns: u32,
            /// The `next` of the part before.
            may since: usize,
        ) -> Span: costs, record_path("path")
            => |_system| span(&path, &names, (from_ns, to_ns), columns, since);
        /// Returns the time of the next firing of a recording that stored a value, or of the one before; null where there is none.
        Observe recorded_firing(
            must path: PathBuf,
            must time_ns: i64,
            /// The one before.
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
