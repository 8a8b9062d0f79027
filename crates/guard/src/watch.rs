// SPDX-License-Identifier: Apache-2.0
//! Rules by which a process counts as lost, and the consequences. Pure logic, without a clock, a thread or a descriptor: the caller
//! provides the time, and a [`Subject`] provides observations and carries out actions.
//!
//! | observer | observed | with | consequence |
//! |---|---|---|---|
//! | the guard, and the supervisor's watcher | each process that has devices | [`Watch`] | its outputs are made safe |
//! | the supervisor's watcher | the guard | [`Pulse`] | it is ended, and another one is started |
//! | the heart of a processor | the guard and the supervisor | [`Watchers`] | if both stall, it makes its own outputs safe |
//!
//! There are two bounds because the certainty differs: a process that the operating system holds stopped (SIGSTOP, a debugger) does
//! nothing, whatever the load of the machine; a process whose heart is silent may only be waiting for a core.
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Maximum stall of a process's heart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bounds {
    /// Time without a beat after which the process counts as frozen, whatever the reason.
    pub silent_ns: i64,
    /// Time without a beat after which the process counts as stopped, if the operating system reports it as such.
    pub stopped_ns: i64,
}

impl Default for Bounds {
    /// Returns the bounds of a heart that beats every 20 ms. A stopped process is detected within some 120 ms; a process that is merely
    /// silent is allowed the time for which a loaded machine may hold it up.
    fn default() -> Bounds {
        Bounds { silent_ns: 500_000_000, stopped_ns: 100_000_000 }
    }
}

impl From<Duration> for Bounds {
    /// Uses `bound` for both bounds: the configured maximum stall applies whatever the reason.
    fn from(bound: Duration) -> Bounds {
        let bound_ns = i64::try_from(bound.as_nanos()).unwrap_or(i64::MAX);
        Bounds { silent_ns: bound_ns, stopped_ns: bound_ns }
    }
}

/// Minimum bound. A shorter one would measure the scheduler, not the process.
const BOUND_NS_MIN: i64 = 10_000_000;
/// Minimum and maximum interval between two checks.
const LOOK_NS: (i64, i64) = (1_000_000, 20_000_000);
/// Maximum time that a killed process may take to exit before its outputs are made safe anyway (and again after its exit).
const DEATH_NS_MAX: i64 = 100_000_000;
/// Time for which failed writes are retried; also the interval between two attempts.
const RETRY_NS_MAX: i64 = 10_000_000_000;
const RETRY_NS: i64 = 10_000_000;

/// State of a process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessStanding {
    /// The process's heart beats, or has not been silent for long.
    Serves,
    /// The operating system has held the process stopped for longer than its bound.
    Stopped,
    /// The process's heart has been silent for longer than its bound.
    Silent,
}

/// Stall detector for a heart that is polled at intervals.
#[derive(Clone, Debug)]
pub struct Pulse {
    bounds: Bounds,
    seen: u64,
    looked_ns: i64,
    still_ns: i64,
}

impl Pulse {
    /// Creates the pulse of a heart that has beaten `beats` times.
    pub fn new(bounds: Bounds, beats: u64, now_ns: i64) -> Pulse {
        let bounds = Bounds { silent_ns: bounds.silent_ns.max(BOUND_NS_MIN), stopped_ns: bounds.stopped_ns.max(BOUND_NS_MIN) };
        Pulse { bounds, seen: beats, looked_ns: now_ns, still_ns: 0 }
    }

    /// Returns the interval between two checks.
    pub fn interval_ns(&self) -> i64 {
        (self.bounds.silent_ns.min(self.bounds.stopped_ns) / 5).clamp(LOOK_NS.0, LOOK_NS.1)
    }

    /// Checks the heart. `is_stopped` is called only if the heart has not beaten for long enough. A long time between two checks counts
    /// as only two intervals, because the observer or the whole machine was suspended. A heart that has not beaten yet does not count as
    /// silent.
    pub fn look(&mut self, beats: u64, is_stopped: impl FnOnce() -> bool, now_ns: i64) -> ProcessStanding {
        let elapsed_ns = (now_ns - self.looked_ns).clamp(0, 2 * self.interval_ns());
        self.looked_ns = now_ns;
        self.still_ns = if beats == self.seen { self.still_ns.saturating_add(elapsed_ns) } else { 0 };
        self.seen = beats;
        if self.still_ns >= self.bounds.stopped_ns && is_stopped() {
            ProcessStanding::Stopped
        } else if beats != 0 && self.still_ns >= self.bounds.silent_ns {
            ProcessStanding::Silent
        } else {
            ProcessStanding::Serves
        }
    }
}

