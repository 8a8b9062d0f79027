// SPDX-License-Identifier: Apache-2.0
//! The supervisor's watcher: a dedicated thread that monitors the guard, and replaces it if it stalls. Like the guard, it also monitors
//! every process registered with the guard: whichever notices a loss first writes the safe handles. If both write them, no harm is done.
//! The thread also serves as the canary of this process.
use crate::canary::Sings;
use crate::messages::{Ask, Loss};
use crate::serve::{BEAT_NS, Hearts};
use crate::stopped::Stops;
use crate::ward::WardReport;
use crate::wards::Wards;
use crate::watch::{Bounds, Cause, ProcessStanding, Pulse};
use interconnect::Link;
use process_kit::{Child, UnixLink, now_ns};
use process_kit::{pid_of, process_descriptor, signal};
use scheduling::Children;
use std::io;
use std::os::fd::{AsFd, AsRawFd, FromRawFd, OwnedFd};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maximum stall of the guard. With its privileges, the guard outranks every other thread; the bound for silence allows for machines that
/// do not grant these privileges.
const GUARD: Bounds = Bounds { silent_ns: 1_000_000_000, stopped_ns: 100_000_000 };
/// Time within which the guard must report its observation; after that, the watcher reports its own. The guard comes first, because its
/// observation may be the reason why it terminated the process.
const SAID_NS: i64 = 1_000_000_000;
/// Priority below that of the guard, and above those of the plants and of every kernel.
const PRIORITY: u8 = 98;

/// State shared by the watcher's thread and the threads that register processes. No lock is held while waiting.
pub(crate) struct Watcher {
    pub hearts: Hearts,
    wards: Mutex<Wards>,
    /// Guard process to check; `None` if there is none.
    guard: Mutex<Option<Present>>,
    /// Wakes the thread when there is a new process to wait for.
    wakes: Wakes,
    /// True if the guard that has exited was terminated by this watcher.
    is_ended: AtomicBool,
    ends: AtomicBool,
    /// True if this watcher also watches the registered processes; otherwise, another watcher does.
    watches: bool,
}

/// The serving guard process.
struct Present {
    /// True if the guard has taken over the registrations.
    guards: bool,
    process: OwnedFd,
    stops: Stops,
    pulse: Pulse,
    link: Arc<UnixLink>,
}

/// A counter that can be polled.
struct Wakes(OwnedFd);

impl Wakes {
    fn new() -> io::Result<Wakes> {
        // SAFETY: makes a descriptor, which is owned at once.
        match unsafe { libc::eventfd(0, libc::EFD_CLOEXEC | libc::EFD_NONBLOCK) } {
            // SAFETY: it was made just now.
            made if made >= 0 => Ok(Wakes(unsafe { OwnedFd::from_raw_fd(made) })),
            _ => Err(io::Error::last_os_error()),
        }
    }

    fn wake(&self) {
        let one = 1_u64;
        // SAFETY: writes a number of our own. Where there is no room, it wakes already.
        unsafe { libc::write(self.0.as_raw_fd(), (&raw const one).cast(), 8) };
    }

    fn heard(&self) {
        let mut count = 0_u64;
        // SAFETY: reads into a number of our own. Where nothing is there, nobody woke it.
        unsafe { libc::read(self.0.as_raw_fd(), (&raw mut count).cast(), 8) };
    }
}

