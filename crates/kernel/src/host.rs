// SPDX-License-Identifier: Apache-2.0
//! The kernels of one process: a thread for each interrupt source, or all of them under the virtual clock.
use crate::abroad::Abroad;
use crate::clock::monotonic_ns;
use crate::event::telling;
use crate::firing::{Kernel, Shared};
use crate::guard::BLACK_BOX_LEN;
use crate::script::Submission;
use crate::source::Source;
use crate::tape::Tape;
use crate::trace::{CodeNames, Trace};
use crate::virtual_clock::Virtual;
use crate::watchdog::Watchdog;
use crate::*;
use interconnect::Carrier;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU32, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, RwLock, RwLockReadGuard};
use std::thread::JoinHandle;

/// All kernels of this process.
pub struct Host {
    pub(crate) carrier: Mutex<Box<dyn Carrier>>,
    sources: RwLock<Vec<Arc<Source>>>,
    pub(crate) shared: Arc<Shared>,
    /// What lies elsewhere.
    pub(crate) abroad: Abroad,
    /// The record that is made of it.
    trace: OnceLock<Arc<Trace>>,
    /// It does again what is recorded.
    plays: AtomicBool,
    /// Where the next sources say which block runs.
    black_box: Mutex<Option<BlackBox>>,
    /// Monotonic: when the host was made. Zero under the virtual clock.
    pub(crate) epoch_ns: i64,
    /// Virtual: now.
    now_ns: AtomicI64,
    /// Virtual: the executor, used by one thread at a time.
    executor: Option<Mutex<Virtual>>,
    watchdog: Arc<Watchdog>,
    threads: Mutex<Vec<JoinHandle<()>>>,
    /// Rings of the supervisor's bell when `poll` found nothing last.
    polled: AtomicU32,
    closed: AtomicBool,
}

// SAFETY: the executor, the only part that is not `Sync` by itself, holds kernels, which belong to whoever holds its lock.
unsafe impl Sync for Host {}
// SAFETY: as for `Sync`.
unsafe impl Send for Host {}

/// Memory for guards that others read.
struct BlackBox {
    memory: *mut u8,
    /// Places from there on.
    left: usize,
}

// SAFETY: an address; whoever gave it promised that nobody else writes there.
unsafe impl Send for BlackBox {}

impl BlackBox {
    fn guard(&self, budget_ns: i64) -> guard::Guard {
        // SAFETY: the promise of `set_black_box`, and each place is given once.
        unsafe { guard::Guard::at(self.memory, budget_ns) }
    }
}

/// The least default time budget of a firing, and the one under the virtual clock.
const BUDGET_MIN_NS: i64 = 100_000_000;
pub(crate) const BUDGET_VIRTUAL_NS: i64 = 1_000_000_000;

impl Host {
    /// No sources yet. `carrier`: what carries connections. Installs the fault handlers (once a process; earlier handlers are called for what is not ours).
    pub fn new(clock: ClockKind, carrier: Box<dyn Carrier>) -> Host {
        Host::since(clock, carrier, monotonic_ns())
    }

    /// The same with an epoch of its own, ns of CLOCK_MONOTONIC: that of the host whose sources some of these are. Nothing under the virtual clock.
    pub fn since(clock: ClockKind, carrier: Box<dyn Carrier>, epoch_ns: i64) -> Host {
        guard::install();
        let (epoch_ns, executor) = match clock {
            ClockKind::Monotonic => (epoch_ns, None),
            ClockKind::Virtual { seed } => (0, Some(Mutex::new(Virtual::new(seed)))),
        };
        let host = Host {
            carrier: Mutex::new(carrier),
            sources: RwLock::default(),
            shared: Arc::default(),
            abroad: Abroad::default(),
            trace: OnceLock::new(),
            plays: AtomicBool::new(false),
            black_box: Mutex::default(),
            epoch_ns,
            now_ns: AtomicI64::new(0),
            executor,
            watchdog: Arc::default(),
            threads: Mutex::default(),
            polled: AtomicU32::new(0),
            closed: AtomicBool::new(false),
        };
        let watchdog = host.watchdog.clone();
        let thread = std::thread::Builder::new().name("watchdog".into()).spawn(move || watchdog.run());
        // Without it only endless loops are not contained.
        host.threads().extend(thread);
        host
    }

