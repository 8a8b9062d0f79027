// SPDX-License-Identifier: Apache-2.0
//! Journal of a daemon: the calls that configured its system, from which a restarted daemon restores it.
//!
//! A call is recorded after it has been made and before it is answered. [`lines`] defines the format of the file, [`ledger`] computes its
//! effect, [`file`](self::file) and [`content`] store it, and [`playing`](crate::playing) repeats it.
pub(crate) mod compaction;
mod content;
mod file;
pub mod ledger;
pub mod lines;

use crate::caller::Caller;
use crate::calls::Call;
use crate::failure::Failure;
use crate::files::{Files, Reference};
use api::{Effect, JournalEntry, Role};
use content::Content;
use file::{LogFile, Unavailable};
use ledger::Ledger;
use lines::{By, Damage, FORMAT, Head, Line, State, Subject, VERSION};
use model::refusal::{Class, Refusal, Refusals};
use serde::Deserialize;
use serde_json::{Map, Value as Json};
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{SystemTime, UNIX_EPOCH};
use supervisor::System;

/// An open journal of a served system.
pub struct Journal {
    pub(crate) path: PathBuf,
    pub(crate) content: Content,
    inner: Mutex<Inner>,
    /// True if a write failure has been reported since the last success.
    told: AtomicBool,
}

pub(crate) struct Inner {
    head: Head,
    file: LogFile,
    /// Lines that are in the file, or that will be written once it is writable again.
    pub(crate) ledger: Ledger,
    /// Instances of this run of the daemon, by their number in the journal.
    pub(crate) instances: BTreeMap<u64, u64>,
    /// Recordings in progress in this run of the daemon, with the names under which they were started.
    pub(crate) recordings: BTreeMap<u64, Json>,
    /// True if the last line could not be written, so that the whole file must be rewritten first.
    is_broken: bool,
}

fn refuse(class: Class, message: String, remedy: &str) -> Refusals {
    vec![Refusal::new(class, message).remedy(remedy)]
}

fn unwritable(path: &Path, why: &io::Error) -> Refusals {
    refuse(Class::DefinitionError, format!("cannot keep the journal '{}': {why}", path.display()), "choose another one with --journal, or free up disk space")
}

impl Journal {
    /// Opens the journal of a system, and rewrites it without obsolete lines. Also returns messages for the operator. Fails, without
    /// changing the file, if another daemon uses it, or if a line is damaged or belongs to another version or system.
    pub fn open(path: &Path, system: &str) -> Result<(Journal, Vec<String>), Refusals> {
        let shown = path.display();
        let (lock, bytes) = file::lock(path).map_err(|why| match why {
            Unavailable::Taken => refuse(
                Class::InUse,
                format!("another daemon keeps the journal '{shown}'"),
                "stop that one first, or give this one another journal: --journal FILE",
            ),
            Unavailable::Failed(why) => unwritable(path, &why),
        })?;
        let head = Head { format: FORMAT.to_owned(), version: VERSION, system: system.to_owned() };
        let (mut ledger, mut told) = (Ledger::default(), Vec::new());
        if let Some(bytes) = bytes {
            let read = lines::read(&bytes).map_err(|Damage { line, why }| damaged(path, line, &why))?;
            if read.head.system != system {
                let message = format!("the journal '{shown}' belongs to system '{}', but this is '{system}'", read.head.system);
                return Err(refuse(Class::DefinitionError, message, "start the daemon under that --name, or give another --journal"));
            }
            if let Some(line) = read.cut {
                told.push(format!("journal '{shown}', line {line}: the last line was cut short and is skipped: its call was never answered"));
            }
            ledger = Ledger::of(read.lines).map_err(|(line, why)| damaged(path, line, &why))?;
            let lost = ledger.leave_lost();
            if lost > 0 {
                told.push(format!("journal '{shown}': {lost} instances of sessions that ended with the daemon are not created again"));
            }
        }
        let old = ledger.leave_old_definitions();
        if old > 0 {
            told.push(format!("journal '{shown}': {old} definitions and modules that were replaced later are skipped"));
        }
        ledger.renumber();
        let kept = ledger.lines().map(|kept| &kept.line);
        let (file, content) =
            LogFile::write(path, lock, &head, kept).and_then(|file| Ok((file, Content::beside(path)?))).map_err(|why| unwritable(path, &why))?;
        content.leave(&needed(&ledger));
        let inner = Inner { head, file, ledger, instances: BTreeMap::new(), recordings: BTreeMap::new(), is_broken: false };
        Ok((Journal { path: path.to_owned(), content, inner: Mutex::new(inner), told: AtomicBool::new(false) }, told))
    }

