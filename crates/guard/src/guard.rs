// SPDX-License-Identifier: Apache-2.0
//! The supervisor's side of the guard: it starts the guard process, tells it what to guard, and starts another one with
//! everything that was registered when it is gone.
use crate::registry::{Registry, Ward};
use crate::serve::{LINK, PATH};
use crate::wire::{Ask, Asked, Loss, Tell, WardText, encode};
use crate::{Child, Heartbeat, Launch, Restarts, UnixLink, connect, now_ns};
use interconnect::{Closed, Link};
use kernel::SafeHandle;
use std::ffi::OsString;
use std::fmt;
use std::os::fd::{BorrowedFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How long the guard may take to answer.
const ANSWER: Duration = Duration::from_secs(10);
/// How often a guard that died may be started again.
const RESTARTS: (u32, Duration) = (20, Duration::from_secs(10));
/// How long a guard with nothing to guard may take to end.
const GRACE: Duration = Duration::from_secs(2);

/// How a guard process is started, and where it can be found.
#[derive(Clone, Debug)]
pub struct GuardCommand {
    /// A command line whose process calls [`guard::run`](crate::run).
    pub command: Vec<OsString>,
    /// Where a later supervisor finds it with [`Guard::adopt`]; none: nowhere.
    pub path: Option<PathBuf>,
}

/// What the guard has to say, in the order in which it happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum GuardEvent {
    /// A process is lost; its outputs are safe.
    Lost(Loss),
    /// What the operating system did not give the guard, one line each; once for each guard process that lacks something.
    Missing(Vec<String>),
    /// The guard was gone, how it ended, and another one guards now.
    Restarted(String),
    /// There is no guard any more, and why: processes that die from now on leave their outputs as they are.
    Gone(String),
}

/// The guard of one supervisor.
///
/// Calls wait for the guard's answer, some tens of microseconds; none is for a real-time thread, nor for the function that events are told to,
/// which must not drop it either.
/// When it is dropped, the guard goes on with the processes that have not been forgotten, and ends where there are none.
pub struct Guard {
    shared: Arc<Shared>,
    keeper: Option<JoinHandle<()>>,
}

struct Shared {
    command: GuardCommand,
    state: Mutex<State>,
    answered: Condvar,
    tell: Box<dyn Fn(GuardEvent) + Send + Sync>,
}

struct State {
    link: Arc<UnixLink>,
    /// The guard process; none where a predecessor of ours started it.
    child: Option<Child>,
    registry: Registry,
    next_request: u64,
    /// Requests that wait for an answer, and those that have one.
    requests: Vec<(u64, Option<Result<(), String>>)>,
    restarts: Restarts,
    /// Why there is no guard any more.
    gone: Option<String>,
    is_closing: bool,
}

/// A process that a guard of a predecessor guards.
#[derive(Debug)]
pub struct Found {
    /// The number it was registered with.
    pub ward: u64,
    /// Its name.
    pub name: String,
    /// The process.
    pub process: Child,
    /// Its devices that have safe handles.
    pub devices: Vec<String>,
    /// That it was lost, and when.
    pub loss: Option<Loss>,
}

impl Guard {
    /// Starts a guard process. `tell` is called from a thread of this value.
    ///
    /// # Errors
    /// [`GuardError`]: it cannot be started, or ended at once.
    pub fn start(command: GuardCommand, tell: impl Fn(GuardEvent) + Send + Sync + 'static) -> Result<Guard, GuardError> {
        let (link, child) = launch(&command)?;
        Ok(Guard::of(command, link, Some(child), Registry::default(), Box::new(tell)))
    }

    /// Takes over the guard that listens at the path of `command`, with everything that it guards, from a supervisor that is gone.
    ///
    /// # Errors
    /// [`GuardError`]: nobody listens there, or what answers is no guard.
    pub fn adopt(command: GuardCommand, tell: impl Fn(GuardEvent) + Send + Sync + 'static) -> Result<(Guard, Vec<Found>), GuardError> {
        let path = command.path.clone().ok_or_else(|| GuardError("a guard is adopted at a path, and none is given".to_owned()))?;
        let link = connect(&path).map_err(|error| GuardError(format!("no guard at '{}': {error}", path.display())))?;
        let (registry, missing) = tale(&link, &path)?;
        let found = registry.found().map_err(|error| GuardError(format!("cannot adopt what the guard at '{}' guards: {error}", path.display())))?;
        if !missing.is_empty() {
            tell(GuardEvent::Missing(missing));
        }
        Ok((Guard::of(command, link, None, registry, Box::new(tell)), found))
    }

