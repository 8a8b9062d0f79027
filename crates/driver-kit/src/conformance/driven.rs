// SPDX-License-Identifier: Apache-2.0
//! Checks of motion over many firings: readings that stay finite, parts that rest, parts that follow their command and say so.
use super::check::{Check, NO_PARTS, Passed, Tried, none_of};
use super::rig::{Joint, PERIOD_NS, Rig};
use super::subject::Subject;
use std::time::Duration;

pub(super) const CHECKS: &[Check] = &[
    Check { name: "readings-stay-finite", sentence: "its readings stay finite over many firings", run: stay_finite },
    Check { name: "creep", sentence: "a part that nothing commands does not creep", run: creep },
    Check { name: "moves", sentence: "a part moves while it is pushed, and its position says so", run: moves },
    Check { name: "velocity-sign", sentence: "the velocity of a part has the sign of its motion", run: velocity_sign },
];

/// Firings that are looked at: half a second of a machine at 1 kHz, and more than what shows in the first ones.
const MANY: usize = 500;
/// Rad or m that a part at rest may go in `MANY` firings.
const CREEP: f64 = 0.01;
/// Firings of a push.
const PUSHED: usize = 100;
/// Rad or m: less is no motion.
const MOTION: f64 = 1e-9;
/// Rad, m: motion whose direction is beyond doubt.
const CLEAR: f64 = 1e-6;

fn stay_finite(subject: &Subject) -> Tried {
    let mut rig = subject.open()?;
    for firing in 1..=MANY {
        rig.cycle()?;
        // The first reading has its own check.
        if let Some(name) = rig.not_finite().filter(|_| firing > 1) {
            return Err(format!("'{name}' is not finite after {firing} readings"));
        }
    }
    Ok(Passed::Yes)
}

fn creep(subject: &Subject) -> Tried {
    let Some((mut rig, joints)) = subject.open_with_parts()? else { return Ok(NO_PARTS) };
    rig.cycles(2)?;
    let before = rig.positions(&joints);
    rig.cycles(MANY)?;
    let gone = joints.iter().zip(before).zip(rig.positions(&joints));
    none_of(
        gone.filter(|((_, before), after)| (after - before).abs() > CREEP)
            .map(|((joint, before), after)| format!("'{}' goes from {before} to {after} within {MANY} firings, and nothing commands it", joint.name)),
    )
}

/// Motion of one part during the second half of a push.
struct Motion {
    distance: f64,
    velocity_mean: f64,
}

/// Pushes every part gently in one direction; `pause` is real time between two firings, for machines that do not follow the time of the kit.
fn push(rig: &mut Rig, joints: &[Joint], sign: f64, pause: Duration) -> Result<Vec<Motion>, String> {
    rig.cycles(2)?;
    let start = rig.positions(joints);
    let (mut half, mut sums) = (start.clone(), vec![0.0; joints.len()]);
    for firing in 1..=PUSHED {
        rig.hold(joints);
        for (joint, start) in joints.iter().zip(&start) {
            let command = if joint.is_effort {
                joint.command.double(&rig.commands, 0) + sign * (0.05 * joint.effort_max).min(1.0)
            } else {
                start + sign * firing as f64 * (0.2 * joint.speed_max * PERIOD_NS as f64 * 1e-9).min(1e-4)
            };
            joint.command.set_double(&mut rig.commands, 0, command);
        }
        rig.cycle()?;
        std::thread::sleep(pause);
        if firing == PUSHED / 2 {
            half = rig.positions(joints);
        }
        if firing > PUSHED / 2 {
            sums.iter_mut().zip(joints).for_each(|(sum, joint)| *sum += joint.velocity.double(&rig.readings, 0));
        }
    }
    let motions = half.iter().zip(rig.positions(joints)).zip(sums);
    let motions = motions.map(|((half, end), sum)| Motion { distance: end - half, velocity_mean: sum / (PUSHED - PUSHED / 2) as f64 });
    let motions = motions.collect();
    rig.let_go();
    rig.cycles(PUSHED)?;
    Ok(motions)
}

/// A part that was pushed up and down.
struct PushedPart {
    joint: Joint,
    motions: [Motion; 2],
}

impl PushedPart {
    fn is_still(&self) -> bool {
        self.motions.iter().all(|motion| motion.distance.abs() < MOTION)
    }
}

/// Every part, pushed up and down; none where the driver has no parts or its exchange is not inline.
fn pushed(subject: &Subject, pause: Duration) -> Result<Vec<PushedPart>, String> {
    if !subject.is_inline() {
        return Ok(Vec::new());
    }
    let Some((mut rig, joints)) = subject.open_with_parts()? else { return Ok(Vec::new()) };
    let (up, down) = (push(&mut rig, &joints, 1.0, pause)?, push(&mut rig, &joints, -1.0, pause)?);
    rig.driver.safe_state();
    Ok(joints.into_iter().zip(up.into_iter().zip(down)).map(|(joint, (up, down))| PushedPart { joint, motions: [up, down] }).collect())
}

const NO_INLINE_PARTS: Passed = Passed::NotApplicable("it has no parts whose exchange is inline");

/// Judges the parts of a push; `fault` says what is wrong with one.
///
/// Parts with a fault are pushed once more, at the pace of the clock on the wall. A machine that moves by that clock may
/// stand still during a push of some microseconds, or get where it should in one step that no reading shows.
fn judged(subject: &Subject, fault: impl Fn(&PushedPart) -> Option<String>) -> Tried {
    let mut parts = pushed(subject, Duration::ZERO)?;
    if parts.is_empty() {
        return Ok(NO_INLINE_PARTS);
    }
    if parts.iter().any(|part| fault(part).is_some()) {
        parts = pushed(subject, Duration::from_nanos(PERIOD_NS.unsigned_abs()))?;
    }
    none_of(parts.iter().filter_map(fault))
}

fn moves(subject: &Subject) -> Tried {
    judged(subject, |part| {
        let name = &part.joint.name;
        let fault = || format!("'{name}.position' stays the same while '{name}' is pushed each way: the command is ignored, or the reading is frozen");
        part.is_still().then(fault)
    })
}

fn velocity_sign(subject: &Subject) -> Tried {
    judged(subject, |part| {
        let name = &part.joint.name;
        let is_wrong = |motion: &&Motion| motion.distance.abs() > CLEAR && motion.distance * motion.velocity_mean <= 0.0;
        let wrong = part.motions.iter().find(is_wrong)?;
        Some(format!("'{name}.position' changes by {:.3e} while '{name}.velocity' is {:.3e} on average", wrong.distance, wrong.velocity_mean))
    })
}
