// SPDX-License-Identifier: Apache-2.0
//! Checks of the safe state: it is reached as declared, and the driver continues afterwards.
use super::check::{Check, CheckResult, NO_PARTS, PassedCheck, holds};
use super::measures::allocations;
use super::rig::{PERIOD_NS, Rig};
use super::subject::Subject;
use device::{SafeBy, SafeHandle};
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::time::{Duration, Instant};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "safe-returns", sentence: "going to the safe state returns, within its declared time and the delay of a busy machine", run: returns },
    Check { name: "safe-rests", sentence: "its parts stand still once its declared time has passed", run: rests },
    Check { name: "safe-twice", sentence: "going to the safe state twice is harmless", run: twice },
    Check { name: "safe-allocation", sentence: "going to the safe state allocates nothing if the exchange is inline", run: allocation },
    Check { name: "safe-goes-on", sentence: "after its safe state it exchanges again, or is lost and can be opened again", run: goes_on },
    Check { name: "safe-handles", sentence: "it has handles for the guard if and only if it declares the guard", run: handles },
    Check { name: "handles-work", sentence: "what the guard writes to its handles is accepted completely", run: handles_work },
    Check { name: "watchdog-by", sentence: "it has a watchdog if it declares that its device goes to its safe state by itself", run: by_device },
];

/// Additional time allowed for a busy machine; only intended to catch a driver that hangs.
const ALLOWANCE: Duration = Duration::from_secs(10);
/// Maximum motion in 10 firings at rest, rad or m.
const REST: f64 = 1e-3;

/// Pushes the parts gently, in each direction in which they can move.
fn pushed(subject: &Subject) -> Result<Rig, String> {
    let mut rig = subject.open()?;
    let joints = rig.joints();
    rig.cycles(2)?;
    for _ in 0..20 {
        rig.hold(&joints);
        for joint in joints.iter().filter(|joint| joint.is_effort) {
            let effort = joint.command.double(&rig.commands, 0) + (0.05 * joint.effort_max).min(1.0);
            joint.command.set_double(&mut rig.commands, 0, effort);
        }
        rig.cycle()?;
    }
    Ok(rig)
}

fn returns(subject: &Subject) -> CheckResult {
    let mut rig = pushed(subject)?;
    let (begun, limit) = (Instant::now(), Duration::from_nanos(subject.of.safe_state.within_ns.unsigned_abs()) + ALLOWANCE);
    rig.driver.safe_state();
    let lasted = begun.elapsed();
    holds(lasted <= limit, || format!("it took {:.1} s", lasted.as_secs_f64()))
}

fn rests(subject: &Subject) -> CheckResult {
    let mut rig = pushed(subject)?;
    let joints = rig.joints();
    if joints.is_empty() {
        return Ok(NO_PARTS);
    }
    rig.driver.safe_state();
    // The kernel does the same after a fault: no channel is engaged.
    rig.let_go();
    rig.read_for(subject.of.safe_state.within_ns + 2 * PERIOD_NS)?;
    let before = rig.positions(&joints);
    rig.read_for(10 * PERIOD_NS)?;
    for ((joint, before), after) in joints.iter().zip(before).zip(rig.positions(&joints)) {
        holds((after - before).abs() <= REST, || format!("'{}' goes from {before} to {after} within 10 firings", joint.name))?;
    }
    Ok(PassedCheck::Yes)
}

fn twice(subject: &Subject) -> CheckResult {
    let mut rig = pushed(subject)?;
    rig.driver.safe_state();
    rig.driver.safe_state();
    rig.driver.close();
    rig.driver.safe_state();
    Ok(PassedCheck::Yes)
}

fn allocation(subject: &Subject) -> CheckResult {
    if !subject.is_inline() {
        return Ok(PassedCheck::NotApplicable("it is not inline"));
    }
    let mut rig = pushed(subject)?;
    let Some(before) = allocations() else { return Ok(PassedCheck::NotApplicable("allocations are not counted here")) };
    rig.safe_state();
    let times = allocations().unwrap_or(before) - before;
    holds(times == 0, || format!("{times} times"))
}

fn goes_on(subject: &Subject) -> CheckResult {
    let mut rig = pushed(subject)?;
    rig.driver.safe_state();
    rig.let_go();
    if rig.cycles(5).is_ok() {
        return Ok(PassedCheck::Yes);
    }
    drop(rig);
    subject.open()?.cycles(5).map_err(|why| format!("after it was opened again: {why}"))?;
    Ok(PassedCheck::Yes)
}

fn declares(subject: &Subject, by: SafeBy) -> bool {
    subject.of.safe_state.by.contains(&by)
}

fn handles(subject: &Subject) -> CheckResult {
    let rig = subject.open()?;
    let (has, declared) = (!rig.driver.safe_handles().is_empty(), declares(subject, SafeBy::Guard));
    holds(has == declared, || if has { "it has some but does not declare the guard".to_owned() } else { "it declares the guard but has none".to_owned() })
}

/// Carries out the writes that the guard would make.
pub(super) fn write(handle: SafeHandle) -> Result<(), String> {
    let file = File::from(handle.descriptor);
    for (offset, bytes) in &handle.writes {
        let written = file.write_all_at(bytes, *offset).or_else(|_| std::io::Write::write_all(&mut &file, bytes));
        written.map_err(|why| format!("{} bytes at {offset}: {why}", bytes.len()))?;
    }
    if handle.writes.iter().all(|(_, bytes)| bytes.is_empty()) { Err("it has nothing to write".to_owned()) } else { Ok(()) }
}

fn handles_work(subject: &Subject) -> CheckResult {
    let rig = subject.open()?;
    let handles = rig.driver.safe_handles();
    if handles.is_empty() {
        return Ok(PassedCheck::NotApplicable("it has none"));
    }
    handles.into_iter().try_for_each(write)?;
    Ok(PassedCheck::Yes)
}

fn by_device(subject: &Subject) -> CheckResult {
    if !declares(subject, SafeBy::Device) {
        return Ok(PassedCheck::NotApplicable("it does not declare that"));
    }
    holds(subject.rig()?.driver.watchdog_ns().is_some(), || "it has none with these options".to_owned())
}
