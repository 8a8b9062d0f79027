// SPDX-License-Identifier: Apache-2.0
//! Holder of command, requests for it, and their outcomes. One session has command at a time; requests wait in order, and each ends with
//! one of the values of [`Outcome`] and a reason.
//!
//! This module identifies sessions only by name: the table of sessions determines which ones exist and may request command.
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Maximum number of completed requests that are listed.
pub const SETTLED_MAX: usize = 32;

/// Outcome of a request for command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The requesting session has command.
    Granted,
    /// The holder declined the request.
    Declined,
    /// The waiting time of the request expired.
    TimedOut,
    /// The requesting session has withdrawn the request, or has left.
    Withdrawn,
}

impl Outcome {
    fn word(self) -> &'static str {
        match self {
            Outcome::Granted => "granted",
            Outcome::Declined => "declined",
            Outcome::TimedOut => "timed out",
            Outcome::Withdrawn => "withdrawn",
        }
    }
}

impl SettledRequest {
    /// Returns the outcome as a log line.
    pub fn line(&self) -> String {
        let by = self.by.as_ref().filter(|by| **by != self.name).map(|by| format!(" by session '{by}'")).unwrap_or_default();
        let reason = if self.reason.is_empty() { String::new() } else { format!(": {}", self.reason) };
        let verb = if self.outcome == Outcome::TimedOut { "has" } else { "was" };
        format!("the request of session '{}' for command {verb} {}{by}{reason}", self.name, self.outcome.word())
    }
}

/// A completed request for command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct SettledRequest {
    /// Number of the request, unique within the system.
    pub number: u64,
    /// Session that made the request.
    pub name: String,
    pub outcome: Outcome,
    /// Session that granted, declined or withdrew the request; null if none did, for example after a timeout.
    pub by: Option<String>,
    /// Human-readable reason.
    pub reason: String,
}

/// A pending request.
pub(super) struct Request {
    pub number: u64,
    pub name: String,
    pub reason: String,
    pub until: Instant,
}

/// State of command.
#[derive(Default)]
pub(super) struct Command {
    holder: Option<String>,
    waiting: Vec<Request>,
    settled: VecDeque<SettledRequest>,
    /// Outcomes that have not been logged yet.
    untold: Vec<SettledRequest>,
    last: u64,
}

impl Command {
    pub fn holder(&self) -> Option<&str> {
        self.holder.as_deref()
    }

    /// Returns the pending requests, oldest first.
    pub fn waiting(&self) -> &[Request] {
        &self.waiting
    }

    /// Returns the completed requests, oldest first.
    pub fn settled(&self) -> impl Iterator<Item = &SettledRequest> {
        self.settled.iter()
    }

    /// Returns the requests completed since the last call.
    pub fn untold(&mut self) -> Vec<SettledRequest> {
        std::mem::take(&mut self.untold)
    }

    /// Makes a session the holder, replacing any previous one. If the session has a pending request, it is granted.
    pub fn hold(&mut self, name: &str, by: Option<&str>, reason: &str) {
        self.holder = Some(name.to_owned());
        self.settle(|request| request.name == name, Outcome::Granted, by, reason);
    }

    /// Adds a request, or renews the session's existing one. It is granted immediately if no session has command. Returns the number of
    /// the request.
    pub fn ask(&mut self, name: &str, reason: &str, wait: Duration, now: Instant) -> u64 {
        let (reason, until) = (reason.to_owned(), now + wait);
        let number = match self.waiting.iter_mut().find(|request| request.name == name) {
            Some(known) => {
                (known.reason, known.until) = (reason, until);
                known.number
            }
            None => {
                self.last += 1;
                self.waiting.push(Request { number: self.last, name: name.to_owned(), reason, until });
                self.last
            }
        };
        if self.holder.as_deref().is_none_or(|holder| holder == name) {
            self.hold(name, None, "no other session was in command");
        }
        number
    }

    /// Ends a session's request without granting command. Returns false if the session has no request.
    pub fn end(&mut self, name: &str, outcome: Outcome, by: Option<&str>, reason: &str) -> bool {
        self.settle(|request| request.name == name, outcome, by, reason)
    }

    /// Releases command, because the session gives it up or has left; the session with the oldest request then receives it. Does nothing
    /// if the session did not have command.
    pub fn release(&mut self, name: &str, reason: &str) {
        if self.holder.as_deref() != Some(name) {
            return;
        }
        self.holder = None;
        if let Some(next) = self.waiting.first().map(|request| request.name.clone()) {
            self.hold(&next, Some(name), reason);
        }
    }

    /// Ends the requests whose waiting time has expired.
    pub fn expire(&mut self, now: Instant) {
        let holder = self.holder.clone().unwrap_or_default();
        let reason = format!("session '{holder}' did not answer in time");
        self.settle(|request| request.until <= now, Outcome::TimedOut, None, &reason);
    }

    fn settle(&mut self, of: impl Fn(&Request) -> bool, outcome: Outcome, by: Option<&str>, reason: &str) -> bool {
        let over: Vec<Request> = self.waiting.extract_if(.., |request| of(request)).collect();
        let any = !over.is_empty();
        for Request { number, name, .. } in over {
            if self.settled.len() == SETTLED_MAX {
                self.settled.pop_front();
            }
            let settled = SettledRequest { number, name, outcome, by: by.map(str::to_owned), reason: reason.to_owned() };
            self.untold.push(settled.clone());
            self.settled.push_back(settled);
        }
        any
    }
}
