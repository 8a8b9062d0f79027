// SPDX-License-Identifier: Apache-2.0
//! Door of a processor's process, through which a new supervisor enters.
use crate::adopting::{ANSWER, AdoptionAnswer, Enter, Knock, heard, next, place, say};
use crate::{BLACK_BOX_SOURCES, text};
use guard::canary::{self, Canary};
use guard::watch::Watchers;
use interconnect::Ends;
use kernel::BLACK_BOX_LEN;
use process_kit::{Heartbeat, Listener, UnixLink, now_ns, this_process};
use rtp::{AdmittedSupervisor, BlackBox, Caller, Door, Reaches};
use shared_memory::SharedMemory;
use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// Timeout for the first message of a process that has connected.
const KNOCK: Duration = Duration::from_secs(1);

/// Watchers of this process.
pub(crate) struct ProcessWatchers {
    guard: Heartbeat,
    supervisor: Heartbeat,
    watchers: Option<(Duration, Watchers)>,
    /// Canary whose exit indicates that the supervisor is dying.
    canary: Canary,
}

impl ProcessWatchers {
    /// Creates the watchers from these heartbeats of the guard and the supervisor. Fails if the descriptors are not heartbeats.
    pub fn by(guard: OwnedFd, supervisor: OwnedFd) -> Result<ProcessWatchers, String> {
        let heart = |descriptor| Heartbeat::received(descriptor).map_err(text);
        Ok(ProcessWatchers { guard: heart(guard)?, supervisor: heart(supervisor)?, watchers: None, canary: Canary::default() })
    }

    fn canary(&mut self) -> Option<Arc<OwnedFd>> {
        self.canary.look(&self.supervisor, None);
        self.canary.thread()
    }

    fn notice_dying(&mut self) -> bool {
        self.canary.notice_dying(&self.supervisor)
    }

    fn look(&mut self, patience: Duration) -> bool {
        let now_ns = now_ns();
        let (_, watchers) = match &mut self.watchers {
            Some(known) if known.0 == patience => known,
            other => other.insert((patience, Watchers::new(patience, now_ns))),
        };
        watchers.look(self.guard.count(), self.supervisor.count(), now_ns)
    }
}

/// State that a process keeps when its commander changes.
pub(crate) struct Belongings {
    pub system: String,
    /// Name of the process.
    pub processor: String,
    pub heart: Arc<Heartbeat>,
    handles: Mutex<UnixLink>,
    watched: Mutex<ProcessWatchers>,
    guard: Mutex<Option<PathBuf>>,
}

impl Belongings {
    pub fn new(
        (system, processor): (String, String),
        heart: Arc<Heartbeat>,
        watched: ProcessWatchers,
        handles: UnixLink,
        guard: Option<PathBuf>,
    ) -> Arc<Belongings> {
        Arc::new(Belongings { system, processor, heart, handles: Mutex::new(handles), watched: Mutex::new(watched), guard: Mutex::new(guard) })
    }

    /// Switches to other watchers.
    fn watched_by(&self, guard: OwnedFd, supervisor: OwnedFd) -> Result<(), String> {
        *self.watched.lock().expect("nobody panics with the lock held") = ProcessWatchers::by(guard, supervisor)?;
        Ok(())
    }

    /// Beats, or records the timer that keeps the heart from beating.
    pub fn beat(&self, stuck: Option<usize>) {
        self.heart.hold_up(stuck);
        if stuck.is_none() {
            self.heart.beat();
        }
    }

    /// Sleeps for `span`, or until the supervisor is dying; in the latter case returns true, once.
    pub fn rests(&self, span: Duration) -> bool {
        let locked = || self.watched.lock().expect("nobody panics with the lock held");
        let thread = locked().canary();
        match thread {
            None => std::thread::sleep(span),
            Some(thread) => canary::wait(&thread, span),
        }
        locked().notice_dying()
    }

