// SPDX-License-Identifier: Apache-2.0
//! Checks of pushed parts: each moves in the direction of the push, and its position and velocity agree.
use super::check::{Check, CheckResult, PassedCheck, none_of};
use super::rig::{Joint, PERIOD_NS, Rig};
use super::subject::Subject;
use std::time::Duration;

pub(super) const CHECKS: &[Check] = &[
    Check { name: "moves", sentence: "a part moves when it is commanded to move, and its position changes accordingly", run: moves },
    Check { name: "moves-alone", sentence: "a part that alone is commanded to move does so in the commanded direction", run: moves_alone },
    Check { name: "moves-late", sentence: "a part still moves, and its position still changes accordingly, after many firings", run: moves_late },
    Check { name: "velocity-sign", sentence: "the velocity of a part has the sign of its motion", run: velocity_sign },
    Check { name: "velocity-size", sentence: "the velocity of a part is in the unit of its position per second", run: velocity_size },
];

/// Number of firings of a push.
const PUSHED: usize = 100;
/// Number of warm-up firings before a late push.
const LATE: usize = 2_000;
/// Minimum motion, rad or m.
const MOTION: f64 = 1e-9;
/// Minimum motion whose direction is reliable, rad or m.
const CLEAR: f64 = 1e-6;
/// Minimum motion whose magnitude is reliable, whatever the encoder, rad or m.
const LONG: f64 = 2e-3;
/// Factor by which a velocity may differ from the motion. Wrong units (revolutions or degrees per second) differ by more.
const FACTOR: f64 = 3.0;

/// Motion of one part during the second half of a push.
#[derive(Default)]
struct Motion {
    distance: f64,
    /// Duration, s.
    span: f64,
    velocity_mean: f64,
    /// Range of the magnitudes of the velocity.
    speeds: Option<(f64, f64)>,
}

impl Motion {
    /// Adds the velocity of one of the observed firings.
    fn add(&mut self, velocity: f64) {
        let speed = velocity.abs();
        let (least, most) = self.speeds.unwrap_or((speed, speed));
        self.speeds = Some((least.min(speed), most.max(speed)));
        self.velocity_mean += velocity / (PUSHED - PUSHED / 2) as f64;
    }
}

/// Parts that are pushed at the same time.
#[derive(Clone, Copy)]
enum Choice {
    All,
    Alone(usize),
}

impl Choice {
    fn has(self, index: usize) -> bool {
        match self {
            Choice::All => true,
            Choice::Alone(alone) => alone == index,
        }
    }
}

/// Pushes the chosen parts gently in one direction; `pause` is real time between two firings, for machines that do not follow the time of the kit.
fn push(rig: &mut Rig, joints: &[Joint], chosen: Choice, sign: f64, pause: Duration) -> Result<Vec<Motion>, String> {
    rig.cycles(2)?;
    let start = rig.positions(joints);
    let (mut half, mut half_ns) = (start.clone(), rig.release_ns);
    let mut motions: Vec<Motion> = joints.iter().map(|_| Motion::default()).collect();
    for firing in 1..=PUSHED {
        rig.hold(joints);
        for (_, (joint, start)) in joints.iter().zip(&start).enumerate().filter(|(index, _)| chosen.has(*index)) {
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
            (half, half_ns) = (rig.positions(joints), rig.release_ns);
        }
        if firing > PUSHED / 2 {
            motions.iter_mut().zip(joints).for_each(|(motion, joint)| motion.add(joint.velocity.double(&rig.readings, 0)));
        }
    }
    let span = (rig.release_ns - half_ns) as f64 * 1e-9;
    for ((motion, half), end) in motions.iter_mut().zip(half).zip(rig.positions(joints)) {
        (motion.distance, motion.span) = (end - half, span);
    }
    rig.let_go();
    rig.cycles(PUSHED)?;
    Ok(motions)
}

/// Motions of a part that was pushed up and down.
struct PartMotions {
    joint: Joint,
    motions: [Motion; 2],
}

impl PartMotions {
    fn is_still(&self) -> bool {
        self.motions.iter().all(|motion| motion.distance.abs() < MOTION)
    }
}

/// Parameters of a push.
#[derive(Clone, Copy)]
struct Manner {
    /// Number of warm-up firings before the push.
    warm: usize,
    /// True if each part is pushed alone, with the others held.
    is_alone: bool,
    pause: Duration,
}

