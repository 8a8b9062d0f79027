// SPDX-License-Identifier: Apache-2.0
use crate::kinematics::chain::Chain;
use crate::kinematics::inverse::Ranges;
use crate::pace;
use crate::profile::Limits;
use crate::queue::run::ENDLESS;
use crate::queue::{ABORTING, CLOSE, QueueProgress, QueuedMoves, QueuedPath, Refusal, Run, Surroundings, WAITING_MAX};
use crate::span::Span;
use crate::takeover::Brake;
use opengpac::{Condition, ConditionOf, FunctionBlock, InPlaceMut, Invocation, Outcome, Step, Type};

/// The arm is not a chain of n joints.
const BAD_CHAIN: u32 = 1;
/// A value of a move or of the start position is not valid.
const BAD_MOVE: u32 = 2;
/// A limit is not above 0, or an override is not between 0 and 1.
const BAD_LIMIT: u32 = 3;

/// Queue of moves: setpoint = q(s(t)), a path of lines, arcs and blends, and a jerk-limited motion s(t) along it.
///
/// Each invocation takes one waiting move, the one that follows the last move taken, and appends it to the path: a line in joint space,
/// or a straight line or an arc of the tool, blended with the previous move. The speed, acceleration and jerk of each joint stay within
/// their limits. `rate`, the overrides and `holding` change only the speed along the path, down to 0 or backwards, and never the path
/// itself: the state is a position on the path, not a time. A move that the arm cannot make is refused before any part of it is executed;
/// the moves before it are completed, and then `refused` is reported. `complete` is true when the motion is at rest at the end, if a move
/// of kind 3, which ends the queue, has been taken. Joints that move at the start are braked first, each on its own. Time lost because
/// releases were skipped is not made up for; if the time lost in a single gap exceeds `gap_max`, the motion comes to rest on its path and
/// `gap` is reported. A move with mode 2 replaces the moves before it: the motion blends into it if possible, and otherwise comes to rest
/// on the path first. The path holds about 40 lines in joint space or 16 of the tool ahead of the set-point; further moves wait. Faults:
/// 1 the arm is not a chain of n joints; 2 a value of a move or of the start position is not valid; 3 a limit is not above 0, or an
/// override is not between 0 and 1.
#[derive(FunctionBlock)]
pub struct QueueGenerator {
    /// number of joints
    #[size(1, 16)]
    n: u32,
    /// current commanded positions of the joints, rad or m
    #[input(asynchronous, sized)]
    start: [f64; 16],
    /// current speed at which the servos move the joints
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    start_velocity: [f64; 16],
    /// speed of the last set-points, whichever motion generated them
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s|m/s", range = "[-inf, inf)")]
    last_velocity: [f64; 16],
    /// acceleration of the last set-points
    #[input(asynchronous, default = [0.0; 16], sized, unit = "rad/s^2|m/s^2", range = "[-inf, inf)")]
    last_acceleration: [f64; 16],
    /// time at which the last set-points were stored, ns of the system clock
    #[input(asynchronous, default = [i64::MIN; 16], sized, range = "[-inf, inf)")]
    last_time: [i64; 16],
    /// braking by the servos themselves because set-points did not arrive in time: see `joint_servo`
    #[input(asynchronous, default = [[0.0; 4]; 16], sized, range = "[-inf, inf)")]
    braking: [[f64; 4]; 16],
    /// waiting moves, with move k in row k modulo 16, and, for single-stepping, the number of moves after which the motion comes to rest
    #[input(asynchronous)]
    moves: QueuedMoves,
    /// fraction of the programmed speed; negative: backwards along the path
    #[input(asynchronous, default = 1.0, range = "[-1, 1]")]
    rate: f64,
    /// permitted fraction of the speed, 0 to 1; the minimum over the joints applies to all
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    r#override: [f64; 16],
    /// override of the whole cell; the two are multiplied
    #[input(asynchronous, default = [1.0; 16], sized, range = "[0, 1]")]
    cell_override: [f64; 16],
    /// true: bring the motion to rest on its path
    #[input(asynchronous, default = false)]
    holding: bool,
    /// maximum time lost in a single gap; if it is exceeded, the motion comes to rest
    #[input(asynchronous, default = [0.5; 16], sized, unit = "s", range = "(0, inf)")]
    gap_max: [f64; 16],
    /// maximum speed of each joint
    #[input(asynchronous, default = [std::f64::consts::PI; 16], sized, range = "(0, inf)")]
    speed_max: [f64; 16],
    /// maximum acceleration of each joint
    #[input(asynchronous, default = [5.0; 16], sized, range = "(0, inf)")]
    acceleration_max: [f64; 16],
    /// maximum jerk of each joint
    #[input(asynchronous, default = [50.0; 16], sized, range = "(0, inf)")]
    jerk_max: [f64; 16],
    /// minimum position of each joint
    #[input(asynchronous, default = [-1e6; 16], sized, range = "[-inf, inf)")]
    position_min: [f64; 16],
    /// maximum position of each joint
    #[input(asynchronous, default = [1e6; 16], sized, range = "[-inf, inf)")]
    position_max: [f64; 16],
    /// commanded positions of the joints, rad or m
    #[output(sized)]
    setpoint: [f64; 16],
    /// commanded speed at the set-point, rad/s or m/s
    #[output(sized)]
    setpoint_velocity: [f64; 16],
    /// acceleration of the set-points, rad/s^2 or m/s^2
    #[output(sized)]
    setpoint_acceleration: [f64; 16],
    /// time at which the set-points are stored, ns of the system clock
    #[output(sized)]
    setpoint_time: [i64; 16],
    /// position of the set-point in the queue, the last move taken, and the ends of the most recent moves
    #[output]
    progress: QueueProgress,
    /// joint positions at the end of the path, for comparison by other blocks
    #[output(sized)]
    target: [f64; 16],
    /// true if the end of the last move has been stored as the set-point
    #[output]
    complete: bool,
    /// the path
    #[output(in_place)]
    path: InPlaceMut<QueuedPath>,
    /// time between two set-points
    #[param(default = 0.02, unit = "s", range = "[0, inf)")]
    lead: f64,
    /// the arm
    #[param(default = Chain::NOTHING)]
    chain: Chain,
    /// the motion is at rest because of `holding`
    #[condition]
    held: Condition,
    /// a move was refused, and the moves before it have been completed; the value is the number of the refused move
    #[condition]
    refused: ConditionOf<i32>,
    /// the motion is at rest because the time lost in a single gap exceeded `gap_max`; the value is the time lost, s
    #[condition]
    gap: ConditionOf<f64>,
    /// progress along the path
    #[state(opaque)]
    way: Way,
}

