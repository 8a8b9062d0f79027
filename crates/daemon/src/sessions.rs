// SPDX-License-Identifier: Apache-2.0
//! Sessions: their presence, command, the owners of instances, and the end reports kept for absent sessions.
//!
//! No function in this module reads a clock: the caller passes the time.
mod answers;
mod command;
mod commanding;

use crate::caller::Caller;
use crate::failure::Failure;
use crate::requests::{OpenSession, hex};
use api::Role;
use indexmap::IndexMap;
use model::refusal::Class;
use std::collections::{BTreeSet, HashMap, VecDeque};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};
use supervisor::End;

pub use answers::{Holder, KeptReport, OpenedSession, Reports, SessionAnswer, SessionInfo, SessionInstance};
use command::Command;
pub use command::{Outcome, SETTLED_MAX, SettledRequest};

/// Maximum number of sessions, both live and lost.
pub const SESSIONS_MAX: usize = 64;
/// Maximum number of sessions per caller, so that no caller can fill the table.
pub const SESSIONS_EACH_MAX: usize = 24;
/// Maximum number of reports to keep for each session.
pub const REPORTS_MAX: usize = 256;

/// Placeholder for the ID of a session from an earlier daemon. It is not a valid ID, and is not empty like that of a session that was
/// never open.
const RESTORED: &str = "restored";

struct Session {
    id: String,
    who: String,
    /// Name of the person who opened the session.
    person: Option<String>,
    role: Role,
    from: String,
    alive: bool,
    seen: Instant,
    lost_after: Duration,
    /// Number of requests in progress: a client that is waiting for an answer does not count as silent.
    in_flight: usize,
    /// Number of connections that hold the session. `broken` is true if one of them has broken.
    holds: usize,
    broken: bool,
    instances: BTreeSet<u64>,
    reports: VecDeque<KeptReport>,
    lost_reports: u64,
}

#[derive(Default)]
struct State {
    by_name: IndexMap<String, Session>,
    command: Command,
    /// Session that last started each instance or, if none did, that created it.
    owners: HashMap<u64, String>,
    /// Session that created each instance. Instances created by the program are not included.
    makers: HashMap<u64, String>,
    /// Session that set each force.
    forces: HashMap<u64, String>,
    /// Number of the next end report to process.
    next_end: u64,
}

/// Sessions of one system.
#[derive(Default)]
pub struct Sessions(Mutex<State>);

impl Session {
    /// Creates a lost session without any instances or reports.
    fn of(caller: &Caller, now: Instant) -> Session {
        Session {
            id: String::new(),
            who: caller.who.clone(),
            person: None,
            role: caller.role,
            from: caller.from.clone(),
            alive: false,
            seen: now,
            lost_after: Duration::ZERO,
            in_flight: 0,
            holds: 0,
            broken: false,
            instances: BTreeSet::new(),
            reports: VecDeque::new(),
            lost_reports: 0,
        }
    }
}

impl State {
    fn of_id(&mut self, id: &str) -> Option<(&String, &mut Session)> {
        self.by_name.iter_mut().find(|(_, session)| session.alive && session.id == id)
    }

    /// Releases command if the session has it, and withdraws its requests for command.
    fn leave(&mut self, name: &str, how: &str) {
        let reason = format!("session '{name}' {how}");
        self.command.end(name, Outcome::Withdrawn, None, &reason);
        self.command.release(name, &reason);
    }

    /// Makes space for one more session of a caller. If the caller, or all callers together, have too many, the session that has been
    /// lost for the longest time is dropped, preferably one for which no reports are kept.
    fn make_room(&mut self, who: &str) -> Result<(), Failure> {
        let own = self.by_name.values().filter(|session| session.who == who).count();
        if own >= SESSIONS_EACH_MAX {
            self.evict(|session| session.who == who, &format!("{who} already has {own} sessions"))?;
        }
        if self.by_name.len() >= SESSIONS_MAX {
            self.evict(|_| true, &format!("there are already {SESSIONS_MAX} sessions"))?;
        }
        Ok(())
    }