/// Pushes every part up and down. Returns an empty list if the driver has no parts or its exchange is not inline.
fn pushed(subject: &Subject, manner: Manner) -> Result<Vec<PartMotions>, String> {
    if !subject.is_inline() {
        return Ok(Vec::new());
    }
    let Some((mut rig, joints)) = subject.open_with_parts()? else { return Ok(Vec::new()) };
    rig.cycles(manner.warm)?;
    let mut both = |chosen| -> Result<_, String> {
        let (up, down) = (push(&mut rig, &joints, chosen, 1.0, manner.pause)?, push(&mut rig, &joints, chosen, -1.0, manner.pause)?);
        Ok(up.into_iter().zip(down).map(|(up, down)| [up, down]))
    };
    let motions: Vec<[Motion; 2]> = if manner.is_alone {
        (0..joints.len()).map(|index| Ok(both(Choice::Alone(index))?.nth(index))).collect::<Result<Vec<_>, String>>()?.into_iter().flatten().collect()
    } else {
        both(Choice::All)?.collect()
    };
    rig.driver.safe_state();
    Ok(joints.into_iter().zip(motions).map(|(joint, motions)| PartMotions { joint, motions }).collect())
}

const NO_INLINE_PARTS: PassedCheck = PassedCheck::NotApplicable("it has no parts whose exchange is inline");

/// Evaluates the motions of the pushed parts; `fault` returns the problem with a part.
///
/// Faulty parts are pushed again, at the pace of the wall clock. A machine that moves by that clock may not move at all during a push of
/// some microseconds, or may move in a single step that no reading shows.
fn judged(subject: &Subject, warm: usize, is_alone: bool, fault: impl Fn(&PartMotions) -> Option<String>) -> CheckResult {
    let manner = Manner { warm, is_alone, pause: Duration::ZERO };
    let mut parts = pushed(subject, manner)?;
    if parts.is_empty() {
        return Ok(NO_INLINE_PARTS);
    }
    if parts.iter().any(|part| fault(part).is_some()) {
        parts = pushed(subject, Manner { pause: Duration::from_nanos(PERIOD_NS.unsigned_abs()), ..manner })?;
    }
    none_of(parts.iter().filter_map(fault))
}

fn moves(subject: &Subject) -> CheckResult {
    judged(subject, 0, false, |part| {
        let name = &part.joint.name;
        let fault = || {
            format!(
                "'{name}.position' does not change when '{name}' is commanded to move in either direction: the command is ignored, or the reading is frozen"
            )
        };
        part.is_still().then(fault)
    })
}

fn moves_alone(subject: &Subject) -> CheckResult {
    // Whatever the coupling, a part that is pushed alone moves with the push, because the inverse of a mass matrix is positive on its
    // diagonal.
    judged(subject, 0, true, |part| {
        let (name, [up, down]) = (&part.joint.name, &part.motions);
        let fault =
            || format!("'{name}.position' changes by {:.3e} when '{name}' alone is commanded to move up, and by {:.3e} when down", up.distance, down.distance);
        (up.distance - down.distance < MOTION).then(fault)
    })
}

fn moves_late(subject: &Subject) -> CheckResult {
    judged(subject, LATE, false, |part| {
        let name = &part.joint.name;
        part.is_still().then(|| format!("after {LATE} firings '{name}.position' does not change when '{name}' is commanded to move in either direction"))
    })
}

fn velocity_sign(subject: &Subject) -> CheckResult {
    judged(subject, 0, false, |part| {
        let name = &part.joint.name;
        let is_wrong = |motion: &&Motion| motion.distance.abs() > CLEAR && motion.distance * motion.velocity_mean <= 0.0;
        let wrong = part.motions.iter().find(is_wrong)?;
        Some(format!("'{name}.position' changes by {:.3e} while '{name}.velocity' is {:.3e} on average", wrong.distance, wrong.velocity_mean))
    })
}

fn velocity_size(subject: &Subject) -> CheckResult {
    judged(subject, 0, false, |part| {
        let name = &part.joint.name;
        let is_wrong = |motion: &&Motion| {
            let (speed, (least, most)) = (motion.distance.abs() / motion.span, motion.speeds.unwrap_or_default());
            motion.distance.abs() > LONG && !(least / FACTOR..=most * FACTOR).contains(&speed)
        };
        let wrong = part.motions.iter().find(is_wrong)?;
        let (distance, span, velocity) = (wrong.distance, wrong.span, wrong.velocity_mean);
        Some(format!("'{name}.position' changes by {distance:.3e} within {span:.3} s while '{name}.velocity' is {velocity:.3e} on average"))
    })
}
