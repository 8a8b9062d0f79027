// SPDX-License-Identifier: Apache-2.0
//! The thread that listens for this process: it raises the readers whose rows have come.
use crate::bell::{BellNumber, Bells};
use crate::layout::Layout;
use interconnect::QueueMemory;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Its priority where the rights are given: above every source, as it works for them all; a raise is short.
const PRIORITY: i32 = 99;
/// A count that is further off than this, and than the queue is deep, was written over by something else: it is not followed.
const ROWS_MAX: usize = 1 << 10;
/// Rings one after the other that nothing had come for, before this thread rests a while: a sender that rings without a row does not get a
/// processor for it.
const VAIN_MAX: u32 = 16;
const REST: Duration = Duration::from_millis(1);

type Raise = Arc<dyn Fn() + Send + Sync>;

/// Listens until it is dropped.
pub(crate) struct Listener {
    shared: Arc<ListenerState>,
    thread: Option<JoinHandle<()>>,
}

struct ListenerState {
    bells: Arc<Bells>,
    number: BellNumber,
    watched: Mutex<Vec<WatchedQueue>>,
    next: AtomicU64,
    ends: AtomicBool,
}

/// A queue whose reader is raised.
struct WatchedQueue {
    key: u64,
    layout: Layout,
    /// Rows of which it was raised so far (wraps, as their count does).
    raised: usize,
    raise: Raise,
}

impl Listener {
    /// Claims a bell and starts the thread.
    pub fn start(bells: Arc<Bells>) -> io::Result<Self> {
        let Some(number) = bells.claim()? else { return Err(io::Error::other("too many processes read in this run")) };
        let shared = Arc::new(ListenerState { bells, number, watched: Mutex::default(), next: AtomicU64::new(0), ends: AtomicBool::new(false) });
        let listening = shared.clone();
        let thread = thread::Builder::new().name("shared-memory".to_owned()).spawn(move || listening.listen())?;
        Ok(Listener { shared, thread: Some(thread) })
    }

    /// Raises by `raise` for each row that waits in `layout`, and for each that comes, until [`forget`](Self::forget) with the number returned.
    pub fn watch(&self, layout: Layout, raise: Box<dyn Fn() + Send + Sync>) -> u64 {
        let key = self.shared.next.fetch_add(1, Ordering::Relaxed);
        let raised = layout.popped().load(Ordering::Acquire);
        layout.bell().store(self.shared.number.0, Ordering::SeqCst);
        self.shared.watched().push(WatchedQueue { key, layout, raised, raise: raise.into() });
        // What came before the bell was known rang none.
        self.shared.bells.ring(self.shared.number);
        key
    }

    /// No raise begins after this for what was watched under `key`.
    pub fn forget(&self, key: u64) {
        let mut watched = self.shared.watched();
        if let Some(place) = watched.iter().position(|one| one.key == key) {
            watched.swap_remove(place).layout.bell().store(0, Ordering::SeqCst);
        }
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::SeqCst);
        self.shared.bells.rouse(self.shared.number);
        if let Some(thread) = self.thread.take() {
            // It would wait for itself where a raise dropped the last end; then the thread ends by itself.
            if thread.thread().id() != thread::current().id() {
                thread.join().ok();
            }
        }
    }
}

impl ListenerState {
    fn listen(&self) {
        let parameters = libc::sched_param { sched_priority: PRIORITY };
        // SAFETY: of this thread. Without the rights it listens at an ordinary priority.
        unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK, &parameters) };
        let mut due: Vec<(Raise, usize)> = Vec::new();
        let mut vain = 0;
        while !self.ends.load(Ordering::SeqCst) {
            let heard = self.bells.rings(self.number);
            due.extend(self.watched().iter_mut().filter_map(WatchedQueue::due));
            vain = if due.is_empty() { vain + 1 } else { 0 };
            if vain > VAIN_MAX {
                vain = 0;
                thread::sleep(REST);
            }
            // The lock is free again: who is raised may make and drop ends.
            for (raise, rows) in due.drain(..) {
                (0..rows).for_each(|_| raise());
            }
            self.bells.wait(self.number, heard);
        }
    }

    fn watched(&self) -> MutexGuard<'_, Vec<WatchedQueue>> {
        // A list is whole between any two of its calls.
        self.watched.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl WatchedQueue {
    /// The rows that have come since, if any.
    fn due(&mut self) -> Option<(Raise, usize)> {
        let pushed = self.layout.pushed().load(Ordering::Acquire);
        let rows = pushed.wrapping_sub(self.raised);
        self.raised = pushed;
        (rows > 0).then(|| (self.raise.clone(), if rows > ROWS_MAX.max(self.layout.depth()) { 1 } else { rows }))
    }
}
