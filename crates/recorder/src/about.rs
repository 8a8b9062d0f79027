// SPDX-License-Identifier: Apache-2.0
//! Description of a recording in one answer: its time span, channels and ends.
use crate::archive::Index;
use crate::{ABOUT, Archive, DamagedPart, ENDS, INSTALLED, numbers};
use model::refusal::Refusals;
use serde::Serialize;
use serde_json::Value as Json;
use std::collections::BTreeMap;

/// Maximum number of chunks that are read to find the verbs, and again to find the ends.
const CHUNKS_MAX: usize = 32;

/// Description of the contents of a recording.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RecordingContents {
    /// Name of the recorded system.
    pub system: String,
    /// Version of OpenGPAC that wrote the recording.
    pub version: String,
    /// Clock of the system: `virtual` or `monotonic`.
    pub clock: String,
    /// Time at which the system's clock was 0, s since the Unix epoch.
    pub epoch_unix_s: f64,
    /// Earliest and latest time in the recording, ns on the system's clock.
    pub begins_ns: i64,
    pub ends_ns: i64,
    /// False if the file has no end record because it is still being recorded, its recorder was killed, or the disk was full.
    pub complete: bool,
    /// True if `opengpac replay` can replay the recording.
    pub replay: bool,
    pub channels: Vec<RecordedChannel>,
    /// Topics of the other channels, such as `/log` and `/ends`.
    pub topics: Vec<String>,
    /// Installed verbs in alphabetical order; for a long recording, the verbs at its beginning.
    pub verbs: Vec<String>,
    /// Ends of verb instances; for a long recording, only the first ones.
    pub ends: Vec<RecordedEnd>,
    /// Number of lost messages by channel; channels without losses are omitted.
    pub lost: BTreeMap<String, u64>,
    /// Unreadable parts of the file that have been found so far. The content of a chunk is checked when it is first read.
    pub damage: Vec<DamagedPart>,
    /// Description of the system in the file: `configuration` is the answer to the `configuration` call as JSON.
    pub metadata: BTreeMap<String, String>,
}

/// An SVV or private cell in a recording.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RecordedChannel {
    /// Name; the name of a cell is `INSTANCE:CELL`.
    pub name: String,
    /// Kind: `svv` or `cell`.
    pub kind: String,
    pub type_text: String,
    pub unit: String,
    /// Number of components of one value.
    pub components: usize,
}

/// An end of a verb instance.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct RecordedEnd {
    pub instance: String,
    /// Condition that ended the instance.
    pub condition: String,
    pub time_s: f64,
}

impl Archive {
    /// Returns the description of the recording. Does not read any values.
    pub fn about(&self) -> Result<RecordingContents, Refusals> {
        let (installed, _) = self.records(INSTALLED, 0, CHUNKS_MAX)?;
        let (ends, _) = self.records(ENDS, 0, CHUNKS_MAX)?;
        let mut verbs: Vec<String> = installed.iter().flat_map(|one| verbs_of(&one.message)).collect();
        verbs.sort_unstable();
        verbs.dedup();
        let damage = self.damage();
        let index = self.index();
        let said = index.file.metadata.get(ABOUT).cloned().unwrap_or_default();
        let text = |name: &str| said.get(name).cloned().unwrap_or_default();
        let epoch_ns: i128 = text("epoch_unix_ns").parse().unwrap_or(0);
        let begins_ns = text("begins_ns").parse().unwrap_or(0);
        #[allow(clippy::cast_precision_loss, reason = "a time of day in seconds")]
        Ok(RecordingContents {
            system: text("system"),
            version: text("version"),
            clock: text("clock"),
            epoch_unix_s: epoch_ns as f64 * 1e-9,
            begins_ns,
            ends_ns: index.file.chunks.iter().map(|chunk| chunk.last.cast_signed()).max().map_or(begins_ns, |last| last.max(begins_ns)),
            complete: index.file.is_whole(),
            replay: index.tracks.contains_key(replay::TOPIC),
            channels: channels_of(&index),
            topics: index.tracks.iter().filter(|(_, track)| track.values.is_none()).map(|(name, _)| name.clone()).collect(),
            verbs,
            ends: ends.iter().filter_map(|one| end_of(&one.message)).collect(),
            lost: self.lost(),
            damage,
            metadata: said,
        })
    }
}

fn channels_of(index: &Index) -> Vec<RecordedChannel> {
    let of = |(name, track): (&String, &crate::archive::Track)| {
        let values = track.values.as_ref()?;
        let (type_text, components) = (values.value_type.normalised(), numbers::count(&values.value_type));
        Some(RecordedChannel { name: name.clone(), kind: values.kind.clone(), type_text, unit: values.unit.clone(), components })
    };
    index.tracks.iter().filter_map(of).collect()
}

fn verbs_of(installed: &Json) -> Vec<String> {
    let instances = installed["instances"].as_array().into_iter().flatten();
    instances.filter_map(|instance| instance["verb"].as_str().map(str::to_owned)).collect()
}

fn end_of(end: &Json) -> Option<RecordedEnd> {
    let report = &end["report"];
    let text = |name: &str| report[name].as_str().map(str::to_owned);
    Some(RecordedEnd { instance: text("instance")?, condition: text("condition").unwrap_or_default(), time_s: report["time_s"].as_f64()? })
}
