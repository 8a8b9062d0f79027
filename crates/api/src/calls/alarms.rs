// SPDX-License-Identifier: Apache-2.0
//! Alarms.
use crate::sure;
use supervisor::{Alarm, AlarmList, AlarmText};

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
        /// Returns all alarms and their history.
        Observe alarms() -> AlarmList
            => |system| sure(system.alarms());
        /// Acknowledges one alarm, or all. Returns how many.
        Operate acknowledge_alarms(may number: Option<u64>) -> usize: commands(""), told, free
            => |system| system.acknowledge_alarms(number);
        /// Enters the history of an earlier life.
        Configure restore_alarms(must history: Vec<Alarm>) -> (): commands(""), replaces(&[])
            => |system| system.restore_alarms(history);
    ];
}
