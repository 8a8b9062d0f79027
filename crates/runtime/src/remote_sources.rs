// SPDX-License-Identifier: Apache-2.0
//! Remote sources of a host: their hosts, the processes spread over several locations, and the events received from them.
use crate::locked::locked;
use crate::relay::Relays;
use crate::remote::Remote;
use kernel::{Event, Home, Process, SourceId};
use std::collections::{HashMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, RwLock, Weak};

/// Remote sources, with their pending events.
#[derive(Default)]
pub(crate) struct RemoteSources {
    by_source: RwLock<HashMap<SourceId, Arc<dyn Remote>>>,
    is_any: AtomicBool,
    /// Number of the last connection to a remote source.
    last_way: AtomicU64,
    /// Processes with remote sources.
    processes: Mutex<HashMap<u64, Reaching>>,
    /// Number of processes that were still referenced at the last search.
    held: AtomicUsize,
    /// Events received from remote sources: (order among the events of the host, event).
    told: Mutex<VecDeque<(u64, Event)>>,
    /// Events to be returned first, because they precede an event that has already been taken.
    first: Mutex<VecDeque<Event>>,
    /// Connections between remote processors that pass through here.
    pub(crate) relays: Relays,
}

/// A process with remote sources.
struct Reaching {
    process: Weak<Process>,
    /// Hosts of a spread process: their kernels report its conditions, and follow its stage.
    places: Vec<Arc<dyn Remote>>,
}

impl RemoteSources {
    pub(crate) fn is_any(&self) -> bool {
        self.is_any.load(Ordering::Acquire)
    }

    pub(crate) fn pop_first(&self) -> Option<Event> {
        if self.is_any() { locked(&self.first).pop_front() } else { None }
    }

    /// Takes an event of remote sources that arrived before the local event `serial`.
    pub(crate) fn take_told(&self, serial: Option<u64>) -> Option<Event> {
        if !self.is_any() {
            return None;
        }
        let mut told = locked(&self.told);
        told.pop_front_if(|(at, _)| serial.is_none_or(|serial| *at < serial)).map(|(_, event)| event)
    }

    pub(crate) fn close(&self) {
        self.relays.close();
        let all: Vec<Arc<dyn Remote>> = self.by_source.read().expect("nobody panics with the lock held").values().cloned().collect();
        all.iter().enumerate().filter(|(index, remote)| !all[..*index].iter().any(|other| Arc::ptr_eq(other, remote))).for_each(|(_, remote)| remote.close());
    }

    /// Registers `remote` as the host of this source.
    pub(crate) fn enter(&self, source: SourceId, remote: Arc<dyn Remote>) {
        self.by_source.write().expect("nobody panics with the lock held").insert(source, remote);
        self.is_any.store(true, Ordering::Release);
    }

    /// Returns the host of a source; `None` for local sources.
    pub(crate) fn of(&self, source: SourceId) -> Option<Arc<dyn Remote>> {
        if !self.is_any() {
            return None;
        }
        self.by_source.read().expect("nobody panics with the lock held").get(&source).cloned()
    }

    /// Returns the number of a new connection to a remote source.
    pub(crate) fn next_way(&self) -> u64 {
        self.last_way.fetch_add(1, Ordering::Relaxed) + 1
    }

    /// Records an event of a remote source; `serial`: its order among the events of the host.
    pub(crate) fn told(&self, serial: u64, event: Event) {
        self.is_any.store(true, Ordering::Release);
        locked(&self.told).push_back((serial, event));
    }

    /// Sets or clears the flag that every write of a remote device obeys.
    pub(crate) fn stop(&self, set: bool) {
        self.by_source.read().expect("nobody panics with the lock held").values().for_each(|remote| remote.stop(set));
    }

    /// Creates a process with steps in `sources`. See [`Process::new`]. If all sources run in one remote processor process, the word is
    /// kept there.
    pub(crate) fn new_process(&self, id: u64, created: u64, sources: &[SourceId]) -> Arc<Process> {
        let mut places: Vec<Option<Arc<dyn Remote>>> = Vec::new();
        for remote in sources.iter().map(|source| self.of(*source)) {
            if !places.iter().any(|place| is_same(place, &remote)) {
                places.push(remote);
            }
        }
        let (home, places) = match places.as_mut_slice() {
            [] | [None] => return Process::new(id, created),
            [Some(place)] => (Home::There(place.clone()), Vec::new()),
            _ => (Home::Spread, places.into_iter().flatten().collect()),
        };
        let process = Process::at(id, created, home);
        let mut processes = locked(&self.processes);
        if processes.len() >= PROCESSES_MIN.max(2 * self.held.load(Ordering::Relaxed)) {
            processes.retain(|_, reaching| reaching.process.strong_count() > 0);
            self.held.store(processes.len(), Ordering::Relaxed);
        }
        processes.insert(id, Reaching { process: Arc::downgrade(&process), places });
        process
    }

    /// Adds events to be returned first, because they precede an event that has already been taken.
    pub(crate) fn tell_first(&self, events: impl IntoIterator<Item = Event>) {
        locked(&self.first).extend(events);
    }

    pub(crate) fn process(&self, id: u64) -> Option<Arc<Process>> {
        locked(&self.processes).get(&id)?.process.upgrade()
    }

    /// Returns the hosts whose kernels serve a spread process.
    pub(crate) fn places(&self, id: u64) -> Vec<Arc<dyn Remote>> {
        locked(&self.processes).get(&id).map(|reaching| reaching.places.clone()).unwrap_or_default()
    }
}

/// Number of processes below which unreferenced processes are not searched for.
const PROCESSES_MIN: usize = 256;

/// Returns true if both are the same host.
pub(crate) fn is_same(one: &Option<Arc<dyn Remote>>, other: &Option<Arc<dyn Remote>>) -> bool {
    match (one, other) {
        (Some(one), Some(other)) => Arc::ptr_eq(one, other),
        (None, None) => true,
        _ => false,
    }
}
