// SPDX-License-Identifier: Apache-2.0
//! A guard process as seen by the supervisor: it is started, receives the registrations and, when it exits, is replaced by another one
//! with the same registrations.
use crate::guard_event::{GuardCommand, GuardError, GuardEvent};
use crate::messages::{Ask, HANDED_OVER, Loss, Tell};
use crate::registry::{Registry, Request};
use crate::serve::Hearts;
use crate::standing_in::{ChildWait, StandIn};
use crate::starting::{ANSWER, launch, send, tale};
use crate::watcher::{self, Watcher};
use interconnect::{Link, LinkClosed};
use process_kit::{Child, ChildChange, Heartbeat, Restarts, Silence, UnixLink, connect, now_ns};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

/// Limit on restarting a guard that died: maximum number of restarts, and the time window.
const RESTARTS: (u32, Duration) = (20, Duration::from_secs(10));
/// Maximum time that a guard without registrations may take to exit.
const GRACE: Duration = Duration::from_secs(2);
/// Poll period while waiting for an answer.
const LOOK: Duration = Duration::from_millis(100);

/// Receiver of the guard's events.
pub(crate) type Tells = Box<dyn Fn(GuardEvent) + Send + Sync>;

/// A guard process of this supervisor. When this value is dropped, the process continues with its remaining registrations, and exits if
/// there are none.
pub(crate) struct Member {
    shared: Arc<MemberState>,
    /// Threads that receive messages from the guard and that run the watcher.
    threads: Vec<JoinHandle<()>>,
}

struct MemberState {
    command: GuardCommand,
    state: Mutex<State>,
    answered: Condvar,
    watcher: Watcher,
    tell: Tells,
}

struct State {
    link: Arc<UnixLink>,
    /// Guard process; `None` if a previous supervisor started it.
    child: Option<Arc<Child>>,
    registry: Registry,
    /// Thread that waits for state changes of the child.
    waiting: Option<ChildWait>,
    /// Guard that stands in for the child.
    stand_in: Option<StandIn>,
    /// Limit on starting stand-ins, for a guard that is stopped repeatedly.
    stands: Restarts,
    next_request: u64,
    /// Requests that are pending, or whose answer has not been taken yet.
    requests: Vec<(u64, Option<Result<(), String>>)>,
    restarts: Restarts,
    /// Handover to a restarted guard, until the guard has answered all of it.
    handover: Option<Handover>,
    /// Reason why there is no guard.
    gone: Option<String>,
    is_closing: bool,
}

/// Handover of all registrations to a restarted guard. Until the guard has answered all of them, only the watcher guards the processes.
struct Handover {
    /// Reason why the previous guard ended.
    how: String,
    /// Number of pending answers, including the greeting of the guard.
    awaited: usize,
    /// Last request included in the handed-over registrations.
    last_request: u64,
    /// Registrations that the guard refused.
    refused: Vec<String>,
}

impl Member {
    /// Starts a guard process. `tell` is called from a thread of this value. `watches`: the supervisor also watches the registered
    /// processes itself.
    ///
    /// Fails if the process cannot be started, or exited immediately.
    pub fn start(command: GuardCommand, watches: bool, tell: Tells) -> Result<Member, GuardError> {
        let heart = || Heartbeat::new().map_err(|error| GuardError(format!("cannot allocate memory for the heartbeats of guard and supervisor: {error}")));
        let hearts = Hearts { guard: heart()?, supervisor: heart()? };
        let (link, child) = launch(&command, &hearts, false)?;
        Member::of(command, watches, link, Some(child), (Registry::default(), hearts), tell)
    }

    /// Takes over the guard that listens at the path of `command`, with everything that it guards, from a supervisor that has exited.
    ///
    /// Fails if no guard listens there, or the process that answers is not a guard.
    pub fn adopt(command: GuardCommand, watches: bool, tell: Tells) -> Result<Member, GuardError> {
        let path = command.path.clone().ok_or_else(|| GuardError("a guard to take over must have a path".to_owned()))?;
        let link = connect(&path).map_err(|error| GuardError(format!("there is no guard at '{}': {error}", path.display())))?;
        let (registry, hearts, missing) = tale(&link, &path)?;
        if !missing.is_empty() {
            tell(GuardEvent::Missing(missing));
        }
        Member::of(command, watches, link, None, (registry, hearts), tell)
    }

