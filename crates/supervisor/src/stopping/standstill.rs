// SPDX-License-Identifier: Apache-2.0
//! Detects that a whole process was suspended (a paused virtual machine, a frozen container), at the first firing after it resumes. The
//! log gets an entry for each source. If nothing else drove the outputs to a safe state in the meantime, a single alarm reports how long
//! the process was suspended.
use crate::alarms::causes::{alarm_returns, raise};
use crate::alarms::list::{Cause, RaisedAlarm, Severity};
use crate::core::Core;
use kernel::SourceId;

/// Code of the alarm, and name of the condition with which motions end after a gap.
const TIME_LOST: &str = "time_lost";

/// Records that a source was suspended until `time_ns`. If several sources were, the first one raises the alarm.
pub(crate) fn stood_still(core: &mut Core, source: SourceId, late_ns: i64, is_unattended: bool, time_ns: i64) {
    let name = core.registry.source_name(source).to_owned();
    let text = format!("source '{name}' was suspended for {:.1} s (its process or the machine was stopped)", late_ns as f64 * 1e-9);
    core.observation.log.add(time_ns, "late", &name, text.clone());
    if !is_unattended || core.safety.stood_still_until_ns.is_some_and(|until_ns| time_ns - late_ns < until_ns) {
        return;
    }
    core.safety.stood_still_until_ns = Some(time_ns);
    let text = format!(
        "{text}, and nothing updated the outputs: commanded devices were lost and are in their safe states; time limits continued to elapse, and verbs without devices continue"
    );
    let remedy = "find what paused it, check the machine, then call reset()";
    raise(core, RaisedAlarm { code: TIME_LOST, source: "system", block: None, text, remedy, severity: Severity::High, cause: Cause::Event });
    alarm_returns(core, TIME_LOST, "system");
}
