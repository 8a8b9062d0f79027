// SPDX-License-Identifier: Apache-2.0
//! Guard of a system's processes, started with the first of them.
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

/// Timeout for the guard's report on a process that has ended.
const SAID: Duration = Duration::from_secs(2);

/// Period at which the guard checks whether a process still exists.
const LOOK: Duration = Duration::from_secs(1);

/// The guard process, if there is one, and the receiver of its reports.
#[derive(Default)]
pub(crate) struct Guarding {
    telling: Telling,
    guard: Mutex<Option<Arc<Guard>>>,
    /// Guards taken over from lost systems, with their wards.
    adopted: Mutex<Vec<AdoptedProcess>>,
    last_ward: AtomicU64,
    seen: Arc<SeenLosses>,
    /// Path at which a later supervisor finds the guard started here.
    path: Option<PathBuf>,
}

/// Reports of guards about lost processes, by ward.
#[derive(Default)]
struct SeenLosses {
    losses: Mutex<HashMap<u64, guard::Cause>>,
    changed: Condvar,
}

struct AdoptedProcess {
    path: PathBuf,
    guard: Arc<Guard>,
    /// Number of each ward, with its process ID.
    wards: Vec<(u64, i32)>,
}

/// A process to be guarded.
pub(crate) struct WatchedProcess {
    pub process: OwnedFd,
    pub heart: Heartbeat,
    /// Maximum stall of the process's heart, if configured.
    pub lost_after: Option<Duration>,
}

/// A guarded process.
pub(crate) struct GuardedProcess {
    guard: Arc<Guard>,
    ward: u64,
    bounds: Bounds,
    seen: Arc<SeenLosses>,
    /// True if the process is guarded for this system; a process that has not been taken over remains guarded independently of it.
    is_ours: AtomicBool,
}

impl GuardedProcess {
    /// Returns the heartbeats of the process's guard and of this supervisor. Fails if no descriptors are left.
    pub fn hearts(&self) -> Result<[OwnedFd; 2], String> {
        self.guard.hearts().map_err(crate::text)
    }

    /// Records whether the process has been taken over.
    pub fn own(&self, is_ours: bool) {
        self.is_ours.store(is_ours, Ordering::Release);
    }

    /// Returns a message if the guard terminated the process because it exceeded its maximum stall. May wait briefly for the guard.
    pub fn stood_still(&self) -> Option<String> {
        let losses = self.seen.losses.lock().expect("nobody panics with the lock held");
        let said = self.seen.changed.wait_timeout_while(losses, SAID, |losses| !losses.contains_key(&self.ward));
        let (losses, _) = said.expect("nobody panics with the lock held");
        match losses.get(&self.ward) {
            Some(guard::Cause::Frozen) => Some(format!("hung for {} s (its heartbeat stopped), so it was ended", self.bounds.silent_ns as f64 * 1e-9)),
            Some(guard::Cause::Stopped) => Some(format!("was stopped for {} s (SIGSTOP, a debugger), so it was ended", self.bounds.stopped_ns as f64 * 1e-9)),
            Some(guard::Cause::Died) | None => None,
        }
    }

    /// Notifies the guard that the process is about to exit in an orderly way.
    pub fn forget(&self) {
        if !self.is_ours.load(Ordering::Acquire) {
            return;
        }
        // If the guard has exited, there is nothing to forget.
        let _forgotten = self.guard.forget(self.ward);
        self.seen.losses.lock().expect("nobody panics with the lock held").remove(&self.ward);
    }
}

impl Drop for GuardedProcess {
    fn drop(&mut self) {
        // Its loss has been handled.
        self.forget();
    }
}

impl Guarding {
    /// Creates the guarding state; no guard is running yet. `path` is the path at which a later supervisor finds the guard.
    pub fn new(path: Option<PathBuf>, telling: Telling) -> Guarding {
        Guarding { path, telling, ..Guarding::default() }
    }

    /// Returns the path at which a later supervisor finds the guard started here.
    pub fn path(&self) -> Option<&PathBuf> {
        self.path.as_ref()
    }