    fn of(
        command: GuardCommand,
        watches: bool,
        link: UnixLink,
        child: Option<Child>,
        (registry, hearts): (Registry, Hearts),
        tell: Tells,
    ) -> Result<Member, GuardError> {
        let watcher = Watcher::new(hearts, watches).map_err(|error| GuardError(format!("cannot create a descriptor to watch the guard: {error}")))?;
        let link = Arc::new(link);
        watcher.guarded_by(child.as_ref(), &link, true);
        // It cannot fail, since registrations are only passed on.
        let _all: Result<(), LinkClosed> = registry.everything(|ask, descriptors| {
            watcher.act(&ask, descriptors);
            Ok(())
        });
        let state = State {
            link,
            child: child.map(Arc::new),
            registry,
            waiting: None,
            stand_in: None,
            stands: Restarts::new(RESTARTS.0, RESTARTS.1),
            next_request: 1,
            requests: Vec::new(),
            restarts: Restarts::new(RESTARTS.0, RESTARTS.1),
            handover: None,
            gone: None,
            is_closing: false,
        };
        let shared = Arc::new(MemberState { command, state: Mutex::new(state), answered: Condvar::new(), watcher, tell });
        shared.wait_for_child();
        let (keeps, watches) = (shared.clone(), shared.clone());
        let spawn = |name: &str, body: Box<dyn FnOnce() + Send>| std::thread::Builder::new().name(name.into()).spawn(body).expect("a thread can be started");
        let threads =
            vec![spawn("hears-guard", Box::new(move || keeps.keep())), spawn("watcher", Box::new(move || watches.watcher.run(|loss| watches.lost(loss))))];
        Ok(Member { shared, threads })
    }

    /// Calls `see` with the guarded processes and their safe handles.
    pub fn registered<T>(&self, see: impl FnOnce(&Registry) -> T) -> T {
        see(&self.shared.state().registry)
    }

    /// Returns the heartbeats of this guard and of the supervisor's watcher.
    pub fn hearts(&self) -> &Hearts {
        &self.shared.watcher.hearts
    }

    /// Changes the registrations, sends the change to the guard, and waits for its answer.
    ///
    /// Fails if the change is refused, or the guard has exited.
    pub fn request(&self, change: impl FnOnce(&mut Registry) -> Result<Request, String>) -> Result<(), GuardError> {
        self.shared.request(change)
    }

    /// Returns true if the guard process has exited and will not be replaced.
    pub fn is_gone(&self) -> bool {
        self.shared.state().gone.is_some()
    }

    /// Returns the process ID of the guard, if this supervisor started it.
    pub fn pid(&self) -> Option<i32> {
        self.shared.state().child.as_ref().map(|child| child.pid())
    }

    /// Returns the process ID of the guard that stands in for this one.
    pub fn stand_in(&self) -> Option<i32> {
        self.shared.state().stand_in.as_ref().map(|stand_in| stand_in.child.pid())
    }
}

impl Drop for Member {
    fn drop(&mut self) {
        let (link, is_done) = {
            let mut state = self.shared.state();
            state.is_closing = true;
            (state.link.clone(), state.registry.is_empty())
        };
        self.shared.watcher.end();
        link.close();
        for thread in self.threads.drain(..) {
            // A panic of the function that receives events has been printed already.
            let _ended = thread.join();
        }
        let (child, stand_in, waiting) = {
            let mut state = self.shared.state();
            (state.child.take(), state.stand_in.take(), state.waiting.take())
        };
        if let Some(stand_in) = stand_in {
            if is_done {
                stand_in.child.kill();
            } else {
                stand_in.child.leave();
            }
        }
        if let Some(child) = child {
            // A guard that is still retrying a write continues, and ends by itself; a stopped one would stay forever.
            if is_done && child.wait(GRACE).is_some() {
                waiting.into_iter().for_each(ChildWait::join);
            } else {
                if is_done && watcher::is_stopped(&child) {
                    child.kill();
                }
                if let Some(child) = Arc::into_inner(child) {
                    child.leave();
                }
            }
        }
    }
}