/// Process that a [`Watch`] observes and acts on. No method may block.
pub trait Subject {
    /// Returns true if the process has exited.
    fn notice_end(&mut self) -> bool;
    /// Returns true if the process is dying: its threads have exited, but its memory has not been freed yet.
    fn notice_dying(&mut self) -> bool {
        false
    }
    /// Returns the process's heartbeat count.
    fn beats(&self) -> u64;
    /// Returns true if the operating system holds the process stopped.
    fn is_stopped(&self) -> bool;
    /// Returns true if the process's safe values stay in force even if the process itself writes later.
    fn latches(&self) -> bool;
    /// Kills the process immediately; its exit is noticed later.
    fn kill(&mut self);
    /// Records the reason for which the process is about to be terminated, for other watchers.
    fn condemn(&mut self, _why: Cause) {}
    /// Returns the reason for which another watcher terminated the process, if one did.
    fn condemned(&self) -> Option<Cause> {
        None
    }
    /// Writes the process's safe values: those not yet written, or all of them (`afresh`). Returns true if nothing is left to write.
    fn write(&mut self, afresh: bool) -> bool;
}

/// Reason for which a process counts as lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The process has exited: it was killed, aborted, crashed, or exited by itself without notice.
    Died,
    /// The process's heart did not beat for longer than its bound.
    Frozen,
    /// The process was stopped (SIGSTOP, a debugger) for longer than its bound.
    Stopped,
}

/// Result of one check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The process is lost: its outputs have been made safe. Occurs once in the lifetime of a process.
    Lost {
        /// Cause of the loss.
        cause: Cause,
        /// Time of the observation.
        seen_ns: i64,
    },
    /// The process has stalled and is spared: its outputs have been made safe.
    MadeSafe {
        /// Cause of the stall.
        cause: Cause,
        /// Time of the observation.
        seen_ns: i64,
    },
    /// The process had stalled, was spared, and has resumed.
    GoesOn,
}

/// A watched process: detection of its loss, and the order of the actions that follow.
///
/// A process that merely stalls is killed first, and its safe values are written only after it has exited, so that it can never resume
/// and overwrite them. The safe values of a spared process are written while it is stalled, which requires outputs that
/// [latch](Subject::latches).
#[derive(Clone, Debug)]
pub struct Watch {
    pulse: Option<Pulse>,
    is_spared: bool,
    state: State,
    /// True if a write is still pending.
    is_owed: bool,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Guarded,
    /// The process has stalled, and its outputs are safe.
    Still,
    /// The process had stalled, was killed, and has not exited yet.
    Killed {
        cause: Cause,
        seen_ns: i64,
    },
    /// The process is lost. `is_over`: it has exited, which takes time for a killed process.
    Lost {
        since_ns: i64,
        is_over: bool,
    },
}

impl Watch {
    /// Creates a watch. `pulse`: `None` if only the exit of the process counts. `is_spared`: the process is not killed if it stalls and
    /// its outputs latch.
    pub fn new(pulse: Option<Pulse>, is_spared: bool) -> Watch {
        Watch { pulse, is_spared, state: State::Guarded, is_owed: false }
    }

    /// Checks the process.
    pub fn look(&mut self, of: &mut impl Subject, now_ns: i64) -> Option<Event> {
        self.look_as(of, true, now_ns)
    }

    /// Checks the process alongside a serving guard. If the process has exited, its safe values are written immediately, no matter which
    /// of the two noticed first; a process that has stalled is left to the guard.
    pub fn look_beside(&mut self, of: &mut impl Subject, now_ns: i64) -> Option<Event> {
        self.look_as(of, false, now_ns)
    }