    fn of(command: GuardCommand, link: UnixLink, child: Option<Child>, registry: Registry, tell: Box<dyn Fn(GuardEvent) + Send + Sync>) -> Guard {
        let state = State {
            link: Arc::new(link),
            child,
            registry,
            next_request: 1,
            requests: Vec::new(),
            restarts: Restarts::new(RESTARTS.0, RESTARTS.1),
            gone: None,
            is_closing: false,
        };
        let shared = Arc::new(Shared { command, state: Mutex::new(state), answered: Condvar::new(), tell });
        let keeps = shared.clone();
        let keeper = std::thread::spawn(move || keeps.keep());
        Guard { shared, keeper: Some(keeper) }
    }

    /// Guards a process from now on, under a number of the caller's. `heartbeat`: it counts as lost too when that stands still for the bound
    /// (500 ms is a good one, at least 10 ms), from its first beat on.
    ///
    /// # Errors
    /// [`GuardError`]: the number is in use, or the guard is gone.
    pub fn watch(&self, ward: u64, name: &str, process: OwnedFd, heartbeat: Option<(Heartbeat, Duration)>) -> Result<(), GuardError> {
        let bound_ns = heartbeat.as_ref().map(|(_, bound)| i64::try_from(bound.as_nanos()).unwrap_or(i64::MAX));
        let text = WardText { ward, name: name.to_owned(), bound_ns };
        self.shared.request(|registry| registry.add(Ward::new(text, process, heartbeat.map(|(heartbeat, _)| heartbeat))))
    }

    /// What makes the outputs of a device of that process safe; instead of what was registered for that device.
    ///
    /// # Errors
    /// [`GuardError`]: there is no such process, or the guard is gone.
    pub fn hold(&self, ward: u64, device: &str, handles: Vec<SafeHandle>) -> Result<(), GuardError> {
        self.release(ward, device)?;
        handles.into_iter().try_for_each(|handle| self.shared.request(|registry| registry.hold(ward, device, handle)))
    }

    /// The device was closed in good order: nothing is written for it any more.
    ///
    /// # Errors
    /// As [`Guard::hold`].
    pub fn release(&self, ward: u64, device: &str) -> Result<(), GuardError> {
        self.shared.request(|registry| registry.release(ward, device))
    }

    /// The process is about to end in good order, or its loss has been dealt with.
    ///
    /// # Errors
    /// [`GuardError`]: the guard is gone.
    pub fn forget(&self, ward: u64) -> Result<(), GuardError> {
        self.shared.request(|registry| registry.forget(ward))
    }

    /// The number of the guard process, where this supervisor started it.
    pub fn pid(&self) -> Option<i32> {
        self.shared.state().child.as_ref().map(Child::pid)
    }
}

