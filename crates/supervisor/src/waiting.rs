// SPDX-License-Identifier: Apache-2.0
//! Waits of calls for kernel answers and for deadlines. Under the virtual clock, a wait advances time.
use crate::attending::Attending;
use crate::core::Core;
use crate::refuse::refuse;
use crate::stopping::emergency_stop::watch_inputs;
use crate::stopping::lost_processors::{look_for_lost, next_answer};
use crate::system::{SystemState, WaitResult};
use crate::watchful::Watchful;
use model::refusal::{Class, Refusals};
use std::time::{Duration, Instant};

impl SystemState {
    /// Waits until `found` returns a value. Under the virtual clock, advances time as far as necessary.
    pub fn wait_for<T>(
        &self,
        until_ns: Option<i64>,
        slice: Duration,
        found: impl FnMut(&mut Core) -> Result<Option<T>, Refusals>,
    ) -> Result<WaitResult<T>, Refusals> {
        self.wait_watchfully(Watchful::At, None, until_ns, slice, found)
    }

    /// Waits as [`SystemState::wait_for`] does. `watchful` determines when to poll rather than sleep; `attending` polls in place of the
    /// supervisor until it sleeps.
    pub fn wait_watchfully<T>(
        &self,
        watchful: Watchful,
        mut attending: Option<Attending>,
        until_ns: Option<i64>,
        slice: Duration,
        mut found: impl FnMut(&mut Core) -> Result<Option<T>, Refusals>,
    ) -> Result<WaitResult<T>, Refusals> {
        let begun = Instant::now();
        let begun_ns = self.host.now_ns();
        let mut core = self.locked();
        loop {
            // Read this before everything else, so that later arrivals are not missed.
            let seen = self.signs();
            let came = core.drain();
            let result = found(&mut core)?;
            // Notify waiting threads only of arrivals: if they notified each other of mere checks, they would never rest.
            if core.drain() || came || core.observation.ended > 0 {
                self.announce(&mut core);
            }
            let left = slice.saturating_sub(begun.elapsed());
            let waited = match result {
                Some(result) => Some(WaitResult::Done(result)),
                None if until_ns.is_some_and(|until| self.host.now_ns() >= until) => Some(WaitResult::TimedOut),
                None if left.is_zero() => Some(WaitResult::Slice),
                None => None,
            };
            if let Some(waited) = waited {
                attending.into_iter().for_each(|attending| attending.end(&core, seen.0));
                return Ok(waited);
            }
            if self.is_virtual {
                drop(core);
                let limit_ns = until_ns.unwrap_or(i64::MAX);
                if !self.step(limit_ns)? {
                    match until_ns {
                        Some(until) => self.host.set_now(until),
                        None => {
                            return Err(refuse(
                                Class::InvalidState,
                                "the wait would never end: no event is pending",
                                "start a timer, or activate a block, before the wait",
                            ));
                        }
                    }
                }
                core = self.locked();
                continue;
            }
            let now_ns = self.host.now_ns();
            if let Some(end_ns) = watchful.looks_until_ns(begun_ns, now_ns) {
                // A kernel answers within microseconds, sooner than two threads wake one after the other.
                if attending.is_none() && matches!(watchful, Watchful::AtRelease(_)) {
                    attending = Some(Attending::new(&core));
                }
                drop(core);
                while self.signs() == seen && self.host.now_ns() < end_ns {
                    (0..PAUSES).for_each(|_| std::hint::spin_loop());
                }
                core = self.locked();
            } else {
                let next_ns = [until_ns, watchful.looks_next_ns(begun_ns, now_ns)].into_iter().flatten().min();
                let by_clock = next_ns.map_or(left, |next| Duration::from_nanos(u64::try_from(next - now_ns).unwrap_or(0)));
                attending.take().into_iter().for_each(|attending| attending.end(&core, seen.0));
                self.changes.wait(core, left.min(by_clock));
                core = self.locked();
                look_for_lost(&mut core);
            }
        }
    }

    /// Returns the wake-up counters: notifications from kernels, and changes made by other threads.
    fn signs(&self) -> (u32, u64) {
        (self.host.rings(), self.changes.count())
    }

    /// Holds virtual time while a tap that holds it has not been read.
    fn wait_for_taps(&self) {
        // Hold the lock for the check, but not while waiting.
        let full = || {
            let core = self.locked();
            core.observation.taps.full(core.observation.log.next(), core.observation.ends.next())
        };
        while let Some(inbox) = full() {
            inbox.press();
        }
    }

    /// Runs everything that is due at the next instant of the virtual clock, up to `limit_ns`, so that a caller can act between two
    /// instants. Returns false if nothing is due.
    pub fn step(&self, limit_ns: i64) -> Result<bool, Refusals> {
        if !self.happen(limit_ns)? {
            return Ok(false);
        }
        // If firings have a cost, also run everything until they complete.
        let end_ns = self.host.now_ns().max(self.host.busy_until_ns());
        while self.happen(end_ns)? {}
        self.host.set_now(end_ns);
        Ok(true)
    }

    /// Runs the next firing or deadline of the virtual clock, up to `limit_ns`. Returns false if there is none.
    pub fn happen(&self, limit_ns: i64) -> Result<bool, Refusals> {
        self.wait_for_taps();
        let deadline = {
            let mut core = self.locked();
            core.drain();
            [core.next_deadline(), next_answer(&core)].into_iter().flatten().min()
        };
        let next = self.host.next_time();
        let deadline_first = deadline.is_some_and(|d| next.is_none_or(|n| d < n));
        let stepped = if let (true, Some(deadline_ns)) = (deadline_first, deadline) {
            if deadline_ns > limit_ns {
                return Ok(false);
            }
            self.host.set_now(deadline_ns.max(self.host.now_ns()));
            true
        } else {
            // Results of firings that have not completed by a deadline must not be visible then.
            let fired = (self.host.fire_next(limit_ns.min(deadline.unwrap_or(i64::MAX))))
                .map_err(|why| refuse(Class::SchedulingError, why, "drive one of these sources with a timer"))?;
            // If something merely arrived before the deadline, that counts as the next event.
            fired || deadline.is_some_and(|deadline_ns| deadline_ns <= limit_ns)
        };
        let mut core = self.locked();
        core.drain();
        let now_ns = self.host.now_ns();
        if core.next_deadline().is_some_and(|d| d <= now_ns) {
            core.serve_deadlines(now_ns);
            core.drain();
        }
        look_for_lost(&mut core);
        watch_inputs(&mut core);
        self.announce(&mut core);
        Ok(stepped)
    }
}

/// Number of spin-loop pauses between two checks.
const PAUSES: u32 = 16;
