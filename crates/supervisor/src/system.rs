// SPDX-License-Identifier: Apache-2.0
//! One real-time system: what a programming system calls. Every call either does all of what it says or refuses and changes
//! nothing; the calls that wait can be given up at any time.
use crate::catalog::Catalog;
use crate::companions::Companions;
use crate::core::Core;
use crate::instance::{Instance, Limits, State};
use crate::location::Processor;
use crate::refuse::{invalid_state, refuse};
use crate::report::Report;
use indexmap::IndexMap;
use kernel::{ClockKind, Host};
use model::CheckedVerb;
use model::configuration::Configuration;
use model::refusal::{Class, Refusals};
use model::value::Value;
use std::collections::HashMap;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock};
use std::time::{Duration, Instant};

/// What is defined: configuration and code. Locked before [`Core`] where both are needed.
pub(crate) struct Definitions {
    pub configuration: Configuration,
    pub catalog: Catalog,
    /// Verbs that have been checked with the code and device types that are there now.
    pub checked: HashMap<String, Arc<CheckedVerb>>,
    pub processors: IndexMap<String, Processor>,
}

/// A real-time system in this process.
pub struct System {
    pub(crate) name: String,
    pub(crate) shared: Arc<Shared>,
    supervisor: Mutex<Option<std::thread::JoinHandle<()>>>,
    /// False of an observer.
    owns: bool,
}

/// What the calls and the supervisor's thread share.
pub(crate) struct Shared {
    pub host: Arc<Host>,
    pub is_virtual: bool,
    pub definitions: Mutex<Definitions>,
    pub core: Mutex<Core>,
    /// Told after every change that somebody may wait for.
    pub changed: Condvar,
    /// How many wait for it: telling nobody would be a system call too.
    waiting: AtomicUsize,
    pub closing: AtomicBool,
    pub closed: AtomicBool,
    /// Where and at which priority the supervisor's thread runs: on its processor's core, above that processor's sources.
    pub post: Mutex<Post>,
    /// Where processors elsewhere come from.
    pub places: OnceLock<Arc<dyn rtp::Places>>,
    pub companions: Mutex<Companions>,
    /// Readable after an end, for event loops.
    ended_fd: OwnedFd,
}

/// The place of the supervisor's thread, as the configuration has it, and what of it was not given.
#[derive(Default)]
pub(crate) struct Post {
    pub wanted: Option<(u8, Option<usize>)>,
    pub taken: bool,
    pub missing: Vec<String>,
}

/// How a wait ended.
pub enum Waited<T> {
    Done(T),
    TimedOut,
    /// The time slice is over: the caller may look at signals or show progress, and go on.
    Slice,
}

impl System {
    /// `interconnect`: what carries connections between sources.
    pub fn new(name: &str, clock: ClockKind, carrier: Box<dyn interconnect::Carrier>) -> Result<System, Refusals> {
        let host = Arc::new(Host::new(clock, carrier));
        // SAFETY: eventfd has no preconditions; the result is checked below.
        let fd = unsafe { libc::eventfd(0, libc::EFD_NONBLOCK | libc::EFD_CLOEXEC) };
        if fd < 0 {
            let why = std::io::Error::last_os_error();
            return Err(refuse(Class::InvalidState, format!("cannot make an event descriptor: {why}"), "close some files and try again"));
        }
        let shared = Arc::new(Shared {
            is_virtual: matches!(clock, ClockKind::Virtual { .. }),
            definitions: Mutex::new(Definitions {
                configuration: Configuration::default(),
                catalog: Catalog::default(),
                checked: HashMap::new(),
                processors: IndexMap::new(),
            }),
            core: Mutex::new(Core::new(host.clone())),
            host,
            changed: Condvar::new(),
            waiting: AtomicUsize::new(0),
            post: Mutex::new(Post::default()),
            closing: AtomicBool::new(false),
            closed: AtomicBool::new(false),
            places: OnceLock::new(),
            companions: Mutex::default(),
            // SAFETY: `fd` was just made and belongs to nobody else.
            ended_fd: unsafe { OwnedFd::from_raw_fd(fd) },
        });
        shared.locked().alarms.has_wall = !shared.is_virtual;
        let supervisor = if shared.is_virtual { None } else { Some(supervise(&shared)?) };
        let system = System { name: name.to_owned(), shared, supervisor: Mutex::new(supervisor), owns: true };
        system.enter_library();
        Ok(system)
    }

