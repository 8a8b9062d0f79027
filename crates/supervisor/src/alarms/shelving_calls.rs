// SPDX-License-Identifier: Apache-2.0
//! Shelving: an operator removes an alarm from the list for a limited time, stating a reason (ISA-18.2). The alarm itself is shelved, not
//! one occurrence of it: if it returns and recurs in the meantime, it stays shelved.
use crate::alarms::list::{Alarm, Alarms, Cause, Severity};
use crate::alarms::shelving::Shelving;
use crate::core::Core;
use crate::refuse::{refuse, unknown};
use model::refusal::{Class, Refusals};
use model::wording::printable;

/// Maximum duration of a shelving.
const FOR_MAX_NS: i64 = 24 * 3600 * 1_000_000_000;
/// Maximum number of shelvings recorded with an alarm; only the most recent are kept.
const REMEMBERED_MAX: usize = 16;
/// Maximum number of characters in a reason.
const REASON_MAX: usize = 400;

/// Request to shelve an alarm.
pub struct ShelvingRequest {
    pub number: u64,
    pub reason: String,
    pub for_ns: i64,
    pub who: String,
}

impl Alarm {
    /// Returns true if the alarm is currently shelved.
    pub fn is_shelved(&self) -> bool {
        self.shelvings.last().is_some_and(|shelving| shelving.ended_ns.is_none())
    }

    /// Returns the reason why the alarm must stay in the list, if it must.
    fn unshelvable(&self) -> Option<&'static str> {
        match self.cause {
            Cause::Latch => Some("it is an emergency stop"),
            Cause::Loss | Cause::Processor => Some("the device or processor that it reports is lost"),
            Cause::Forced => Some("it lasts as long as the signal is forced"),
            Cause::Event | Cause::Fault => (self.severity == Severity::Critical).then_some("its severity is critical"),
        }
    }

    /// Puts the alarm back into the list if it is shelved.
    pub(crate) fn unshelve(&mut self, now_ns: i64, who: &str) {
        if let Some(shelving) = self.shelvings.last_mut().filter(|shelving| shelving.ended_ns.is_none()) {
            (shelving.ended_ns, shelving.ended_by) = (Some(now_ns), printable(who));
        }
    }

    /// Updates whether the alarm can be shelved, and puts it back into the list if it no longer can.
    pub(crate) fn judge_shelvable(&mut self, now_ns: i64) {
        self.shelvable = self.unshelvable().is_none();
        if !self.shelvable {
            self.unshelve(now_ns, "");
        }
    }
}

impl Alarms {
    /// Returns the time at which the next shelving expires.
    pub fn next_unshelving(&self) -> Option<i64> {
        self.current.iter().filter(|alarm| alarm.is_shelved()).filter_map(|alarm| Some(alarm.shelvings.last()?.until_ns)).min()
    }

    fn known(&mut self, number: u64) -> Result<&mut Alarm, Refusals> {
        let Some(at) = self.current.iter().position(|alarm| alarm.number == number) else {
            let known: Vec<String> = self.current.iter().map(|alarm| alarm.number.to_string()).collect();
            return Err(unknown("alarm", &number.to_string(), known.iter().map(String::as_str)));
        };
        Ok(&mut self.current[at])
    }
}

impl Core {
    /// Shelves an alarm. If it is already shelved, its expiry and reason are replaced.
    pub fn shelve(&mut self, asked: &ShelvingRequest) -> Result<(), Refusals> {
        let reason = printable(asked.reason.trim());
        if reason.is_empty() || reason.chars().count() > REASON_MAX {
            let what = if reason.is_empty() { "has no reason".to_owned() } else { format!("has a reason of more than {REASON_MAX} characters") };
            return Err(refuse(Class::CallError, format!("the shelving of alarm {} {what}", asked.number), "explain in a sentence why it may leave the list"));
        }
        if !(1..=FOR_MAX_NS).contains(&asked.for_ns) {
            let message = format!("an alarm cannot be shelved for {} s: the time must be above 0 s and at most 24 h", asked.for_ns as f64 * 1e-9);
            return Err(refuse(Class::OutOfRange, message, "give at most 24 h; shelve it again after that"));
        }
        let now_ns = self.host.now_ns();
        let wall_ns = self.safety.alarms.wall_ns(now_ns);
        let alarm = self.safety.alarms.known(asked.number)?;
        if let Some(why) = alarm.unshelvable() {
            let message = format!("alarm '{}' of '{}' cannot be shelved: {why}", alarm.code, alarm.source);
            return Err(refuse(Class::NotAllowed, message, "remove its cause, and acknowledge it"));
        }
        alarm.unshelve(now_ns, &asked.who);
        if alarm.shelvings.len() == REMEMBERED_MAX {
            alarm.shelvings.remove(0);
        }
        let who = printable(&asked.who);
        let text = format!("{}: shelved for {} s: {reason}", alarm.code, asked.for_ns as f64 * 1e-9);
        let source = alarm.source.clone();
        let until_ns = now_ns.saturating_add(asked.for_ns);
        alarm.shelvings.push(Shelving { who: who.clone(), reason, time_ns: now_ns, wall_ns, until_ns, ended_ns: None, ended_by: String::new() });
        self.observation.log.add_of(now_ns, "alarm", &source, text, &who);
        Ok(())
    }

    /// Puts an alarm back into the list. Returns true if it was shelved.
    pub fn unshelve(&mut self, number: u64, who: &str) -> Result<bool, Refusals> {
        let now_ns = self.host.now_ns();
        let alarm = self.safety.alarms.known(number)?;
        if !alarm.is_shelved() {
            return Ok(false);
        }
        alarm.unshelve(now_ns, who);
        let (source, text) = (alarm.source.clone(), format!("{}: no longer shelved", alarm.code));
        self.safety.alarms.sweep();
        self.observation.log.add_of(now_ns, "alarm", &source, text, who);
        Ok(true)
    }

    /// Puts all alarms whose shelving has expired back into the list.
    pub fn serve_shelvings(&mut self, now_ns: i64) {
        if self.safety.alarms.next_unshelving().is_none_or(|until_ns| until_ns > now_ns) {
            return;
        }
        let is_due = |alarm: &&mut Alarm| alarm.is_shelved() && alarm.shelvings.last().is_some_and(|shelving| shelving.until_ns <= now_ns);
        for alarm in self.safety.alarms.current.iter_mut().filter(is_due) {
            alarm.unshelve(now_ns, "");
            self.observation.log.add(now_ns, "alarm", &alarm.source, format!("{}: its shelving has expired", alarm.code));
        }
        self.safety.alarms.sweep();
    }
}
