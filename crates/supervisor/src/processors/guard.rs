// SPDX-License-Identifier: Apache-2.0
//! Guard of this process. Processors that are threads of this process also command devices, which the process cannot make safe after it
//! has exited or while it hangs. The guard monitors the process from the time at which it has the first device that can be made safe from
//! outside.
use device::SafeHandle;
use kernel::SourceId;
use rtp::{BEAT, Firings, Holder, Places, ProcessorHold};
use runtime::Host;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Guard of this process.
#[derive(Default)]
pub(crate) struct ProcessGuard {
    state: Arc<State>,
    /// Heartbeat thread.
    heart: Mutex<Option<JoinHandle<()>>>,
}

#[derive(Default)]
struct State {
    /// Registered heartbeats by processor, each with its own limits.
    held: Mutex<BTreeMap<String, Box<dyn ProcessorHold>>>,
    /// Sources that run as threads of this process.
    sources: Mutex<Vec<SourceId>>,
    /// Maximum time for which a processor may hang, if configured.
    lost_after: Mutex<BTreeMap<String, Duration>>,
    ends: AtomicBool,
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl ProcessGuard {
    /// Records that a source runs as a thread of this process.
    pub fn runs(&self, source: SourceId) {
        locked(&self.state.sources).push(source);
    }

    /// Sets the maximum time for which a processor of this process may hang.
    pub fn bound(&self, processor: &str, lost_after: Duration) {
        locked(&self.state.lost_after).insert(processor.to_owned(), lost_after);
    }

    /// Records that the device was closed.
    pub fn release(&self, device: &str) {
        let holders: Vec<Holder> = locked(&self.state.held).values().map(|held| held.holder()).collect();
        for holds in holders {
            // If the guard has exited, or never had the device, there is nothing to release.
            let _released = holds(device, &[]);
        }
    }

    /// Stops guarding this process after its devices have been closed.
    pub fn end(&self) {
        self.state.ends.store(true, Ordering::Release);
        if let Some(heart) = locked(&self.heart).take() {
            heart.thread().unpark();
            // A panic of the thread has already been reported.
            let _ended = heart.join();
        }
        locked(&self.state.held).clear();
    }

    /// Starts the heartbeat. It never waits for a lock whose holder waits, because its locks are held only for a single access.
    fn begin(&self, host: &Arc<Host>) -> Result<(), String> {
        let mut heart = locked(&self.heart);
        if heart.is_none() {
            let (state, host) = (self.state.clone(), host.clone());
            let body = move || {
                runtime::take_for_heart();
                let mut firings = Firings::default();
                while !state.ends.load(Ordering::Acquire) {
                    let sources = locked(&state.sources).clone();
                    if firings.stuck(&host, &sources).is_none() {
                        locked(&state.held).values().for_each(|held| held.beat());
                    }
                    std::thread::park_timeout(BEAT);
                }
            };
            *heart = Some(std::thread::Builder::new().name("heart".into()).spawn(body).map_err(|why| format!("cannot start the heartbeat thread: {why}"))?);
        }
        Ok(())
    }
}

impl ProcessGuard {
    /// Passes the guard the handles that make a device safe. Starting with the first one, a heartbeat signals that this process is alive.
    pub fn hold(&self, places: &dyn Places, host: &Arc<Host>, processor: &str, device: &str, handles: &[SafeHandle]) -> Result<(), String> {
        self.begin(host)?;
        if !locked(&self.state.held).contains_key(processor) {
            let lost_after = locked(&self.state.lost_after).get(processor).copied();
            let held = places.this(processor, lost_after)?;
            locked(&self.state.held).entry(processor.to_owned()).or_insert(held);
        }
        // This waits for the guard's answer, which the heart must not do.
        let holds = locked(&self.state.held).get(processor).map(|held| held.holder()).ok_or("it was closed in the meantime")?;
        holds(device, handles)
    }
}
