// SPDX-License-Identifier: Apache-2.0
//! Replay of a journal: the configuration is restored in order; then everything that was still running is restarted.
use crate::audit::Act;
use crate::caller::Caller;
use crate::calls;
use crate::failure::Failure;
use crate::files::check_digest;
use crate::journal::ledger::{LedgerEntry, creates, effect};
use crate::journal::lines::{By, Line, Subject};
use crate::journal::{Journal, needed};
use crate::service::Service;
use crate::sessions::Sessions;
use api::{CallResult, Effect};
use model::refusal::{Class, Refusal, Refusals};
use serde_json::{Map, Value as Json, json};
use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};
use supervisor::{Anew, OfProcessor, TakenOver, WaitResult};

/// Interval between progress reports.
const SAY: Duration = Duration::from_secs(1);
/// Time for which a wait continues before it checks whether the replay should continue.
const SLICE: Duration = Duration::from_millis(50);
/// Time limit for a device to be enabled, ns of the system's clock.
const ENABLED_WITHIN_NS: i64 = 10_000_000_000;

/// Observer of a daemon's start.
pub trait Watcher {
    /// Reports a message for the operator.
    fn tell(&mut self, text: &str);
    /// Returns true if the replay should continue; called repeatedly.
    fn goes_on(&mut self) -> bool;
}

/// Watcher that ignores a replay.
pub struct NoWatcher;

impl Watcher for NoWatcher {
    fn tell(&mut self, _: &str) {}

    fn goes_on(&mut self) -> bool {
        true
    }
}

struct Player<'a> {
    service: &'a Service,
    journal: &'a Journal,
    watcher: &'a mut dyn Watcher,
    /// Recreated instances, by their number in the journal.
    instances: BTreeMap<u64, u64>,
    /// Instances of devices' own verbs.
    devices: HashMap<String, u64>,
    failures: Refusals,
    is_unwatched: bool,
    played: usize,
    total: usize,
    said: Instant,
}

/// Replays the journal of a service before it accepts calls. Fails if the replay was interrupted or, if `strict` is true, if anything
/// failed.
pub fn play(service: &Service, journal: &Journal, strict: bool, watcher: &mut dyn Watcher) -> Result<(), Refusals> {
    let (kept, suspended, is_stopped) = {
        let inner = journal.locked();
        let kept: Vec<LedgerEntry> = inner.ledger.lines().cloned().collect();
        let suspended: Vec<Subject> = inner.ledger.running().into_iter().filter(|of| inner.ledger.is_suspended(of)).collect();
        (kept, suspended, inner.ledger.stopped().is_some())
    };
    let (running, there): (Vec<LedgerEntry>, Vec<LedgerEntry>) = kept.into_iter().partition(|kept| runs(&kept.line));
    // If a latched emergency stop ended starts whose ends were not written, they are not called again and do not count as failures.
    let (stopped, running): (Vec<LedgerEntry>, Vec<LedgerEntry>) = running.into_iter().partition(|_| is_stopped);
    let running: Vec<LedgerEntry> = running.into_iter().filter(|kept| !suspended.iter().any(|of| subject(&kept.line) == Some(of))).collect();
    let mut player = Player {
        service,
        journal,
        watcher,
        instances: BTreeMap::new(),
        devices: HashMap::new(),
        failures: Refusals::new(),
        is_unwatched: false,
        played: 0,
        total: there.len() + running.len(),
        said: Instant::now(),
    };
    player.content();
    player.all(&there)?;
    if player.is_unwatched && !running.is_empty() {
        player.failed("nothing was started: the monitoring of the machine could not be set up again".to_owned(), "fix that, then enable the devices");
    } else {
        player.all(&running)?;
    }
    if !suspended.is_empty() {
        player.watcher.tell(&format!("{} verb instances were suspended and are not started again", suspended.len()));
    }
    if !stopped.is_empty() {
        player.watcher.tell("the emergency stop is latched: instances that were running when it was triggered are not started again");
    }
    player.take_over();
    let Player { instances, failures, total, .. } = player;
    if total > 0 {
        watcher.tell(&format!("played {total} of {total} calls, {} of them failed", failures.len()));
    }
    if strict && !failures.is_empty() {
        return Err(failures);
    }
    journal.locked().instances = instances;
    journal.look(&service.system);
    Ok(())
}

/// Returns true if a line starts something, or refers to a running subject.
fn runs(line: &Line) -> bool {
    match line {
        Line::Call { call, of, .. } => of.is_some() && !creates(call),
        Line::Became { .. } => true,
        _ => false,
    }
}

fn subject(line: &Line) -> Option<&Subject> {
    match line {
        Line::Call { of, .. } => of.as_ref(),
        Line::Became { of, .. } => Some(of),
        _ => None,
    }
}

