// SPDX-License-Identifier: Apache-2.0
//! Ledger of a journal: the lines that still count, in replay order, without those that cancelled each other out.
use crate::journal::lines::{Line, State, Subject};
use api::{Call, Effect};
use serde_json::{Map, Value as Json};

/// A line that counts, with its number in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct LedgerEntry {
    pub at: usize,
    pub line: Line,
}

/// Lines that still count.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ledger {
    kept: Vec<LedgerEntry>,
    /// Next instance number.
    next: u64,
}

impl Ledger {
    /// Computes the ledger of these lines. Fails with the number of a line that does not refer to a previous one, and the reason.
    pub fn of(lines: impl IntoIterator<Item = (usize, Line)>) -> Result<Ledger, (usize, String)> {
        let mut ledger = Ledger::default();
        for (at, line) in lines {
            ledger.take(at, line).map_err(|why| (at, why))?;
        }
        Ok(ledger)
    }

    /// Returns an instance number that has not been used in this journal since it was read.
    pub fn fresh(&mut self) -> u64 {
        self.next += 1;
        self.next
    }

    /// Returns the lines that count, in order.
    pub fn lines(&self) -> impl Iterator<Item = &LedgerEntry> {
        self.kept.iter()
    }

    /// Keeps the lines for which `keep` returns true. `keep` is called in line order.
    pub(crate) fn retain(&mut self, keep: impl FnMut(&LedgerEntry) -> bool) {
        self.kept.retain(keep);
    }

    /// Renumbers the lines for a file that contains only these lines after its first line.
    pub fn renumber(&mut self) {
        self.kept.iter_mut().enumerate().for_each(|(index, kept)| kept.at = index + 2);
    }

    /// Returns true if the subject was started and has not ended.
    pub fn runs(&self, subject: &Subject) -> bool {
        self.started(subject).is_some()
    }

    /// Returns true if the subject was started, has not ended, and is suspended.
    pub fn is_suspended(&self, subject: &Subject) -> bool {
        self.kept.iter().any(|kept| matches!(&kept.line, Line::Became { of, state: State::Suspended } if of == subject))
    }

    /// Returns all running subjects.
    pub fn running(&self) -> Vec<Subject> {
        self.kept.iter().filter_map(|kept| starting(&kept.line)).cloned().collect()
    }

    /// Returns the reason why the emergency stop is latched, if it is.
    pub fn stopped(&self) -> Option<&str> {
        self.kept.iter().find_map(|kept| if let Line::Stopped { reason } = &kept.line { Some(reason.as_str()) } else { None })
    }

    /// Adds a line: either keeps it, or removes the lines that it cancels. Fails if it refers to an instance that was not created by a
    /// previous line.
    pub fn take(&mut self, at: usize, line: Line) -> Result<(), String> {
        match line {
            Line::Became { of, state } => self.became(at, of, state),
            Line::Reset {} => self.kept.retain(|kept| !matches!(kept.line, Line::Stopped { .. })),
            Line::Stopped { .. } => {
                self.kept.retain(|kept| !matches!(kept.line, Line::Stopped { .. }));
                // The emergency stop ends everything that runs, even if the daemon died before the ends were written.
                self.running().iter().for_each(|of| self.end(of));
                self.kept.push(LedgerEntry { at, line });
            }
            Line::Closed { session } => self.close(&session),
            Line::Module { ref module, ref file, ref sha256, .. } => {
                let before = self.kept.iter().rev().find_map(|kept| match &kept.line {
                    Line::Module { module: m, file: f, sha256: s, .. } if m == module => Some((f, s)),
                    _ => None,
                });
                if before != Some((file, sha256)) {
                    self.kept.push(LedgerEntry { at, line });
                }
            }
            Line::Call { ref call, ref of, .. } => match (effect(call), of.clone()) {
                (Effect::CreatesInstance, Some(Subject::Instance(number))) => {
                    if self.made(number) {
                        return Err(format!("it creates instance {number}, which an earlier line has already created"));
                    }
                    self.next = self.next.max(number);
                    self.kept.push(LedgerEntry { at, line });
                }
                (Effect::StartsInstance | Effect::EnablesDevice, Some(subject)) => {
                    if let Subject::Instance(number) = subject
                        && !self.made(number)
                    {
                        return Err(format!("it starts instance {number}, which no earlier line creates"));
                    }
                    self.end(&subject);
                    self.kept.push(LedgerEntry { at, line });
                }
                (Effect::TunesInstance, Some(subject)) => {
                    if !self.runs(&subject) {
                        return Err("it sets parameters of an instance that no earlier line starts".to_owned());
                    }
                    self.set(at, &subject, line);
                }
                (Effect::CreatesInstance | Effect::StartsInstance | Effect::EnablesDevice | Effect::TunesInstance | Effect::DeletesInstance, _) => {
                    return Err(format!("call '{call}' does not name its instance or device"));
                }
                (_, Some(_)) => return Err(format!("call '{call}' does not act on an instance or device")),
                (_, None) => self.configure(at, line),
            },
        }
        Ok(())
    }

    /// Drops instances of sessions that were lost with the daemon, unless they must run again. After a restart, all earlier sessions are
    /// lost, and instances of a lost session are deleted when they have ended. Returns the number of instances dropped.
    pub fn leave_lost(&mut self) -> usize {
        let lost = |kept: &LedgerEntry| match &kept.line {
            Line::Call { call, of: Some(of), by, .. } if creates(call) && !by.session.is_empty() => Some(of.clone()),
            _ => None,
        };
        let lost: Vec<Subject> = self.kept.iter().filter_map(lost).filter(|of| !self.runs(of) || self.is_suspended(of)).collect();
        lost.iter().for_each(|of| self.delete(of));
        lost.len()
    }

