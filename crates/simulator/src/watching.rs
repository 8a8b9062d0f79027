// SPDX-License-Identifier: Apache-2.0
//! Watchers of processes, following the rules of [`guard::watch`], under the virtual clock: the process that drives the plant, its guard,
//! and the supervisor's watcher. Each can be killed or suspended; the plant's outputs must be safe soon afterwards, as long as one
//! watcher remains.
//!
//! The process is observed from the plant: while it is suspended or has exited, its writes do not arrive and it sends no heartbeats.
use crate::broken::{BrokenInvariant, broken};
use crate::plant::{SharedLedger, locked};
use crate::program::MS;
use guard::watch::{Bounds, Event, ProcessStanding, Pulse, Subject, Watch, Watchers};
use std::time::Duration;

/// Period of heartbeats and of checks.
const BEAT_NS: i64 = 20 * MS;
/// Time after which the heartbeat of an unwatched processor stops.
const PATIENCE: Duration = Duration::from_millis(2_000);
/// Limits that the supervisor applies when it watches the guard.
const OF_GUARD: Bounds = Bounds { silent_ns: 1_000 * MS, stopped_ns: 100 * MS };
/// Time limit for the outputs to become safe after a process has exited or was suspended, counted while a watcher is running: a suspended
/// guard is detected first (silent: 1 s), then its successor detects the process (silent: 0.5 s), and then the process is killed (0.1 s).
const SAFE_NS: i64 = 1_000 * MS + 500 * MS + 100 * MS + 6 * BEAT_NS;

/// A process: whether it is running, and its heartbeat.
#[derive(Clone, Debug, Default)]
struct Process {
    beats: u64,
    /// Time until which the process is suspended; `is_stopped` is true if the operating system reports this.
    still_until_ns: i64,
    is_stopped: bool,
    /// Time at which the process exited, or will exit.
    ends_ns: Option<i64>,
}

impl Process {
    fn is_gone(&self, now_ns: i64) -> bool {
        self.ends_ns.is_some_and(|ends_ns| now_ns >= ends_ns)
    }

    fn runs(&self, now_ns: i64) -> bool {
        !self.is_gone(now_ns) && now_ns >= self.still_until_ns
    }
}

/// The process that drives the plant, as a watcher sees it.
struct Driving<'a> {
    process: &'a mut Process,
    plant: &'a SharedLedger,
    now_ns: i64,
    dies_after_ns: i64,
}

impl Subject for Driving<'_> {
    fn notice_end(&mut self) -> bool {
        self.process.is_gone(self.now_ns)
    }

    fn beats(&self) -> u64 {
        self.process.beats
    }

    fn is_stopped(&self) -> bool {
        self.process.is_stopped && !self.process.runs(self.now_ns)
    }

    fn latches(&self) -> bool {
        false
    }

    fn kill(&mut self) {
        self.process.ends_ns.get_or_insert(self.now_ns + self.dies_after_ns);
    }

    fn write(&mut self, _: bool) -> bool {
        locked(self.plant).make_safe();
        true
    }
}

pub struct Watching {
    driving: Process,
    guard: Process,
    supervisor: Process,
    by_guard: Watch,
    by_supervisor: Watch,
    of_guard: Pulse,
    heart: Watchers,
    serves: bool,
    next_ns: i64,
    /// Time for which the outputs have been unsafe while the process was suspended or had exited and a watcher was running.
    unsafe_ns: i64,
    /// Time at which the process last recovered from a suspension or an exit. For a short time afterwards, a watcher may still misjudge
    /// it.
    healthy_since_ns: i64,
}

fn watch(now_ns: i64, beats: u64) -> Watch {
    Watch::new(Some(Pulse::new(Bounds::default(), beats, now_ns)), false)
}

impl Watching {
    pub fn new() -> Watching {
        let started = Process { beats: 1, ..Process::default() };
        Watching {
            driving: started.clone(),
            guard: started.clone(),
            supervisor: started,
            by_guard: watch(0, 1),
            by_supervisor: watch(0, 1),
            of_guard: Pulse::new(OF_GUARD, 1, 0),
            heart: Watchers::new(PATIENCE, 0),
            serves: true,
            next_ns: BEAT_NS,
            unsafe_ns: 0,
            healthy_since_ns: 0,
        }
    }

    /// Kills `who` (0: the process, 1: its guard), or suspends it for a time (also 2: the supervisor). The operating system reports the
    /// suspension only if `is_stopped` is true.
    pub fn hit(&mut self, who: usize, still_ns: Option<i64>, is_stopped: bool, now_ns: i64) -> String {
        let who = who % 3;
        let (process, name) = match who {
            0 => (&mut self.driving, "the plant's process"),
            1 => (&mut self.guard, "the guard"),
            _ => (&mut self.supervisor, "the supervisor"),
        };
        match still_ns.or((who == 2).then_some(30_000 * MS)) {
            None => {
                process.ends_ns.get_or_insert(now_ns);
                format!("{name} is killed")
            }
            Some(still_ns) => {
                (process.still_until_ns, process.is_stopped) = (process.still_until_ns.max(now_ns + still_ns), is_stopped);
                format!("{name} {} for {} ms", if is_stopped { "is stopped" } else { "hangs" }, still_ns / MS)
            }
        }
    }

