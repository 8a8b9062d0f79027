// SPDX-License-Identifier: Apache-2.0
//! The guard process: waits for processes to exit or stall, and makes their outputs safe.
//!
//! It has one thread and one loop. In each round it beats its own heart, then checks every guarded process, and only then processes
//! messages; nothing in a round blocks, neither on a write to a device nor on a supervisor that does not read. It continues to guard
//! after its supervisor has exited, and exits when it guards no process and no supervisor is connected.
use crate::messages::{Ask, GuardRequest, Tell, encode};
use crate::rights;
use crate::ward::WardReport;
use crate::wards::Wards;
use interconnect::LinkClosed;
use process_kit::{Heartbeat, Listener, UnixLink, has_ended, inherited, now_ns, process_descriptor};
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Environment variable with the path at which a returning supervisor finds the guard.
pub(crate) const PATH: &str = "OPENGPAC_GUARD_PATH";
/// Environment variable that marks a guard as a stand-in for another one.
pub(crate) const STANDS_IN: &str = "OPENGPAC_GUARD_STANDS_IN";
/// Name of the descriptor of the link to the first supervisor.
pub(crate) const LINK: &str = "link";
/// Names of the descriptors of the heartbeats: the guard's own, and its supervisor's.
pub(crate) const HEART: &str = "heart";
pub(crate) const SUPERVISOR: &str = "supervisor";
/// Period of the guard's own heartbeat.
pub(crate) const BEAT_NS: i64 = 20_000_000;
/// Maximum number of frames from one supervisor that are processed in a round.
const FRAMES_MAX: usize = 64;

/// Runs the guard process with the link and the path that [`Guard::start`](crate::Guard::start) passed. Returns when no process is
/// guarded and no supervisor is connected.
///
/// # Errors
/// Fails with a human-readable message if the process was not started by a supervisor, or another guard listens at that path.
pub fn run() -> Result<(), String> {
    let descriptor = inherited(LINK).map_err(|error| error.to_string())?;
    let link = UnixLink::from_descriptor(descriptor).map_err(|error| format!("the link of the guard cannot be used: {error}"))?;
    let heart = |name: &str| inherited(name).map_err(|error| error.to_string()).and_then(|heart| Heartbeat::received(heart).map_err(|error| error.to_string()));
    let hearts = Hearts { guard: heart(HEART)?, supervisor: heart(SUPERVISOR)? };
    let path = std::env::var_os(PATH);
    let leads = std::env::var_os(STANDS_IN).is_none();
    serve(link, hearts, path.as_deref().map(Path::new), leads).map_err(|error| format!("the guard cannot serve: {error}"))
}

/// Guards on behalf of every supervisor that is connected by `link` or connects to `path`. The guard beats and listens at the path if it
/// `leads`, when it is asked to lead, or when its supervisor has exited. Takes over the process: scheduling, signals, memory.
///
/// # Errors
/// Fails with `AddrInUse` if another guard listens at `path`, otherwise with the error of the operating system.
pub fn serve(link: UnixLink, hearts: Hearts, path: Option<&Path>, leads: bool) -> io::Result<()> {
    let path = path.map(Path::to_owned);
    let listener = path.as_deref().filter(|_| leads).map(Listener::listen).transpose()?;
    let mut guarding = Guarding { hearts, leads, path, listener, links: Vec::new(), wards: Wards::default(), waits: Vec::new(), missing: rights::take() };
    guarding.welcome(link);
    while guarding.has_reason() {
        guarding.beat();
        guarding.wait();
        guarding.look();
        guarding.accept();
        guarding.hear();
    }
    Ok(())
}

/// Heartbeats of both watchers, by which each detects that the other has stalled.
#[derive(Debug)]
pub struct Hearts {
    /// Heartbeat of the guard.
    pub guard: Heartbeat,
    /// Heartbeat of the guard's supervisor.
    pub supervisor: Heartbeat,
}

impl Hearts {
    /// Returns descriptors of both heartbeats, in this order.
    ///
    /// # Errors
    /// Fails if no descriptors are left.
    pub fn descriptors(&self) -> io::Result<[OwnedFd; 2]> {
        Ok([self.guard.descriptor()?, self.supervisor.descriptor()?])
    }
}

/// A supervisor connected to this guard.
struct Supervisor {
    link: UnixLink,
    /// The supervisor's process, if known. It is needed because a process forked by the supervisor may keep the link open after the
    /// supervisor has exited.
    process: Option<OwnedFd>,
}

impl Supervisor {
    fn of(link: UnixLink) -> Supervisor {
        let process = link.peer().ok().filter(|(_, pid)| *pid > 0).and_then(|(_, pid)| process_descriptor(pid).ok());
        Supervisor { link, process }
    }

    fn has_ended(&self) -> bool {
        self.process.as_ref().is_some_and(|process| has_ended(process.as_fd()))
    }
}

struct Guarding {
    hearts: Hearts,
    /// False while this guard stands in for another one, which owns the heart and the path.
    leads: bool,
    path: Option<PathBuf>,
    listener: Option<Listener>,
    links: Vec<Supervisor>,
    wards: Wards,
    /// Polled descriptors: first those of the wards, in their order, then the links, then the listener. The capacity is reused.
    waits: Vec<libc::pollfd>,
    missing: Vec<String>,
}

impl Guarding {
    fn has_reason(&self) -> bool {
        !self.links.is_empty() || self.wards.has_reason()
    }

    fn beat(&mut self) {
        if self.links.is_empty() && !self.leads {
            // No supervisor is left to request it. If another guard listens at the path, clients find that one.
            let _listens = self.lead();
        }
        if self.leads {
            self.hearts.guard.beat();
        }
    }