    fn made(&self, number: u64) -> bool {
        self.kept.iter().any(|kept| matches!(&kept.line, Line::Call { call, of: Some(Subject::Instance(n)), .. } if creates(call) && *n == number))
    }

    fn started(&self, subject: &Subject) -> Option<&LedgerEntry> {
        self.kept.iter().find(|kept| starting(&kept.line) == Some(subject))
    }

    fn became(&mut self, at: usize, of: Subject, state: State) {
        match state {
            State::Ended => self.end(&of),
            State::Deleted => self.delete(&of),
            State::Running | State::Suspended => {
                self.kept.retain(|kept| !matches!(&kept.line, Line::Became { of: about, .. } if *about == of));
                if state == State::Suspended && self.runs(&of) {
                    self.kept.push(LedgerEntry { at, line: Line::Became { of, state } });
                }
            }
        }
    }

    fn end(&mut self, subject: &Subject) {
        self.kept.retain(|kept| match &kept.line {
            Line::Call { call, of: Some(of), .. } => creates(call) || of != subject,
            Line::Became { of, .. } => of != subject,
            _ => true,
        });
    }

    fn delete(&mut self, subject: &Subject) {
        self.kept.retain(|kept| !matches!(&kept.line, Line::Call { of: Some(of), .. } | Line::Became { of, .. } if of == subject));
    }

    fn close(&mut self, session: &str) {
        for kept in &mut self.kept {
            if let Line::Call { of: Some(_), by, .. } = &mut kept.line
                && by.session == session
            {
                by.session.clear();
            }
        }
    }

    /// Merges new values into the previously set ones.
    fn set(&mut self, at: usize, subject: &Subject, line: Line) {
        let is_set =
            |kept: &&mut LedgerEntry| matches!(&kept.line, Line::Call { call, of: Some(of), .. } if effect(call) == Effect::TunesInstance && of == subject);
        let before = self.kept.iter_mut().find(is_set);
        match (before.map(|kept| &mut kept.line), line) {
            (Some(Line::Call { arguments: have, .. }), Line::Call { arguments, .. }) => {
                for (name, given) in arguments {
                    match (have.get_mut(&name), given) {
                        (Some(Json::Object(have)), Json::Object(given)) => have.extend(given),
                        (_, given) => drop(have.insert(name, given)),
                    }
                }
            }
            (_, line) => self.kept.push(LedgerEntry { at, line }),
        }
    }

    fn configure(&mut self, at: usize, line: Line) {
        let Line::Call { call, arguments, .. } = &line else { return };
        let makers: Vec<(&str, &str)> = api::calls().filter_map(|maker| gone_with(maker, call)).collect();
        if !makers.is_empty() {
            if let Some(device) = arguments.get("name").and_then(Json::as_str).filter(|_| effect(call) == Effect::DeletesDevice) {
                self.end(&Subject::Device(device.to_owned()));
            }
            let count = self.kept.len();
            self.kept.retain(|kept| !makers.iter().any(|(maker, by)| is_call(&kept.line, maker, &[(*by, arguments.get("name"))])));
            if self.kept.len() < count {
                return;
            }
        }
        if let Some(keys) = api::find(call).and_then(|call| call.journal.replaces) {
            let of: Vec<(&str, Option<&Json>)> = keys.iter().map(|key| (*key, arguments.get(*key))).collect();
            self.kept.retain(|kept| !is_call(&kept.line, call, &of));
        } else {
            let of = ["processor", "name"].map(|key| (key, arguments.get(key)));
            let before = self.kept.iter().rev().find(|kept| is_call(&kept.line, call, &of));
            if before.is_some_and(|kept| matches!(&kept.line, Line::Call { arguments: have, .. } if same(have, arguments))) {
                return;
            }
        }
        self.kept.push(LedgerEntry { at, line });
    }
}

/// Returns the effect of a line's call; `None` if the call no longer exists.
pub(crate) fn effect(call: &str) -> Effect {
    api::find(call).map_or(Effect::None, |call| call.effect)
}

/// Returns true if the call of a line creates an instance.
pub(crate) fn creates(call: &str) -> bool {
    effect(call) == Effect::CreatesInstance
}

/// Returns the subject that a line starts.
fn starting(line: &Line) -> Option<&Subject> {
    match line {
        Line::Call { call, of, .. } if matches!(effect(call), Effect::StartsInstance | Effect::EnablesDevice) => of.as_ref(),
        _ => None,
    }
}

/// Returns the call whose item is deleted by the call `deletes`, and the argument of that call that names the item.
fn gone_with(maker: &'static Call, deletes: &str) -> Option<(&'static str, &'static str)> {
    maker.journal.goes_with.filter(|(with, _)| *with == deletes).map(|(_, by)| (maker.name, by))
}

fn is_call(line: &Line, name: &str, of: &[(&str, Option<&Json>)]) -> bool {
    matches!(line, Line::Call { call, arguments, .. } if call == name && of.iter().all(|(key, value)| arguments.get(*key) == *value))
}

/// Returns true if two argument maps are equal, including the order of their names, on which lists of commands depend.
fn same(have: &Map<String, Json>, given: &Map<String, Json>) -> bool {
    serde_json::to_string(have).ok() == serde_json::to_string(given).ok()
}