impl Player<'_> {
    /// Loads the files to which calls refer into the service.
    fn content(&mut self) {
        let needed = needed(&self.journal.locked().ledger);
        for sha256 in needed {
            // The call that needs a missing or damaged file refuses it.
            let kept = self.journal.content.bytes(&sha256).map(|bytes| self.service.files.put(&sha256, &bytes));
            if let Ok(Err(failure)) = kept {
                self.failed(format!("file {sha256}: {}", text(&failure)), "");
            }
        }
    }

    fn all(&mut self, lines: &[LedgerEntry]) -> Result<(), Refusals> {
        for LedgerEntry { at, line } in lines {
            self.watched()?;
            let played = self.line(line);
            self.watched()?;
            if let Err(failure) = played {
                let name = match line {
                    Line::Call { call, .. } => format!("call '{call}'"),
                    Line::Module { module, .. } => format!("module '{module}'"),
                    Line::Stopped { .. } => "emergency stop".to_owned(),
                    _ => "line".to_owned(),
                };
                self.is_unwatched |= matches!(line, Line::Stopped { .. }) || matches!(line, Line::Call { call, .. } if watches(call));
                self.failed(format!("line {at}: {name} failed: {}", text(&failure)), "");
            }
            self.played += 1;
            if self.played < self.total && self.said.elapsed() >= SAY {
                self.said = Instant::now();
                self.watcher.tell(&format!("played {} of {} calls", self.played, self.total));
            }
        }
        Ok(())
    }

    fn watched(&mut self) -> Result<(), Refusals> {
        if self.watcher.goes_on() {
            return Ok(());
        }
        let message = format!("the daemon was stopped when {} of {} calls of its journal had been played", self.played, self.total);
        Err(vec![Refusal::new(Class::InvalidState, message).remedy("start it again: the journal is unchanged")])
    }

    fn failed(&mut self, what: String, remedy: &str) {
        let told = format!("journal '{}': {what}", self.journal.path.display());
        self.watcher.tell(&told);
        self.service.system.log_journal(&told);
        self.failures.push(Refusal::new(Class::InvalidState, told).remedy(remedy));
    }

    /// Takes over everything that runs in processes that lost the previous daemon, so that it continues in the current configuration.
    /// Called after everything has been restored, so that running blocks find their successors; until then, this system does not access
    /// the devices in these processes.
    fn take_over(&mut self) {
        match self.service.system.take_over() {
            Ok(TakenOver { processors }) => processors.iter().for_each(|of| {
                self.watcher.tell(&taken(of));
                of.anew.iter().for_each(|Anew { block, why }| self.watcher.tell(&format!("  {block} starts again: {why}")));
            }),
            Err(refusals) => self.failed(format!("cannot take over the running processes: {}", text(&Failure::from(refusals))), "call take_over again"),
        }
    }

    fn line(&mut self, line: &Line) -> Result<(), Failure> {
        match line {
            Line::Module { module, file, sha256, by } => {
                let act = Act::new(&caller(by), &by.session, "module", sha256.as_bytes());
                self.service.recorded(&act, by.role, || self.module(module, file, sha256))
            }
            Line::Call { call, withheld, .. } if !withheld.is_empty() => {
                let message = format!("its argument '{}' is a secret, which a journal does not contain", withheld.join("', '"));
                Err(Failure::new(Class::CallError, message, format!("call '{call}' again")))
            }
            Line::Call { call, of, arguments, by, .. } => {
                let act = Act::new(&caller(by), &by.session, call, &lines_text(arguments));
                let given = self.given(of.as_ref(), call, arguments.clone())?;
                let result = self.service.recorded(&act, by.role, || make(self.service, call, given, by))?;
                self.follow((call, arguments), of.as_ref(), by, &result)
            }
            Line::Stopped { reason } => self.service.system.emergency_stop(reason).map_err(Failure::from),
            Line::Became { .. } | Line::Reset {} | Line::Closed { .. } => Ok(()),
        }
    }

    fn module(&self, module: &str, file: &str, sha256: &str) -> Result<(), Failure> {
        let lost = |why: std::io::Error| Failure::new(Class::ModuleError, format!("its file {sha256} cannot be read: {why}"), "download it again");
        let bytes = self.journal.content.bytes(sha256).map_err(lost)?;
        check_digest(sha256, &bytes, "the module")?;
        self.service.download(module, file, &bytes).map(|_| ())
    }

    /// Returns the arguments with the current number of the instance, which belongs to the session that started it.
    fn given(&self, of: Option<&Subject>, call: &str, mut arguments: Map<String, Json>) -> Result<Map<String, Json>, Failure> {
        let instance = match of {
            Some(Subject::Instance(_)) if creates(call) => return Ok(arguments),
            Some(Subject::Instance(number)) => self.instances.get(number),
            Some(Subject::Device(device)) if effect(call) == Effect::TunesInstance => self.devices.get(device),
            _ => return Ok(arguments),
        };
        let gone = || Failure::new(Class::InvalidState, "its instance could not be created or started", "create it again");
        arguments.insert("instance".to_owned(), json!(instance.ok_or_else(gone)?));
        Ok(arguments)
    }

    /// Registers the instance or device that a call created or started, for use by later lines, and the session that owned it.
    fn follow(&mut self, (call, arguments): (&str, &Map<String, Json>), of: Option<&Subject>, by: &By, result: &Json) -> Result<(), Failure> {
        match (effect(call), of) {
            (Effect::BeginsRecording, _) => {
                if let (Some(number), Some(name)) = (result["recording"].as_u64(), arguments.get("path")) {
                    self.journal.locked().recordings.insert(number, name.clone());
                }
            }
            (Effect::CreatesInstance, Some(Subject::Instance(number))) => {
                let instance = result.as_u64().unwrap_or_default();
                self.instances.insert(*number, instance);
                self.owned(by, instance, |sessions| sessions.make(&by.session, instance));
            }
            (Effect::StartsInstance, Some(Subject::Instance(number))) => {
                let instance = self.instances.get(number).copied().unwrap_or_default();
                self.owned(by, instance, |sessions| drop(sessions.own(&by.session, instance)));
            }
            (Effect::EnablesDevice, Some(Subject::Device(device))) => {
                let instance = result.as_u64().unwrap_or_default();
                self.devices.insert(device.clone(), instance);
                self.owned(by, instance, |sessions| drop(sessions.own(&by.session, instance)));
                return self.enabled(device);
            }
            _ => {}
        }
        Ok(())
    }

    /// Restores the session of a line, if it has one, and passes the instance to it.
    fn owned(&self, by: &By, instance: u64, give: impl FnOnce(&Sessions)) {
        if !by.session.is_empty() && instance > 0 {
            self.service.sessions.restore(&by.session, &caller(by), Instant::now());
            give(&self.service.sessions);
        }
    }

    /// Waits until a device is enabled, because the next start may need it.
    fn enabled(&mut self, device: &str) -> Result<(), Failure> {
        let system = &self.service.system;
        let until_ns = system.now_ns().saturating_add(ENABLED_WITHIN_NS);
        loop {
            match system.wait_enabled(device, Some(until_ns), SLICE)? {
                WaitResult::Done(false) | WaitResult::TimedOut => {
                    let message = format!("device '{device}' is not enabled after {} s", ENABLED_WITHIN_NS / 1_000_000_000);
                    return Err(Failure::new(Class::NotEnabled, message, "check the log, and enable it again"));
                }
                WaitResult::Done(true) => return Ok(()),
                // The next check ends the replay.
                WaitResult::Slice if !self.watcher.goes_on() => return Ok(()),
                WaitResult::Slice => {}
            }
        }
    }
}

