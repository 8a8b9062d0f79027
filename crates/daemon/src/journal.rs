// SPDX-License-Identifier: Apache-2.0
//! The journal of a daemon: the calls that made its system what it is, so that the daemon knows them when it starts again.
//!
//! A call is recorded after it was made and before it is answered. [`lines`] is the form of a file, [`ledger`] what it comes to,
//! [`file`](self::file) and [`content`] where it lies, [`playing`](crate::playing) how it is made again.
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

/// An open journal, under which a system is served.
pub struct Journal {
    pub(crate) path: PathBuf,
    pub(crate) content: Content,
    inner: Mutex<Inner>,
    /// True if a failure to write was told since the last success.
    told: AtomicBool,
}

pub(crate) struct Inner {
    head: Head,
    file: LogFile,
    /// Lines that the file has, or is to have when it can be written again.
    pub(crate) ledger: Ledger,
    /// Instances of this life of the daemon by their number in the journal.
    pub(crate) instances: BTreeMap<u64, u64>,
    /// Recordings of this life of the daemon that are under way, and the names that they were begun under.
    pub(crate) recordings: BTreeMap<u64, Json>,
    /// The last line could not be written: the whole file is rewritten before anything else.
    is_broken: bool,
}

fn refuse(class: Class, message: String, remedy: &str) -> Refusals {
    vec![Refusal::new(class, message).remedy(remedy)]
}

fn unwritable(path: &Path, why: &io::Error) -> Refusals {
    refuse(Class::DefinitionError, format!("cannot keep the journal '{}': {why}", path.display()), "give another with --journal, or make room for it")
}