    /// Returns true if both watchers have been stalled for longer than `patience`.
    pub fn is_unwatched(&self, patience: Duration) -> bool {
        self.watched.lock().expect("nobody panics with the lock held").look(patience)
    }

    /// Returns the link for safe handles to the current commander.
    pub fn handles(&self) -> MutexGuard<'_, UnixLink> {
        self.handles.lock().expect("nobody panics with the lock held")
    }
}

/// Socket at which new supervisors connect.
pub(crate) struct SocketDoor {
    listener: Listener,
    belongings: Arc<Belongings>,
}

impl SocketDoor {
    /// Opens the socket; returns `None` if this user has no folder for it, so that the process cannot be taken over.
    pub fn open(belongings: &Arc<Belongings>) -> Option<Box<dyn Door>> {
        let path = place(&belongings.system, &belongings.processor, std::process::id())?;
        match Listener::listen(&path) {
            Ok(listener) => Some(Box::new(SocketDoor { listener, belongings: belongings.clone() })),
            Err(why) => {
                eprintln!("process '{}' cannot be taken over by a new supervisor: it cannot listen at '{}': {why}", belongings.processor, path.display());
                None
            }
        }
    }
}

impl Door for SocketDoor {
    fn wait(&mut self, limit: Duration) -> Option<Box<dyn Caller>> {
        if !self.listener.wait(limit) {
            return None;
        }
        let link = self.listener.accept().ok()??;
        let (frame, _) = next(&link, KNOCK).ok()?;
        let belongings = self.belongings.clone();
        match heard::<Knock>(&frame) {
            Ok(knock) if knock.means(&belongings.system, &belongings.processor) => Some(Box::new(Visitor { link, belongings })),
            _ => {
                // If the other end misses this, it still sees the link closed.
                let _said = say(&link, &AdoptionAnswer::Other, &[]);
                None
            }
        }
    }
}

struct Visitor {
    link: UnixLink,
    belongings: Arc<Belongings>,
}

impl Caller for Visitor {
    fn refuse(self: Box<Self>, why: &str) {
        // A supervisor that has disconnected needs no reason.
        let _said = say(&self.link, &AdoptionAnswer::Refused { why: why.to_owned() }, &[]);
    }

    fn admit(self: Box<Self>) -> Result<AdmittedSupervisor, String> {
        let Visitor { link, belongings } = *self;
        let guard = belongings.guard.lock().expect("nobody panics with the lock held").clone();
        let (process, heart) = (this_process().map_err(text)?, belongings.heart.descriptor().map_err(text)?);
        say(&link, &AdoptionAnswer::Come { guard }, &[&process, &heart])?;
        let (frame, descriptors) = next(&link, ANSWER)?;
        let Enter { run, guard, is_unguarded } = heard(&frame)?;
        let [handles, black_box, guards, supervises] =
            <[OwnedFd; 4]>::try_from(descriptors).map_err(|_| "the new supervisor sent too few descriptors".to_owned())?;
        let shared = SharedMemory::new(&belongings.system, run).map_err(text)?;
        let black_box = black_box_of(black_box)?;
        belongings.watched_by(guards, supervises)?;
        *belongings.handles() = UnixLink::from_descriptor(handles).map_err(text)?;
        *belongings.guard.lock().expect("nobody panics with the lock held") = guard;
        let reaches = Reaches { host: Some(Box::new(shared) as Box<dyn Ends>), network: None };
        Ok(AdmittedSupervisor { link: Arc::new(link), reaches, black_box: Some(black_box), is_unguarded })
    }
}

/// Maps the black box for the lifetime of the process, because sources write to it until the end.
pub(crate) fn black_box_of(descriptor: OwnedFd) -> Result<BlackBox, String> {
    let memory = Box::leak(Box::new(process_kit::SharedMemory::received(descriptor, BLACK_BOX_SOURCES * BLACK_BOX_LEN).map_err(text)?));
    Ok(BlackBox { memory: memory.start(), len: memory.len() })
}