impl MemberState {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Starts a thread that waits for state changes of the guard process, if it is a child of this one. A guard that is not a child is
    /// replaced when its loss is detected.
    fn wait_for_child(self: &Arc<Self>) {
        let member = Arc::downgrade(self);
        let changed = move |change, is_over: &AtomicBool| member.upgrade().map(|member| member.child_changed(change, is_over)).is_some();
        let mut state = self.state();
        state.waiting = state.child.as_ref().and_then(|child| ChildWait::start(child, changed));
    }

    /// Starts or terminates the stand-in after a state change of the child.
    fn child_changed(&self, change: ChildChange, is_over: &AtomicBool) {
        let mut state = self.state();
        let is_needed = match change {
            ChildChange::Continued => false,
            ChildChange::Stopped => state.stand_in.is_some() || state.stands.allow(now_ns()),
            ChildChange::Ended => true,
        };
        if is_needed && state.stand_in.is_none() && !state.is_closing {
            // If no stand-in can be started, the replacement of the guard tries again and reports the reason.
            state.stand_in = StandIn::start(&self.command, &self.watcher.hearts, &state.registry).ok();
        }
        let needless = if is_needed { None } else { state.stand_in.take() };
        is_over.store(change == ChildChange::Ended, Ordering::Release);
        drop(state);
        self.answered.notify_all();
        needless.into_iter().for_each(StandIn::end);
    }

