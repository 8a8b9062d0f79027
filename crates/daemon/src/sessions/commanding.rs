// SPDX-License-Identifier: Apache-2.0
//! Takes, requests and hands over command. The table of sessions determines which sessions exist and which actions their roles permit.
use super::answers::{Asks, Holder};
use super::command::{Outcome, Request, SettledRequest};
use super::{Session, Sessions, State};
use crate::failure::Failure;
use api::Role;
use model::refusal::Class;
use std::time::{Duration, Instant};

impl State {
    /// Returns a human-readable description of a session: its name, and its person or else its caller.
    fn called(&self, name: &str) -> String {
        match self.by_name.get(name) {
            Some(session) => format!("session '{name}' of {}", session.person.as_deref().unwrap_or(&session.who)),
            None => format!("session '{name}'"),
        }
    }

    fn not_commanding(&self, remedy: &str) -> Failure {
        let message = match self.command.holder() {
            Some(holder) => format!("{} commands the system", self.called(holder)),
            None => "no session commands the system".to_owned(),
        };
        Failure::new(Class::NotCommanding, message, remedy)
    }

    fn require_holder(&self, name: &str) -> Result<(), Failure> {
        if self.command.holder() == Some(name) {
            return Ok(());
        }
        Err(self.not_commanding("only the session in command can answer requests for command"))
    }

    fn told(&self, now: Instant) -> Holder {
        let of = |name: &str| self.by_name.get(name).map_or((None, None), |session: &Session| (Some(session.who.clone()), session.person.clone()));
        let asks = |request: &Request| {
            let (who, person) = of(&request.name);
            Asks {
                number: request.number,
                name: request.name.clone(),
                who: who.unwrap_or_default(),
                person,
                reason: request.reason.clone(),
                left_ms: u64::try_from(request.until.saturating_duration_since(now).as_millis()).unwrap_or(u64::MAX),
            }
        };
        let (who, person) = self.command.holder().map_or((None, None), of);
        Holder {
            holder: self.command.holder().map(str::to_owned),
            who,
            person,
            requests: self.command.waiting().iter().map(asks).collect(),
            settled: self.command.settled().cloned().collect(),
        }
    }
}

impl Sessions {
    /// Takes command. Fails if another session has it, unless command is taken by force with the role `configure`.
    pub fn take(&self, name: &str, role: Role, force: bool) -> Result<(), Failure> {
        let mut state = self.locked();
        match state.command.holder() {
            Some(holder) if holder != name && !(force && role >= Role::Configure) => {
                let remedy = if force {
                    "taking command from its holder needs the role configure"
                } else {
                    "request it, wait until it is given back, or take it by force"
                };
                Err(state.not_commanding(remedy))
            }
            _ => {
                let reason = if force { "taken by force" } else { "taken" };
                state.command.hold(name, Some(name), reason);
                Ok(())
            }
        }
    }

    /// Gives up command; the session with the oldest request then receives it. Does nothing if the session did not have command.
    pub fn give_back(&self, name: &str) {
        let mut state = self.locked();
        let reason = format!("{} gave it back", state.called(name));
        state.command.release(name, &reason);
    }

    /// Requests command. It is granted immediately if no session has command. Returns the number of the request.
    pub fn ask(&self, name: &str, reason: &str, wait: Duration, now: Instant) -> u64 {
        let mut state = self.locked();
        state.command.expire(now);
        state.command.ask(name, reason, wait, now)
    }

    /// Withdraws a request for command. Fails if the session has none.
    pub fn withdraw(&self, name: &str, reason: &str) -> Result<(), Failure> {
        if self.locked().command.end(name, Outcome::Withdrawn, Some(name), reason) {
            return Ok(());
        }
        Err(Failure::new(
            Class::InvalidState,
            format!("session '{name}' has not requested command"),
            "check GET /v1/command: the request may have been answered",
        ))
    }

    /// Hands command over to another session, whether or not it has requested command. Fails if the session `name` does not have command,
    /// or if the other session does not exist or is not permitted to have command.
    pub fn hand_over(&self, name: &str, to: &str) -> Result<(), Failure> {
        let mut state = self.locked();
        state.require_holder(name)?;
        match state.by_name.get(to) {
            Some(session) if !session.alive => {
                Err(Failure::new(Class::UnknownName, format!("session '{to}' is lost, so it cannot command"), "wait until it has come back"))
            }
            Some(session) if session.role < Role::Operate => {
                let message = format!("session '{to}' has the role {}, but commanding needs operate", session.role.word());
                Err(Failure::new(Class::NotAllowed, message, "give it a token of that role"))
            }
            Some(_) => {
                let reason = format!("{} handed it over", state.called(name));
                state.command.hold(to, Some(name), &reason);
                Ok(())
            }
            None => Err(Failure::new(Class::UnknownName, format!("there is no session '{to}'"), "see GET /v1/sessions")),
        }
    }

    /// Declines another session's request. Fails if the session `name` does not have command, or if the other session has no request.
    pub fn decline(&self, name: &str, asking: &str, reason: &str) -> Result<(), Failure> {
        let mut state = self.locked();
        state.require_holder(name)?;
        if state.command.end(asking, Outcome::Declined, Some(name), reason) {
            return Ok(());
        }
        Err(Failure::new(Class::UnknownName, format!("session '{asking}' has not requested command"), "check the requests in GET /v1/command"))
    }

    /// Returns the name of a session's person, if provided.
    pub fn person(&self, name: &str) -> Option<String> {
        self.locked().by_name.get(name)?.person.clone()
    }

    /// Ends the requests whose waiting time has expired. Returns all requests completed since the last call.
    pub fn settle(&self, now: Instant) -> Vec<SettledRequest> {
        let mut state = self.locked();
        state.command.expire(now);
        state.command.untold()
    }

    /// Returns the name of the session that has command.
    pub fn holder(&self) -> Option<String> {
        self.locked().command.holder().map(str::to_owned)
    }

    /// Returns the holder of command, pending requests, and the outcomes of the most recent requests.
    pub fn command(&self, now: Instant) -> Holder {
        let mut state = self.locked();
        state.command.expire(now);
        state.told(now)
    }

    /// Refuses a command from a session that does not have command.
    pub fn require_command(&self, name: Option<&str>) -> Result<(), Failure> {
        let state = self.locked();
        if name.is_some() && state.command.holder() == name {
            return Ok(());
        }
        Err(state.not_commanding("open a session and take command: POST /v1/command"))
    }
}
