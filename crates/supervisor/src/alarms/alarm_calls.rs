// SPDX-License-Identifier: Apache-2.0
//! Alarm calls: they define texts, raise alarms for the programming system, acknowledge alarms, and list them.
use crate::alarms::causes::{known_alarm, raise};
use crate::alarms::list::{Alarm, AlarmList, AlarmText, Cause, RaisedAlarm, Severity};
use crate::alarms::shelving_calls::ShelvingRequest;
use crate::refuse::{refuse, unknown};
use crate::system::System;
use model::refusal::{Class, Refusals};
use model::wording::printable;

impl System {
    /// Defines the text of an alarm code, or redefines it for subsequent alarms.
    pub fn define_alarm(&self, code: &str, said: AlarmText) -> Result<(), Refusals> {
        if code.is_empty() || said.text.is_empty() {
            return Err(refuse(Class::DefinitionError, format!("alarm '{code}' has no code or no text"), "give both"));
        }
        if printable(code) != code {
            return Err(refuse(Class::DefinitionError, format!("the code of an alarm cannot be {code:?}"), "use printable characters"));
        }
        let said = AlarmText { text: printable(said.text), remedy: printable(said.remedy), ..said };
        self.shared.command(|core| {
            core.safety.alarms.texts.insert(code.to_owned(), said);
            Ok(())
        })
    }

    /// Raises a defined alarm, which stays active until it is cleared.
    pub fn raise_alarm(&self, code: &str, source: &str, text: &str) -> Result<(), Refusals> {
        self.shared.command(|core| {
            known_alarm(core, code)?;
            raise(core, RaisedAlarm { code, source, block: None, text: text.to_owned(), remedy: "", severity: Severity::High, cause: Cause::Event });
            Ok(())
        })
    }

    /// Clears an alarm raised by the programming system. Returns false if it was not active.
    pub fn clear_alarm(&self, code: &str, source: Option<&str>) -> Result<bool, Refusals> {
        self.shared.command(|core| {
            known_alarm(core, code)?;
            let now_ns = core.host.now_ns();
            Ok(core.safety.alarms.clear(now_ns, |a| a.code == code && source.is_none_or(|source| a.source == source)) > 0)
        })
    }

    /// Acknowledges the alarm with this number, or all alarms except shelved ones. Returns the number of newly acknowledged alarms.
    pub fn acknowledge_alarms(&self, number: Option<u64>) -> Result<usize, Refusals> {
        self.shared.command(|core| {
            if let Some(number) = number.filter(|n| !core.safety.alarms.current.iter().any(|a| a.number == *n)) {
                let known: Vec<String> = core.safety.alarms.current.iter().map(|a| a.number.to_string()).collect();
                return Err(unknown("alarm", &number.to_string(), known.iter().map(String::as_str)));
            }
            let now_ns = core.host.now_ns();
            Ok(core.safety.alarms.acknowledge(now_ns, |a| number.map_or(!a.is_shelved(), |n| a.number == n)))
        })
    }

    /// Returns the current alarms, the history, and the text of each alarm code.
    pub fn alarms(&self) -> AlarmList {
        let core = self.shared.locked();
        let of = &core.safety.alarms;
        let (shelved, current) = of.current.iter().cloned().partition(Alarm::is_shelved);
        AlarmList { current, shelved, history: of.history.iter().cloned().collect(), texts: of.texts.clone(), dropped: of.dropped }
    }

    /// Removes an alarm from the list for a limited time.
    ///
    /// # Errors
    /// Fails with `CallError` if no reason is given, with `OutOfRange` beyond 24 h, with `UnknownName` if the alarm does not exist, and with `NotAllowed` if the alarm must stay in the list: emergency stops, losses, and alarms of critical severity.
    pub fn shelve_alarm(&self, asked: &ShelvingRequest) -> Result<(), Refusals> {
        self.shared.command(|core| core.shelve(asked))
    }

    /// Puts a shelved alarm back into the list. Returns true if it was shelved.
    pub fn unshelve_alarm(&self, number: u64, who: &str) -> Result<bool, Refusals> {
        self.shared.command(|core| core.unshelve(number, who))
    }

    /// Restores the history of an earlier run of the system; its numbers are not reused.
    pub fn restore_alarms(&self, history: Vec<Alarm>) -> Result<(), Refusals> {
        self.shared.command(|core| {
            let last = history.iter().map(|a| a.number).max().unwrap_or(0);
            core.safety.alarms.last = core.safety.alarms.last.max(last);
            history.into_iter().rev().map(Alarm::printable).for_each(|alarm| core.safety.alarms.history.push_front(alarm));
            core.safety.alarms.trim();
            Ok(())
        })
    }
}
