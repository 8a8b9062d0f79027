// SPDX-License-Identifier: Apache-2.0
//! A process that is guarded: how its loss is seen, and what makes its outputs safe.
//!
//! The order is what matters: a process that only stopped answering is killed first, and written for only when it has ended, so that it can
//! never come back and write over a safe value.
use crate::child::signal;
use crate::heartbeat::Pulse;
use crate::wire::{Cause, HandleText, Loss, WardText};
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};

/// How long a killed process may take to end before its outputs are made safe all the same (and again when it has ended).
const DEATH_NS_MAX: i64 = 100_000_000;
/// How long writes that failed are tried again, and how often.
const RETRY_NS_MAX: i64 = 10_000_000_000;
const RETRY_NS: i64 = 10_000_000;

/// A guarded process.
pub(crate) struct Ward {
    pub text: WardText,
    pub process: OwnedFd,
    pub pulse: Option<Pulse>,
    pub handles: Vec<Handle>,
    state: State,
}

/// Where to write what makes outputs safe.
pub(crate) struct Handle {
    pub text: HandleText,
    pub descriptor: OwnedFd,
    is_owed: bool,
}

enum State {
    Guarded,
    /// It stopped answering, was killed, and has not ended yet.
    Killed {
        seen_ns: i64,
    },
    /// Latched. `is_over`: it has ended, which a killed one may not have at first.
    Lost {
        loss: Loss,
        is_over: bool,
    },
}

impl Ward {
    pub fn new(text: WardText, process: OwnedFd, pulse: Option<Pulse>) -> Ward {
        Ward { text, process, pulse, handles: Vec::new(), state: State::Guarded }
    }

    /// Adds a handle; of a process that is lost already it is written to at once.
    pub fn add(&mut self, text: HandleText, descriptor: OwnedFd) {
        self.handles.push(Handle { text, descriptor, is_owed: true });
        if let State::Lost { .. } = self.state {
            self.write_owed();
        }
    }

    /// Whether anything of it has to be waited for: its end, or writes that failed.
    pub fn is_settled(&self) -> bool {
        matches!(self.state, State::Lost { is_over: true, .. }) && !self.handles.iter().any(|handle| handle.is_owed)
    }

    /// Its loss, if it is lost.
    pub fn loss(&self) -> Option<&Loss> {
        match &self.state {
            State::Lost { loss, .. } => Some(loss),
            _ => None,
        }
    }

    /// What to wait for: the end of the process. None when that has come.
    pub fn waits_for(&self) -> Option<BorrowedFd<'_>> {
        match self.state {
            State::Lost { is_over: true, .. } => None,
            _ => Some(self.process.as_fd()),
        }
    }

    /// When to look again though nothing comes; none: never.
    pub fn interval_ns(&self) -> Option<i64> {
        match &self.state {
            State::Guarded => self.pulse.as_ref().map(Pulse::interval_ns),
            State::Killed { .. } => Some(RETRY_NS),
            State::Lost { .. } => (!self.is_settled()).then_some(RETRY_NS),
        }
    }

    /// Looks at it. `has_ended`: the process has. True when it was lost at this look, and its outputs are safe.
    pub fn look(&mut self, has_ended: bool, now_ns: i64) -> bool {
        match &mut self.state {
            State::Guarded if has_ended => self.lose(Cause::Died, now_ns, true),
            State::Guarded => {
                if self.pulse.as_mut().is_some_and(|pulse| pulse.is_frozen(now_ns)) {
                    signal(self.process.as_fd(), libc::SIGKILL);
                    self.state = State::Killed { seen_ns: now_ns };
                }
                false
            }
            State::Killed { seen_ns } => {
                let seen_ns = *seen_ns;
                let is_late = now_ns - seen_ns > DEATH_NS_MAX;
                (has_ended || is_late) && self.lose(Cause::Frozen, seen_ns, has_ended)
            }
            State::Lost { loss, is_over } => {
                if has_ended && !*is_over {
                    *is_over = true;
                    self.handles.iter_mut().for_each(|handle| handle.is_owed = true);
                } else if now_ns - loss.safe_ns > RETRY_NS_MAX {
                    *is_over = true;
                    self.handles.iter_mut().for_each(|handle| handle.is_owed = false);
                }
                self.write_owed();
                false
            }
        }
    }

    fn lose(&mut self, cause: Cause, seen_ns: i64, is_over: bool) -> bool {
        let failed = self.write_owed();
        let written = self.handles.len() - failed.len();
        let loss = Loss { ward: self.text.ward, name: self.text.name.clone(), cause, seen_ns, safe_ns: crate::now_ns(), written, failed };
        self.state = State::Lost { loss, is_over };
        true
    }

    /// Writes what has not been written yet; what failed, in words.
    fn write_owed(&mut self) -> Vec<String> {
        let mut failed = Vec::new();
        for handle in self.handles.iter_mut().filter(|handle| handle.is_owed) {
            match handle.write() {
                Ok(()) => handle.is_owed = false,
                Err(error) => failed.push(format!("device '{}': {error}", handle.text.device)),
            }
        }
        failed
    }
}

impl Handle {
    /// All its writes, in order. Never waits.
    fn write(&self) -> io::Result<()> {
        self.text.writes.iter().try_for_each(|(offset, bytes)| write_at(self.descriptor.as_fd(), *offset, bytes))
    }
}

/// Writes all of `bytes` at `offset`, or just writes them where the descriptor has no positions.
fn write_at(descriptor: BorrowedFd<'_>, mut offset: u64, mut bytes: &[u8]) -> io::Result<()> {
    let number = descriptor.as_raw_fd();
    while !bytes.is_empty() {
        let mut poll = libc::pollfd { fd: number, events: libc::POLLOUT, revents: 0 };
        // SAFETY: one entry of our own; no time to wait.
        if unsafe { libc::poll(&mut poll, 1, 0) } == 0 {
            return Err(io::Error::new(io::ErrorKind::WouldBlock, "there is no room to write"));
        }
        let at = libc::off_t::try_from(offset).map_err(|_| io::Error::from(io::ErrorKind::InvalidInput))?;
        // SAFETY: writes bytes that are there.
        let mut written = unsafe { libc::pwrite(number, bytes.as_ptr().cast(), bytes.len(), at) };
        if written < 0 && io::Error::last_os_error().raw_os_error() == Some(libc::ESPIPE) {
            // SAFETY: as above.
            written = unsafe { libc::write(number, bytes.as_ptr().cast(), bytes.len()) };
        }
        match usize::try_from(written) {
            Ok(0) => return Err(io::Error::from(io::ErrorKind::WriteZero)),
            Ok(written) => {
                offset += written as u64;
                bytes = &bytes[written..];
            }
            Err(_) => match io::Error::last_os_error() {
                error if error.kind() == io::ErrorKind::Interrupted => {}
                error => return Err(error),
            },
        }
    }
    Ok(())
}
