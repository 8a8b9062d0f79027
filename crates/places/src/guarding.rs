// SPDX-License-Identifier: Apache-2.0
//! The guard of a system's processes: started with the first of them.
use crate::adopting;
use crate::own::Own;
use crate::telling::Telling;
use guard::{Bounds, Guard, GuardCommand, GuardEvent, receive_handles};
use interconnect::Link;
use process_kit::{Heartbeat, UnixLink};
use std::collections::HashMap;
use std::ffi::OsString;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;

/// Bound for the guard's word on a process that has ended.
const SAID: Duration = Duration::from_secs(2);

/// Between two looks at whether a process is still there.
const LOOK: Duration = Duration::from_secs(1);

/// The guard process, as far as there is one, and who is told of it.
#[derive(Default)]
pub(crate) struct Guarding {
    telling: Telling,
    guard: Mutex<Option<Arc<Guard>>>,
    /// Guards of systems that were lost, whose processes are taken over.
    adopted: Mutex<Vec<AdoptedProcess>>,
    last_ward: AtomicU64,
    seen: Arc<SeenLosses>,
    /// Path at which a later supervisor finds the guard that is started here.
    path: Option<PathBuf>,
}

/// Reports of guards on processes that were lost, by their wards.
#[derive(Default)]
struct SeenLosses {
    losses: Mutex<HashMap<u64, guard::Cause>>,
    changed: Condvar,
}

struct AdoptedProcess {
    path: PathBuf,
    guard: Arc<Guard>,
    /// Numbers of the ward and of its process.
    wards: Vec<(u64, i32)>,
}

/// A process that is to be guarded.
pub(crate) struct WatchedProcess {
    pub process: OwnedFd,
    pub heart: Heartbeat,
    /// Bound for a standstill of its heart, where somebody gave one.
    pub lost_after: Option<Duration>,
}

/// A process that is guarded.
pub(crate) struct GuardedProcess {
    guard: Arc<Guard>,
    ward: u64,
    bounds: Bounds,
    seen: Arc<SeenLosses>,
    /// It is guarded for this system; one that has not been taken over stays guarded without it.
    is_ours: AtomicBool,
}

impl GuardedProcess {
    /// The hearts of its guard and of this supervisor. Errors: no descriptors left.
    pub fn hearts(&self) -> Result<[OwnedFd; 2], String> {
        self.guard.hearts().map_err(crate::text)
    }

    /// It was taken over.
    pub fn own(&self, is_ours: bool) {
        self.is_ours.store(is_ours, Ordering::Release);
    }

    /// Returns, in words, that it stood still for its bound and was ended for that, where the guard saw so. May wait a moment for the guard.
    pub fn stood_still(&self) -> Option<String> {
        let losses = self.seen.losses.lock().expect("nobody panics with the lock held");
        let said = self.seen.changed.wait_timeout_while(losses, SAID, |losses| !losses.contains_key(&self.ward));
        let (losses, _) = said.expect("nobody panics with the lock held");
        match losses.get(&self.ward) {
            Some(guard::Cause::Frozen) => Some(format!("stood still for {} s (its heart did not beat), so it was ended", self.bounds.silent_ns as f64 * 1e-9)),
            Some(guard::Cause::Stopped) => Some(format!("was stopped for {} s (SIGSTOP, a debugger), so it was ended", self.bounds.stopped_ns as f64 * 1e-9)),
            Some(guard::Cause::Died) | None => None,
        }
    }

    /// It is about to end in good order.
    pub fn forget(&self) {
        if !self.is_ours.load(Ordering::Acquire) {
            return;
        }
        // Where the guard is gone there is nothing to forget.
        let _forgotten = self.guard.forget(self.ward);
        self.seen.losses.lock().expect("nobody panics with the lock held").remove(&self.ward);
    }
}

impl Drop for GuardedProcess {
    fn drop(&mut self) {
        // Its loss has been dealt with.
        self.forget();
    }
}

impl Guarding {
    /// `path`: where the guard that is started here is found by a later supervisor.
    pub fn new(path: Option<PathBuf>, telling: Telling) -> Guarding {
        Guarding { path, telling, ..Guarding::default() }
    }

