// SPDX-License-Identifier: Apache-2.0
//! Checks of the exchange: readings and commands, including unusual times and numbers.
use super::check::{Check, CheckResult, NO_PARTS, PassedCheck, holds};
use super::rig::{PERIOD_NS, Rig};
use super::subject::Subject;
use device::Direction;

pub(super) const CHECKS: &[Check] = &[
    Check { name: "first-reading", sentence: "the first reading after opening succeeds, and its numbers are finite", run: first_reading },
    Check { name: "readings-whole", sentence: "a reading writes nothing beyond the last channel", run: readings_whole },
    Check { name: "truth-values", sentence: "a Boolean that it reads is 0 or 1", run: truth_values },
    Check { name: "commands-kept", sentence: "an exchange leaves the commands as they are", run: commands_kept },
    Check { name: "unengaged", sentence: "while nothing is commanded, its parts stand still", run: unengaged },
    Check { name: "no-leap", sentence: "a part that is engaged at its measured state does not jump", run: no_leap },
    Check { name: "let-go", sentence: "a part that is released comes to rest, and can be engaged again", run: let_go },
    Check { name: "time-stands", sentence: "two exchanges at the same time leave its readings finite", run: time_stands },
    Check { name: "time-leaps", sentence: "an exchange 10 s late succeeds or loses the device, and its readings are finite", run: time_leaps },
    Check { name: "time-returns", sentence: "an exchange before the last one succeeds or loses the device, and its readings are finite", run: time_returns },
    Check { name: "nan", sentence: "a command that is not a number is refused, or does not come back in the readings", run: nan },
    Check { name: "infinity", sentence: "a command that is infinite is refused, or does not come back in the readings", run: infinity },
    Check { name: "huge", sentence: "commands of the maximum magnitude do not end an exchange", run: huge },
    Check { name: "all-bytes", sentence: "arbitrary bytes as a command do not end its process", run: all_bytes },
];

/// Maximum step in one firing, rad or m; more counts as a leap, whatever the part.
const LEAP: f64 = 0.01;
/// Number of warm-up firings before the check.
const WARM: usize = 50;

fn first_reading(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    rig.read()?;
    finite(&rig)
}

fn finite(rig: &Rig) -> CheckResult {
    rig.not_finite().map_or(Ok(PassedCheck::Yes), |name| Err(format!("'{name}' is not finite")))
}

fn readings_whole(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    rig.cycles(WARM)?;
    holds(rig.is_whole(), || "bytes beyond it have changed".to_owned())
}

fn truth_values(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    let truths = rig.driver.channels().iter().filter(|channel| channel.direction == Direction::Read && channel.type_text.starts_with("bool"));
    let truths: Vec<_> = truths.map(|channel| (channel.name.clone(), channel.offset..channel.offset + channel.len)).collect();
    if truths.is_empty() {
        return Ok(PassedCheck::NotApplicable("it reads none"));
    }
    for _ in 0..WARM {
        rig.cycle()?;
        let odd = truths.iter().find_map(|(name, place)| Some((name, rig.readings[place.clone()].iter().find(|byte| **byte > 1)?)));
        holds(odd.is_none(), || odd.map_or_else(String::new, |(name, byte)| format!("'{name}' is {byte}")))?;
    }
    Ok(PassedCheck::Yes)
}

fn commands_kept(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    let before = rig.commands.clone();
    rig.cycles(WARM)?;
    holds(rig.commands == before, || "they differ after it".to_owned())
}

/// Checks that no part has moved by more than a leap between two positions.
fn still(rig: &Rig, joints: &[super::rig::Joint], before: &[f64], what: &str) -> CheckResult {
    for ((joint, before), after) in joints.iter().zip(before).zip(rig.positions(joints)) {
        let most = LEAP.min((joint.speed_max * PERIOD_NS as f64 * 1e-9).max(LEAP / 10.0));
        holds((after - before).abs() <= most, || format!("'{}' goes from {before} to {after} {what}", joint.name))?;
    }
    Ok(PassedCheck::Yes)
}

fn unengaged(subject: &Subject) -> CheckResult {
    let Some((mut rig, joints)) = subject.open_with_parts()? else { return Ok(NO_PARTS) };
    rig.cycles(2)?;
    let before = rig.positions(&joints);
    rig.cycles(20)?;
    still(&rig, &joints, &before, "within 20 firings")
}