    /// Makes a record from now on, so that the run can be run again. `names`: how code is called there. None where there are sources already,
    /// or a record.
    pub fn record(&self, names: CodeNames) -> Option<Arc<Trace>> {
        let sources = self.sources();
        let trace = Arc::new(Trace::new(names));
        (sources.is_empty() && self.trace.set(trace.clone()).is_ok()).then_some(trace)
    }

    /// A host under the virtual clock whose sources do what is recorded of others: [`Host::play`].
    pub fn playing() -> Host {
        let host = Host::new(ClockKind::Virtual { seed: 0 }, Box::new(interconnect::Memory));
        host.plays.store(true, Ordering::Release);
        host
    }

    /// The record that is made of it.
    pub fn trace(&self) -> Option<&Arc<Trace>> {
        self.trace.get()
    }

    /// Makes a source with an empty table; a monotonic one starts its thread. Fails if the thread cannot be made.
    pub fn add_source(&self, spec: SourceSpec) -> std::io::Result<SourceId> {
        let mut sources = self.sources.write().expect("nobody panics with the lock held");
        let id = SourceId(sources.len() as u32);
        let budget_ns = match (&self.executor, &spec.kind) {
            (Some(_), _) => BUDGET_VIRTUAL_NS,
            (None, SourceKind::Timer { period_ns }) => BUDGET_MIN_NS.max(10 * *period_ns as i64),
            (None, SourceKind::Software) => BUDGET_MIN_NS,
        };
        let (teller, listener) = telling(id);
        let guard = self.black_box().map_or_else(|| guard::Guard::new(budget_ns), |place| place.guard(budget_ns));
        let tape = match self.trace.get() {
            Some(trace) => Some(trace.tape(id, &spec)),
            None => self.plays.load(Ordering::Acquire).then(Tape::playing),
        };
        let source = Arc::new(Source::new(id, spec, listener, guard, tape));
        let kernel = Kernel::new(source.clone(), self.shared.clone(), teller, 0, budget_ns);
        match &self.executor {
            Some(executor) => executor.lock().expect("nobody panics with the lock held").add(kernel, self.now_ns()),
            None => {
                let epoch_ns = self.epoch_ns;
                let (ready, is_ready) = channel();
                let name = source.spec.name.chars().take(15).collect();
                let thread = std::thread::Builder::new().name(name).spawn(move || thread::run(kernel, epoch_ns, &ready))?;
                self.threads().push(thread);
                // Its rights are known when this returns; a thread that ended at once has dropped its end.
                let _ready = is_ready.recv();
            }
        }
        self.watchdog.watch(source.clone());
        sources.push(source);
        Ok(id)
    }

    /// From now on sources say in `memory` which step runs, one behind the other in the order in which they are made, each in
    /// [`BLACK_BOX_LEN`] bytes: so that it can be read when this process is gone. Sources that find no room say it to nobody.
    ///
    /// # Safety
    /// The memory is zero, starts on a cache line, stays as long as the process, and nobody else writes there.
    pub unsafe fn set_black_box(&self, memory: *mut u8, len: usize) {
        *self.black_box.lock().expect("nobody panics with the lock held") = Some(BlackBox { memory, left: len / BLACK_BOX_LEN });
    }

    fn black_box(&self) -> Option<BlackBox> {
        let mut present = self.black_box.lock().expect("nobody panics with the lock held");
        let place = present.as_mut().filter(|place| place.left > 0)?;
        let next = BlackBox { memory: place.memory, left: 1 };
        // SAFETY: within the memory, or at its end where nothing is left.
        (place.memory, place.left) = (unsafe { place.memory.add(BLACK_BOX_LEN) }, place.left - 1);
        Some(next)
    }

