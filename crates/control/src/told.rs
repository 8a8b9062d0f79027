// SPDX-License-Identifier: Apache-2.0
//! Text frames of a stream.
use api::Snapshot;
use model::refusal::Refusals;
use schemars::JsonSchema;
use serde::Serialize;
use supervisor::{End, Entry, InstalledInstances, Statistics};

/// A text frame of the stream: an update of a subscription, or the reason why a frame of the client was refused.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub(crate) struct StreamAnswer {
    /// Name that the client chose for the subscription.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Heartbeat of a stream opened with `?beat=true`: the daemon's clock, ms. `OpenGPAC-As-Of` is relative to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beat: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub svvs: Option<Snapshot>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub statistics: Option<Statistics>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub installed: Option<InstalledInstances>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log: Option<Vec<Entry>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ends: Option<Vec<End>>,
    /// First frame of a scope, which describes the content of the binary frames that follow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scope: Option<ScopeHead>,
    /// Number of frames or entries of this subscription dropped since its last frame because the reader was too slow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dropped: Option<u64>,
    /// Reason why the subscription ended or the frame was refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub errors: Option<Refusals>,
}

/// Channels of a scope.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ScopeHead {
    /// Channels, in the order in which the binary frames number them.
    pub channels: Vec<ScopeChannel>,
}

/// A channel of a scope.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct ScopeChannel {
    pub name: String,
    pub type_text: String,
    pub unit: String,
    /// Number of components of one value: elements of an array, members of a struct.
    pub components: usize,
}

impl StreamAnswer {
    /// Creates a frame of this subscription.
    pub fn of(id: &str) -> StreamAnswer {
        StreamAnswer { id: Some(id.to_owned()), ..StreamAnswer::default() }
    }
}