    pub(crate) fn of(name: &str, shared: Arc<Shared>) -> System {
        System { name: name.to_owned(), shared, supervisor: Mutex::new(None), owns: false }
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether time is a number that waits and `advance` move.
    pub fn is_virtual(&self) -> bool {
        self.shared.is_virtual
    }

    /// Starts a verb instance.
    pub fn start(&self, instance: u64, values: &IndexMap<String, Value>, limits: Limits) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        self.untune(&mut definitions, instance)?;
        let plan = self.shared.locked().instance(instance)?.plan.clone();
        let values = self.settled(&plan, values, &definitions.configuration)?;
        self.shared.command(|core| core.start(instance, &values, limits, &definitions.configuration))
    }

    /// Suspends it; returns when the kernels have done it.
    pub fn suspend(&self, instance: u64) -> Result<(), Refusals> {
        self.shared.command(|core| core.suspend(instance))?;
        let is_settled = |i: &Instance| i.state != State::Running || i.departure.is_some();
        loop {
            let settled = self.until_settled(instance, is_settled);
            // One that comes to rest first has its own time for that.
            if settled.is_ok() || self.shared.locked().instances.get(&instance).is_none_or(|i| i.resting_until_ns.is_none()) {
                settled?;
                break;
            }
        }
        match self.shared.locked().instances.get(&instance).filter(|i| i.departure.is_some() && i.state != State::Ended) {
            Some(ends) => Err(invalid_state(&format!("'{}'", ends.name), "ending", "suspend", "wait for it")),
            None => Ok(()),
        }
    }

    pub fn resume(&self, instance: u64) -> Result<(), Refusals> {
        self.shared.command(|core| {
            core.refuse_paused(instance)?;
            core.resume(instance)
        })?;
        self.until_settled(instance, |i| i.state != State::Suspended)
    }

    /// Begins a halt: τ on `halted`, or the end. See [`System::wait`] for when it is over.
    pub fn halt(&self, instance: u64) -> Result<(), Refusals> {
        self.shared.command(|core| core.halt(instance))
    }

    /// The end report of the latest start, waiting at most `slice` of real time. `until_ns`: when to give up, on the system's clock.
    pub fn wait(&self, instance: u64, until_ns: Option<i64>, slice: Duration) -> Result<Waited<Report>, Refusals> {
        let found = self.shared.wait_for(until_ns, slice, |core| {
            let instance = core.instance(instance)?;
            match &instance.report {
                Some(report) if instance.state == State::Ended => Ok(Some(report.clone())),
                _ if instance.state == State::Created && instance.ending.is_none() => {
                    Err(invalid_state(&format!("'{}'", instance.name), "created, not started", "wait for", "start it first"))
                }
                _ => Ok(None),
            }
        })?;
        Ok(found)
    }

    /// The report of the latest start, if it has ended.
    pub fn report(&self, instance: u64) -> Result<Option<Report>, Refusals> {
        Ok(self.shared.locked().instance(instance)?.report.clone())
    }

    pub fn state(&self, instance: u64) -> &'static str {
        self.shared.locked().instances.get(&instance).map_or("deleted", |i| i.state.name())
    }

    /// ns on the system's clock.
    pub fn now_ns(&self) -> i64 {
        self.shared.host.now_ns()
    }

    /// Virtual clock: runs the firings in (now, now + duration].
    pub fn advance(&self, duration_ns: i64) -> Result<(), Refusals> {
        self.require_virtual("advance")?;
        let limit_ns = self.now_ns().saturating_add(duration_ns.max(0));
        while self.shared.happen(limit_ns)? {}
        self.shared.host.set_now(limit_ns);
        self.shared.locked().serve_deadlines(limit_ns);
        self.shared.settle();
        Ok(())
    }

    /// Virtual clock: everything that happens at the next instant; false if nothing ever will.
    pub fn step(&self) -> Result<bool, Refusals> {
        self.require_virtual("step")?;
        self.shared.step(i64::MAX)
    }

    fn require_virtual(&self, call: &str) -> Result<(), Refusals> {
        if self.shared.is_virtual {
            return Ok(());
        }
        Err(refuse(Class::InvalidState, format!("cannot {call} system '{}': its clock is monotonic", self.name), "make it with clock=\"virtual\""))
    }

    /// Readable whenever some instance has ended.
    pub fn ended_fd(&self) -> RawFd {
        self.shared.ended_fd.as_raw_fd()
    }

    /// Waits until a condition on an instance holds, a second of the system's clock at the most (kernels answer at once).
    pub(crate) fn until_settled(&self, instance: u64, holds: impl Fn(&Instance) -> bool) -> Result<(), Refusals> {
        let waited = self.shared.wait_for(None, SETTLE_MAX, |core| Ok(core.instances.get(&instance).is_none_or(&holds).then_some(())))?;
        match waited {
            Waited::Done(()) => Ok(()),
            _ => Err(refuse(Class::InvalidState, "a kernel did not answer", "is its processor overloaded? see statistics()")),
        }
    }

    /// Halts the actions, disables the devices, stops the kernels. Twice is once.
    pub fn close(&self) {
        if self.shared.closed.swap(true, Ordering::AcqRel) {
            return;
        }
        // Where the supervisor panicked there is nobody left to end anything: the kernels are stopped, devices are safe.
        let is_orderly = !self.shared.core.is_poisoned();
        let begun = Instant::now();
        let late_ns = self.now_ns().saturating_add(WIND_DOWN_NS);
        while is_orderly && begun.elapsed() < CLOSE_MAX {
            let waited = self.shared.wait_for(None, Duration::from_millis(50), |core| {
                let is_late = core.host.now_ns() >= late_ns;
                Ok(core.wind_down(is_late).then_some(()))
            });
            if matches!(waited, Ok(Waited::Done(())) | Err(_)) {
                break;
            }
        }
        self.end_companions();
        self.shared.closing.store(true, Ordering::Release);
        self.shared.host.unpark();
        if let Some(thread) = self.supervisor.lock().expect("nobody panics with this lock").take() {
            // A supervisor that panicked has said so; closing goes on.
            let _ended = thread.join();
        }
        self.shared.host.close();
        self.close_elsewhere();
        if let Some(places) = self.shared.places.get() {
            places.close();
        }
    }
}