impl Journal {
    /// Opens the journal of a system, and rewrites it without what cancelled itself out. Also what a person is to be told.
    /// Errors: another daemon has it; a line is damaged, of another version or another system: then nothing is touched.
    pub fn open(path: &Path, system: &str) -> Result<(Journal, Vec<String>), Refusals> {
        let shown = path.display();
        let (lock, bytes) = file::lock(path).map_err(|why| match why {
            Unavailable::Taken => refuse(
                Class::InUse,
                format!("another daemon keeps the journal '{shown}'"),
                "end that one first, or give this one a journal of its own: --journal FILE",
            ),
            Unavailable::Failed(why) => unwritable(path, &why),
        })?;
        let head = Head { format: FORMAT.to_owned(), version: VERSION, system: system.to_owned() };
        let (mut ledger, mut told) = (Ledger::default(), Vec::new());
        if let Some(bytes) = bytes {
            let read = lines::read(&bytes).map_err(|Damage { line, why }| damaged(path, line, &why))?;
            if read.head.system != system {
                let message = format!("the journal '{shown}' is of system '{}', this is '{system}'", read.head.system);
                return Err(refuse(Class::DefinitionError, message, "start the daemon under that --name, or give another --journal"));
            }
            if let Some(line) = read.cut {
                told.push(format!("journal '{shown}', line {line}: the last line was cut short and is left out: its call was never answered"));
            }
            ledger = Ledger::of(read.lines).map_err(|(line, why)| damaged(path, line, &why))?;
            let lost = ledger.leave_lost();
            if lost > 0 {
                told.push(format!("journal '{shown}': {lost} instances of sessions that went with the daemon are not made again"));
            }
        }
        let old = ledger.leave_old_definitions();
        if old > 0 {
            told.push(format!("journal '{shown}': {old} definitions and modules that later ones replaced are left out"));
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

    /// Checks, before something is made that cannot go unrecorded, that there is room for its line. Errors: `AuditFailed`, nothing is done.
    pub fn ready(&self, bytes: usize) -> Result<(), Failure> {
        let mut inner = self.locked();
        // What a line has beside the arguments of its call.
        let room = bytes as u64 + 1024;
        inner.mend().and_then(|()| inner.file.reserve(room)).map_err(|why| self.refused(&why, "nothing was done"))
    }

    /// Keeps the files that the options of a device refer to. Errors: `AuditFailed`.
    pub fn keep_files(&self, arguments: &Map<String, Json>, files: &Files) -> Result<(), Failure> {
        for sha256 in referred(arguments) {
            // One that is not there is refused by the call itself.
            if let Some(bytes) = files.bytes(&sha256) {
                self.keep_content(&sha256, &bytes)?;
            }
        }
        Ok(())
    }

    fn keep_content(&self, sha256: &str, bytes: &[u8]) -> Result<(), Failure> {
        self.content.keep(sha256, bytes).map_err(|why| self.refused(&why, "nothing was done"))
    }

    /// Records a call that was made. Errors: `AuditFailed` where it configures; what operates goes on, and is told of.
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

    /// Keeps the bytes of a module before it is downloaded, and checks that there is room for its line.
    pub fn ready_for_module(&self, sha256: &str, bytes: &[u8]) -> Result<(), Failure> {
        self.ready(0)?;
        self.keep_content(sha256, bytes)
    }

    /// Records a module that was downloaded.
    pub fn downloaded(&self, system: &System, module: &str, file: &str, sha256: &str, by: By) -> Result<(), Failure> {
        let line = Line::Module { module: module.to_owned(), file: file.to_owned(), sha256: sha256.to_owned(), by };
        let written = self.locked().append(line);
        self.said(system, Role::Download, written)
    }

    /// Looks what has become of that which runs, and writes what could not be written before.
    pub fn look(&self, system: &System) {
        let mut inner = self.locked();
        let looked = inner.mend().and_then(|()| inner.look(system));
        drop(inner);
        // It has been said, and is tried again.
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

    /// Records that a session was closed in order.
    pub fn closed(&self, system: &System, session: &str) {
        let written = self.locked().append(Line::Closed { session: session.to_owned() });
        let _said = self.said(system, Role::Operate, written);
    }

    /// Records that the daemon ends in order, and everything that runs with it.
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
        Failure::new(Class::AuditFailed, message, "make room for it; observing, operating and stopping go on")
    }

    /// Tells of a line that could not be written: who configures hears it, everybody can read it in the log.
    fn said(&self, system: &System, role: Role, written: io::Result<()>) -> Result<(), Failure> {
        let Err(why) = written else {
            self.told.store(false, Ordering::Relaxed);
            return Ok(());
        };
        let failure = self.refused(&why, "what was called was done, and is lost if the daemon dies before the journal can be written again");
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
    refuse(Class::DefinitionError, message, "mend or delete that line, or move the file away to begin without it; it was not touched")
}

/// Digests of the files that a call refers to, at every depth of its options.
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

/// Digests of all content that lines refer to.
pub(crate) fn needed(ledger: &Ledger) -> BTreeSet<String> {
    let of = |line: &Line| match line {
        Line::Module { sha256, .. } => vec![sha256.clone()],
        Line::Call { arguments, .. } => referred(arguments),
        _ => Vec::new(),
    };
    ledger.lines().flat_map(|kept| of(&kept.line)).collect()
}

/// Returns the line of a recording that ended by itself, or with the daemon.
fn recording_ended(name: Json) -> Line {
    let by = By { who: "the system".to_owned(), role: Role::Configure, session: String::new(), time: now_s() };
    let arguments = Map::from_iter([("name".to_owned(), name)]);
    let call = api::with_effect(Effect::EndsRecording).name.to_owned();
    Line::Call { call, of: None, arguments, withheld: Vec::new(), by }
}

/// Returns s since 1970.
fn now_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

impl By {
    /// Returns the caller, in a session or in none, now.
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
        self.ledger.take(0, line.clone()).map_err(|why| io::Error::other(format!("a line that goes with none before it: {why}")))?;
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

    /// Returns the number in the journal of an instance.
    fn number(&self, instance: u64) -> Option<u64> {
        self.instances.iter().find(|(_, live)| **live == instance).map(|(number, _)| *number)
    }

    /// Returns the subject of an instance in the journal: one that was made under it, or the verb of a device.
    fn subject(&self, system: &System, instance: u64) -> Option<Subject> {
        self.number(instance).map(Subject::Instance).or_else(|| system.instance_about(instance).ok()?.owner.map(Subject::Device))
    }

    /// Returns the line of a call that was made; none if it leaves nothing that has to be known.
    fn line(&mut self, system: &System, call: &Call, mut arguments: Map<String, Json>, result: &Json, by: By) -> Option<Line> {
        let instance = arguments.get("instance").and_then(Json::as_u64);
        let of = match call.effect {
            Effect::CreatesInstance => {
                let instance = result.as_u64()?;
                let number = self.ledger.fresh();
                self.instances.insert(number, instance);
                // Others may know it by its name, which the next life of the daemon would give to another one.
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

    /// Records what has become of that which runs, and whether the emergency stop is latched.
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