    fn look_as(&mut self, of: &mut impl Subject, leads: bool, now_ns: i64) -> Option<Event> {
        let has_ended = of.notice_end();
        match self.state {
            State::Guarded | State::Still if has_ended => self.lose(of, of.condemned().unwrap_or(Cause::Died), now_ns, now_ns, true),
            State::Guarded | State::Still if of.notice_dying() => {
                // It does not wait until the process's memory is freed. After its end the values are written again.
                of.kill();
                self.lose(of, of.condemned().unwrap_or(Cause::Died), now_ns, now_ns, false)
            }
            State::Guarded => {
                let cause = self.stands_still(of, now_ns).filter(|_| leads)?;
                if self.is_spared && of.latches() {
                    self.state = State::Still;
                    self.is_owed = !of.write(true);
                    return Some(Event::MadeSafe { cause, seen_ns: now_ns });
                }
                self.kill(of, cause, now_ns)
            }
            State::Still => match self.stands_still(of, now_ns) {
                None => {
                    (self.state, self.is_owed) = (State::Guarded, false);
                    Some(Event::GoesOn)
                }
                Some(cause) if !of.latches() => self.kill(of, cause, now_ns),
                Some(_) => {
                    self.write_owed(of);
                    None
                }
            },
            State::Killed { cause, seen_ns } => {
                let is_late = now_ns - seen_ns > DEATH_NS_MAX;
                if has_ended || is_late || of.notice_dying() { self.lose(of, cause, seen_ns, now_ns, has_ended) } else { None }
            }
            State::Lost { since_ns, is_over } => {
                if has_ended && !is_over {
                    self.state = State::Lost { since_ns, is_over: true };
                    self.is_owed = !of.write(true);
                } else if now_ns - since_ns > RETRY_NS_MAX {
                    (self.state, self.is_owed) = (State::Lost { since_ns, is_over: true }, false);
                }
                self.write_owed(of);
                None
            }
        }
    }

    /// Records that a handle was added; if the outputs are already safe, it is written immediately.
    pub fn added(&mut self, of: &mut impl Subject) {
        if matches!(self.state, State::Lost { .. } | State::Still) {
            self.is_owed = !of.write(false);
        }
    }

    /// Returns the interval between two checks; `None` if only the exit of the process matters.
    pub fn interval_ns(&self) -> Option<i64> {
        let pulse = || self.pulse.as_ref().map(Pulse::interval_ns);
        match self.state {
            State::Guarded => pulse(),
            State::Still => Some(pulse().unwrap_or(RETRY_NS).min(RETRY_NS)),
            State::Killed { .. } => Some(RETRY_NS),
            State::Lost { is_over, .. } => (self.is_owed || !is_over).then_some(RETRY_NS),
        }
    }

    /// Returns true if the process is lost and has exited.
    pub fn is_over(&self) -> bool {
        matches!(self.state, State::Lost { is_over: true, .. })
    }

    /// Returns true if neither the exit of the process nor a failed write is pending.
    pub fn is_settled(&self) -> bool {
        self.is_over() && !self.is_owed
    }

    fn stands_still(&mut self, of: &impl Subject, now_ns: i64) -> Option<Cause> {
        match self.pulse.as_mut()?.look(of.beats(), || of.is_stopped(), now_ns) {
            ProcessStanding::Serves => None,
            ProcessStanding::Stopped => Some(Cause::Stopped),
            ProcessStanding::Silent => Some(Cause::Frozen),
        }
    }

    fn kill(&mut self, of: &mut impl Subject, cause: Cause, seen_ns: i64) -> Option<Event> {
        of.condemn(cause);
        of.kill();
        self.state = State::Killed { cause, seen_ns };
        None
    }

    fn lose(&mut self, of: &mut impl Subject, cause: Cause, seen_ns: i64, since_ns: i64, is_over: bool) -> Option<Event> {
        self.is_owed = !of.write(true);
        self.state = State::Lost { since_ns, is_over };
        Some(Event::Lost { cause, seen_ns })
    }

    fn write_owed(&mut self, of: &mut impl Subject) {
        if self.is_owed {
            self.is_owed = !of.write(false);
        }
    }
}

/// Watchers of a process, as monitored by the process's own heart.
#[derive(Clone, Debug)]
pub struct Watchers {
    guard: Pulse,
    supervisor: Pulse,
}

impl Watchers {
    /// Creates watchers with a maximum stall of `patience`.
    pub fn new(patience: Duration, now_ns: i64) -> Watchers {
        let pulse = || Pulse::new(patience.into(), 0, now_ns);
        Watchers { guard: pulse(), supervisor: pulse() }
    }

    /// Checks the counts of the watchers' heartbeats. Returns true if both have been stalled for longer than the patience: this process
    /// then makes its outputs safe itself, because no watcher would.
    pub fn look(&mut self, guard: u64, supervisor: u64, now_ns: i64) -> bool {
        // A watcher that has not beaten yet is also given the patience, and no more.
        let silent = |pulse: &mut Pulse, beats: u64| pulse.look(beats.saturating_add(1), || false, now_ns) == ProcessStanding::Silent;
        let (guard, supervisor) = (silent(&mut self.guard, guard), silent(&mut self.supervisor, supervisor));
        guard && supervisor
    }
}

#[cfg(test)]
mod tests;