    /// Path at which a later supervisor finds the guard that is started here.
    pub fn path(&self) -> Option<&PathBuf> {
        self.path.as_ref()
    }

    /// Starts guarding a process; `handles` brings what makes its devices safe. Errors: there is no guard, in words.
    pub fn watch(&self, command: &[OsString], name: &str, watched: WatchedProcess, handles: &Arc<UnixLink>) -> Result<GuardedProcess, String> {
        let guard = self.guard(command)?;
        let ward = self.last_ward.fetch_add(1, Ordering::Relaxed) + 1;
        let bounds = bounds(watched.lost_after);
        guard.watch(ward, name, watched.process, Some((watched.heart, bounds))).map_err(|why| why.to_string())?;
        self.hear(guard, ward, name, bounds, handles)
    }

    /// This process itself, for a processor that is threads of it. Errors: there is no guard, in words.
    pub fn watch_this(&self, command: &[OsString], processor: &str, lost_after: Option<Duration>) -> Result<Own, String> {
        let guard = self.guard(command)?;
        let ward = self.last_ward.fetch_add(1, Ordering::Relaxed) + 1;
        Own::guarded(guard, ward, processor, bounds(lost_after))
    }

    /// The hearts of the guard and of this supervisor, for a process that is to see whether anybody watches it. Errors: there is no guard.
    pub fn hearts(&self, command: &[OsString]) -> Result<[OwnedFd; 2], String> {
        self.guard(command)?.hearts().map_err(crate::text)
    }

    /// The process `pid` as the guard at `path` guards it, for a system that was lost; `handles` brings what makes further devices safe.
    /// None where that guard is gone, or does not know it.
    pub fn adopt(
        &self,
        command: &[OsString],
        path: &Path,
        (name, pid): (&str, i32),
        lost_after: Option<Duration>,
        handles: &Arc<UnixLink>,
    ) -> Result<Option<GuardedProcess>, String> {
        let bounds = bounds(lost_after);
        let found = {
            let mut adopted = self.adopted.lock().expect("nobody panics with the lock held");
            if !adopted.iter().any(|one| one.path == path) {
                let command = GuardCommand { command: command.to_vec(), path: Some(path.to_owned()) };
                let Ok((guard, found)) = Guard::adopt(command, self.telling()) else { return Ok(None) };
                let wards: Vec<(u64, i32)> = found.iter().filter(|one| one.loss.is_none()).map(|one| (one.ward, one.process.pid())).collect();
                self.last_ward.fetch_max(found.iter().map(|one| one.ward).max().unwrap_or(0), Ordering::Relaxed);
                let guard = Arc::new(guard);
                self.guard.lock().expect("nobody panics with the lock held").get_or_insert_with(|| guard.clone());
                adopted.push(AdoptedProcess { path: path.to_owned(), guard, wards });
            }
            let of = adopted.iter().find(|one| one.path == path).expect("it was put there above");
            of.wards.iter().find(|(_, of)| *of == pid).map(|(ward, _)| (of.guard.clone(), *ward))
        };
        // Its bound is what it was registered with.
        found.map(|(guard, ward)| self.hear(guard, ward, name, bounds, handles)).transpose()
    }

    /// Passes on what makes devices safe.
    fn hear(&self, guard: Arc<Guard>, ward: u64, name: &str, bounds: Bounds, handles: &Arc<UnixLink>) -> Result<GuardedProcess, String> {
        let (held, handles, telling, name) = (Arc::downgrade(&guard), handles.clone(), self.telling.clone(), name.to_owned());
        let body = move || {
            loop {
                match receive_handles(&handles, LOOK) {
                    Err(_) => return,
                    Ok(None) => {}
                    Ok(Some((device, given))) => {
                        let Some(guard) = held.upgrade() else { return };
                        let told = if given.is_empty() { guard.release(ward, &device) } else { guard.hold(ward, &device, given) };
                        if let Err(why) = told {
                            telling.tell("guard", &name, format!("device '{device}' is not guarded: {why}"));
                        }
                        let _heard = handles.send(b"held");
                    }
                }
            }
        };
        std::thread::Builder::new().name("safe-handles".into()).spawn(body).map_err(|why| why.to_string())?;
        Ok(GuardedProcess { guard, ward, bounds, seen: self.seen.clone(), is_ours: AtomicBool::new(true) })
    }