    /// Returns true if the journal records a call.
    pub fn concerns(call: &Call) -> bool {
        call.journal.recorded != JournalEntry::Nothing
    }

    /// Checks that there is space for the line of a call that must not go unrecorded. Fails with `AuditFailed` before anything is done.
    pub fn ready(&self, bytes: usize) -> Result<(), Failure> {
        let mut inner = self.locked();
        // Room for the rest of the line, in addition to the arguments.
        let room = bytes as u64 + 1024;
        inner.mend().and_then(|()| inner.file.reserve(room)).map_err(|why| self.refused(&why, "nothing was done"))
    }

    /// Stores the files to which the options of a device refer. Fails with `AuditFailed` if they cannot be stored.
    pub fn keep_files(&self, arguments: &Map<String, Json>, files: &Files) -> Result<(), Failure> {
        for sha256 in referred(arguments) {
            // The call itself refuses a missing file.
            if let Some(bytes) = files.bytes(&sha256) {
                self.keep_content(&sha256, &bytes)?;
            }
        }
        Ok(())
    }

    fn keep_content(&self, sha256: &str, bytes: &[u8]) -> Result<(), Failure> {
        self.content.keep(sha256, bytes).map_err(|why| self.refused(&why, "nothing was done"))
    }

    /// Records a call that was made. If this fails, a configuring call fails with `AuditFailed`; for an operating call, the failure is
    /// only reported.
    pub fn made(&self, system: &System, call: &Call, arguments: Map<String, Json>, result: &Json, by: By) -> Result<(), Failure> {
        let mut inner = self.locked();
        let written = match inner.line(system, call, arguments, result, by) {
            Some(line) => inner.append(line),
            None => Ok(()),
        };
        let looked = inner.look(system);
        drop(inner);
        self.said(system, call.role, written.and(looked))
    }

    /// Stores the bytes of a module before it is downloaded, and checks that there is space for its line.
    pub fn ready_for_module(&self, sha256: &str, bytes: &[u8]) -> Result<(), Failure> {
        self.ready(0)?;
        self.keep_content(sha256, bytes)
    }

    /// Records a downloaded module.
    pub fn downloaded(&self, system: &System, module: &str, file: &str, sha256: &str, by: By) -> Result<(), Failure> {
        let line = Line::Module { module: module.to_owned(), file: file.to_owned(), sha256: sha256.to_owned(), by };
        let written = self.locked().append(line);
        self.said(system, Role::Download, written)
    }

    /// Checks the states of running subjects, and writes lines that could not be written before.
    pub fn look(&self, system: &System) {
        let mut inner = self.locked();
        let looked = inner.mend().and_then(|()| inner.look(system));
        drop(inner);
        // The failure has been reported; writing is tried again.
        let _said = self.said(system, Role::Operate, looked);
    }

    /// Records that an instance was deleted without a call.
    pub fn deleted(&self, system: &System, instance: u64) {
        let mut inner = self.locked();
        let written = match inner.number(instance) {
            Some(number) => inner.became(Subject::Instance(number), State::Deleted),
            None => Ok(()),
        };
        drop(inner);
        let _said = self.said(system, Role::Operate, written);
    }

    /// Records that a session was closed gracefully.
    pub fn closed(&self, system: &System, session: &str) {
        let written = self.locked().append(Line::Closed { session: session.to_owned() });
        let _said = self.said(system, Role::Operate, written);
    }

    /// Records that the daemon, and everything that is running in it, ends gracefully.
    pub fn end(&self, system: &System) {
        let mut inner = self.locked();
        let mut written = inner.ledger.running().into_iter().try_for_each(|of| inner.became(of, State::Ended));
        for (_, name) in std::mem::take(&mut inner.recordings) {
            written = written.and_then(|()| inner.append(recording_ended(name)));
        }
        drop(inner);
        let _said = self.said(system, Role::Operate, written);
    }