/// Repeats a call with the permissions of its original caller.
fn make(service: &Service, name: &str, arguments: Map<String, Json>, by: &By) -> Result<Json, Failure> {
    let unknown = || Failure::new(Class::UnknownName, format!("there is no call '{name}'"), "check whether this daemon is older than the journal");
    let call = calls::find(name).ok_or_else(unknown)?;
    service.require_role(&caller(by), call.role, name)?;
    let mut arguments = arguments;
    service.resolve(call, &mut arguments, by.role)?;
    crate::records::place(service.records.as_deref(), &service.trust, &call.records, &mut arguments)?;
    crate::records::go_on(&call.records, &mut arguments);
    match api::begin(&service.system, name, &Json::Object(arguments).to_string(), SLICE)? {
        CallResult::Done(result) => Ok(result),
        CallResult::Waiting { .. } => Err(Failure::new(Class::CallError, format!("call '{name}' may wait, so it cannot be played"), "delete that line")),
    }
}

/// Returns the message for a processor that lost its daemon.
fn taken(of: &OfProcessor) -> String {
    let OfProcessor { name, processors, carried, ended, gap_ns, .. } = of;
    let what = if processors.contains(name) { format!("processor '{name}'") } else { format!("process '{name}' (processors '{}')", processors.join("', '")) };
    if !of.is_adopted {
        return format!("{what} starts again: none of its processes was left");
    }
    let held = gap_ns.map_or(String::new(), |gap_ns| format!("; outputs held their values for {:.1} ms", gap_ns as f64 * 1e-6));
    format!("{what} was taken over: {} blocks continue, {} have ended{held}", carried.len(), ended.len())
}

/// Returns true if nothing may be started after replaying this call has failed, because a safeguard that would stop a motion is missing.
fn watches(call: &str) -> bool {
    calls::find(call).is_some_and(|call| call.journal.watches)
}

fn caller(by: &By) -> Caller {
    Caller { who: by.who.clone(), role: by.role, from: "journal".to_owned() }
}

fn lines_text(arguments: &Map<String, Json>) -> Vec<u8> {
    serde_json::to_vec(arguments).expect("JSON came in")
}

fn text(failure: &Failure) -> String {
    failure.refusals.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