    fn evict(&mut self, of: impl Fn(&Session) -> bool, full: &str) -> Result<(), Failure> {
        let lost = self.by_name.iter().filter(|(_, session)| !session.alive && of(session));
        let first = lost.min_by_key(|(_, session)| (!session.reports.is_empty() || !session.instances.is_empty(), session.seen));
        let Some(name) = first.map(|(name, _)| name.clone()) else {
            return Err(Failure::new(Class::LimitExceeded, full, "close one").again_in(5));
        };
        self.by_name.shift_remove(&name);
        self.release_all(&name);
        Ok(())
    }

    /// Removes a session as creator and owner of its instances.
    fn release_all(&mut self, name: &str) {
        self.owners.retain(|_, owner| owner != name);
        self.makers.retain(|_, maker| maker != name);
    }

    /// Makes a session the owner of an instance, or leaves it without an owner. Returns the previous owner.
    fn pass(&mut self, instance: u64, to: Option<&str>) -> Option<String> {
        let before = match to {
            Some(name) => self.owners.insert(instance, name.to_owned()),
            None => self.owners.remove(&instance),
        };
        if let Some(session) = before.as_ref().and_then(|name| self.by_name.get_mut(name)) {
            session.instances.remove(&instance);
        }
        if let Some(session) = to.and_then(|name| self.by_name.get_mut(name)) {
            session.instances.insert(instance);
        }
        before
    }
}

fn ended() -> Failure {
    Failure::new(Class::SessionLost, "there is no such session: it was closed, taken over elsewhere, or counts as lost", "open it again: POST /v1/sessions")
}

fn fresh_id() -> Result<String, Failure> {
    let mut random = [0_u8; 16];
    let why = |why: getrandom::Error| Failure::new(Class::InvalidState, format!("cannot generate a random number: {why}"), "try again");
    getrandom::fill(&mut random).map_err(why)?;
    Ok(hex(&random))
}