impl Drop for System {
    fn drop(&mut self) {
        if self.owns {
            self.close();
        }
    }
}

/// How long a wait looks for an answer by itself before it sleeps: some wake-ups of a thread.
const AWAKE_MAX: Duration = Duration::from_micros(60);
/// Pauses of the processor between two looks.
const PAUSES: u32 = 40;
/// Kernels answer a script within a firing; longer than this means that a processor does not run.
const SETTLE_MAX: Duration = Duration::from_secs(5);
/// How long the command lists that a halt at closing leads to may take, ns of the system's clock.
const WIND_DOWN_NS: i64 = 2_000_000_000;
/// How long an orderly close may take before the kernels are stopped all the same.
const CLOSE_MAX: Duration = Duration::from_secs(5);

impl Shared {
    pub fn definitions(&self) -> MutexGuard<'_, Definitions> {
        self.definitions.lock().expect("nobody panics while definitions change")
    }

    pub fn locked(&self) -> MutexGuard<'_, Core> {
        self.core.lock().expect("nobody panics while the supervisor works")
    }

    /// Gives a command to the supervisor, and takes what the kernels answered at once.
    pub fn command<T>(&self, command: impl FnOnce(&mut Core) -> Result<T, Refusals>) -> Result<T, Refusals> {
        let mut core = self.locked();
        if self.closed.load(Ordering::Acquire) {
            return Err(refuse(Class::InvalidState, "the system is closed", "make a new one"));
        }
        let wake = core.next_wake(0);
        core.drain();
        let result = command(&mut core);
        core.drain();
        self.announce(&mut core);
        // The supervisor's thread sleeps until the time that it knew of: it is woken only where that has changed.
        let changed = core.next_wake(0) != wake;
        drop(core);
        if changed && !self.is_virtual {
            self.host.unpark();
        }
        result
    }

    /// The supervisor's thread goes to its post, where that has changed.
    fn take_post(&self) {
        let mut post = self.post.lock().expect("nobody panics with the lock held");
        if let (false, Some((priority, core))) = (post.taken, post.wanted) {
            post.missing = kernel::take_for_supervisor(priority, core);
            post.taken = true;
        }
    }

    /// Takes what the kernels have told.
    pub fn settle(&self) {
        let mut core = self.locked();
        core.drain();
        self.announce(&mut core);
    }

    /// Wakes those who wait.
    fn announce(&self, core: &mut Core) {
        if core.ended > 0 {
            let count: u64 = std::mem::take(&mut core.ended);
            // SAFETY: the descriptor is open as long as `self` lives, and 8 bytes are what an eventfd takes.
            unsafe { libc::write(self.ended_fd.as_raw_fd(), (&raw const count).cast(), 8) };
        }
        // Counted under the lock of the core, which the caller holds.
        if self.waiting.load(Ordering::Relaxed) > 0 {
            self.changed.notify_all();
        }
    }

    /// Waits until `found` gives something. Virtual clock: time advances, as far as it must.
    pub fn wait_for<T>(
        &self,
        until_ns: Option<i64>,
        slice: Duration,
        mut found: impl FnMut(&mut Core) -> Result<Option<T>, Refusals>,
    ) -> Result<Waited<T>, Refusals> {
        let begun = Instant::now();
        let mut core = self.locked();
        loop {
            core.drain();
            let result = found(&mut core)?;
            core.drain();
            self.announce(&mut core);
            if let Some(result) = result {
                return Ok(Waited::Done(result));
            }
            if until_ns.is_some_and(|until| self.host.now_ns() >= until) {
                return Ok(Waited::TimedOut);
            }
            let left = slice.saturating_sub(begun.elapsed());
            if left.is_zero() {
                return Ok(Waited::Slice);
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
                                "nothing is ever going to happen: the wait would have no end",
                                "is a timer running, is a block active?",
                            ));
                        }
                    }
                }
                core = self.locked();
            } else if begun.elapsed() < AWAKE_MAX {
                // A kernel answers within microseconds: sooner than two threads wake up one after the other.
                drop(core);
                (0..PAUSES).for_each(|_| std::hint::spin_loop());
                core = self.locked();
            } else {
                self.waiting.fetch_add(1, Ordering::Relaxed);
                let by_clock = until_ns.map_or(left, |until| Duration::from_nanos(u64::try_from(until - self.host.now_ns()).unwrap_or(0)));
                core = self.changed.wait_timeout(core, left.min(by_clock)).expect("nobody panics while the supervisor works").0;
                self.waiting.fetch_sub(1, Ordering::Relaxed);
                core.look_for_lost();
            }
        }
    }

    /// Virtual clock: time stands still while a tap that holds it has not been read.
    fn wait_for_taps(&self) {
        // The lock is held while it is looked, not while it is waited.
        let full = || {
            let core = self.locked();
            core.taps.full(core.log.next(), core.ends.next())
        };
        while let Some(inbox) = full() {
            inbox.press();
        }
    }

    /// Virtual clock: everything that happens at the next instant, not after `limit_ns`, so that whoever acts then acts between two
    /// instants. False if nothing does.
    pub fn step(&self, limit_ns: i64) -> Result<bool, Refusals> {
        if !self.happen(limit_ns)? {
            return Ok(false);
        }
        // Of firings with a cost all that happens until they are over.
        let end_ns = self.host.now_ns().max(self.host.busy_until_ns());
        while self.happen(end_ns)? {}
        self.host.set_now(end_ns);
        Ok(true)
    }

    /// Virtual clock: the next firing or deadline, not after `limit_ns`. False if there is none.
    fn happen(&self, limit_ns: i64) -> Result<bool, Refusals> {
        self.wait_for_taps();
        let deadline = {
            let mut core = self.locked();
            core.drain();
            [core.next_deadline(), core.next_answer()].into_iter().flatten().min()
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
            // What is not over at a deadline is not to be seen then.
            self.host
                .fire_next(limit_ns.min(deadline.unwrap_or(i64::MAX)))
                .map_err(|why| refuse(Class::SchedulingError, why, "let one of them wait for a timer"))?
        };
        let mut core = self.locked();
        core.drain();
        let now_ns = self.host.now_ns();
        if core.next_deadline().is_some_and(|d| d <= now_ns) {
            core.serve_deadlines(now_ns);
            core.drain();
        }
        core.look_for_lost();
        core.watch_inputs();
        self.announce(&mut core);
        Ok(stepped)
    }
}

/// The supervisor's thread: serves what the kernels tell and what time brings.
fn supervise(shared: &Arc<Shared>) -> Result<std::thread::JoinHandle<()>, Refusals> {
    let shared = shared.clone();
    let body = move || {
        loop {
            // Before everything that is looked at, so that what changes meanwhile wakes it; commands of other threads poll too.
            let seen = shared.host.rings();
            if shared.closing.load(Ordering::Acquire) {
                return;
            }
            shared.take_post();
            let deadline = {
                let mut core = shared.locked();
                core.drain();
                let now_ns = shared.host.now_ns();
                core.serve_deadlines(now_ns);
                core.look_for_lost();
                core.watch_inputs();
                core.drain();
                shared.announce(&mut core);
                [core.next_wake(now_ns), core.next_answer()].into_iter().flatten().min()
            };
            shared.host.park_since(seen, deadline);
        }
    };
    std::thread::Builder::new()
        .name("supervisor".to_owned())
        .spawn(body)
        .map_err(|why| refuse(Class::InvalidState, format!("cannot start the supervisor: {why}"), "close other programs and try again"))
}
