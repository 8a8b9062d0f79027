// SPDX-License-Identifier: Apache-2.0
//! Decodes the frames that the client of a stream sends. All functions are pure.
use daemon::Failure;
use daemon::requests::{object, wrong};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A frame that the client of a stream sends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StreamFrame {
    /// Topic of the subscription.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub subscribe: Option<Topic>,
    /// Name that the client chose for the subscription.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Name of the subscription to end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unsubscribe: Option<String>,
    /// SVVs and cells to observe, for the topics `svvs` and `scope`.
    #[serde(default)]
    pub names: Vec<String>,
    /// Observation period, ms of wall-clock time: at least 10; at least 100 for `statistics` and `installed`; at most 1,000 for `scope`.
    #[serde(default = "every_ms")]
    pub every_ms: u64,
    /// True if the topic `svvs` sends base64-encoded bytes instead of values.
    #[serde(default)]
    pub raw: bool,
    /// Number of the first entry of `log` or `ends` to send.
    #[serde(default)]
    pub since: u64,
}

/// Topic of a stream. `scope` sends every value of the selected SVVs and private cells in binary frames; `installed` is sent at the start
/// and whenever it changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    Svvs,
    Log,
    Ends,
    Scope,
    Statistics,
    Installed,
}

fn every_ms() -> u64 {
    50
}

/// Request that a frame contains.
#[derive(Clone, Debug, PartialEq)]
pub enum StreamRequest {
    Subscribe { id: String, topic: Topic, names: Vec<String>, every: Duration, raw: bool, since: u64 },
    Unsubscribe(String),
}

/// Parses a frame of a stream.
pub fn frame(text: &str) -> Result<StreamRequest, Failure> {
    let frame: StreamFrame = object(text.as_bytes())?;
    let short = |id: &String| !id.is_empty() && id.len() <= 64;
    match (frame.subscribe, frame.id, frame.unsubscribe) {
        (Some(topic), Some(id), None) if short(&id) => {
            if matches!(topic, Topic::Svvs | Topic::Scope) == frame.names.is_empty() {
                let remedy = "give names in a subscription to svvs or scope, and in no other";
                return Err(wrong(format!("subscription '{id}' cannot have {} names", frame.names.len()), remedy));
            }
            // These topics send their whole content each time, which takes longer than sending values.
            let least = if matches!(topic, Topic::Statistics | Topic::Installed) { 100 } else { 10 };
            let every = Duration::from_millis(frame.every_ms.clamp(least, 3_600_000));
            Ok(StreamRequest::Subscribe { id, topic, names: frame.names, every, raw: frame.raw, since: frame.since })
        }
        (None, None, Some(id)) => Ok(StreamRequest::Unsubscribe(id)),
        _ => Err(wrong("a frame must subscribe with an id of 1 to 64 characters, or unsubscribe".to_owned(), "see docs/control.md")),
    }
}