impl Drop for Guard {
    fn drop(&mut self) {
        let (link, is_done) = {
            let mut state = self.shared.state();
            state.is_closing = true;
            (state.link.clone(), state.registry.is_empty())
        };
        link.close();
        if let Some(keeper) = self.keeper.take() {
            // A panic of the function that events are told to has been printed; there is nothing to add.
            let _ended = keeper.join();
        }
        if let Some(child) = self.shared.state().child.take() {
            // One that still tries to write somewhere goes on doing so, and ends by itself.
            if !is_done || child.wait(GRACE).is_none() {
                child.leave();
            }
        }
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what is registered, tells the guard, and waits for its answer.
    fn request(&self, change: impl FnOnce(&mut Registry) -> Result<Request, String>) -> Result<(), GuardError> {
        let mut state = self.state();
        if let Some(why) = &state.gone {
            return Err(GuardError(format!("there is no guard: {why}")));
        }
        let (ask, descriptors) = change(&mut state.registry).map_err(GuardError)?;
        let request = state.next_request;
        state.next_request += 1;
        state.requests.push((request, None));
        // Where the link is gone, the guard that is started instead is told everything: that is the answer too.
        let _sent = send(&state.link, request, ask, &descriptors);
        let deadline = Instant::now() + ANSWER;
        loop {
            let place = state.requests.iter().position(|(one, _)| *one == request).expect("only this call takes it away");
            if let Some(answer) = state.requests[place].1.take() {
                state.requests.swap_remove(place);
                return answer.map_err(GuardError);
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                state.requests.swap_remove(place);
                return Err(GuardError(format!("the guard does not answer for {} s", ANSWER.as_secs())));
            }
            state = self.answered.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Hears the guard until this side closes the link, or there is no guard any more.
    fn keep(&self) {
        loop {
            let link = self.state().link.clone();
            match link.receive_with(Duration::from_secs(3600)) {
                Ok(Some((frame, _))) => self.hear(&frame),
                Ok(None) => {}
                Err(Closed) => {
                    if !self.restore() {
                        return;
                    }
                }
            }
        }
    }

    fn hear(&self, frame: &[u8]) {
        let Ok(told) = serde_json::from_slice::<Tell>(frame) else { return };
        match told {
            Tell::Hello { missing } if !missing.is_empty() => (self.tell)(GuardEvent::Missing(missing)),
            Tell::Done { request } => self.answer(request, Ok(())),
            Tell::Refused { request, problem } => self.answer(request, Err(problem)),
            Tell::Lost(loss) => {
                if self.state().registry.lose(&loss) {
                    (self.tell)(GuardEvent::Lost(loss));
                }
            }
            Tell::Hello { .. } | Tell::Ward(_) | Tell::Handle(_) => {}
        }
    }

    fn answer(&self, request: u64, answer: Result<(), String>) {
        if let Some((_, place)) = self.state().requests.iter_mut().find(|(one, _)| *one == request) {
            *place = Some(answer);
        }
        self.answered.notify_all();
    }

    /// Starts another guard with everything that is registered. False: this side is closing, or there can be none.
    fn restore(&self) -> bool {
        let mut state = self.state();
        if state.is_closing {
            return false;
        }
        let how = match state.child.take() {
            Some(child) => {
                // One that lives but does not talk is of no use.
                child.kill();
                child.wait(GRACE).map_or_else(|| "does not end".to_owned(), |status| status.to_string())
            }
            None => "is gone".to_owned(),
        };
        let outcome = if state.restarts.allow(now_ns()) {
            launch(&self.command).map_err(|error| error.0).and_then(|(link, child)| {
                state.registry.everything(|ask, descriptors| send(&link, 0, ask, descriptors)).map_err(|Closed| "it ended at once".to_owned())?;
                Ok((link, child))
            })
        } else {
            Err(format!("it ended too often: {}", state.restarts))
        };
        let (event, answer) = match outcome {
            Ok((link, child)) => {
                (state.link, state.child) = (Arc::new(link), Some(child));
                (GuardEvent::Restarted(format!("the guard {how}; another one guards now")), Ok(()))
            }
            Err(problem) => {
                let why = format!("the guard {how}, and another one cannot be started: {problem}");
                state.gone = Some(why.clone());
                (GuardEvent::Gone(why.clone()), Err(why))
            }
        };
        let is_there = state.gone.is_none();
        state.requests.iter_mut().filter(|(_, place)| place.is_none()).for_each(|(_, place)| *place = Some(answer.clone()));
        drop(state);
        self.answered.notify_all();
        (self.tell)(event);
        is_there
    }
}

/// An ask, and the descriptors that go with it.
pub(crate) type Request = (Ask, Vec<OwnedFd>);

fn send(link: &UnixLink, request: u64, ask: Ask, descriptors: &[OwnedFd]) -> Result<(), Closed> {
    use std::os::fd::AsFd;
    let borrowed: Vec<BorrowedFd<'_>> = descriptors.iter().map(AsFd::as_fd).collect();
    link.send_with(&encode(&Asked { request, ask }), &borrowed, Some(ANSWER))
}

fn launch(command: &GuardCommand) -> Result<(UnixLink, Child), GuardError> {
    let (link, theirs) = UnixLink::pair().map_err(|error| GuardError(format!("no link to a guard can be made: {error}")))?;
    let mut launch = Launch::new(command.command.iter().cloned()).descriptor(LINK, theirs);
    if let Some(path) = &command.path {
        launch = launch.variable(PATH, path);
    }
    let child = launch.start().map_err(|error| GuardError(error.to_string()))?;
    Ok((link, child))
}

/// What a guard tells to who adopts it, and what it lacks.
fn tale(link: &UnixLink, path: &Path) -> Result<(Registry, Vec<String>), GuardError> {
    let silent = || GuardError(format!("what listens at '{}' does not answer as a guard does", path.display()));
    let (mut registry, mut lacks) = (Registry::default(), Vec::new());
    send(link, 0, Ask::Adopt, &[]).map_err(|Closed| silent())?;
    loop {
        let (frame, descriptors) = link.receive_with(ANSWER).map_err(|Closed| silent())?.ok_or_else(silent)?;
        match serde_json::from_slice::<Tell>(&frame).map_err(|_| silent())? {
            Tell::Hello { missing } => lacks = missing,
            Tell::Ward(text) => registry.told_ward(text, descriptors).ok_or_else(silent)?,
            Tell::Handle(text) => registry.told_handle(text, descriptors).ok_or_else(silent)?,
            Tell::Lost(loss) => {
                registry.lose(&loss);
            }
            Tell::Done { .. } => return Ok((registry, lacks)),
            Tell::Refused { problem, .. } => return Err(GuardError(problem)),
        }
    }
}

/// Why the guard could not do what it was asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GuardError(pub String);

impl fmt::Display for GuardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for GuardError {}
