// SPDX-License-Identifier: Apache-2.0
//! Answers to requests about sessions.
use super::command::SettledRequest;
use api::Role;
use schemars::JsonSchema;
use serde::Serialize;
use supervisor::{InstanceState, Report};

/// An end report that waits for its session.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct KeptReport {
    /// Counts the ends of the system.
    pub number: u64,
    /// The verb instance.
    pub instance: u64,
    pub report: Report,
    /// True if it was in an answer; it goes when the session shows that it has had that.
    #[serde(skip)]
    pub(super) told: bool,
}

/// Answer to an opened session.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OpenedSession {
    /// Its ID, for the header `OpenGPAC-Session`.
    pub session: String,
    pub name: String,
    pub role: Role,
    /// Period at which it has to give a sign of life, ms.
    pub heartbeat_ms: u64,
    /// Time without one after which it counts as lost, ms.
    pub lost_after_ms: u64,
    /// True if it was there before, and lost.
    pub returned: bool,
    #[serde(skip)]
    pub instances: Vec<u64>,
    /// End reports that wait for it.
    pub kept_reports: usize,
    /// End reports that are gone, because too many waited.
    pub lost_reports: u64,
}

/// One line of the list of sessions.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SessionInfo {
    pub name: String,
    /// Its caller: a user, a token or a certificate.
    pub who: String,
    /// Name of the person who opened it, if it was given.
    pub person: Option<String>,
    pub role: Role,
    /// Address from which it calls.
    pub from: String,
    /// True if it has command.
    pub commands: bool,
    pub alive: bool,
    /// A connection holds it: where that breaks it is lost at once.
    pub held: bool,
    pub kept_reports: usize,
}

/// An opened session with the instances that are still there of those that it has started.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Returned")]
pub struct SessionAnswer {
    #[serde(flatten)]
    pub opened: OpenedSession,
    pub instances: Vec<SessionInstance>,
}

/// A verb instance of a session.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SessionInstance {
    pub instance: u64,
    pub name: String,
    pub state: InstanceState,
}

/// Holder of command, those who ask for it, and the outcomes of the last requests.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Holder {
    /// Name of the session that commands; null: none does.
    pub holder: Option<String>,
    /// Its caller: a user, a token or a certificate.
    pub who: Option<String>,
    /// Name of its person, if it was given.
    pub person: Option<String>,
    /// Requests for command that wait, oldest first.
    pub requests: Vec<Asks>,
    /// The last requests that have ended, oldest first.
    pub settled: Vec<SettledRequest>,
}

/// A session that asks for command.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "AskingSession")]
pub struct Asks {
    /// Counts the requests of the system.
    pub number: u64,
    /// The session that asks.
    pub name: String,
    /// Its caller.
    pub who: String,
    pub person: Option<String>,
    /// Purpose, for people.
    pub reason: String,
    /// Time for which it still waits, ms.
    pub left_ms: u64,
}

/// The end reports that wait for a session.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "KeptReports")]
pub struct Reports {
    /// Oldest first.
    pub reports: Vec<KeptReport>,
    /// Number of reports that are gone, because too many waited.
    pub lost: u64,
}
