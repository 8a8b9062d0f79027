// SPDX-License-Identifier: Apache-2.0
//! Kernels of one process: a thread for each interrupt source, or a single one for all under the virtual clock.
mod looking;
mod play;
mod remote;
mod submitting;

pub use play::{Change, PlayedSegment};

use crate::clock::{BUDGET_VIRTUAL_NS, ClockKind};
use crate::remote_sources::RemoteSources;
use crate::thread;
use crate::trace::tape::SourceTape;
use crate::trace::{CodeNames, Trace};
use crate::virtual_clock::Virtual;
use crate::watchdog::Watchdog;
use interconnect::Carrier;
use kernel::clock::monotonic_ns;
use kernel::containment::BLACK_BOX_LEN;
use kernel::event::telling;
use kernel::script::Submission;
use kernel::shared::HostState;
use kernel::shared::Source;
use kernel::state::Kernel;
use kernel::tape::Tape;
use kernel::{BlockTimes, Event, Inbound, Op, Outbound, Script, SourceId, SourceKind, SourceSpec, Statistics, containment};
use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU32, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock, RwLockReadGuard};
use std::thread::JoinHandle;
use std::time::Duration;

/// Host of all kernels of this process.
pub struct Host {
    pub(crate) carrier: Mutex<Box<dyn Carrier>>,
    sources: RwLock<Vec<Arc<Source>>>,
    pub(crate) shared: Arc<HostState>,
    remote_sources: RemoteSources,
    /// Record of the host, if it is being recorded.
    trace: OnceLock<Arc<Trace>>,
    /// True if the host replays a record.
    plays: AtomicBool,
    /// Tapes of sources that are being recorded or played back.
    tapes: Mutex<HashMap<SourceId, Arc<SourceTape>>>,
    /// Memory in which newly added sources record the running step.
    black_box: Mutex<Option<BlackBox>>,
    /// Time at which the host was created, on the monotonic clock; zero under the virtual clock.
    pub(crate) epoch_ns: i64,
    /// Virtual clock: current time.
    now_ns: AtomicI64,
    /// Virtual clock: the executor, used by one thread at a time.
    executor: Option<Mutex<Virtual>>,
    watchdog: Arc<Watchdog>,
    threads: Mutex<Vec<RunningThread>>,
    /// Number of rings of the supervisor's bell when `poll` last found nothing.
    polled: AtomicU32,
    closed: AtomicBool,
}

// SAFETY: the executor, the only part that is not `Sync` by itself, holds kernels, which belong to the holder of its lock.
unsafe impl Sync for Host {}
// SAFETY: as for `Sync`.
unsafe impl Send for Host {}

/// A thread of the host, and the source that it serves, if any.
type RunningThread = (Option<Arc<Source>>, JoinHandle<()>);

/// Memory for containments that is read by other processes.
struct BlackBox {
    memory: *mut u8,
    /// Number of remaining slots.
    left: usize,
}

// SAFETY: an address; the caller promised that nothing else writes there.
unsafe impl Send for BlackBox {}

impl BlackBox {
    fn containment(&self, budget_ns: i64) -> containment::Containment {
        // SAFETY: the promise of `set_black_box`, and each place is given once.
        unsafe { containment::Containment::at(self.memory, budget_ns) }
    }
}

/// Minimum of the default time budget of a firing.
const BUDGET_MIN_NS: i64 = 100_000_000;

impl Host {
    /// Creates a host without sources, whose connections use `carrier`. Installs the fault handlers (once per process; faults outside
    /// block code are forwarded to earlier handlers).
    pub fn new(clock: ClockKind, carrier: Box<dyn Carrier>) -> Host {
        Host::since(clock, carrier, monotonic_ns())
    }

    /// Creates a host with the given epoch, ns of CLOCK_MONOTONIC: that of the host to which some of its sources belong. The epoch has no
    /// effect under the virtual clock.
    pub fn since(clock: ClockKind, carrier: Box<dyn Carrier>, epoch_ns: i64) -> Host {
        containment::install();
        let (epoch_ns, executor) = match clock {
            ClockKind::Monotonic => (epoch_ns, None),
            ClockKind::Virtual { seed } => (0, Some(Mutex::new(Virtual::new(seed)))),
        };
        let shared: Arc<HostState> = Arc::default();
        let host = Host {
            carrier: Mutex::new(carrier),
            sources: RwLock::default(),
            shared: shared.clone(),
            remote_sources: RemoteSources::default(),
            trace: OnceLock::new(),
            plays: AtomicBool::new(false),
            tapes: Mutex::default(),
            black_box: Mutex::default(),
            epoch_ns,
            now_ns: AtomicI64::new(0),
            executor,
            watchdog: Arc::new(Watchdog::new(shared)),
            threads: Mutex::default(),
            polled: AtomicU32::new(0),
            closed: AtomicBool::new(false),
        };
        let watchdog = host.watchdog.clone();
        let thread = std::thread::Builder::new().name("watchdog".into()).spawn(move || watchdog.run());
        // Without this thread, only endless loops are not contained.
        host.threads().extend(thread.map(|thread| (None, thread)));
        host
    }