    fn guard(&self, command: &[OsString]) -> Result<Arc<Guard>, String> {
        let mut present = self.guard.lock().expect("nobody panics with the lock held");
        if let Some(guard) = present.as_ref() {
            return Ok(guard.clone());
        }
        let command = GuardCommand { command: command.to_vec(), path: self.path.clone() };
        let made = Guard::start(command, self.telling()).map_err(|why| format!("the guard cannot be started: {why}"))?;
        let made = Arc::new(made);
        *present = Some(made.clone());
        Ok(made)
    }

    fn telling(&self) -> impl Fn(GuardEvent) + Send + Sync + 'static {
        let (telling, seen) = (self.telling.clone(), self.seen.clone());
        move |event: GuardEvent| {
            if let GuardEvent::Lost(loss) = &event {
                seen.losses.lock().expect("nobody panics with the lock held").insert(loss.ward, loss.cause);
                seen.changed.notify_all();
            }
            let (about, text) = words(event);
            telling.tell("guard", &about, text);
        }
    }

    /// The guard ends when it guards nothing.
    pub fn close(&self) {
        self.adopted.lock().expect("nobody panics with the lock held").clear();
        drop(self.guard.lock().expect("nobody panics with the lock held").take());
    }
}

/// Bound for a standstill of a process's heart: the one that was given, or the guard's own.
fn bounds(lost_after: Option<Duration>) -> Bounds {
    lost_after.map_or_else(Bounds::default, Bounds::from)
}

/// The life of the guard process. Behind it nothing of the processes that it guarded is left, neither in shared memory nor of their sockets.
///
/// # Errors
/// As of [`guard::run`].
pub fn guard_processes() -> Result<(), String> {
    let guarded = guard::run();
    shared_memory::clean();
    adopting::clean();
    guarded
}

/// Words of the guard, for people.
fn words(event: GuardEvent) -> (String, String) {
    match event {
        GuardEvent::Lost(loss) => {
            let how = match loss.cause {
                guard::Cause::Died => "has ended",
                guard::Cause::Frozen => "stood still (its heart did not beat) and was ended",
                guard::Cause::Stopped => "was stopped (SIGSTOP, a debugger) and was ended",
            };
            let written = written(&loss);
            (loss.name, format!("its process {how}; {written}"))
        }
        GuardEvent::MadeSafe(loss) => {
            let how = if loss.cause == guard::Cause::Stopped { "is stopped (SIGSTOP, a debugger)" } else { "stands still (its heart does not beat)" };
            let written = written(&loss);
            (loss.name, format!("its program {how}; {written}, and stay safe until reset() or reopen()"))
        }
        GuardEvent::GoesOn(name) => (name, "its program goes on".to_owned()),
        GuardEvent::Missing(missing) => ("guard".to_owned(), format!("it has less than real-time rights: {}", missing.join("; "))),
        GuardEvent::Restarted { how, refused } if refused.is_empty() => {
            ("guard".to_owned(), format!("one of its two processes {how}; another one guards now, with all that was registered"))
        }
        GuardEvent::Restarted { how, refused } => {
            ("guard".to_owned(), format!("one of its two processes {how}; another one guards now, but for what it could not take: {}", refused.join("; ")))
        }
        GuardEvent::Alone(why) => ("guard".to_owned(), format!("one of its two processes is gone for good: {why}; the other one guards alone")),
        GuardEvent::Gone(why) => {
            ("guard".to_owned(), format!("there is no guard any more: {why}; processes that die from now on leave their outputs as they are"))
        }
    }
}

fn written(loss: &guard::Loss) -> String {
    let failed = if loss.failed.is_empty() { String::new() } else { format!("; not written: {}", loss.failed.join(", ")) };
    let us = (loss.safe_ns - loss.seen_ns) as f64 * 1e-3;
    format!("{} safe outputs were written {us:.0} us after that was seen{failed}", loss.written)
}