/// Progress along the path.
#[derive(Clone, Copy, Debug, Default)]
struct Way {
    /// Joints that are braked to rest first.
    brake: Brake,
    run: Run,
    span: Span,
    has_begun: bool,
    /// True if the last move has been taken.
    is_closed: bool,
    /// True if the motion is coming to rest because time was lost.
    is_lost: bool,
}

impl Step for QueueGenerator {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        let n = self.n as usize;
        let last = crate::takeover::last_setpoints!(self, n);
        let passed = self.way.span.pass(invocation);
        if let Some(now) = self.way.brake.step(&last, &self.acceleration_max[..n], &self.jerk_max[..n], self.lead, true, invocation) {
            (self.setpoint, self.setpoint_velocity, self.setpoint_acceleration) = (now.setpoint, now.velocity, now.acceleration);
            (self.setpoint_time, self.complete) = ([invocation.now_ns; 16], false);
            if now.is_at_rest && self.holding {
                self.held.report();
            }
            return Outcome::Done;
        }
        if !self.way.has_begun {
            if !self.start[..n].iter().all(|q| q.is_finite()) {
                return Outcome::Fault(BAD_MOVE);
            }
            self.path.clear(&std::array::from_fn(|i| if i < n { self.start[i] } else { 0.0 }), n);
            (self.way.has_begun, self.progress) = (true, <QueueProgress as Type>::zero());
        }
        let Some(allowed) = pace::allowed(&self.r#override[..n], &self.cell_override[..n]) else { return Outcome::Fault(BAD_LIMIT) };
        if let Err(code) = self.take_one(n) {
            return Outcome::Fault(code);
        }
        self.way.is_lost |= pace::note_lost(passed, &self.gap_max[..n], &mut self.progress.lost);
        // An aborting move waits until a motion back along the path rests.
        let turns = self.way.run.direction < 0.0 && self.aborting().is_some();
        self.way.run.rest_behind(if self.moves.stepping == 0 { ENDLESS } else { self.moves.until });
        let rate = if self.holding || self.way.is_lost || turns { 0.0 } else { self.rate.clamp(-1.0, 1.0) * allowed };
        self.way.run.advance(&self.path, passed.cycle_s(), rate);
        self.store(invocation);
        self.report();
        Outcome::Done
    }
}