    /// Starts a record for later replay. `names`: names of the blocks' code in the replaying process. Returns `None` if the host already
    /// has sources or is already being recorded.
    pub fn record(&self, names: CodeNames) -> Option<Arc<Trace>> {
        let sources = self.sources();
        let trace = Arc::new(Trace::new(names));
        (sources.is_empty() && self.trace.set(trace.clone()).is_ok()).then_some(trace)
    }

    /// Creates a host under the virtual clock whose sources replay records of other hosts: see [`Host::play`].
    pub fn playing() -> Host {
        let host = Host::new(ClockKind::Virtual { seed: 0 }, Box::new(interconnect::Memory));
        host.plays.store(true, Ordering::Release);
        host
    }

    /// Returns the record of the host, if it is being recorded.
    pub fn trace(&self) -> Option<&Arc<Trace>> {
        self.trace.get()
    }

    /// Creates a source with an empty table; under the monotonic clock, starts its thread. Fails if the thread cannot be created.
    pub fn add_source(&self, spec: SourceSpec) -> std::io::Result<SourceId> {
        let mut sources = self.sources.write().expect("nobody panics with the lock held");
        let id = SourceId(sources.len() as u32);
        let budget_ns = match (&self.executor, &spec.kind) {
            (Some(_), _) => BUDGET_VIRTUAL_NS,
            (None, SourceKind::Timer { period_ns }) => BUDGET_MIN_NS.max(10 * *period_ns as i64),
            (None, SourceKind::Software) => BUDGET_MIN_NS,
        };
        let (teller, listener) = telling(id);
        let containment = self.black_box().map_or_else(|| containment::Containment::new(budget_ns), |place| place.containment(budget_ns));
        // Simulated time stands still while the thread has no core.
        let containment = if self.executor.is_some() { containment.without_waits() } else { containment };
        let tape = match self.trace.get() {
            Some(trace) => Some(trace.tape(id, &spec)),
            None => self.plays.load(Ordering::Acquire).then(SourceTape::playing),
        };
        let source = Arc::new(Source::new(id, spec, listener, containment, tape.clone().map(|tape| tape as Arc<dyn Tape>)));
        let kernel = Kernel::new(source.clone(), self.shared.clone(), teller, 0, budget_ns);
        match &self.executor {
            Some(executor) => executor.lock().expect("nobody panics with the lock held").add(kernel, self.now_ns()),
            None => {
                let epoch_ns = self.epoch_ns;
                let (ready, is_ready) = channel();
                let name = source.spec.name.chars().take(15).collect();
                let thread = std::thread::Builder::new().name(name).spawn(move || thread::run(kernel, epoch_ns, &ready))?;
                self.threads().push((Some(source.clone()), thread));
                // The source's rights are known when this returns; a thread that ended immediately has dropped its end.
                let _ready = is_ready.recv();
            }
        }
        self.tapes.lock().expect("nobody panics with the lock held").extend(tape.map(|tape| (id, tape)));
        self.watchdog.watch(source.clone());
        sources.push(source);
        Ok(id)
    }

    /// Sets the time for which timers of this host may be suspended before the outputs that they command are made safe and their devices
    /// count as lost; 2 s by default. If set several times, the longest one applies.
    pub fn allow_standstill(&self, bound: Duration) {
        self.shared.allow_standstill(i64::try_from(bound.as_nanos()).unwrap_or(i64::MAX));
    }

    /// Makes new sources record the running step in `memory`, in slots of [`BLACK_BOX_LEN`] bytes in order of creation, which can be read
    /// after this process has exited. Sources for which no slot is left use memory of their own.
    ///
    /// # Safety
    /// The memory must be zeroed, start on a cache line and exist as long as the process, and no other code may write to it.
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

    /// Reserves the number of a remote source.
    pub(crate) fn reserve(&self, spec: SourceSpec) -> SourceId {
        let mut sources = self.sources.write().expect("nobody panics with the lock held");
        let id = SourceId(sources.len() as u32);
        let (_, listener) = telling(id);
        if let Some(trace) = self.trace.get() {
            trace.broken(&format!("source '{}' runs in another process or on another host", spec.name));
        }
        sources.push(Arc::new(Source::new(id, spec, listener, containment::Containment::new(0), None)));
        id
    }

    /// Runs a function on the kernel of a source, between two firings, under the virtual clock.
    pub(crate) fn with_kernel<T>(&self, source: SourceId, then: impl FnOnce(&mut Kernel) -> T) -> T {
        self.executor().with_kernel(source.0 as usize, then)
    }

    /// Returns true, under the virtual clock, if the next request at this instant would be refused; always false under the monotonic
    /// clock.
    pub fn is_full(&self) -> bool {
        self.executor.as_ref().is_some_and(|executor| executor.lock().expect("nobody panics with the lock held").is_full())
    }