fn no_leap(subject: &Subject) -> CheckResult {
    let Some((mut rig, joints)) = subject.open_with_parts()? else { return Ok(NO_PARTS) };
    rig.cycles(3)?;
    for _ in 0..10 {
        let before = rig.positions(&joints);
        rig.hold(&joints);
        rig.cycle()?;
        rig.read()?;
        still(&rig, &joints, &before, "in one firing")?;
    }
    Ok(PassedCheck::Yes)
}

fn let_go(subject: &Subject) -> CheckResult {
    let Some((mut rig, joints)) = subject.open_with_parts()? else { return Ok(NO_PARTS) };
    for _ in 0..3 {
        rig.cycle()?;
        rig.hold(&joints);
        rig.cycles(3)?;
        rig.let_go();
        rig.cycles(50)?;
        let before = rig.positions(&joints);
        rig.cycles(10)?;
        still(&rig, &joints, &before, "although it is not commanded")?;
    }
    Ok(PassedCheck::Yes)
}

/// Runs an exchange that may fail; if it does not, checks that the readings are finite.
fn tolerant(rig: &mut Rig) -> CheckResult {
    match rig.cycle().and_then(|()| rig.read()) {
        Ok(()) => finite(rig),
        Err(_) => Ok(PassedCheck::Yes),
    }
}

fn time_stands(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    rig.cycle()?;
    for _ in 0..3 {
        rig.read().map_err(|why| format!("its reading fails: {why}"))?;
        rig.write().map_err(|why| format!("its writing fails: {why}"))?;
    }
    finite(&rig)
}

fn time_leaps(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    rig.cycles(3)?;
    rig.release_ns += 10_000_000_000;
    tolerant(&mut rig)
}

fn time_returns(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    rig.cycles(20)?;
    rig.release_ns -= 10 * PERIOD_NS;
    tolerant(&mut rig)
}

/// Commands every double with this value, and checks that each exchange fails or returns finite readings.
fn commanded(subject: &Subject, value: f64) -> CheckResult {
    let mut rig = subject.open()?;
    let doubles: Vec<_> = doubles(&rig);
    if doubles.is_empty() {
        return Ok(PassedCheck::NotApplicable("no double is written"));
    }
    rig.cycles(3)?;
    for (offset, len) in doubles {
        (offset..offset + len).step_by(8).for_each(|at| rig.commands[at..at + 8].copy_from_slice(&value.to_ne_bytes()));
    }
    rig.engaged.fill(true);
    tolerant(&mut rig)?;
    rig.let_go();
    tolerant(&mut rig)?;
    rig.driver.safe_state();
    Ok(PassedCheck::Yes)
}

fn doubles(rig: &Rig) -> Vec<(usize, usize)> {
    let written = rig.driver.channels().iter().filter(|channel| channel.direction == Direction::Write && channel.type_text.starts_with("double"));
    written.map(|channel| (channel.offset, channel.len)).collect()
}

fn nan(subject: &Subject) -> CheckResult {
    commanded(subject, f64::NAN)
}

fn infinity(subject: &Subject) -> CheckResult {
    commanded(subject, f64::INFINITY)?;
    commanded(subject, f64::NEG_INFINITY)
}

fn huge(subject: &Subject) -> CheckResult {
    for value in [f64::MAX, f64::MIN, f64::MIN_POSITIVE] {
        let mut rig = subject.open()?;
        for (offset, len) in doubles(&rig) {
            (offset..offset + len).step_by(8).for_each(|at| rig.commands[at..at + 8].copy_from_slice(&value.to_ne_bytes()));
        }
        rig.engaged.fill(true);
        let _ = rig.cycles(3);
        rig.driver.safe_state();
    }
    Ok(PassedCheck::Yes)
}

fn all_bytes(subject: &Subject) -> CheckResult {
    let mut rig = subject.open()?;
    let written: Vec<_> =
        rig.driver.channels().iter().filter(|channel| channel.direction == Direction::Write && channel.type_text != "bool").cloned().collect();
    // A Boolean has two valid forms; each other type may have any bytes.
    let written: Vec<_> = written.into_iter().filter(|channel| !channel.type_text.starts_with("bool")).collect();
    if written.is_empty() {
        return Ok(PassedCheck::NotApplicable("no number is written"));
    }
    for byte in [0x00, 0x01, 0x7F, 0x80, 0xFF] {
        written.iter().for_each(|channel| rig.commands[channel.offset..channel.offset + channel.len].fill(byte));
        rig.engaged.fill(byte != 0);
        if rig.cycle().is_err() {
            rig = subject.open()?;
        }
    }
    rig.driver.safe_state();
    Ok(PassedCheck::Yes)
}