    /// Starts guarding a process; its safe handles are received over the link `handles`. Fails with a message if there is no guard.
    pub fn watch(&self, command: &[OsString], name: &str, watched: WatchedProcess, handles: &Arc<UnixLink>) -> Result<GuardedProcess, String> {
        let guard = self.guard(command)?;
        let ward = self.last_ward.fetch_add(1, Ordering::Relaxed) + 1;
        let bounds = bounds(watched.lost_after);
        guard.watch(ward, name, watched.process, Some((watched.heart, bounds))).map_err(|why| why.to_string())?;
        self.hear(guard, ward, name, bounds, handles)
    }

    /// Guards this process itself, for a processor that consists of threads of this process. Fails with a message if there is no guard.
    pub fn watch_this(&self, command: &[OsString], processor: &str, lost_after: Option<Duration>) -> Result<Own, String> {
        let guard = self.guard(command)?;
        let ward = self.last_ward.fetch_add(1, Ordering::Relaxed) + 1;
        Own::guarded(guard, ward, processor, bounds(lost_after))
    }

    /// Returns the heartbeats of the guard and of this supervisor, for a process that checks whether it is watched. Fails if there is no
    /// guard.
    pub fn hearts(&self, command: &[OsString]) -> Result<[OwnedFd; 2], String> {
        self.guard(command)?.hearts().map_err(crate::text)
    }

    /// Adopts process `pid`, which the guard at `path` guards for a lost system; further safe handles are received over the link
    /// `handles`. Returns `None` if that guard has exited, or does not guard the process.
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
        // Its bounds are those with which it was registered.
        found.map(|(guard, ward)| self.hear(guard, ward, name, bounds, handles)).transpose()
    }

    /// Forwards the safe handles received over `handles` to the guard.
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

    /// Closes the guard, which exits when it guards no process.
    pub fn close(&self) {
        self.adopted.lock().expect("nobody panics with the lock held").clear();
        drop(self.guard.lock().expect("nobody panics with the lock held").take());
    }
}

/// Returns the maximum stall of a process's heart: the configured one, or the guard's default.
fn bounds(lost_after: Option<Duration>) -> Bounds {
    lost_after.map_or_else(Bounds::default, Bounds::from)
}

/// Runs the guard process. After it exits, no shared memory or socket of the processes that it guarded remains.
///
/// # Errors
/// Same as for [`guard::run`].
pub fn guard_processes() -> Result<(), String> {
    let guarded = guard::run();
    shared_memory::clean();
    adopting::clean();
    guarded
}

/// Returns a human-readable description of a guard event.
fn words(event: GuardEvent) -> (String, String) {
    match event {
        GuardEvent::Lost(loss) => {
            let how = match loss.cause {
                guard::Cause::Died => "has ended",
                guard::Cause::Frozen => "hung (its heartbeat stopped) and was ended",
                guard::Cause::Stopped => "was stopped (SIGSTOP, a debugger) and was ended",
            };
            let written = written(&loss);
            (loss.name, format!("its process {how}; {written}"))
        }
        GuardEvent::MadeSafe(loss) => {
            let how = if loss.cause == guard::Cause::Stopped { "is stopped (SIGSTOP, a debugger)" } else { "hangs (its heartbeat stopped)" };
            let written = written(&loss);
            (loss.name, format!("its program {how}; {written}, and stay safe until reset() or reopen()"))
        }
        GuardEvent::GoesOn(name) => (name, "its program continues".to_owned()),
        GuardEvent::Missing(missing) => ("guard".to_owned(), format!("it lacks real-time privileges: {}", missing.join("; "))),
        GuardEvent::Restarted { how, refused } if refused.is_empty() => {
            ("guard".to_owned(), format!("one of its two processes {how}; another one guards now, with all registrations"))
        }
        GuardEvent::Restarted { how, refused } => (
            "guard".to_owned(),
            format!("one of its two processes {how}; another one guards now, except for what it could not take over: {}", refused.join("; ")),
        ),
        GuardEvent::Alone(why) => ("guard".to_owned(), format!("one of its two processes is lost permanently: {why}; the other one guards alone")),
        GuardEvent::Gone(why) => {
            ("guard".to_owned(), format!("there is no longer a guard: {why}; processes that die from now on leave their outputs as they are"))
        }
    }
}

fn written(loss: &guard::Loss) -> String {
    let failed = if loss.failed.is_empty() { String::new() } else { format!("; not written: {}", loss.failed.join(", ")) };
    let us = (loss.safe_ns - loss.seen_ns) as f64 * 1e-3;
    format!("{} safe outputs were written {us:.0} us after this was detected{failed}", loss.written)
}
