// SPDX-License-Identifier: Apache-2.0
//! Listener thread of this process: raises the readers whose rows have arrived.
use crate::bell::{BellNumber, Bells};
use crate::layout::Layout;
use interconnect::QueueMemory;
use scheduling::Children;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Priority of the thread, if the process has the privilege: above every source, because it works for all of them. Each raise takes only
/// a short time.
const PRIORITY: u8 = 99;
/// Maximum plausible increase of a count. A count that has increased by more than this and by more than the queue's depth was
/// overwritten, and is ignored.
const ROWS_MAX: usize = 1 << 10;
/// Maximum number of consecutive rings without a row before this thread pauses, so that a sender that rings unnecessarily cannot occupy a
/// CPU core.
const VAIN_MAX: u32 = 16;
const REST: Duration = Duration::from_millis(1);

type Raise = Arc<dyn Fn() + Send + Sync>;

/// Listener thread, which runs until this value is dropped.
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

/// A queue whose reader is raised when rows arrive.
struct WatchedQueue {
    key: u64,
    layout: Layout,
    /// Number of rows for which the reader has been raised so far (wraps around, like the count of rows).
    raised: usize,
    raise: Raise,
}

impl Listener {
    /// Claims a bell and starts the thread.
    pub fn start(bells: Arc<Bells>) -> io::Result<Self> {
        let Some(number) = bells.claim()? else { return Err(io::Error::other("too many processes have read in this run")) };
        let shared = Arc::new(ListenerState { bells, number, watched: Mutex::default(), next: AtomicU64::new(0), ends: AtomicBool::new(false) });
        let listening = shared.clone();
        let thread = thread::Builder::new().name("shared-memory".to_owned()).spawn(move || listening.listen())?;
        Ok(Listener { shared, thread: Some(thread) })
    }

    /// Calls `raise` for each row that waits in `layout` and for each that arrives later, until [`forget`](Self::forget) is called with
    /// the returned number.
    pub fn watch(&self, layout: Layout, raise: Box<dyn Fn() + Send + Sync>) -> u64 {
        let key = self.shared.next.fetch_add(1, Ordering::Relaxed);
        let raised = layout.popped().load(Ordering::Acquire);
        layout.bell().store(self.shared.number.0, Ordering::SeqCst);
        self.shared.watched().push(WatchedQueue { key, layout, raised, raise: raise.into() });
        // Rows that arrived before the bell was registered did not ring it.
        self.shared.bells.ring(self.shared.number);
        key
    }

    /// Stops raising the reader of the queue watched under `key`: no raise begins afterwards.
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
            // It would wait for itself if a raise dropped the last end; the thread then ends by itself.
            if thread.thread().id() != thread::current().id() {
                thread.join().ok();
            }
        }
    }
}

impl ListenerState {
    fn listen(&self) {
        // Without the right it listens at an ordinary priority.
        let _granted = scheduling::prioritise(PRIORITY, Children::Ordinary);
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
            // The lock has been released, because a raised source may make and drop ends.
            for (raise, rows) in due.drain(..) {
                (0..rows).for_each(|_| raise());
            }
            self.bells.wait(self.number, heard);
        }
    }

    fn watched(&self) -> MutexGuard<'_, Vec<WatchedQueue>> {
        // A list is consistent between any two of its calls.
        self.watched.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl WatchedQueue {
    /// Returns the number of rows that have arrived since the last call, if any, with the function that raises the reader.
    fn due(&mut self) -> Option<(Raise, usize)> {
        let pushed = self.layout.pushed().load(Ordering::Acquire);
        let rows = pushed.wrapping_sub(self.raised);
        self.raised = pushed;
        (rows > 0).then(|| (self.raise.clone(), if rows > ROWS_MAX.max(self.layout.depth()) { 1 } else { rows }))
    }
}