    pub(crate) fn locked(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().expect("nobody panics with this lock")
    }

    fn refused(&self, why: &io::Error, done: &str) -> Failure {
        let message = format!("the journal '{}' cannot be written: {why}; {done}", self.path.display());
        Failure::new(Class::AuditFailed, message, "free up disk space; observing, operating and stopping still work")
    }

    /// Reports a line that could not be written: as an error if the role is `configure` or above, otherwise once in the log and on
    /// standard error.
    fn said(&self, system: &System, role: Role, written: io::Result<()>) -> Result<(), Failure> {
        let Err(why) = written else {
            self.told.store(false, Ordering::Relaxed);
            return Ok(());
        };
        let failure = self.refused(&why, "the call was carried out, but is lost if the daemon dies before the journal can be written again");
        if role >= Role::Configure {
            return Err(failure);
        }
        if !self.told.swap(true, Ordering::Relaxed) {
            let told = &failure.refusals[0].message;
            eprintln!("journal: {told}");
            system.log_journal(told);
        }
        Ok(())
    }
}

fn damaged(path: &Path, line: usize, why: &str) -> Refusals {
    let message = format!("the journal '{}' cannot be played: line {line}: {why}", path.display());
    refuse(Class::DefinitionError, message, "fix or delete that line, or move the file away to begin without it; it was not changed")
}

/// Returns the digests of the files to which a call refers, at any depth of its options.
fn referred(arguments: &Map<String, Json>) -> Vec<String> {
    let mut found = Vec::new();
    let mut left: Vec<&Json> = arguments.get("options").into_iter().collect();
    while let Some(value) = left.pop() {
        match value {
            Json::Object(table) => match Reference::deserialize(value) {
                Ok(reference) => found.extend(reference.files.into_values()),
                Err(_) => left.extend(table.values()),
            },
            Json::Array(list) => left.extend(list),
            _ => {}
        }
    }
    found
}

/// Returns the digests of all content to which lines refer.
pub(crate) fn needed(ledger: &Ledger) -> BTreeSet<String> {
    let of = |line: &Line| match line {
        Line::Module { sha256, .. } => vec![sha256.clone()],
        Line::Call { arguments, .. } => referred(arguments),
        _ => Vec::new(),
    };
    ledger.lines().flat_map(|kept| of(&kept.line)).collect()
}

/// Returns the line for a recording that ended by itself or with the daemon.
fn recording_ended(name: Json) -> Line {
    let by = By { who: "the system".to_owned(), role: Role::Configure, session: String::new(), time: now_s() };
    let arguments = Map::from_iter([("name".to_owned(), name)]);
    let call = api::with_effect(Effect::EndsRecording).name.to_owned();
    Line::Call { call, of: None, arguments, withheld: Vec::new(), by }
}

/// Returns the current time, s since the Unix epoch.
fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

impl By {
    /// Returns the record of a caller, with its session, if any, and the current time.
    pub fn of(caller: &Caller, session: &str) -> By {
        By { who: caller.who.clone(), role: caller.role, session: session.to_owned(), time: now_s() }
    }
}

impl Inner {
    /// Rewrites the whole file if a line could not be written.
    fn mend(&mut self) -> io::Result<()> {
        if self.is_broken {
            self.rewrite()?;
        }
        Ok(())
    }

    fn rewrite(&mut self) -> io::Result<()> {
        self.file.rewrite(&self.head, self.ledger.lines().map(|kept| &kept.line))?;
        self.ledger.renumber();
        self.is_broken = false;
        Ok(())
    }

    fn append(&mut self, line: Line) -> io::Result<()> {
        if let Line::Became { of: Subject::Instance(number), state: State::Deleted } = &line {
            self.instances.remove(number);
        }
        self.ledger.take(0, line.clone()).map_err(|why| io::Error::other(format!("a line that does not follow from the earlier ones: {why}")))?;
        let written = if self.is_broken { self.rewrite() } else { self.file.append(&line) };
        self.is_broken |= written.is_err();
        if written.is_ok() && self.file.has_grown() {
            self.rewrite()?;
        }
        written
    }

