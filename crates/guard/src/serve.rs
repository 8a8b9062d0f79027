// SPDX-License-Identifier: Apache-2.0
//! The guard process: it waits for processes to end or stop answering, and makes their outputs safe.
//!
//! One thread, one loop. In each round its own heart beats, then it looks at every process that it guards, and only then hears who talks to it; nothing
//! in a round waits: neither a write to a device nor a supervisor that does not read. It guards on when its supervisor is gone, and ends
//! when nothing is left to guard and nobody is connected.
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

/// The environment variable with the path where a supervisor that comes back finds the guard.
pub(crate) const PATH: &str = "OPENGPAC_GUARD_PATH";
/// The environment variable of a guard that stands in for another one.
pub(crate) const STANDS_IN: &str = "OPENGPAC_GUARD_STANDS_IN";
/// The name of the descriptor of the first link.
pub(crate) const LINK: &str = "link";
/// The names of the descriptors of hearts: its own, that of its supervisor.
pub(crate) const HEART: &str = "heart";
pub(crate) const SUPERVISOR: &str = "supervisor";
/// Between two beats of its own heart.
pub(crate) const BEAT_NS: i64 = 20_000_000;
/// Frames of one supervisor that are heard in a round.
const FRAMES_MAX: usize = 64;

/// Runs the guard process: it takes its link and its path from where [`Guard::start`](crate::Guard::start) left them. Returns when nothing is
/// left to guard and nobody is connected.
///
/// # Errors
/// For people: it was not started by a supervisor, or another guard is at that path.
pub fn run() -> Result<(), String> {
    let descriptor = inherited(LINK).map_err(|error| error.to_string())?;
    let link = UnixLink::from_descriptor(descriptor).map_err(|error| format!("the link of the guard cannot be used: {error}"))?;
    let heart = |name: &str| inherited(name).map_err(|error| error.to_string()).and_then(|heart| Heartbeat::received(heart).map_err(|error| error.to_string()));
    let hearts = Hearts { guard: heart(HEART)?, supervisor: heart(SUPERVISOR)? };
    let path = std::env::var_os(PATH);
    let leads = std::env::var_os(STANDS_IN).is_none();
    serve(link, hearts, path.as_deref().map(Path::new), leads).map_err(|error| format!("the guard cannot serve: {error}"))
}

/// Guards for every supervisor that talks over `link`, or connects to `path`. It beats and listens at the path if it `leads`, or when it is asked
/// to lead, or when its supervisor is gone. Takes over the process: scheduling, signals, memory.
///
/// # Errors
/// `AddrInUse` where another guard listens at `path`; else what the operating system refuses.
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

/// The hearts of those who watch: each sees whether the other stands still.
#[derive(Debug)]
pub struct Hearts {
    /// Heart of the guard.
    pub guard: Heartbeat,
    /// Heart of its supervisor.
    pub supervisor: Heartbeat,
}

impl Hearts {
    /// Descriptors of both, in this order.
    ///
    /// # Errors
    /// No descriptors left.
    pub fn descriptors(&self) -> io::Result<[OwnedFd; 2]> {
        Ok([self.guard.descriptor()?, self.supervisor.descriptor()?])
    }
}

/// A supervisor that talks to this guard.
struct Supervisor {
    link: UnixLink,
    /// Its process, where that is known. A process that it forked keeps the link open when it is gone itself.
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
    /// It does not stand in for another one, whose heart and path these are.
    leads: bool,
    path: Option<PathBuf>,
    listener: Option<Listener>,
    links: Vec<Supervisor>,
    wards: Wards,
    /// Descriptors that are waited for: the wards in their order, then the links, then the listener. Its room stays.
    waits: Vec<libc::pollfd>,
    missing: Vec<String>,
}

impl Guarding {
    fn has_reason(&self) -> bool {
        !self.links.is_empty() || self.wards.has_reason()
    }

    fn beat(&mut self) {
        if self.links.is_empty() && !self.leads {
            // Nobody is left who would ask it to. Where another guard listens at the path, that one is found there.
            let _listens = self.lead();
        }
        if self.leads {
            self.hearts.guard.beat();
        }
    }

    /// Takes the heart and the path of the guard that it stood in for.
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
        // What is ready is asked again, one by one; a wait that was interrupted is a round more.
        // SAFETY: the list has the length given; the limit lives until the call returns.
        unsafe { libc::ppoll(self.waits.as_mut_ptr(), self.waits.len() as libc::nfds_t, &limit, std::ptr::null()) };
    }

    /// Looks at every ward; what is lost is safe before anybody is told.
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

    /// Tells everyone; a supervisor that is gone may have said something before: its link stays until that is heard.
    fn tell_everyone(&self, frame: &[u8]) {
        self.links.iter().for_each(|of| tell(&of.link, frame, &[]));
    }

    fn accept(&mut self) {
        let Some(listener) = &self.listener else { return };
        // One that cannot be taken now is still there at the next round.
        if let Ok(Some(link)) = listener.accept() {
            self.welcome(link);
        }
    }

    /// Its supervisor may be gone already, and have said what is to be guarded: that is heard all the same.
    fn welcome(&mut self, link: UnixLink) {
        tell(&link, &encode(&Tell::Hello { missing: self.missing.clone() }), &[]);
        self.links.push(Supervisor::of(link));
    }

    /// Hears every supervisor. What one said before it was gone counts.
    fn hear(&mut self) {
        let mut links = std::mem::take(&mut self.links);
        links.retain(|of| self.hear_one(of));
        self.links = links;
    }

    /// Returns false if the link or the supervisor is gone, and everything that came over the link has been heard.
    fn hear_one(&mut self, of: &Supervisor) -> bool {
        // Asked first: what it said before it ended is heard below.
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

    /// Tells everything that is guarded, with descriptors.
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

/// Sends a message. A link that is gone, or whose supervisor does not read, is closed: [`Guarding::hear`] hears the rest and drops it.
fn tell(link: &UnixLink, frame: &[u8], descriptors: &[BorrowedFd<'_>]) {
    let _closed = link.send_with(frame, descriptors, Some(Duration::ZERO));
}