    /// Returns true if the process that drives the plant is running.
    pub fn is_driven(&self, now_ns: i64) -> bool {
        self.driving.runs(now_ns)
    }

    /// Performs all checks that are due by now.
    pub fn look(&mut self, plant: &SharedLedger, now_ns: i64) -> Result<(), BrokenInvariant> {
        locked(plant).is_cut = !self.driving.runs(now_ns);
        while self.next_ns <= now_ns {
            let at_ns = self.next_ns;
            self.next_ns += BEAT_NS;
            for process in [&mut self.driving, &mut self.guard, &mut self.supervisor] {
                process.beats += u64::from(process.runs(at_ns));
            }
            self.look_once(plant, at_ns)?;
            self.judge(plant, at_ns)?;
        }
        Ok(())
    }

    fn look_once(&mut self, plant: &SharedLedger, now_ns: i64) -> Result<(), BrokenInvariant> {
        let was_healthy = self.driving.runs(now_ns) && now_ns - self.healthy_since_ns > BEAT_NS;
        let dies_after_ns = 30 * MS;
        let mut seen = None;
        if self.guard.runs(now_ns) {
            seen = self.by_guard.look(&mut Driving { process: &mut self.driving, plant, now_ns, dies_after_ns }, now_ns);
        }
        if self.supervisor.runs(now_ns) {
            let stopped = self.guard.is_stopped && !self.guard.runs(now_ns);
            self.serves = !self.guard.is_gone(now_ns) && self.of_guard.look(self.guard.beats, || stopped, now_ns) == ProcessStanding::Serves;
            let of = &mut Driving { process: &mut self.driving, plant, now_ns, dies_after_ns };
            let told = if self.serves { self.by_supervisor.look_beside(of, now_ns) } else { self.by_supervisor.look(of, now_ns) };
            seen = seen.or(told);
            if !self.serves {
                // The guard is ended, and replaced by another one.
                self.guard = Process { beats: 1, ..Process::default() };
                self.of_guard = Pulse::new(OF_GUARD, 1, now_ns);
                self.by_guard = watch(now_ns, self.driving.beats);
            }
        }
        if was_healthy && self.driving.ends_ns.is_some() {
            return broken("no healthy processor is lost", format!("a process that runs is killed at {} ms", now_ns / MS));
        }
        if self.driving.runs(now_ns) && self.heart.look(self.guard.beats, self.supervisor.beats, now_ns) {
            // No watcher is left, so the process makes its own outputs safe and exits.
            locked(plant).make_safe();
            self.driving.ends_ns = Some(now_ns);
            locked(plant).is_cut = true;
        }
        if let (Some(Event::Lost { cause, .. }), true) = (seen, was_healthy) {
            return broken("no healthy processor is lost", format!("a process that runs counts as lost at {} ms: {cause:?}", now_ns / MS));
        }
        Ok(())
    }

    fn judge(&mut self, plant: &SharedLedger, now_ns: i64) -> Result<(), BrokenInvariant> {
        if self.driving.runs(now_ns) {
            self.unsafe_ns = 0;
            return Ok(());
        }
        self.healthy_since_ns = now_ns;
        // Only the supervisor can detect a guard that has exited or stands still.
        let sees = self.supervisor.runs(now_ns) || self.guard.runs(now_ns);
        self.unsafe_ns = if locked(plant).is_safe() { 0 } else { self.unsafe_ns + if sees { BEAT_NS } else { 0 } };
        if self.unsafe_ns > SAFE_NS {
            let outputs = locked(plant).outputs.clone();
            return broken("safe outputs", format!("the plant's process has been away for long, and its outputs are {outputs:?} at {} ms", now_ns / MS));
        }
        Ok(())
    }

    /// Restores the process and everything that was killed, as an operator would; the heartbeats restart.
    pub fn mend(&mut self, plant: &SharedLedger, now_ns: i64) {
        *self = Watching::new();
        self.next_ns = (now_ns / BEAT_NS + 1) * BEAT_NS;
        (self.by_guard, self.by_supervisor) = (watch(now_ns, 1), watch(now_ns, 1));
        self.of_guard = Pulse::new(OF_GUARD, 1, now_ns);
        self.heart = Watchers::new(PATIENCE, now_ns);
        self.healthy_since_ns = now_ns;
        locked(plant).is_cut = false;
    }
}
