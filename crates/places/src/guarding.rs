// SPDX-License-Identifier: Apache-2.0
//! The guard of a system's processes: started with the first of them.
use guard::{Guard, GuardCommand, GuardEvent, Heartbeat, UnixLink, receive_handles};
use interconnect::Link;
use rtp::Tell;
use std::ffi::OsString;
use std::os::fd::OwnedFd;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

/// How long the heart of a process may stand still: a machine with other work may hold it up for long.
const FROZEN: Duration = Duration::from_secs(2);

/// Between two looks at whether a process is still there.
const LOOK: Duration = Duration::from_secs(1);

/// The guard process, as far as there is one, and who is told of it.
#[derive(Default)]
pub(crate) struct Guarding {
    tell: Arc<OnceLock<Tell>>,
    guard: Mutex<Option<Arc<Guard>>>,
    last_ward: AtomicU64,
}

/// A process that is guarded.
pub(crate) struct Guarded {
    guard: Arc<Guard>,
    ward: u64,
}

impl Guarded {
    /// It is about to end in good order.
    pub fn forget(&self) {
        // Where the guard is gone there is nothing to forget.
        let _forgotten = self.guard.forget(self.ward);
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        // Its loss has been dealt with.
        self.forget();
    }
}

impl Guarding {
    pub fn tell_to(&self, tell: Tell) {
        let _first = self.tell.set(tell);
    }

    /// Guards a process from now on; `handles` brings what makes its devices safe. Errors: there is no guard, in words.
    pub fn watch(&self, command: &[OsString], name: &str, process: OwnedFd, heart: Heartbeat, handles: UnixLink) -> Result<Guarded, String> {
        let guard = self.guard(command)?;
        let ward = self.last_ward.fetch_add(1, Ordering::Relaxed) + 1;
        guard.watch(ward, name, process, Some((heart, FROZEN))).map_err(|why| why.to_string())?;
        let (held, tell, name) = (Arc::downgrade(&guard), self.tell.clone(), name.to_owned());
        let body = move || {
            loop {
                match receive_handles(&handles, LOOK) {
                    Err(_) => return,
                    Ok(None) => {}
                    Ok(Some((device, given))) => {
                        let Some(guard) = held.upgrade() else { return };
                        let told = if given.is_empty() { guard.release(ward, &device) } else { guard.hold(ward, &device, given) };
                        if let (Err(why), Some(tell)) = (told, tell.get()) {
                            tell("guard", &name, format!("device '{device}' is not guarded: {why}"));
                        }
                        let _heard = handles.send(b"held");
                    }
                }
            }
        };
        std::thread::Builder::new().name("safe-handles".into()).spawn(body).map_err(|why| why.to_string())?;
        Ok(Guarded { guard, ward })
    }

    fn guard(&self, command: &[OsString]) -> Result<Arc<Guard>, String> {
        let mut present = self.guard.lock().expect("nobody panics with the lock held");
        if let Some(guard) = present.as_ref() {
            return Ok(guard.clone());
        }
        let tell = self.tell.clone();
        let told = move |event: GuardEvent| {
            if let Some(tell) = tell.get() {
                let (about, text) = words(event);
                tell("guard", &about, text);
            }
        };
        let made = Guard::start(GuardCommand { command: command.to_vec(), path: None }, told).map_err(|why| format!("the guard cannot be started: {why}"))?;
        let made = Arc::new(made);
        *present = Some(made.clone());
        Ok(made)
    }

    /// The guard ends where it guards nothing any more.
    pub fn close(&self) {
        drop(self.guard.lock().expect("nobody panics with the lock held").take());
    }
}

/// The life of the guard process. Behind it nothing of the processes that it guarded is left in shared memory.
///
/// # Errors
/// As of [`guard::run`].
pub fn guard_processes() -> Result<(), String> {
    let guarded = guard::run();
    shared_memory::clean();
    guarded
}

/// What the guard says, for people.
fn words(event: GuardEvent) -> (String, String) {
    match event {
        GuardEvent::Lost(loss) => {
            let how = match loss.cause {
                guard::Cause::Died => "has ended",
                guard::Cause::Frozen => "stopped answering and was ended",
            };
            let failed = if loss.failed.is_empty() { String::new() } else { format!("; not written: {}", loss.failed.join(", ")) };
            let us = (loss.safe_ns - loss.seen_ns) as f64 * 1e-3;
            (loss.name, format!("its process {how}; {} safe outputs were written {us:.0} us after that was seen{failed}", loss.written))
        }
        GuardEvent::Missing(missing) => ("guard".to_owned(), format!("it has less than real-time rights: {}", missing.join("; "))),
        GuardEvent::Restarted(how) => ("guard".to_owned(), format!("it {how}; another one guards now, with all that was registered")),
        GuardEvent::Gone(why) => {
            ("guard".to_owned(), format!("there is no guard any more: {why}; processes that die from now on leave their outputs as they are"))
        }
    }
}