impl Sessions {
    fn locked(&self) -> MutexGuard<'_, State> {
        self.0.lock().expect("nobody panics with this lock")
    }

    /// Opens a new session, takes over a live one, or returns to a lost one.
    pub fn open(&self, caller: &Caller, asked: &OpenSession, now: Instant) -> Result<OpenedSession, Failure> {
        let id = fresh_id()?;
        let mut state = self.locked();
        if let Some(before) = state.by_name.get(&asked.name) {
            if before.who != caller.who || (before.alive && !asked.take_up) {
                let is = if before.alive { "is alive" } else { "is kept" };
                let (message, remedy) = (format!("session '{}' of {} {is}", asked.name, before.who), "use another name, or take it over as the same caller");
                return Err(Failure::new(Class::InUse, message, remedy));
            }
        } else {
            state.make_room(&caller.who)?;
            state.by_name.insert(asked.name.clone(), Session::of(caller, now));
        }
        let session = state.by_name.get_mut(&asked.name).expect("it was there, or has just been put there");
        let returned = !session.alive && !session.id.is_empty();
        (session.id, session.role, session.from, session.seen) = (id.clone(), caller.role, caller.from.clone(), now);
        (session.alive, session.broken, session.lost_after) = (true, false, Duration::from_millis(asked.lost_after_ms));
        (session.in_flight, session.holds) = (0, 0);
        session.person = asked.person.clone().or(session.person.take());
        Ok(OpenedSession {
            session: id,
            name: asked.name.clone(),
            role: caller.role,
            heartbeat_ms: 1_000,
            lost_after_ms: asked.lost_after_ms,
            returned,
            instances: session.instances.iter().copied().collect(),
            kept_reports: session.reports.len(),
            lost_reports: session.lost_reports,
        })
    }

    /// Restores a session from an earlier daemon: it is considered lost, and its caller can return to it. Does nothing if a session with
    /// that name exists or the table is full.
    pub fn restore(&self, name: &str, caller: &Caller, now: Instant) {
        let mut state = self.locked();
        if !state.by_name.contains_key(name) && state.make_room(&caller.who).is_ok() {
            state.by_name.insert(name.to_owned(), Session { id: RESTORED.to_owned(), ..Session::of(caller, now) });
        }
    }

    /// Begins a request of the session, which is a sign of life and acknowledges the most recent answers. Returns the name of the
    /// session.
    pub fn begin(&self, id: &str, caller: &Caller, now: Instant) -> Result<String, Failure> {
        let mut state = self.locked();
        let (name, session) = state.of_id(id).filter(|(_, session)| session.who == caller.who).ok_or_else(ended)?;
        session.seen = now;
        session.in_flight += 1;
        session.reports.retain(|kept| !kept.told);
        Ok(name.clone())
    }

    /// Ends a request of the session.
    pub fn end(&self, id: &str, now: Instant) {
        if let Some((_, session)) = self.locked().of_id(id) {
            session.in_flight = session.in_flight.saturating_sub(1);
            session.seen = session.seen.max(now);
        }
    }

    /// Returns true if the session with this ID is alive.
    pub fn is_alive(&self, id: &str) -> bool {
        self.locked().of_id(id).is_some()
    }

    /// Closes a session gracefully: the instances that it has started continue.
    pub fn close(&self, id: &str) -> Result<String, Failure> {
        let mut state = self.locked();
        let name = state.of_id(id).map(|(name, _)| name.clone()).ok_or_else(ended)?;
        state.by_name.shift_remove(&name);
        state.release_all(&name);
        state.leave(&name, "was closed");
        Ok(name)
    }

    /// Records that a connection holds the session.
    pub fn hold(&self, id: &str) {
        if let Some((_, session)) = self.locked().of_id(id) {
            session.holds += 1;
        }
    }

    /// Records that a connection no longer holds the session. If the connection broke, the session is lost at the next check.
    pub fn let_go(&self, id: &str, broke: bool) {
        if let Some((_, session)) = self.locked().of_id(id) {
            session.holds = session.holds.saturating_sub(1);
            session.broken |= broke;
        }
    }

    /// Records that this side was suspended for the duration `late` until `now`, which must not count as silence of its sessions.
    pub fn stood_still(&self, late: Duration, now: Instant) {
        self.locked().by_name.values_mut().for_each(|session| session.seen = (session.seen + late).min(now));
    }

    /// Declares lost all sessions whose time has expired, and returns each with its instances. A lost session loses command.
    pub fn lose(&self, now: Instant) -> Vec<(String, Vec<u64>)> {
        let mut state = self.locked();
        let is_lost =
            |session: &Session| session.alive && (session.broken || (session.in_flight == 0 && now.duration_since(session.seen) > session.lost_after));
        let names: Vec<String> = state.by_name.iter().filter(|(_, session)| is_lost(session)).map(|(name, _)| name.clone()).collect();
        state.command.expire(now);
        // End the requests of all lost sessions first, so that command passes to none of them.
        for name in &names {
            state.command.end(name, Outcome::Withdrawn, None, &format!("session '{name}' was lost"));
        }
        names.iter().for_each(|name| state.leave(name, "was lost"));
        let mut lost = Vec::new();
        for name in names {
            let session = state.by_name.get_mut(&name).expect("it was found just now");
            session.alive = false;
            lost.push((name, session.instances.iter().copied().collect()));
        }
        lost
    }

    /// Returns the instances that lost sessions have created or started. The flag is true for instances that must be deleted once they
    /// have ended, because they were created by a lost session and have not been started by a live one since.
    pub fn orphans(&self) -> Vec<(u64, bool)> {
        let state = self.locked();
        let is = |name: Option<&String>, alive: bool| name.and_then(|name| state.by_name.get(name)).is_some_and(|session| session.alive == alive);
        let known: BTreeSet<u64> = state.owners.keys().chain(state.makers.keys()).copied().collect();
        let judged = known.into_iter().map(|instance| (instance, state.makers.get(&instance), state.owners.get(&instance)));
        let of_lost = judged.filter(|(_, maker, owner)| is(*maker, false) || is(*owner, false));
        of_lost.map(|(instance, maker, owner)| (instance, is(maker, false) && !is(owner, true))).collect()
    }

    /// Records that a session has created an instance. The session owns the instance, which is deleted together with the session.
    pub fn make(&self, name: &str, instance: u64) {
        let mut state = self.locked();
        state.makers.insert(instance, name.to_owned());
        state.pass(instance, Some(name));
    }

    /// Records that a session has set a force, so that the force ends with the session. Returns false if the session has already ended.
    pub fn add_force(&self, name: &str, force: u64) -> bool {
        let mut state = self.locked();
        let is_alive = state.by_name.get(name).is_some_and(|session| session.alive);
        if is_alive {
            state.forces.insert(force, name.to_owned());
        }
        is_alive
    }

    /// Returns the forces that a session has set, and removes them from the session.
    pub fn take_forces(&self, name: &str) -> Vec<u64> {
        self.locked().forces.extract_if(|_, of| of == name).map(|(force, _)| force).collect()
    }

    /// Makes a session the owner of an instance that it starts, even if another session has created the instance. The end is reported to
    /// the owner, and if the owner is lost, the instance follows its policy. Returns the previous owner.
    pub fn own(&self, name: &str, instance: u64) -> Option<String> {
        self.locked().pass(instance, Some(name))
    }

    /// Returns an instance to its previous owner after a start was refused.
    pub fn give_back_to(&self, before: Option<&str>, instance: u64) {
        self.locked().pass(instance, before);
    }

    /// Removes a deleted instance from its owner.
    pub fn disown(&self, instance: u64) {
        let mut state = self.locked();
        state.makers.remove(&instance);
        state.pass(instance, None);
    }

    /// Returns the number of the first end report that has not been processed yet.
    pub fn next_end(&self) -> u64 {
        self.locked().next_end
    }

    /// Stores end reports, as numbered by the supervisor, for the sessions that own their instances.
    pub fn keep(&self, ends: Vec<End>) {
        let mut state = self.locked();
        for End { number, instance, report } in ends {
            if number < state.next_end {
                continue;
            }
            state.next_end = number + 1;
            let Some(owner) = state.owners.get(&instance).cloned() else { continue };
            let Some(session) = state.by_name.get_mut(&owner) else { continue };
            if session.reports.len() == REPORTS_MAX {
                session.reports.pop_front();
                session.lost_reports += 1;
            }
            session.reports.push_back(KeptReport { number, instance, report, told: false });
        }
    }

    /// Records that an answer reports the end of an instance to a session.
    pub fn told(&self, name: &str, instance: u64) {
        if let Some(session) = self.locked().by_name.get_mut(name) {
            session.reports.iter_mut().filter(|kept| kept.instance == instance).for_each(|kept| kept.told = true);
        }
    }

    /// Returns the reports kept for a session, and the number of lost reports. Permitted for the session's own caller, or with the role
    /// `configure`.
    pub fn reports(&self, name: &str, caller: &Caller) -> Result<(Vec<KeptReport>, u64), Failure> {
        let mut state = self.locked();
        let session = reader(&mut state, name, caller)?;
        Ok((session.reports.iter().cloned().collect(), session.lost_reports))
    }

    /// Drops the reports up to this number after they have been collected.
    pub fn collect(&self, name: &str, caller: &Caller, through: u64) -> Result<(), Failure> {
        let mut state = self.locked();
        let session = reader(&mut state, name, caller)?;
        session.reports.retain(|kept| kept.number > through);
        session.lost_reports = 0;
        Ok(())
    }

    /// Returns all sessions.
    pub fn list(&self) -> Vec<SessionInfo> {
        let state = self.locked();
        let listed = |(name, session): (&String, &Session)| SessionInfo {
            name: name.clone(),
            who: session.who.clone(),
            person: session.person.clone(),
            role: session.role,
            from: session.from.clone(),
            commands: state.command.holder() == Some(name.as_str()),
            alive: session.alive,
            held: session.holds > 0,
            kept_reports: session.reports.len(),
        };
        state.by_name.iter().map(listed).collect()
    }
}

fn reader<'a>(state: &'a mut State, name: &str, caller: &Caller) -> Result<&'a mut Session, Failure> {
    let Some(session) = state.by_name.get_mut(name) else {
        return Err(Failure::new(Class::UnknownName, format!("there is no session '{name}'"), "see GET /v1/sessions"));
    };
    if session.who != caller.who && caller.role < Role::Configure {
        let message = format!("the reports of session '{name}' belong to {}", session.who);
        return Err(Failure::new(Class::NotAllowed, message, "call as that caller, or with the role configure"));
    }
    Ok(session)
}
