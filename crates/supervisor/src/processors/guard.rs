// SPDX-License-Identifier: Apache-2.0
//! Guard of this process itself: processors that are threads of it command devices too, which it cannot make safe once it is gone or stands
//! still. The guard watches it from the first device on that can be made safe from outside.
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
    /// The thread of the heart.
    heart: Mutex<Option<JoinHandle<()>>>,
}

#[derive(Default)]
struct State {
    /// Held hearts by processor, each with bounds of its own.
    held: Mutex<BTreeMap<String, Box<dyn ProcessorHold>>>,
    /// Sources that are threads here.
    sources: Mutex<Vec<SourceId>>,
    /// Time for which a processor may stand still, if it was configured.
    lost_after: Mutex<BTreeMap<String, Duration>>,
    ends: AtomicBool,
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl ProcessGuard {
    /// Notes that a source is a thread here.
    pub fn runs(&self, source: SourceId) {
        locked(&self.state.sources).push(source);
    }

    /// Sets the time for which a processor of this process may stand still.
    pub fn bound(&self, processor: &str, lost_after: Duration) {
        locked(&self.state.lost_after).insert(processor.to_owned(), lost_after);
    }

    /// Notes that the device was closed.
    pub fn release(&self, device: &str) {
        let holders: Vec<Holder> = locked(&self.state.held).values().map(|held| held.holder()).collect();
        for holds in holders {
            // Where the guard is gone, or never had it, nothing is written for it.
            let _released = holds(device, &[]);
        }
    }

    /// Devices are closed: this process is guarded no more.
    pub fn end(&self) {
        self.state.ends.store(true, Ordering::Release);
        if let Some(heart) = locked(&self.heart).take() {
            heart.thread().unpark();
            // One that panicked has said so.
            let _ended = heart.join();
        }
        locked(&self.state.held).clear();
    }

    /// Starts the heart. It never waits for a lock whose holder waits: these are held for a look or an entry.
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
            *heart = Some(std::thread::Builder::new().name("heart".into()).spawn(body).map_err(|why| format!("a heart cannot be started: {why}"))?);
        }
        Ok(())
    }
}

impl ProcessGuard {
    /// Gives the guard what makes a device safe; from the first on, a heart says that this process is there.
    pub fn hold(&self, places: &dyn Places, host: &Arc<Host>, processor: &str, device: &str, handles: &[SafeHandle]) -> Result<(), String> {
        self.begin(host)?;
        if !locked(&self.state.held).contains_key(processor) {
            let lost_after = locked(&self.state.lost_after).get(processor).copied();
            let held = places.this(processor, lost_after)?;
            locked(&self.state.held).entry(processor.to_owned()).or_insert(held);
        }
        // The guard's answer is waited for: the heart must not wait with it.
        let holds = locked(&self.state.held).get(processor).map(|held| held.holder()).ok_or("it was closed meanwhile")?;
        holds(device, handles)
    }
}