fn locked<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watcher {
    /// Creates a watcher. Fails if no descriptors are left.
    pub fn new(hearts: Hearts, watches: bool) -> io::Result<Watcher> {
        let (is_ended, ends) = (AtomicBool::new(false), AtomicBool::new(false));
        Ok(Watcher { hearts, wards: Mutex::default(), guard: Mutex::default(), wakes: Wakes::new()?, is_ended, ends, watches })
    }

    /// Watches the processes that the guard is asked to watch, except this process itself, which only the guard watches.
    pub fn act(&self, ask: &Ask, descriptors: &[OwnedFd]) {
        if !self.watches || matches!(ask, Ask::Ward(text) if text.is_spared) {
            return;
        }
        // If no descriptor is left, only the guard watches it; likewise handles of this process, which is not registered here.
        let Ok(copies) = descriptors.iter().map(OwnedFd::try_clone).collect::<io::Result<Vec<_>>>() else { return };
        let _unknown = locked(&self.wards).act(ask.clone(), copies);
        self.wakes.wake();
    }

    /// Registers the guard process: a child of this process, or of a previous supervisor. Until it `guards`, this thread guards in its
    /// place.
    pub fn guarded_by(&self, child: Option<&Child>, link: &Arc<UnixLink>, guards: bool) {
        let process = match child {
            Some(child) => child.descriptor(),
            None => link.peer().and_then(|(_, pid)| process_descriptor(pid)),
        };
        // A guard whose process is unknown is monitored through its link only.
        *locked(&self.guard) = process.ok().map(|process| {
            let pulse = Pulse::new(GUARD, self.hearts.guard.count(), now_ns());
            Present { guards, stops: Stops::of(process.as_fd()), process, pulse, link: link.clone() }
        });
    }

    /// Records that the guard has taken over the registrations.
    pub fn is_guarded(&self) {
        if let Some(guard) = locked(&self.guard).as_mut() {
            guard.guards = true;
        }
    }

    /// Records that the guard has exited. Returns true if the watcher terminated it because it had stalled.
    pub fn is_gone(&self) -> bool {
        *locked(&self.guard) = None;
        self.is_ended.swap(false, Ordering::AcqRel)
    }

    /// Stops the watcher's thread.
    pub fn end(&self) {
        self.ends.store(true, Ordering::Release);
        self.wakes.wake();
    }

    /// Watches until [`end`](Self::end) is called. Calls `lost` for each loss, some time after it was noticed.
    pub fn run(&self, lost: impl Fn(Loss)) {
        // Without the priority the watcher is only less punctual.
        let _granted = scheduling::prioritise(PRIORITY, Children::Ordinary);
        let _sings = Sings::here(&self.hearts.supervisor);
        let mut said = Vec::new();
        while !self.ends.load(Ordering::Acquire) {
            self.hearts.supervisor.beat();
            self.wait();
            let now_ns = now_ns();
            let leads = !self.serves(now_ns);
            let seen = locked(&self.wards).look(leads, now_ns);
            for loss in seen.into_iter().filter_map(|seen| if let WardReport::Lost(loss) = seen { Some(loss) } else { None }) {
                // Only the watcher that ended a process knows the reason.
                let due_ns = if loss.cause == Cause::Died && !leads { now_ns + SAID_NS } else { now_ns };
                said.push((due_ns, loss));
            }
            said.retain(|(due_ns, loss): &(i64, Loss)| {
                let is_due = *due_ns <= now_ns;
                if is_due {
                    lost(loss.clone());
                }
                !is_due
            });
        }
    }

    /// Waits until a process exits, the guard's link breaks, or the next check is due.
    fn wait(&self) {
        let wait = |number: i32, events| libc::pollfd { fd: number, events, revents: 0 };
        let mut waits = vec![wait(self.wakes.0.as_raw_fd(), libc::POLLIN)];
        let interval_ns = {
            let wards = locked(&self.wards);
            waits.extend(wards.waits().map(|process| wait(process.as_raw_fd(), libc::POLLIN)));
            wards.interval_ns().unwrap_or(BEAT_NS).min(BEAT_NS)
        };
        // Only polled for being broken; another thread receives from the guard.
        waits.extend(locked(&self.guard).as_ref().map(|guard| wait(guard.link.as_fd().as_raw_fd(), 0)));
        let limit = libc::timespec { tv_sec: 0, tv_nsec: interval_ns };
        // A descriptor that is closed and reused meanwhile can only end the wait early: every process is checked again. SAFETY: the list
        // has the length given; the limit lives until the call returns.
        let ready = unsafe { libc::ppoll(waits.as_mut_ptr(), waits.len() as libc::nfds_t, &limit, std::ptr::null()) };
        self.wakes.heard();
        if ready > 0 && waits.last().is_some_and(|link| link.events == 0 && link.revents != 0) {
            // The receiving thread restores it.
            *locked(&self.guard) = None;
        }
    }

    /// Returns true if the guard is watching. A guard that has stalled is useless: it is terminated, and its supervisor starts another
    /// one.
    fn serves(&self, now_ns: i64) -> bool {
        let mut present = locked(&self.guard);
        let Some(guard) = present.as_mut() else { return false };
        if guard.pulse.look(self.hearts.guard.count(), || guard.stops.now(), now_ns) != ProcessStanding::Serves {
            self.is_ended.store(true, Ordering::Release);
            signal(guard.process.as_fd(), libc::SIGKILL);
            guard.link.close();
            *present = None;
        }
        present.as_ref().is_some_and(|guard| guard.guards)
    }
}

/// Returns true if a guard that does not exit is being held stopped, and would never exit.
pub(crate) fn is_stopped(child: &Child) -> bool {
    child.descriptor().is_ok_and(|process| pid_of(process.as_fd()).is_ok() && Stops::of(process.as_fd()).now())
}
