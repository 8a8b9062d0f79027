// SPDX-License-Identifier: Apache-2.0
//! The guard process: it waits for processes to end or stop answering, and makes their outputs safe.
//!
//! One thread, one loop. In each round it first looks at every process that it guards, and only then hears who talks to it; nothing
//! in a round waits: neither a write to a device nor a supervisor that does not read. It guards on when its supervisor is gone, and ends
//! when nothing is left to guard and nobody is connected.
use crate::heartbeat::{Heartbeat, Pulse};
use crate::ward::Ward;
use crate::wire::{Ask, Asked, Tell, encode};
use crate::{Listener, UnixLink, inherited, now_ns, rights};
use interconnect::Closed;
use std::collections::VecDeque;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::path::Path;
use std::time::Duration;

/// The environment variable with the path where a supervisor that comes back finds the guard.
pub(crate) const PATH: &str = "OPENGPAC_GUARD_PATH";
/// The name of the descriptor of the first link.
pub(crate) const LINK: &str = "link";
/// Frames of one supervisor that are heard in a round.
const FRAMES_MAX: usize = 64;

/// What the guard process runs: it takes its link and its path from where [`Guard::start`](crate::Guard::start) left them. Returns when nothing is
/// left to guard and nobody is connected.
///
/// # Errors
/// For people: it was not started by a supervisor, or another guard is at that path.
pub fn run() -> Result<(), String> {
    let descriptor = inherited(LINK).map_err(|error| error.to_string())?;
    let link = UnixLink::from_descriptor(descriptor).map_err(|error| format!("the link of the guard cannot be used: {error}"))?;
    let path = std::env::var_os(PATH);
    serve(link, path.as_deref().map(Path::new)).map_err(|error| format!("the guard cannot serve: {error}"))
}

/// Guards for whoever talks over `link`, or connects to `path`. Takes over the process: scheduling, signals, memory.
///
/// # Errors
/// `AddrInUse` where another guard listens at `path`; else what the operating system refuses.
pub fn serve(link: UnixLink, path: Option<&Path>) -> io::Result<()> {
    let listener = path.map(Listener::listen).transpose()?;
    let mut guarding = Guarding { listener, links: Vec::new(), wards: Vec::new(), waits: Vec::new(), missing: rights::take() };
    guarding.welcome(link);
    while guarding.has_reason() {
        guarding.wait();
        guarding.look();
        guarding.accept();
        guarding.hear();
    }
    Ok(())
}

struct Guarding {
    listener: Option<Listener>,
    links: Vec<UnixLink>,
    wards: Vec<Ward>,
    /// What is waited for: the wards in their order, then the links, then the listener. Its room stays.
    waits: Vec<libc::pollfd>,
    missing: Vec<String>,
}

impl Guarding {
    fn has_reason(&self) -> bool {
        !self.links.is_empty() || self.wards.iter().any(|ward| !ward.is_settled())
    }