    /// Takes over the heart and the path of the guard for which this one stood in.
    fn lead(&mut self) -> Result<(), String> {
        self.leads = true;
        if let (None, Some(path)) = (&self.listener, &self.path) {
            self.listener = Some(Listener::listen(path).map_err(|error| format!("the guard cannot listen at '{}': {error}", path.display()))?);
        }
        Ok(())
    }

    fn wait(&mut self) {
        let wait = |descriptor: BorrowedFd<'_>| libc::pollfd { fd: descriptor.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        self.waits.clear();
        self.waits.extend(self.wards.waits().map(wait));
        self.waits.extend(self.links.iter().map(|of| wait(of.link.as_fd())));
        self.waits.extend(self.listener.iter().map(|listener| wait(listener.as_fd())));
        let limit_ns = self.wards.interval_ns().map_or(BEAT_NS, |ns| ns.min(BEAT_NS));
        let limit = libc::timespec { tv_sec: 0, tv_nsec: limit_ns };
        // Ready descriptors are checked again, one by one; an interrupted wait is an extra round. SAFETY: the list has the length given;
        // the limit lives until the call returns.
        unsafe { libc::ppoll(self.waits.as_mut_ptr(), self.waits.len() as libc::nfds_t, &limit, std::ptr::null()) };
    }

    /// Checks every ward; the outputs of a lost ward are made safe before any supervisor is notified.
    fn look(&mut self) {
        for seen in self.wards.look(true, now_ns()) {
            let frame = encode(&match seen {
                WardReport::Lost(loss) => Tell::Lost(loss),
                WardReport::MadeSafe(loss) => Tell::MadeSafe(loss),
                WardReport::GoesOn(ward) => Tell::GoesOn { ward },
            });
            self.tell_everyone(&frame);
        }
    }

    /// Notifies all supervisors. The link of a supervisor that has exited is kept until its earlier messages have been processed.
    fn tell_everyone(&self, frame: &[u8]) {
        self.links.iter().for_each(|of| tell(&of.link, frame, &[]));
    }

    fn accept(&mut self) {
        let Some(listener) = &self.listener else { return };
        // A link that cannot be accepted now remains pending until the next round.
        if let Ok(Some(link)) = listener.accept() {
            self.welcome(link);
        }
    }

    /// Welcomes a supervisor. The supervisor may already have exited after sending its registrations, which are still processed.
    fn welcome(&mut self, link: UnixLink) {
        tell(&link, &encode(&Tell::Hello { missing: self.missing.clone() }), &[]);
        self.links.push(Supervisor::of(link));
    }

    /// Processes the messages of every supervisor, including those that a supervisor sent before it exited.
    fn hear(&mut self) {
        let mut links = std::mem::take(&mut self.links);
        links.retain(|of| self.hear_one(of));
        self.links = links;
    }

    /// Processes the messages of one supervisor. Returns false if the link is broken or the supervisor has exited, and all messages on
    /// the link have been processed.
    fn hear_one(&mut self, of: &Supervisor) -> bool {
        // Checked first: messages sent before it ended are processed below.
        let has_ended = of.has_ended();
        let link = &of.link;
        for _ in 0..FRAMES_MAX {
            let (frame, descriptors) = match link.receive_with(Duration::ZERO) {
                Ok(Some(frame)) => frame,
                Ok(None) => return !has_ended,
                Err(LinkClosed) => return false,
            };
            let Ok(GuardRequest { request, ask }) = serde_json::from_slice(&frame) else { return false };
            let answer = match self.act(ask, descriptors, link) {
                Ok(()) => Tell::Done { request },
                Err(problem) => Tell::Refused { request, problem },
            };
            tell(link, &encode(&answer), &[]);
        }
        true
    }

    fn act(&mut self, ask: Ask, descriptors: Vec<OwnedFd>, link: &UnixLink) -> Result<(), String> {
        match ask {
            Ask::Adopt => self.tell_all(link),
            Ask::Lead => self.lead(),
            _ => self.wards.act(ask, descriptors),
        }
    }

    /// Sends all registrations, with descriptors.
    fn tell_all(&self, link: &UnixLink) -> Result<(), String> {
        let hearts = self.hearts.descriptors().map_err(|error| error.to_string())?;
        tell(link, &encode(&Tell::Hearts), &[hearts[0].as_fd(), hearts[1].as_fd()]);
        for ward in self.wards.iter() {
            let parts = ward.parts();
            let heartbeat = parts.heartbeat.as_ref().map(Heartbeat::descriptor).transpose().map_err(|error| error.to_string())?;
            let descriptors: Vec<BorrowedFd<'_>> = [parts.process.as_fd()].into_iter().chain(heartbeat.as_ref().map(AsFd::as_fd)).collect();
            tell(link, &encode(&Tell::Ward(ward.text.clone())), &descriptors);
            for handle in &parts.handles {
                tell(link, &encode(&Tell::Handle(handle.text.clone())), &[handle.descriptor.as_fd()]);
            }
            if let Some(loss) = ward.loss() {
                tell(link, &encode(&Tell::Lost(loss.clone())), &[]);
            }
        }
        Ok(())
    }
}

/// Sends a message. Closes a link that is broken, or whose supervisor does not read; [`Guarding::hear`] processes its pending messages
/// and drops it.
fn tell(link: &UnixLink, frame: &[u8], descriptors: &[BorrowedFd<'_>]) {
    let _closed = link.send_with(frame, descriptors, Some(Duration::ZERO));
}
