// SPDX-License-Identifier: Apache-2.0
//! Alarms.
use crate::sure;
use supervisor::{Alarm, AlarmList, AlarmText, ShelvingRequest};

/// Caller that shelves an alarm, where none is given.
const PROGRAM: &str = "program";

crate::calls! {
    /// Alarms.
    pub(super) const ALARMS about "alarms" = [
        /// Says what the alarms of a code mean.
        Configure define_alarm(must code: String, whole said: AlarmText) -> (): commands("code"), replaces(&["code"])
            => |system| system.define_alarm(&code, said);
        /// Raises an alarm.
        Operate raise_alarm(
            must code: String,
            /// Source of the alarm.
            may source: String,
            may text: String,
        ) -> (): commands("code"), told
            => |system| system.raise_alarm(&code, &source, &text);
        /// Says that the cause of an alarm is gone. Returns whether there was one.
        Operate clear_alarm(must code: String, may source: Option<String>) -> bool: commands("code"), told
            => |system| system.clear_alarm(&code, source.as_deref());
        /// Returns all alarms, those that are shelved, and their history.
        Observe alarms() -> AlarmList
            => |system| sure(system.alarms());
        /// Acknowledges one alarm, or all that are not shelved. Returns how many.
        Operate acknowledge_alarms(may number: Option<u64>) -> usize: commands(""), told, free
            => |system| system.acknowledge_alarms(number);
        /// Takes an alarm out of the list for a time. Emergency stops, what is lost, and the severity critical stay in it.
        Operate shelve_alarm(
            must number: u64,
            /// Reason for it.
            must reason: String,
            /// Duration on the system's clock: 24 h at most.
            must for_ns: i64,
            /// Person or session that shelves it: the control interface enters its caller.
            may who: Option<String>,
        ) -> (): commands(""), told, free, signed("who")
            => |system| system.shelve_alarm(&ShelvingRequest { number, reason, for_ns, who: who.unwrap_or_else(|| PROGRAM.to_owned()) });
        /// Puts a shelved alarm back into the list. Returns whether it was shelved.
        Operate unshelve_alarm(
            must number: u64,
            /// Person or session that does it: the control interface enters its caller.
            may who: Option<String>,
        ) -> bool: commands(""), told, free, signed("who")
            => |system| system.unshelve_alarm(number, who.as_deref().unwrap_or(PROGRAM));
        /// Enters the history of an earlier life.
        Configure restore_alarms(must history: Vec<Alarm>) -> (): commands(""), replaces(&[])
            => |system| system.restore_alarms(history);
    ];
}