    /// Requests a firing of a software source.
    pub fn request(&self, source: SourceId) {
        if let Some(remote) = self.remote(source) {
            return remote.request(source);
        }
        let source = self.source(source);
        source.request(self.now_ns());
        source.bell().wake();
    }

    /// Returns true if the clock is virtual, i.e. advanced by `fire_next` and `set_now`.
    pub fn is_virtual(&self) -> bool {
        self.executor.is_some()
    }

    /// Returns the time on the clock since the host's epoch, ns; the first release of a timer of period T is at T.
    pub fn now_ns(&self) -> i64 {
        match self.executor {
            Some(_) => self.now_ns.load(Ordering::Relaxed),
            None => monotonic_ns() - self.epoch_ns,
        }
    }

    /// Restarts a source that a fault stopped, after its devices have been made safe and its blocks have been removed.
    pub fn restart(&self, source: SourceId) {
        if let Some(remote) = self.remote(source) {
            return remote.restart(source);
        }
        let source = self.source(source);
        source.restarting.store(true, Ordering::Release);
        match &self.executor {
            Some(executor) => executor.lock().expect("nobody panics with the lock held").carry_out(source.id.0 as usize, self.now_ns()),
            None => source.bell().ring(),
        }
    }

    /// Stops all sources, brings devices to their safe state, and joins the threads.
    pub fn close(&self) {
        self.end(false);
    }

    /// Stops all sources and joins the threads; leaves the devices as they are, for an heir. A device that has no other owner is made
    /// safe and closed.
    pub fn leave(&self) {
        self.end(true);
    }

    fn end(&self, leaves: bool) {
        if self.closed.swap(true, Ordering::AcqRel) {
            return;
        }
        self.remote_sources.close();
        for source in self.sources().iter() {
            source.leaving.store(leaves, Ordering::Release);
            source.closing.store(true, Ordering::Release);
            source.bell().ring();
        }
        if let Some(executor) = &self.executor {
            // Also after a panic in a firing: a destructor may call this during unwinding, where a second panic would abort the process.
            executor.lock().unwrap_or_else(PoisonError::into_inner).close();
        }
        let (of_sources, others): (Vec<_>, Vec<_>) = std::mem::take(&mut *self.threads()).into_iter().partition(|(source, _)| source.is_some());
        of_sources.into_iter().for_each(|(source, thread)| join(source.as_deref(), thread));
        // The watchdog runs until here, so that a block that does not return cannot keep its thread.
        self.watchdog.close();
        others.into_iter().for_each(|(source, thread)| join(source.as_deref(), thread));
    }

    /// Drops the carriers of these connections, because references to the connections may outlive the host. Does nothing unless the host
    /// is closed.
    pub fn sever<'a>(&self, inbounds: impl IntoIterator<Item = &'a Inbound>, outbounds: impl IntoIterator<Item = &'a Outbound>) {
        if !self.closed.load(Ordering::Acquire) || !self.threads().is_empty() {
            return;
        }
        // SAFETY: the kernels of a closed host have ended: its threads are joined, and its executor has let go of them.
        inbounds.into_iter().for_each(|inbound| unsafe { inbound.sever() });
        // SAFETY: as above.
        outbounds.into_iter().for_each(|outbound| unsafe { outbound.sever() });
    }

    /// Delivers everything in transit, and raises the sources that wait for it.
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

    /// Returns the tape of a source that is being recorded or played back.
    pub(crate) fn tape(&self, source: SourceId) -> Option<Arc<SourceTape>> {
        self.tapes.lock().expect("nobody panics with the lock held").get(&source).cloned()
    }

    /// Keeps a thread so that it is joined when the host is closed.
    pub(crate) fn keep_thread(&self, thread: JoinHandle<()>) {
        self.threads().push((None, thread));
    }

    pub(crate) fn sources(&self) -> RwLockReadGuard<'_, Vec<Arc<Source>>> {
        self.sources.read().expect("nobody panics with the lock held")
    }

    pub(crate) fn source(&self, source: SourceId) -> Arc<Source> {
        self.sources()[source.0 as usize].clone()
    }

    fn threads(&self) -> MutexGuard<'_, Vec<RunningThread>> {
        self.threads.lock().expect("nobody panics with the lock held")
    }
}

/// Waits for a thread to exit, unless it never will. A thread that panicked has already reported the panic; the other threads are still
/// joined.
fn join(source: Option<&Source>, thread: JoinHandle<()>) {
    let Some(source) = source else { return drop(thread.join()) };
    while !thread.is_finished() {
        if source.is_beyond_reach() {
            return;
        }
        std::thread::sleep(JOIN_LOOKS);
    }
    drop(thread.join());
}

/// Poll period while a thread is being joined.
const JOIN_LOOKS: std::time::Duration = std::time::Duration::from_micros(200);

impl Drop for Host {
    fn drop(&mut self) {
        self.close();
    }
}