    fn became(&mut self, of: Subject, state: State) -> io::Result<()> {
        self.append(Line::Became { of, state })
    }

    /// Returns the journal number of an instance.
    fn number(&self, instance: u64) -> Option<u64> {
        self.instances.iter().find(|(_, live)| **live == instance).map(|(number, _)| *number)
    }

    /// Returns the subject of an instance in the journal: an instance that the journal created, or a device's own verb.
    fn subject(&self, system: &System, instance: u64) -> Option<Subject> {
        self.number(instance).map(Subject::Instance).or_else(|| system.instance_about(instance).ok()?.owner.map(Subject::Device))
    }

    /// Returns the line for a call that was made; `None` if it does not need to be recorded.
    fn line(&mut self, system: &System, call: &Call, mut arguments: Map<String, Json>, result: &Json, by: By) -> Option<Line> {
        let instance = arguments.get("instance").and_then(Json::as_u64);
        let of = match call.effect {
            Effect::CreatesInstance => {
                let instance = result.as_u64()?;
                let number = self.ledger.fresh();
                self.instances.insert(number, instance);
                // Others may know the instance by its name, which the next run of the daemon would give to a different one.
                if let Ok(about) = system.instance_about(instance) {
                    arguments.insert("name".to_owned(), about.name.into());
                }
                Some(Subject::Instance(number))
            }
            Effect::StartsInstance => Some(Subject::Instance(self.number(instance?).filter(|_| instance.is_some_and(|of| system.continues(of)))?)),
            Effect::TunesInstance => Some(self.subject(system, instance?).filter(|subject| self.ledger.runs(subject))?),
            Effect::EnablesDevice => Some(Subject::Device(arguments.get("name")?.as_str()?.to_owned())),
            Effect::EndsInstance | Effect::DeletesInstance => {
                let state = if call.effect == Effect::EndsInstance { State::Ended } else { State::Deleted };
                let of = self.subject(system, instance?).filter(|of| state == State::Deleted || self.ledger.runs(of))?;
                return Some(Line::Became { of, state });
            }
            Effect::BeginsRecording => {
                self.recordings.insert(result["recording"].as_u64()?, arguments.get("path")?.clone());
                None
            }
            Effect::EndsRecording => {
                let name = self.recordings.remove(&arguments.get("recording")?.as_u64()?)?;
                arguments = Map::from_iter([("name".to_owned(), name)]);
                None
            }
            _ if call.journal.recorded != JournalEntry::Call => return None,
            _ => None,
        };
        if matches!(of, Some(Subject::Instance(_))) {
            arguments.shift_remove("instance");
        }
        let withheld = lines::withhold(call.name, &mut arguments);
        Some(Line::Call { call: call.name.to_owned(), of, arguments, withheld, by })
    }

    /// Records the states of running subjects, and whether the emergency stop is latched.
    fn look(&mut self, system: &System) -> io::Result<()> {
        for of in self.ledger.running() {
            let now = match &of {
                Subject::Instance(number) => state(self.instances.get(number).map_or("ended", |instance| system.state(*instance))),
                Subject::Device(device) => match system.device_state(device) {
                    Ok("disabled" | "fault" | "stopping") | Err(_) => State::Ended,
                    Ok(_) => State::Running,
                },
            };
            if now != if self.ledger.is_suspended(&of) { State::Suspended } else { State::Running } {
                self.became(of, now)?;
            }
        }
        let over: Vec<u64> = self.recordings.keys().copied().filter(|number| !api::is_recording(system, *number)).collect();
        for name in over.iter().filter_map(|number| self.recordings.remove(number)).collect::<Vec<_>>() {
            self.append(recording_ended(name))?;
        }
        let latched = system.latched();
        match latched {
            Some(reason) if self.ledger.stopped() != Some(&reason) => self.append(Line::Stopped { reason }),
            None if self.ledger.stopped().is_some() => self.append(Line::Reset {}),
            _ => Ok(()),
        }
    }
}

fn state(name: &str) -> State {
    match name {
        "queued" | "running" => State::Running,
        "suspended" => State::Suspended,
        "deleted" => State::Deleted,
        _ => State::Ended,
    }
}
