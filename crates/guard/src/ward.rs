// SPDX-License-Identifier: Apache-2.0
//! A guarded process, as seen through the operating system: the subject that [`Watch`] observes and acts on.
use crate::canary::Canary;
use crate::messages::{HandleText, Loss, WardText};
use crate::safe;
use crate::stopped::Stops;
use crate::watch::{Cause, Event, Pulse, Subject, Watch};
use process_kit::Heartbeat;
use process_kit::{has_ended, pid_of, signal};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

/// Reason why a process was terminated, as stored in its heartbeat for all watchers.
const FROZEN: u64 = 1;
const STOPPED: u64 = 2;

/// A guarded process.
pub(crate) struct Ward {
    pub text: WardText,
    parts: Parts,
    watch: Watch,
    loss: Option<Loss>,
}

/// Descriptor, heartbeat and safe handles of a process.
pub(crate) struct Parts {
    pub process: OwnedFd,
    pub heartbeat: Option<Heartbeat>,
    pub handles: Vec<Handle>,
    stops: Stops,
    pid: Option<i32>,
    canary: Canary,
    has_ended: bool,
    /// Errors of the latest attempt to write, human-readable.
    failed: Vec<String>,
}

/// Descriptor and writes that make outputs safe.
pub(crate) struct Handle {
    pub text: HandleText,
    pub descriptor: OwnedFd,
    is_owed: bool,
}

/// Report on a process.
#[derive(Debug)]
pub(crate) enum WardReport {
    Lost(Loss),
    MadeSafe(Loss),
    GoesOn(u64),
}

impl Ward {
    pub fn new(text: WardText, process: OwnedFd, heartbeat: Option<Heartbeat>, now_ns: i64) -> Ward {
        let pulse = heartbeat.as_ref().zip(text.bounds).map(|(heartbeat, bounds)| Pulse::new(bounds, heartbeat.count(), now_ns));
        let watch = Watch::new(pulse, text.is_spared);
        let stops = Stops::of(process.as_fd());
        let pid = pid_of(process.as_fd()).ok();
        let mut parts = Parts { process, heartbeat, handles: Vec::new(), stops, pid, canary: Canary::default(), has_ended: false, failed: Vec::new() };
        parts.look_for_canary();
        Ward { text, parts, watch, loss: None }
    }

    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// Adds a handle; writes it immediately if the outputs of the process are safe already.
    pub fn add(&mut self, text: HandleText, descriptor: OwnedFd) {
        self.parts.handles.push(Handle { text, descriptor, is_owed: true });
        self.watch.added(&mut self.parts);
    }

    pub fn release(&mut self, device: &str) {
        self.parts.handles.retain(|handle| handle.text.device != device);
    }

    /// Returns true if neither the exit of the process nor a write is pending.
    pub fn is_settled(&self) -> bool {
        self.watch.is_settled()
    }

    /// Returns the loss of the process, if it is lost.
    pub fn loss(&self) -> Option<&Loss> {
        self.loss.as_ref()
    }

    /// Returns the descriptors to wait on: those of the process's canary and of the process itself, which become readable when the canary
    /// or the process exits. Empty once the process has exited.
    pub fn waits_for(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        let process = (!self.watch.is_over()).then(|| self.parts.process.as_fd());
        let canary = if self.loss.is_none() { self.parts.canary.waits_for() } else { None };
        process.into_iter().chain(canary)
    }

    /// Returns the time until the next check if no event occurs; `None` if no check is needed.
    pub fn interval_ns(&self) -> Option<i64> {
        self.watch.interval_ns()
    }

    /// Checks the process. When it returns a report, the outputs are safe. `leads`: false for a watcher that runs alongside a serving
    /// guard.
    pub fn look(&mut self, leads: bool, now_ns: i64) -> Option<WardReport> {
        self.parts.look_for_canary();
        let event = if leads { self.watch.look(&mut self.parts, now_ns) } else { self.watch.look_beside(&mut self.parts, now_ns) };
        match event? {
            Event::Lost { cause, seen_ns } => {
                let loss = self.told(cause, seen_ns);
                self.loss = Some(loss.clone());
                Some(WardReport::Lost(loss))
            }
            Event::MadeSafe { cause, seen_ns } => Some(WardReport::MadeSafe(self.told(cause, seen_ns))),
            Event::GoesOn => Some(WardReport::GoesOn(self.text.ward)),
        }
    }

    fn told(&self, cause: Cause, seen_ns: i64) -> Loss {
        let failed = self.parts.failed.clone();
        let written = self.parts.handles.len() - failed.len();
        Loss { ward: self.text.ward, name: self.text.name.clone(), cause, seen_ns, safe_ns: process_kit::now_ns(), written, failed }
    }
}

impl Parts {
    fn look_for_canary(&mut self) {
        if let Some(heart) = self.heartbeat.as_ref().filter(|_| !self.has_ended) {
            self.canary.look(heart, self.pid);
        }
    }
}

impl Subject for Parts {
    fn notice_end(&mut self) -> bool {
        self.has_ended = self.has_ended || has_ended(self.process.as_fd());
        self.has_ended
    }

    fn notice_dying(&mut self) -> bool {
        self.heartbeat.as_ref().is_some_and(|heart| self.canary.notice_dying(heart))
    }

    fn beats(&self) -> u64 {
        self.heartbeat.as_ref().map_or(0, Heartbeat::count)
    }

    fn is_stopped(&self) -> bool {
        self.stops.now()
    }

    fn latches(&self) -> bool {
        self.handles.iter().all(|handle| handle.text.latches)
    }

    fn kill(&mut self) {
        signal(self.process.as_fd(), libc::SIGKILL);
    }

    fn condemn(&mut self, why: Cause) {
        if let Some(heart) = &self.heartbeat {
            heart.end_for(match why {
                Cause::Died => 0,
                Cause::Frozen => FROZEN,
                Cause::Stopped => STOPPED,
            });
        }
    }

    fn condemned(&self) -> Option<Cause> {
        match self.heartbeat.as_ref()?.ended_for() {
            FROZEN => Some(Cause::Frozen),
            STOPPED => Some(Cause::Stopped),
            _ => None,
        }
    }

    fn write(&mut self, afresh: bool) -> bool {
        self.failed.clear();
        for handle in &mut self.handles {
            handle.is_owed |= afresh;
            if !handle.is_owed {
                continue;
            }
            match handle.write() {
                Ok(()) => handle.is_owed = false,
                Err(error) => self.failed.push(format!("device '{}': {error}", handle.text.device)),
            }
        }
        self.failed.is_empty()
    }
}

impl Handle {
    /// Carries out all writes of the handle, in order. Never blocks.
    fn write(&self) -> io::Result<()> {
        safe::write(self.descriptor.as_fd(), &self.text.writes)
    }
}