    /// Keeps the place of a source that lies elsewhere.
    pub(crate) fn reserve(&self, spec: SourceSpec) -> SourceId {
        let mut sources = self.sources.write().expect("nobody panics with the lock held");
        let id = SourceId(sources.len() as u32);
        let (_, listener) = telling(id);
        if let Some(trace) = self.trace.get() {
            trace.broken(&format!("source '{}' runs in another process or on another host", spec.name));
        }
        sources.push(Arc::new(Source::new(id, spec, listener, guard::Guard::new(0), None)));
        id
    }

    /// Hands a script to a source; carried out between two firings, in the order of submission, at once if the source is idle
    /// (it is woken). Acknowledged by `Event::Done`. Any thread. Under the virtual clock it is carried out before this returns, but where a
    /// firing with a cost is not over there: then at its end.
    pub fn submit(&self, source: SourceId, mut script: Box<Script>) {
        self.announce(source, &script);
        if let Some(far) = self.far(source) {
            return far.submit(source, script);
        }
        self.prepare(source, &mut script);
        let mut submission = Submission::new(script);
        submission.recorded = self.trace.get().map_or(0, |trace| trace.script(source, &submission.script));
        let to = self.source(source);
        to.mailbox.put(submission);
        match &self.executor {
            Some(executor) => executor.lock().expect("nobody panics with the lock held").carry_out(source.0 as usize, self.now_ns()),
            None => to.bell.ring(),
        }
    }

    /// Makes the place of a script's tables and processes in its source.
    pub(crate) fn prepare(&self, source: SourceId, script: &mut Script) {
        let sources = self.sources();
        for op in &mut script.ops {
            match op {
                Op::Table(table) => table.place(source, &sources),
                Op::StartClock(process)
                | Op::StopClock(process)
                | Op::ResumeClock(process)
                | Op::KeepClock(process, _)
                | Op::Stage { process, .. }
                | Op::Advance { process, .. } => {
                    process.prepare_time(source);
                }
                _ => {}
            }
        }
    }

    /// Virtual: the kernel of a source, between two firings.
    pub(crate) fn with_kernel<T>(&self, source: SourceId, then: impl FnOnce(&mut Kernel) -> T) -> T {
        self.executor().with_kernel(source.0 as usize, then)
    }

    /// Virtual: true where so much is requested at this instant that one request more is refused. Never under the monotonic clock.
    pub fn is_full(&self) -> bool {
        self.executor.as_ref().is_some_and(|executor| executor.lock().expect("nobody panics with the lock held").is_full())
    }

    /// Requests a firing of a software source.
    pub fn request(&self, source: SourceId) {
        if let Some(far) = self.far(source) {
            return far.request(source);
        }
        let source = self.source(source);
        source.request(self.now_ns());
        source.bell.wake();
    }

    /// True where time is a number that `fire_next` and `set_now` move.
    pub fn is_virtual(&self) -> bool {
        self.executor.is_some()
    }

    /// ns on the clock since the host's epoch; the first release of a timer of period T is at T.
    pub fn now_ns(&self) -> i64 {
        match self.executor {
            Some(_) => self.now_ns.load(Ordering::Relaxed),
            None => monotonic_ns() - self.epoch_ns,
        }
    }

    /// The next event, if there is one. For the supervisor alone. Events come in the order in which they were made, over all
    /// sources; a script's acknowledgement is one of them.
    pub fn poll(&self) -> Option<Event> {
        if let Some(event) = self.abroad.pop_first() {
            return Some(event);
        }
        let event = self.next_event()?;
        Some(if self.abroad.is_any() { self.serve(event) } else { event })
    }

