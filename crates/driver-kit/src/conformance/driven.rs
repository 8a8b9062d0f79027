// SPDX-License-Identifier: Apache-2.0
//! Checks of motion over many firings: readings stay finite, and parts at rest stay at rest.
use super::check::{Check, CheckResult, NO_PARTS, PassedCheck, none_of};
use super::subject::Subject;

pub(super) const CHECKS: &[Check] = &[
    Check { name: "readings-stay-finite", sentence: "its readings stay finite over many firings", run: stay_finite },
    Check { name: "creep", sentence: "a part that nothing commands does not creep", run: creep },
];

/// Number of firings to check: half a second of a machine at 1 kHz, enough for effects that do not appear in the first firings.
const MANY: usize = 500;
/// Maximum distance, rad or m, that a part at rest may creep in `MANY` firings.
const CREEP: f64 = 0.01;

fn stay_finite(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    for firing in 1..=MANY {
        rig.cycle()?;
        // The first reading has a check of its own.
        if let Some(name) = rig.not_finite().filter(|_| firing > 1) {
            return Err(format!("'{name}' is not finite after {firing} readings"));
        }
    }
    Ok(PassedCheck::Yes)
}

fn creep(subject: &Subject) -> CheckResult {
    let Some((mut rig, joints)) = subject.open_with_parts()? else { return Ok(NO_PARTS) };
    rig.cycles(2)?;
    let before = rig.positions(&joints);
    rig.cycles(MANY)?;
    let gone = joints.iter().zip(before).zip(rig.positions(&joints));
    none_of(
        gone.filter(|((_, before), after)| (after - before).abs() > CREEP)
            .map(|((joint, before), after)| format!("'{}' goes from {before} to {after} within {MANY} firings, although nothing commands it", joint.name)),
    )
}
