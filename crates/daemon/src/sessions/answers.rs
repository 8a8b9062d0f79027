// SPDX-License-Identifier: Apache-2.0
//! Answers to requests about sessions.
use super::command::SettledRequest;
use api::Role;
use schemars::JsonSchema;
use serde::Serialize;
use supervisor::{InstanceState, Report};

/// An end report that is kept for its session.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct KeptReport {
    /// Number of the end, counted over the system.
    pub number: u64,
    /// Verb instance.
    pub instance: u64,
    pub report: Report,
    /// True if it was part of an answer; it is dropped when the session shows that it has received that.
    #[serde(skip)]
    pub(super) told: bool,
}

/// Answer to an opened session.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OpenedSession {
    /// ID of the session, for the header `OpenGPAC-Session`.
    pub session: String,
    pub name: String,
    pub role: Role,
    /// Required period of its signs of life, ms.
    pub heartbeat_ms: u64,
    /// Time without a sign of life after which the session counts as lost, ms.
    pub lost_after_ms: u64,
    /// True if the session existed before and was lost.
    pub returned: bool,
    #[serde(skip)]
    pub instances: Vec<u64>,
    /// Number of end reports that are kept for the session.
    pub kept_reports: usize,
    /// Number of end reports dropped because too many were waiting.
    pub lost_reports: u64,
}

/// A line of the list of sessions.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SessionInfo {
    pub name: String,
    /// Caller of the session: a user, a token or a certificate.
    pub who: String,
    /// Name of the person who opened the session, if provided.
    pub person: Option<String>,
    pub role: Role,
    /// Address of the caller.
    pub from: String,
    /// True if the session has command.
    pub commands: bool,
    pub alive: bool,
    /// True if a connection holds the session: if the connection breaks, the session is lost at once.
    pub held: bool,
    pub kept_reports: usize,
}

/// An opened session, with the still existing instances that it has started.
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

/// Holder of command, pending requests, and the outcomes of the last requests.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Holder {
    /// Name of the session that has command; null if none does.
    pub holder: Option<String>,
    /// Caller of that session: a user, a token or a certificate.
    pub who: Option<String>,
    /// Name of its person, if provided.
    pub person: Option<String>,
    /// Pending requests for command, oldest first.
    pub requests: Vec<Asks>,
    /// Last completed requests, oldest first.
    pub settled: Vec<SettledRequest>,
}

/// A session that requests command.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "AskingSession")]
pub struct Asks {
    /// Number of the request, counted over the system.
    pub number: u64,
    /// Session that made the request.
    pub name: String,
    /// Caller of that session.
    pub who: String,
    pub person: Option<String>,
    /// Purpose, for people.
    pub reason: String,
    /// Remaining waiting time, ms.
    pub left_ms: u64,
}

/// End reports kept for a session.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "KeptReports")]
pub struct Reports {
    /// Reports, oldest first.
    pub reports: Vec<KeptReport>,
    /// Number of reports dropped because too many were waiting.
    pub lost: u64,
}