    fn next_event(&self) -> Option<Event> {
        let rings = self.shared.supervisor.rings();
        let sources = self.sources();
        let next = sources.iter().filter_map(|source| Some((source.listener().next_serial(&source.done)?, source))).min_by_key(|(serial, _)| *serial);
        if let Some(told) = self.abroad.take_told(next.as_ref().map(|(serial, _)| *serial)) {
            return Some(told);
        }
        let Some((serial, source)) = next else {
            self.polled.store(rings, Ordering::Release);
            return None;
        };
        source.listener().take(source.id, serial)
    }

    /// Monotonic: waits until an event is there, `unpark` was called, or the time has come. Not on a real-time path of a source.
    /// Call it when `poll` has given nothing. Under the virtual clock it returns at once.
    pub fn park(&self, until_ns: Option<i64>) {
        if self.executor.is_none() {
            self.shared.supervisor.sleep(self.polled.load(Ordering::Acquire), until_ns.map(|until| (self.epoch_ns + until).max(0)));
        }
    }

    /// How often the supervisor was rung for so far: read before `poll` and whatever else is looked at, and given to
    /// [`Host::park_since`], so that nothing that comes meanwhile is slept through, whoever else polls.
    pub fn rings(&self) -> u32 {
        self.shared.supervisor.rings()
    }

    /// `park` for a supervisor that is not alone in polling: returns at once where it was rung for since `seen`.
    pub fn park_since(&self, seen: u32, until_ns: Option<i64>) {
        if self.executor.is_none() {
            self.shared.supervisor.sleep(seen, until_ns.map(|until| (self.epoch_ns + until).max(0)));
        }
    }

    /// Wakes `park`, now or the next time.
    pub fn unpark(&self) {
        self.shared.supervisor.ring();
    }

    /// Virtual: when the next thing happens (a release, a pending request, an arrival on the carrier).
    pub fn next_time(&self) -> Option<i64> {
        let firing = self.executor().next().map(|(time, _)| time);
        let arrival = self.carrier.lock().expect("nobody panics with the lock held").next_arrival();
        [firing, arrival].into_iter().flatten().min()
    }

    /// Virtual: sets the clock to the time of the next firing, if that is not after `limit_ns`, and runs that one firing (with
    /// whatever preempts it). Nobody sees anything of a firing that ends behind `limit_ns` before the clock comes to its end. False if there
    /// is none; the clock is then left as it is. Errs when more than 10,000 requested firings fall in one instant; the others are refused.
    pub fn fire_next(&self, limit_ns: i64) -> Result<bool, String> {
        guard::prepare_thread();
        let executor = self.executor();
        loop {
            let firing = executor.next();
            let arrival = self.carrier.lock().expect("nobody panics with the lock held").next_arrival();
            if let Some(arrival) = arrival.filter(|&arrival| arrival <= limit_ns && firing.is_none_or(|(time, _)| arrival <= time)) {
                self.deliver(arrival.max(self.now_ns()));
                continue;
            }
            let Some((time, index)) = firing.filter(|&(time, _)| time <= limit_ns) else { return Ok(false) };
            executor.fire(index, time, limit_ns, &self.now_ns)?;
            if let Some(trace) = self.trace.get() {
                trace.gather();
            }
            return Ok(true);
        }
    }

    /// Virtual: the end of everything that was computed.
    pub fn busy_until_ns(&self) -> i64 {
        self.executor().busy_until_ns()
    }

    /// Virtual: moves the clock forward where nothing happens.
    pub fn set_now(&self, now_ns: i64) {
        self.now_ns.fetch_max(now_ns, Ordering::Relaxed);
    }

    /// The period of a timer; none of other sources.
    pub fn period_ns(&self, source: SourceId) -> Option<i64> {
        self.source(source).period_ns()
    }

    /// Counters and histograms of a source.
    pub fn statistics(&self, source: SourceId) -> Statistics {
        if let Some(far) = self.far(source) {
            return far.statistics(source);
        }
        self.source(source).statistics()
    }