    fn wait(&mut self) {
        let wait = |descriptor: Option<BorrowedFd<'_>>| {
            // A negative number is passed over.
            libc::pollfd { fd: descriptor.map_or(-1, |descriptor| descriptor.as_raw_fd()), events: libc::POLLIN, revents: 0 }
        };
        self.waits.clear();
        self.waits.extend(self.wards.iter().map(|ward| wait(ward.waits_for())));
        self.waits.extend(self.links.iter().map(|link| wait(Some(link.as_fd()))));
        self.waits.extend(self.listener.iter().map(|listener| wait(Some(listener.as_fd()))));
        let limit_ns = self.wards.iter().filter_map(Ward::interval_ns).min();
        let limit = limit_ns.map(|ns| libc::timespec { tv_sec: ns / 1_000_000_000, tv_nsec: ns % 1_000_000_000 });
        let limit = limit.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
        // SAFETY: the list has the length given; the limit, where there is one, lives until the call returns.
        let ready = unsafe { libc::ppoll(self.waits.as_mut_ptr(), self.waits.len() as libc::nfds_t, limit, std::ptr::null()) };
        if ready < 0 {
            // Interrupted: nothing is known to be ready.
            self.waits.iter_mut().for_each(|wait| wait.revents = 0);
        }
    }

    /// Looks at every ward; what is lost is safe before anybody is told.
    fn look(&mut self) {
        let now_ns = now_ns();
        let mut lost = false;
        for (ward, wait) in self.wards.iter_mut().zip(&self.waits) {
            lost |= ward.look(wait.revents != 0, now_ns);
        }
        if lost {
            let fresh = |ward: &&Ward| ward.loss().is_some_and(|loss| loss.safe_ns >= now_ns);
            for loss in self.wards.iter().filter(fresh).filter_map(Ward::loss) {
                let frame = encode(&Tell::Lost(loss.clone()));
                self.links.retain(|link| tell(link, &frame, &[]));
            }
        }
    }

    fn accept(&mut self) {
        let Some(listener) = &self.listener else { return };
        // One that cannot be taken now is still there at the next round.
        if let Ok(Some(link)) = listener.accept() {
            self.welcome(link);
        }
    }

    fn welcome(&mut self, link: UnixLink) {
        let hello = encode(&Tell::Hello { missing: self.missing.clone() });
        if tell(&link, &hello, &[]) {
            self.links.push(link);
        }
    }

    /// Hears every supervisor. What one said before it was gone counts.
    fn hear(&mut self) {
        let mut links = std::mem::take(&mut self.links);
        links.retain(|link| self.hear_one(link));
        self.links = links;
    }

    /// False when the link is gone, and everything that came over it has been heard.
    fn hear_one(&mut self, link: &UnixLink) -> bool {
        for _ in 0..FRAMES_MAX {
            let (frame, descriptors) = match link.receive_with(Duration::ZERO) {
                Ok(Some(frame)) => frame,
                Ok(None) => return true,
                Err(Closed) => return false,
            };
            let Ok(Asked { request, ask }) = serde_json::from_slice(&frame) else { return false };
            let answer = match self.act(ask, descriptors.into(), link) {
                Ok(()) => Tell::Done { request },
                Err(problem) => Tell::Refused { request, problem },
            };
            tell(link, &encode(&answer), &[]);
        }
        true
    }

    fn act(&mut self, ask: Ask, mut descriptors: VecDeque<OwnedFd>, link: &UnixLink) -> Result<(), String> {
        let mut next = |what: &str| descriptors.pop_front().ok_or_else(|| format!("{what} did not come along"));
        match ask {
            Ask::Ward(text) => {
                let process = next("the process")?;
                let heartbeat = text.bound_ns.map(|_| next("the heartbeat")).transpose()?;
                if self.wards.iter().any(|ward| ward.text.ward == text.ward) {
                    return Err(format!("process {} is guarded already", text.ward));
                }
                let heartbeat = heartbeat.map(Heartbeat::received).transpose().map_err(|error| error.to_string())?;
                let pulse = heartbeat.zip(text.bound_ns).map(|(heartbeat, bound_ns)| Pulse::new(heartbeat, bound_ns, now_ns()));
                self.wards.push(Ward::new(text, process, pulse));
            }
            Ask::Handle(text) => {
                let descriptor = next("the descriptor of the handle")?;
                self.ward(text.ward)?.add(text, descriptor);
            }
            Ask::Release { ward, device } => self.ward(ward)?.handles.retain(|handle| handle.text.device != device),
            Ask::Forget { ward } => self.wards.retain(|one| one.text.ward != ward),
            Ask::Adopt => self.tell_all(link)?,
        }
        Ok(())
    }

    fn ward(&mut self, ward: u64) -> Result<&mut Ward, String> {
        self.wards.iter_mut().find(|one| one.text.ward == ward).ok_or_else(|| format!("no process {ward} is guarded"))
    }

    /// Tells everything that is guarded, with descriptors.
    fn tell_all(&self, link: &UnixLink) -> Result<(), String> {
        for ward in &self.wards {
            let heartbeat = ward.pulse.as_ref().map(|pulse| pulse.heartbeat().descriptor()).transpose().map_err(|error| error.to_string())?;
            let text = crate::wire::WardText { bound_ns: ward.pulse.as_ref().map(Pulse::bound_ns), ..ward.text.clone() };
            let descriptors: Vec<BorrowedFd<'_>> = [ward.process.as_fd()].into_iter().chain(heartbeat.as_ref().map(AsFd::as_fd)).collect();
            tell(link, &encode(&Tell::Ward(text)), &descriptors);
            for handle in &ward.handles {
                let text = crate::wire::HandleText { ward: handle.text.ward, device: handle.text.device.clone(), writes: handle.text.writes.clone() };
                tell(link, &encode(&Tell::Handle(text)), &[handle.descriptor.as_fd()]);
            }
            if let Some(loss) = ward.loss() {
                tell(link, &encode(&Tell::Lost(loss.clone())), &[]);
            }
        }
        Ok(())
    }
}

/// False when the link is gone, or whoever is behind it does not read: then it is closed.
fn tell(link: &UnixLink, frame: &[u8], descriptors: &[BorrowedFd<'_>]) -> bool {
    link.send_with(frame, descriptors, Some(Duration::ZERO)).is_ok()
}