impl QueueGenerator {
    /// Appends the next waiting move, if there is one and the path has space for it; the error is a fault code.
    fn take_one(&mut self, n: usize) -> Result<(), u32> {
        if let Some(number) = self.aborting().filter(|_| self.progress.refused == 0) {
            (self.progress.taken + 1..number).for_each(|skipped| self.path.note_aborted(skipped));
            self.progress.taken = number - 1;
        }
        let number = self.progress.taken + 1;
        let next = self.moves.rows[number.rem_euclid(WAITING_MAX as i64) as usize];
        if next.number != number || self.progress.refused != 0 {
            return Ok(());
        }
        if next.kind == CLOSE {
            (self.progress.taken, self.way.is_closed) = (number, true);
            return Ok(());
        }
        let chain = self.chain;
        let arm = chain.read(n).ok_or(BAD_CHAIN)?;
        let joints: [Limits; 16] =
            std::array::from_fn(|i| Limits { speed: self.speed_max[i], acceleration: self.acceleration_max[i], jerk: self.jerk_max[i] });
        if !joints[..n].iter().all(Limits::are_positive) {
            return Err(BAD_LIMIT);
        }
        let ranges = Ranges { min: &self.position_min[..n], max: &self.position_max[..n] };
        let around = Surroundings { arm: &arm, joints: &joints[..n], ranges };
        match self.path.append(&next, &around, &self.way.run) {
            Ok(()) => {
                self.progress.taken = number;
                self.way.run.renew();
            }
            Err(Refusal::Full) => {}
            Err(Refusal::Bad) => return Err(BAD_MOVE),
            Err(refusal) => {
                (self.progress.reason, self.progress.value) = refusal.numbers();
                self.progress.refused = number;
            }
        }
        Ok(())
    }

    fn store(&mut self, invocation: &Invocation) {
        let now = self.way.run.sample(&self.path);
        (self.setpoint, self.setpoint_velocity, self.setpoint_acceleration) = (now.q, now.velocity, now.acceleration);
        (self.setpoint_time, self.progress.number, self.progress.fraction) = ([invocation.now_ns; 16], now.number, now.fraction);
        (self.target, self.progress.ends) = (self.path.end, self.path.ends);
        let outputs = self.path.outputs(&now);
        (self.progress.switched, self.progress.on) = (outputs.switched, outputs.on);
        (self.progress.resting, self.progress.until) = (i64::from(self.way.run.is_at_rest()), self.moves.until);
    }

    /// Returns the number of the last waiting move that replaces the moves before it.
    fn aborting(&self) -> Option<i64> {
        let waiting = self.moves.rows.iter().filter(|row| row.number > self.progress.taken && row.mode == ABORTING && row.kind != CLOSE);
        waiting.map(|row| row.number).max()
    }

    fn report(&mut self) {
        let run = &self.way.run;
        let is_at_end = run.is_at_end(&self.path);
        self.complete = is_at_end && self.way.is_closed;
        if self.holding && run.is_at_rest() {
            self.held.report();
        }
        if self.way.is_lost && run.is_at_rest() {
            // The motion may resume, if the gap does not end it.
            self.way.is_lost = false;
            self.gap.report(self.progress.lost);
        }
        if self.progress.refused != 0 && is_at_end {
            self.refused.report(i32::try_from(self.progress.refused).unwrap_or(i32::MAX));
        }
    }
}