    /// Returns the state as soon as the waiting thread has handled the exit of the guard process, after `GRACE` at the latest.
    fn state_when_waited(&self) -> MutexGuard<'_, State> {
        let waits = |state: &mut State| state.waiting.as_ref().is_some_and(|waiting| !waiting.is_over());
        self.answered.wait_timeout_while(self.state(), GRACE, waits).unwrap_or_else(PoisonError::into_inner).0
    }

    fn request(&self, change: impl FnOnce(&mut Registry) -> Result<Request, String>) -> Result<(), GuardError> {
        let mut state = self.state();
        if let Some(why) = &state.gone {
            return Err(GuardError(format!("there is no guard: {why}")));
        }
        let (ask, descriptors) = change(&mut state.registry).map_err(GuardError)?;
        self.watcher.act(&ask, &descriptors);
        let request = state.next_request;
        state.next_request += 1;
        state.requests.push((request, None));
        if let Some(stand_in) = &mut state.stand_in {
            stand_in.tell(ask.clone(), &descriptors);
        }
        // If the link is broken, the replacement guard receives all registrations, which also answers this request.
        let _sent = send(&state.link, request, ask, &descriptors);
        let mut silence = Silence::begins();
        loop {
            let place = state.requests.iter().position(|(one, _)| *one == request).expect("only this call takes it away");
            if let Some(answer) = state.requests[place].1.take() {
                state.requests.swap_remove(place);
                return answer.map_err(GuardError);
            }
            silence.looked(false);
            let left = ANSWER.saturating_sub(silence.lasted());
            if left.is_zero() {
                state.requests.swap_remove(place);
                return Err(GuardError(format!("the guard did not answer within {} s", ANSWER.as_secs())));
            }
            state = self.answered.wait_timeout(state, left.min(LOOK)).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Receives messages from the guard until this side closes the link, or the guard exits.
    fn keep(self: &Arc<Self>) {
        loop {
            let link = self.state().link.clone();
            match link.receive_with(Duration::from_secs(3600)) {
                Ok(Some((frame, _))) => self.hear(&frame),
                Ok(None) => {}
                Err(LinkClosed) => {
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
            Tell::Hello { missing } => {
                if !missing.is_empty() {
                    (self.tell)(GuardEvent::Missing(missing));
                }
                self.handed_over(Ok(()));
            }
            Tell::Done { request: HANDED_OVER } => self.handed_over(Ok(())),
            Tell::Refused { request: HANDED_OVER, problem } => self.handed_over(Err(problem)),
            Tell::Done { request } => self.answer(request, Ok(())),
            Tell::Refused { request, problem } => self.answer(request, Err(problem)),
            Tell::Lost(loss) => self.lost(loss),
            Tell::MadeSafe(loss) => (self.tell)(GuardEvent::MadeSafe(loss)),
            Tell::GoesOn { ward } => {
                let name = self.state().registry.name(ward);
                if let Some(name) = name {
                    (self.tell)(GuardEvent::GoesOn(name));
                }
            }
            Tell::Hearts | Tell::Ward(_) | Tell::Handle(_) => {}
        }
    }

    /// Records the loss of a process; only its first report counts.
    fn lost(&self, loss: Loss) {
        let is_news = self.state().registry.lose(&loss);
        if is_news {
            (self.tell)(GuardEvent::Lost(loss));
        }
    }

    fn answer(&self, request: u64, answer: Result<(), String>) {
        if let Some((_, place)) = self.state().requests.iter_mut().find(|(one, _)| *one == request) {
            *place = Some(answer);
        }
        self.answered.notify_all();
    }

    /// Records one answer of a restarted guard. After the last one, the guard is in charge.
    fn handed_over(&self, answer: Result<(), String>) {
        let mut state = self.state();
        let Some(handover) = state.handover.as_mut() else { return };
        handover.awaited -= 1;
        handover.refused.extend(answer.err());
        if handover.awaited > 0 {
            return;
        }
        let Some(Handover { how, last_request, refused, .. }) = state.handover.take() else { return };
        self.watcher.is_guarded();
        state.answer_all(last_request, &Ok(()));
        drop(state);
        self.answered.notify_all();
        (self.tell)(GuardEvent::Restarted { how, refused });
    }

    /// Replaces a guard that has exited with one that has received all registrations. Returns false if this side is closing, or no guard
    /// can be started.
    fn restore(self: &Arc<Self>) -> bool {
        let mut state = self.state();
        if state.is_closing {
            return false;
        }
        let stood_still = self.watcher.is_gone();
        let how = match state.child.clone() {
            Some(child) => {
                // A guard that lives but does not answer is useless.
                child.kill();
                drop(state);
                let how = child.wait(GRACE).map_or_else(|| "does not end".to_owned(), |status| status.to_string());
                state = self.state_when_waited();
                how
            }
            None => "is gone".to_owned(),
        };
        // It may have begun to close while the old guard was ending: its link is closed, and that of another guard would stay open.
        if state.is_closing {
            return false;
        }
        let how = if stood_still { "hung, and was ended".to_owned() } else { how };
        self.watcher.hearts.guard.begin();
        match self.start_again(&mut state) {
            Ok(awaited) => {
                let last_request = state.next_request - 1;
                state.handover = Some(Handover { how, awaited, last_request, refused: Vec::new() });
                drop(state);
                self.wait_for_child();
                true
            }
            Err(problem) => {
                let why = format!("the guard {how}, and another one cannot be started: {problem}");
                state.handover = None;
                state.gone = Some(why.clone());
                let last_request = state.next_request - 1;
                state.answer_all(last_request, &Err(why.clone()));
                drop(state);
                self.answered.notify_all();
                (self.tell)(GuardEvent::Gone(why));
                false
            }
        }
    }

    /// Makes the stand-in lead, or starts a new guard if there is no stand-in. Returns the number of answers that the guard owes: its
    /// greeting, and one for each request sent to it.
    fn start_again(&self, state: &mut State) -> Result<usize, String> {
        let stand_in = state.stand_in.take();
        if !state.restarts.allow(now_ns()) {
            stand_in.into_iter().for_each(StandIn::end);
            return Err(format!("it ended too often: {}", state.restarts));
        }
        let mut stand_in = stand_in.map_or_else(|| StandIn::start(&self.command, &self.watcher.hearts, &state.registry), Ok)?;
        stand_in.tell(Ask::Lead, &[]);
        (state.link, state.child) = (Arc::new(stand_in.link), Some(Arc::new(stand_in.child)));
        self.watcher.guarded_by(state.child.as_deref(), &state.link, false);
        Ok(stand_in.awaited)
    }
}

impl State {
    /// Answers all pending requests up to this one.
    fn answer_all(&mut self, last_request: u64, answer: &Result<(), String>) {
        let waiting = self.requests.iter_mut().filter(|(request, place)| *request <= last_request && place.is_none());
        waiting.for_each(|(_, place)| *place = Some(answer.clone()));
    }
}
