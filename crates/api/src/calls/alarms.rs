// SPDX-License-Identifier: Apache-2.0
//! Calls for alarms.
use crate::calls::PROGRAM;
use crate::sure;
use supervisor::{Alarm, AlarmList, AlarmText, ShelvingRequest};

crate::calls! {
    /// Calls for alarms.
    pub(super) const ALARMS about "alarms" = [
        /// Defines the text of an alarm code.
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
        /// Clears the cause of an alarm. Returns true if the alarm was active.
        Operate clear_alarm(must code: String, may source: Option<String>) -> bool: commands("code"), told
            => |system| system.clear_alarm(&code, source.as_deref());
        /// Returns the current alarms, the shelved ones, and the history.
        Observe alarms() -> AlarmList
            => |system| sure(system.alarms());
        /// Acknowledges one alarm, or all alarms that are not shelved. Returns the number of newly acknowledged alarms.
        Operate acknowledge_alarms(may number: Option<u64>) -> usize: commands(""), told, free
            => |system| system.acknowledge_alarms(number);
        /// Removes an alarm from the list for a limited time. Emergency stops, losses, and alarms of critical severity cannot be shelved.
        Operate shelve_alarm(
            must number: u64,
            /// Reason for the shelving.
            must reason: String,
            /// Duration on the system's clock; at most 24 h.
            must for_ns: i64,
            /// Person or session that shelves the alarm; set by the control interface to its caller.
            may who: Option<String>,
        ) -> (): commands(""), told, free, signed("who")
            => |system| system.shelve_alarm(&ShelvingRequest { number, reason, for_ns, who: who.unwrap_or_else(|| PROGRAM.to_owned()) });
        /// Puts a shelved alarm back into the list. Returns true if it was shelved.
        Operate unshelve_alarm(
            must number: u64,
            /// Person or session that unshelves the alarm; set by the control interface to its caller.
            may who: Option<String>,
        ) -> bool: commands(""), told, free, signed("who")
            => |system| system.unshelve_alarm(number, who.as_deref().unwrap_or(PROGRAM));
        /// Restores the alarm history from an earlier run.
        Configure restore_alarms(must history: Vec<Alarm>) -> (): commands(""), replaces(&[])
            => |system| system.restore_alarms(history);
    ];
}
