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
    /// Number of the end, unique within the system.
    pub number: u64,
    /// Verb instance.
    pub instance: u64,
    pub report: Report,
    /// True if the report was part of an answer. It is dropped once the session shows that it has received the answer.
    #[serde(skip)]
    pub(super) told: bool,
}

/// Answer to a request that opens a session.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OpenedSession {
    /// ID of the session, for the header `OpenGPAC-Session`.
    pub session: String,
    pub name: String,
    pub role: Role,
    /// Maximum interval between the session's signs of life, ms.
    pub heartbeat_ms: u64,
    /// Time without a sign of life after which the session is considered lost, ms.
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

/// An entry in the list of sessions.
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
    /// True if a connection holds the session, in which case the session is lost as soon as the connection breaks.
    pub held: bool,
    pub kept_reports: usize,
}

/// An opened session, with the instances started by it that still exist.
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

/// Holder of command, pending requests, and the outcomes of the most recent requests.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Holder {
    /// Name of the session that has command; null if none does.
    pub holder: Option<String>,
    /// Caller of that session: a user, a token or a certificate.
    pub who: Option<String>,
    /// Name of that session's person, if provided.
    pub person: Option<String>,
    /// Pending requests for command, oldest first.
    pub requests: Vec<Asks>,
    /// Most recently completed requests, oldest first.
    pub settled: Vec<SettledRequest>,
}

/// A session that requests command.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "AskingSession")]
pub struct Asks {
    /// Number of the request, unique within the system.
    pub number: u64,
    /// Session that made the request.
    pub name: String,
    /// Caller of that session.
    pub who: String,
    pub person: Option<String>,
    /// Human-readable purpose.
    pub reason: String,
    /// Remaining waiting time, ms.
    pub left_ms: u64,
}

/// End reports that are kept for a session.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "KeptReports")]
pub struct Reports {
    /// Reports, oldest first.
    pub reports: Vec<KeptReport>,
    /// Number of reports dropped because too many were waiting.
    pub lost: u64,
}
