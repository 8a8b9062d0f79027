// SPDX-License-Identifier: Apache-2.0
//! Checks of the life cycle of a driver: it can be opened and closed in any order, and leaves nothing behind.
use super::check::{Check, CheckResult, PassedCheck, holds};
use super::measures::{descriptors, processes, settled, threads};
use super::subject::Subject;
use device::Class;
use std::time::{Duration, Instant};

pub(super) const CHECKS: &[Check] = &[
    Check { name: "dropped", sentence: "a driver that was created but not opened can be dropped", run: dropped },
    Check { name: "close-unopened", sentence: "a driver that was not opened can be closed", run: close_unopened },
    Check { name: "safe-unopened", sentence: "a driver that was not opened can be sent to its safe state", run: safe_unopened },
    Check { name: "opens", sentence: "it opens within the waiting time that it declares", run: opens },
    Check { name: "open-twice", sentence: "opening it a second time is refused or harmless", run: open_twice },
    Check { name: "close-twice", sentence: "closing it a second time is harmless", run: close_twice },
    Check { name: "dropped-open", sentence: "an open driver can be dropped without being closed", run: dropped_open },
    Check { name: "closed-exchange", sentence: "an exchange after it was closed is refused or harmless", run: closed_exchange },
    Check { name: "channels-open", sentence: "opening it changes none of its channels", run: channels_open },
    Check { name: "again", sentence: "a new driver can be opened after one was closed, and exchanges", run: again },
    Check { name: "descriptors", sentence: "many openings leave no descriptor behind", run: descriptors_left },
    Check { name: "threads", sentence: "many openings leave no thread behind", run: threads_left },
    Check { name: "processes", sentence: "many openings leave no process behind", run: processes_left },
];

/// Time limit for opening, in addition to the declared wait for the device; only intended to catch a driver that hangs.
const ALLOWANCE: Duration = Duration::from_secs(20);
/// Returns the number of life cycles; fewer are enough for a driver in its own process.
fn lives(subject: &Subject) -> usize {
    if subject.of.class == Class::Process { 4 } else { 20 }
}

fn dropped(subject: &Subject) -> CheckResult {
    drop(subject.made()?);
    Ok(PassedCheck::Yes)
}

fn close_unopened(subject: &Subject) -> CheckResult {
    subject.made()?.0.close();
    Ok(PassedCheck::Yes)
}

fn safe_unopened(subject: &Subject) -> CheckResult {
    subject.made()?.0.safe_state();
    Ok(PassedCheck::Yes)
}

fn opens(subject: &Subject) -> CheckResult {
    let (mut driver, _) = subject.made()?;
    let (begun, limit) = (Instant::now(), Duration::from_nanos(subject.of.life.waits_ns.unsigned_abs()) + ALLOWANCE);
    driver.open(0).map_err(|why| why.message)?;
    let lasted = begun.elapsed();
    driver.close();
    holds(lasted <= limit, || format!("it took {:.1} s", lasted.as_secs_f64()))
}

fn open_twice(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    let _ = rig.driver.open(rig.release_ns);
    let _ = rig.read();
    rig.driver.close();
    Ok(PassedCheck::Yes)
}

fn close_twice(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    rig.driver.close();
    rig.driver.close();
    Ok(PassedCheck::Yes)
}

fn dropped_open(subject: &Subject) -> CheckResult {
    drop(subject.open()?);
    let mut next = subject.open()?;
    next.read().map_err(|why| format!("the next driver cannot read: {why}"))?;
    Ok(PassedCheck::Yes)
}

fn closed_exchange(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    rig.cycle()?;
    rig.driver.close();
    let _ = rig.read();
    let _ = rig.write();
    rig.driver.safe_state();
    Ok(PassedCheck::Yes)
}

fn channels_open(subject: &Subject) -> CheckResult {
    let mut rig = subject.rig()?;
    let before = format!("{:?}", rig.driver.channels());
    rig.open()?;
    holds(format!("{:?}", rig.driver.channels()) == before, || "they differ then".to_owned())
}

fn again(subject: &Subject) -> CheckResult {
    for life in 1..=3 {
        let mut rig = subject.open().map_err(|why| format!("opening {life}: {why}"))?;
        rig.cycles(3).map_err(|why| format!("opening {life}: {why}"))?;
        rig.driver.close();
    }
    Ok(PassedCheck::Yes)
}

/// Returns the growth of a count over several life cycles.
fn left(subject: &Subject, count: fn() -> usize) -> Result<usize, String> {
    let live = || -> Result<(), String> {
        let mut rig = subject.open()?;
        rig.cycle()?;
        rig.driver.close();
        Ok(())
    };
    // The first life makes resources that are shared by all lives.
    live()?;
    let before = settled(count, count());
    (0..lives(subject)).try_for_each(|_| live())?;
    Ok(settled(count, before).saturating_sub(before))
}

fn descriptors_left(subject: &Subject) -> CheckResult {
    let left = left(subject, descriptors)?;
    holds(left == 0, || format!("{left} are left"))
}

fn threads_left(subject: &Subject) -> CheckResult {
    let left = left(subject, threads)?;
    holds(left == 0, || format!("{left} are left"))
}

fn processes_left(subject: &Subject) -> CheckResult {
    let left = left(subject, processes)?;
    holds(left == 0, || format!("{left} are left"))
}
