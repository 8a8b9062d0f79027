// SPDX-License-Identifier: Apache-2.0
//! State shared by all requests, and the processing of a call from its arguments to its answer. It does not depend on HTTP.
use crate::audit::{Act, Audit};
use crate::caller::{Caller, Gate};
use crate::calls::{self, Call};
use crate::clock::now;
use crate::code::ModuleOrigin;
use crate::failure::Failure;
use crate::files::Files;
use crate::freshness;
use crate::journal::Journal;
use crate::journal::lines::By;
use crate::lanes::Lanes;
use crate::rates::Rates;
use crate::requests::{self, CallRequest};
use crate::sessions::{SessionInstance, Sessions};
use api::{CallResult, DriverArgument, Effect, Role};
use model::refusal::Class;
use serde_json::{Map, Value as Json, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use supervisor::{ModuleAbout, ReachingValue, System};

/// A system, with all layers between it and its callers.
pub struct Service {
    pub system: Arc<System>,
    pub gate: Gate,
    pub sessions: Sessions,
    pub audit: Audit,
    /// Rate limits of requests, per caller.
    pub rates: Rates,
    pub lanes: Arc<Lanes>,
    pub files: Files,
    /// Journal from which a restarted daemon restores the system.
    pub journal: Option<Journal>,
    /// Folder in which callers may record.
    pub records: Option<PathBuf>,
    /// SHA-256 digests of trusted code modules that may run as part of a recording.
    pub trust: Vec<String>,
    /// Interpreter that tests code modules.
    pub python: String,
}

/// A request of a session, from when it begins until it ends.
pub struct Presence {
    service: Arc<Service>,
    pub id: String,
    pub name: String,
}

impl Drop for Presence {
    fn drop(&mut self) {
        self.service.sessions.end(&self.id, now());
    }
}

impl Service {
    /// Begins a request of the session with this ID; returns `None` without an ID.
    pub fn present(self: &Arc<Self>, id: Option<&str>, caller: &Caller) -> Result<Option<Presence>, Failure> {
        let Some(id) = id else { return Ok(None) };
        let name = self.sessions.begin(id, caller, now())?;
        Ok(Some(Presence { service: self.clone(), id: id.to_owned(), name }))
    }

    /// Refuses an action for which the caller's role is insufficient, and names both roles.
    pub fn require_role(&self, caller: &Caller, role: Role, what: &str) -> Result<(), Failure> {
        if caller.role >= role {
            return Ok(());
        }
        let message = format!("'{what}' needs the role {}, but {} has {}", role.word(), caller.who, caller.role.word());
        Err(Failure::new(Class::NotAllowed, message, "ask the operator of the system for a token of that role"))
    }

    /// Makes a call: checks permissions and command, records it in the audit file, executes it, and assigns owners to the instances that
    /// it creates. May take a long time, so it must not be called on a thread that serves others.
    pub fn call(self: &Arc<Self>, call: &Call, mut asked: CallRequest, caller: &Caller, presence: Option<&Presence>) -> Result<Json, Failure> {
        let role = call.role_under(self.system.is_virtual());
        if let Some(by) = call.signed {
            asked.arguments.insert(by.to_owned(), json!(self.signature(caller, presence.map_or("", |p| &p.name))));
        }
        let mut act = Act::new(caller, presence.map_or("", |p| &p.name), call.name, asked_text(&asked).as_bytes());
        let commands = api::commanded(&self.system, call.name, &asked.arguments);
        act.about = commands.clone().unwrap_or_default();
        let allowed = self.require_role(caller, role, call.name).and_then(|()| match role {
            Role::Observe => Ok(()),
            _ if call.free => Ok(()),
            _ => self.sessions.require_command(presence.map(|p| p.name.as_str())),
        });
        let allowed = allowed.and_then(|()| if call.moves { freshness::check(call.name, asked.as_of_ms) } else { Ok(()) });
        let result = self.audited(&act, role, || allowed.and_then(|()| self.kept(call, asked, caller, presence)));
        if commands.is_some() {
            self.log(&act, result.as_ref().err());
        }
        result
    }

    /// Returns the name under which a caller is logged: its session, the person, and the name of its token.
    fn signature(&self, caller: &Caller, session: &str) -> String {
        let caller = match self.sessions.person(session) {
            Some(person) => format!("{person}, {}", caller.who),
            None => caller.who.clone(),
        };
        if session.is_empty() { caller } else { format!("{session} ({caller})") }
    }

    /// Logs a command with its caller.
    fn log(&self, act: &Act, failure: Option<&Failure>) {
        let who = self.signature(&act.caller, &act.session);
        let refused = failure.map(|failure| failure.refusals.first().map_or_else(String::new, |refusal| refusal.message.clone()));
        let about = if act.about.is_empty() { "system" } else { &act.about };
        self.system.log_command(&who, &act.call, about, refused.as_deref());
    }

    /// Performs a commanding action that is not a call, and records it in the audit file and in the log.
    pub fn recorded<T>(&self, act: &Act, role: Role, run: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
        let result = self.audited(act, role, run);
        if role > Role::Observe {
            self.log(act, result.as_ref().err());
        }
        result
    }

    /// Performs an action that is recorded in the audit file. If it requires the role `configure` or above, nothing is done unless the
    /// record can be written first. An observing action is recorded only if it is refused for lack of permissions.
    fn audited<T>(&self, act: &Act, role: Role, run: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
        if role >= Role::Configure {
            self.audit.write(act, "begun")?;
        }
        let result = run();
        let outcome = match &result {
            Ok(_) => "ok".to_owned(),
            Err(failure) => format!("{:?}", failure.class()),
        };
        let denied = result.as_ref().is_err_and(|failure| failure.class() == Class::NotAllowed);
        if role > Role::Observe || denied {
            // A command of the role `operate` is not held up by a full disk; the audit file has already reported that on standard error.
            let _said = self.audit.write(act, &outcome);
        }
        result
    }

    /// Makes a call, and records it in the journal, if there is one. A configuring call is not made if there is no space for its line.
    fn kept(&self, call: &Call, mut asked: CallRequest, caller: &Caller, presence: Option<&Presence>) -> Result<Json, Failure> {
        crate::records::identify(&call.records, &mut asked.arguments)?;
        if call.effect == Effect::PerformsVerb {
            return self.perform(call, &asked, caller, presence);
        }
        let Some(journal) = self.journal.as_ref().filter(|_| Journal::concerns(call)) else { return self.make(call, asked, caller.role, presence) };
        let arguments = asked.arguments.clone();
        if call.role >= Role::Configure {
            journal.ready(asked_text(&asked).len())?;
            journal.keep_files(&arguments, &self.files)?;
        }
        let answer = self.make(call, asked, caller.role, presence)?;
        let by = By::of(caller, presence.map_or("", |p| &p.name));
        journal.made(&self.system, call, arguments, &answer["result"], by)?;
        Ok(answer)
    }

    /// Calls a verb in one request. Before its instance starts, the instance has an owner and is in the journal.
    fn perform(&self, call: &Call, asked: &CallRequest, caller: &Caller, presence: Option<&Presence>) -> Result<Json, Failure> {
        let prepared = api::prepare(&self.system, &asked_text(asked))?;
        let instance = prepared.instance();
        if let Some(presence) = presence {
            self.sessions.make(&presence.name, instance);
        }
        let mut unrecorded = None;
        let mut record = |effect, arguments, result: Json| {
            let Some(journal) = &self.journal else { return };
            let by = By::of(caller, presence.map_or("", |p| &p.name));
            unrecorded = journal.made(&self.system, api::with_effect(effect), arguments, &result, by).err().or(unrecorded.take());
        };
        let (create, begin) = steps(&asked.arguments, instance);
        record(Effect::CreatesInstance, create, json!(instance));
        let answered = prepared.start().and_then(|started| {
            record(Effect::StartsInstance, begin, Json::Null);
            started.complete(asked.slice)
        });
        match (answered, unrecorded) {
            (Ok(_), Some(failure)) => Err(failure),
            (Ok(answered), None) => Ok(self.answer(call, answered, Some(instance), presence)),
            (Err(refusals), _) => {
                // If only the wait was refused, the instance continues: it still belongs to its session and stays in the journal.
                if self.system.state(instance) == "deleted" {
                    self.forget(instance);
                    self.sessions.disown(instance);
                }
                Err(refusals.into())
            }
        }
    }

    /// Removes the records of an instance that was deleted with its call.
    fn forget(&self, instance: u64) {
        if let Some(journal) = &self.journal {
            journal.deleted(&self.system, instance);
        }
    }

    /// Continues a lasting call, using the continuation in its answer; it was checked and recorded when it began.
    pub fn go_on(self: &Arc<Self>, with: &Json, slice: Duration, presence: Option<&Presence>) -> Result<Json, Failure> {
        let (name, arguments) = (with["call"].as_str().unwrap_or(""), with["arguments"].as_object().cloned().unwrap_or_default());
        let call = calls::find(name).ok_or_else(|| Failure::new(Class::CallError, format!("there is no call '{name}'"), "please report it"))?;
        // A continued call never names a file or code: these were resolved when it began.
        self.make(call, CallRequest { arguments, slice, as_of_ms: None }, Role::Observe, presence)
    }

    /// Resolves files, and refuses code, in the options and arguments for drivers: see [`Files::resolve`].
    pub fn resolve(&self, call: &Call, arguments: &mut Map<String, Json>, role: Role) -> Result<(), Failure> {
        let text = |name: &str| arguments.get(name).and_then(Json::as_str).unwrap_or("").to_owned();
        let mut resolve = |reached: ReachingValue<'_>| self.files.resolve(reached, role);
        let mut none = Json::Null;
        match call.for_driver {
            Some(DriverArgument::Options) => {
                let kind = text("kind");
                supervisor::each_reach(&kind, arguments.get_mut("options").unwrap_or(&mut none), &mut resolve)
            }
            Some(DriverArgument::OfService) => {
                let (device, service) = (text("device"), text("service"));
                let given = arguments.get_mut("arguments").unwrap_or(&mut none);
                self.system.each_reach_of_service(&device, &service, given, &mut resolve)
            }
            None => Ok(()),
        }
    }

    fn make(&self, call: &Call, mut asked: CallRequest, role: Role, presence: Option<&Presence>) -> Result<Json, Failure> {
        let instance = asked.arguments.get("instance").and_then(Json::as_u64);
        if call.costs {
            requests::check_extent(&asked.arguments)?;
        }
        self.resolve(call, &mut asked.arguments, role)?;
        crate::records::place(self.records.as_deref(), &self.trust, &call.records, &mut asked.arguments)?;
        // Assign it before the start, so that an immediate end has an owner.
        let starts = (call.effect == Effect::StartsInstance).then_some(instance).flatten().zip(presence);
        let before = starts.and_then(|(instance, presence)| self.sessions.own(&presence.name, instance));
        let answered = api::begin(&self.system, call.name, &asked_text(&asked), asked.slice);
        if let (Err(_), Some((instance, _))) = (&answered, starts) {
            self.sessions.give_back_to(before.as_deref(), instance);
        }
        Ok(self.answer(call, answered?, instance, presence))
    }

    fn answer(&self, call: &Call, answered: CallResult, instance: Option<u64>, presence: Option<&Presence>) -> Json {
        let result = match answered {
            CallResult::Done(result) => result,
            CallResult::Waiting { call, arguments } => {
                let go_on = json!({ "call": call, "arguments": arguments });
                return json!({ "waiting": true, "go_on": go_on, "now_ns": self.system.now_ns() });
            }
        };
        if let (Effect::PerformsVerb | Effect::CompletesVerb, Some(instance)) = (call.effect, instance) {
            self.forget(instance);
        }
        if matches!(call.effect, Effect::ReportsEnd | Effect::EndsInstance) && !result.is_null() {
            self.note_ends();
        }
        if let Some(presence) = presence {
            self.follow(call, &result, instance, &presence.name);
        }
        json!({ "result": result })
    }

    /// Updates the owners of instances after a call, and the records of the call's session.
    fn follow(&self, call: &Call, result: &Json, instance: Option<u64>, name: &str) {
        match (call.effect, instance) {
            (Effect::CreatesInstance, _) => result.as_u64().into_iter().for_each(|made| self.sessions.make(name, made)),
            (Effect::EnablesDevice, _) => result.as_u64().filter(|made| *made > 0).into_iter().for_each(|servo| drop(self.sessions.own(name, servo))),
            (Effect::PerformsVerb | Effect::CompletesVerb, Some(instance)) => {
                self.drain();
                self.sessions.told(name, instance);
                self.sessions.disown(instance);
            }
            (Effect::DeletesInstance, Some(instance)) => self.sessions.disown(instance),
            (Effect::ForcesSignal, _) => {
                let force = result.as_u64().filter(|force| !self.sessions.add_force(name, *force));
                self.end_forces(force.as_slice(), &format!("session '{name}' has ended"));
            }
            (Effect::ReportsEnd | Effect::EndsInstance, Some(instance)) if !result.is_null() => {
                self.drain();
                self.sessions.told(name, instance);
            }
            _ => {}
        }
    }

    /// Processes the end reports that have arrived since the last call.
    pub fn drain(&self) {
        let ends = self.system.ends_since(self.sessions.next_end());
        if !ends.is_empty() {
            self.note_ends();
        }
        self.sessions.keep(ends);
    }

    /// Records ends in the journal before they are reported to anyone, so that the next daemon does not restart ended instances.
    pub fn note_ends(&self) {
        if let Some(journal) = &self.journal {
            journal.look(&self.system);
        }
    }

    /// Records that this side was suspended, with its process or machine, for the duration `late` until `now`. Messages from its callers
    /// have not been received yet, so the next checks must not count the callers as silent.
    pub fn stood_still(&self, late: Duration, now: Instant) {
        self.sessions.stood_still(late, now);
    }

    /// Checks sessions: cuts off lost ones, and deletes ended instances that lost sessions created.
    pub fn look_after(&self, now: Instant) {
        self.drain();
        for (name, instances) in self.sessions.lose(now) {
            let who = Caller { who: "the system".to_owned(), role: Role::Download, from: "here".to_owned() };
            // A closed system has nothing left to cut off.
            self.end_forces(&self.sessions.take_forces(&name), &format!("session '{name}' was lost"));
            let outcome = self.system.abandon(&instances, &name).map_or("InvalidState", |()| "ok");
            let act = Act::new(&who, &name, "cut_off", b"");
            let _said = self.audit.write(&act, outcome);
        }
        self.drain();
        for (instance, goes) in self.sessions.orphans() {
            let state = self.system.state(instance);
            // An instance that has ended since the last check has a report by now, which is kept only while it has an owner.
            self.drain();
            if state == "deleted" || (goes && matches!(state, "created" | "ended") && self.system.delete(instance).is_ok()) {
                self.sessions.disown(instance);
                if let Some(journal) = &self.journal {
                    journal.deleted(&self.system, instance);
                }
            }
        }
        if let Some(journal) = &self.journal {
            journal.look(&self.system);
        }
        for settled in self.sessions.settle(now) {
            self.system.log_control(&settled.line());
        }
    }

    /// Reports news about the token file in the log and on standard error.
    pub fn tell_of_tokens(&self) {
        for text in self.gate.tokens.iter().flat_map(|tokens| tokens.news(crate::tokens::now_s())) {
            eprintln!("control: {text}");
            self.system.log_control(&text);
        }
    }

    /// Closes a session gracefully.
    pub fn close_session(&self, id: &str) -> Result<(), Failure> {
        let name = self.sessions.close(id)?;
        self.end_forces(&self.sessions.take_forces(&name), &format!("session '{name}' was closed"));
        if let Some(journal) = &self.journal {
            journal.closed(&self.system, &name);
        }
        Ok(())
    }

    fn end_forces(&self, forces: &[u64], why: &str) {
        if !forces.is_empty() {
            self.system.end_forces(forces, why);
        }
    }

    /// Returns the number, name and state of each of these instances that still exists.
    pub fn described(&self, instances: &[u64]) -> Vec<SessionInstance> {
        let described = |instance: &u64| {
            let about = self.system.instance_about(*instance).ok()?;
            Some(SessionInstance { instance: *instance, name: about.name, state: about.state })
        };
        instances.iter().filter_map(described).collect()
    }

    /// Downloads a code module, and records it in the journal, if there is one.
    pub fn download_kept(&self, name: &str, named: &ModuleOrigin, bytes: &[u8], by: By) -> Result<ModuleAbout, Failure> {
        let Some(journal) = &self.journal else { return self.download(name, &named.file, bytes) };
        journal.ready_for_module(&named.sha256, bytes)?;
        let about = self.download(name, &named.file, bytes)?;
        journal.downloaded(&self.system, name, &named.file, &named.sha256, by)?;
        Ok(about)
    }

    /// Downloads a code module from the bytes of a file. Messages refer to the file by the name that the caller uses for it.
    pub fn download(&self, name: &str, file: &str, bytes: &[u8]) -> Result<ModuleAbout, Failure> {
        self.files.with(file, bytes, |path| {
            let named = path.display().to_string();
            self.system.download(path, Some(name), &self.python).map_err(|mut refusals| {
                for refusal in &mut refusals {
                    refusal.message = refusal.message.replace(&named, file);
                    if let Some(place) = refusal.place.as_mut().filter(|place| place.file == named) {
                        place.file = file.to_owned();
                    }
                }
                Failure::from(refusals)
            })
        })?
    }
}

/// Returns the arguments of the two calls with which a verb call begins, for the journal.
fn steps(arguments: &Map<String, Json>, instance: u64) -> (Map<String, Json>, Map<String, Json>) {
    let (mut start, create): (Map<_, _>, Map<_, _>) = arguments.clone().into_iter().partition(|(name, _)| matches!(name.as_str(), "values" | "limits"));
    start.insert("instance".to_owned(), json!(instance));
    (create, start)
}

fn asked_text(asked: &CallRequest) -> String {
    serde_json::to_string(&asked.arguments).expect("JSON came in")
}