    /// From now on, and for `for_ns` at least, the probe visits the blocks of a source, one a firing. Several who look add nothing to
    /// one: the latest end holds.
    pub fn probe(&self, source: SourceId, for_ns: u64) {
        if let Some(far) = self.far(source) {
            far.probe(source, for_ns);
        }
        let until_ns = monotonic_ns().saturating_add(i64::try_from(for_ns).unwrap_or(i64::MAX));
        self.source(source).probe_until_ns.fetch_max(until_ns, Ordering::Relaxed);
    }

    /// Whether the probe was asked to visit the blocks of a source now.
    pub fn probes(&self, source: SourceId) -> bool {
        self.source(source).probe_until_ns.load(Ordering::Relaxed) > monotonic_ns()
    }

    /// How long the invocations of a block in `source` took, as far as they were visited.
    pub fn block_times(&self, source: SourceId, block: &crate::Block) -> crate::BlockTimes {
        match self.far(source) {
            Some(far) => far.block_times(block.id()),
            None => block.block_times(),
        }
    }

    /// Restarts a source that a fault stopped (after its devices are safe and its blocks gone).
    pub fn restart(&self, source: SourceId) {
        if let Some(far) = self.far(source) {
            return far.restart(source);
        }
        let source = self.source(source);
        source.restarting.store(true, Ordering::Release);
        match &self.executor {
            Some(executor) => executor.lock().expect("nobody panics with the lock held").carry_out(source.id.0 as usize, self.now_ns()),
            None => source.bell.ring(),
        }
    }

    /// Stops all sources, brings devices to their safe state, joins the threads.
    pub fn close(&self) {
        self.end(false);
    }

    /// Stops all sources and joins the threads; the devices stay as they are, for an heir. Where nobody holds one any more it is safe and closed.
    pub fn leave(&self) {
        self.end(true);
    }

    fn end(&self, leaves: bool) {
        if self.closed.swap(true, Ordering::AcqRel) {
            return;
        }
        self.abroad.close();
        for source in self.sources().iter() {
            source.leaving.store(leaves, Ordering::Release);
            source.closing.store(true, Ordering::Release);
            source.bell.ring();
        }
        if let Some(executor) = &self.executor {
            executor.lock().expect("nobody panics with the lock held").close();
        }
        self.watchdog.close();
        let threads = std::mem::take(&mut *self.threads());
        // A thread that panicked has said so; the others are joined all the same.
        threads.into_iter().for_each(|thread| drop(thread.join()));
    }

    /// Lets what is under way arrive, and raises who waits for it.
    fn deliver(&self, now_ns: i64) {
        self.now_ns.fetch_max(now_ns, Ordering::Relaxed);
        let sources = self.sources();
        self.carrier.lock().expect("nobody panics with the lock held").deliver(now_ns, &mut |reader| {
            if let Some(source) = sources.get(reader as usize).filter(|source| source.period_ns().is_none()) {
                source.request(now_ns);
            }
        });
    }

    fn executor(&self) -> MutexGuard<'_, Virtual> {
        let executor = self.executor.as_ref().expect("only a host with the virtual clock is driven firing by firing");
        executor.lock().expect("nobody panics with the lock held")
    }

    /// Joined when the host is closed.
    pub(crate) fn keep_thread(&self, thread: JoinHandle<()>) {
        self.threads().push(thread);
    }

    pub(crate) fn sources(&self) -> RwLockReadGuard<'_, Vec<Arc<Source>>> {
        self.sources.read().expect("nobody panics with the lock held")
    }

    pub(crate) fn source(&self, source: SourceId) -> Arc<Source> {
        self.sources()[source.0 as usize].clone()
    }

    fn threads(&self) -> MutexGuard<'_, Vec<JoinHandle<()>>> {
        self.threads.lock().expect("nobody panics with the lock held")
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.close();
    }
}
