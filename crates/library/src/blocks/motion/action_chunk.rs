// SPDX-License-Identifier: Apache-2.0
use opengpac::{ConditionOf, FunctionBlock, Invocation, Outcome, Step};

/// The interval or the blending time is not positive.
const NOT_POSITIVE: u32 = 1;
/// A chunk was observed in the future.
const FUTURE: u32 = 2;
/// Maximum number of actions in a chunk.
const ACTIONS_MAX: usize = 64;

/// Player of action chunks: y = p(t - observed) + c(t), one coordinate of a policy that outputs n positions at a time.
///
/// p is the cubic spline (Catmull and Rom) through the chunk's actions, one per `interval` from `observed`, the time of the policy's
/// observation, so that the inference time is skipped; it ends at rest at the last action. When `number` changes, the next chunk is
/// played: c is the cubic that reduces the difference of position and velocity at that instant to 0 within `blend`; if it is restarted
/// with each of many chunks, it acts as a damped spring. Position and velocity are continuous, however long inference takes and however
/// often chunks arrive. Until the first chunk, y is the value of `present` at the start. Range: interval and blend above 0. Faults: 1 the
/// interval or the blend is not above 0; 2 `observed` lies in the future.
#[derive(FunctionBlock)]
pub struct ActionChunk {
    /// number of actions in a chunk
    #[size(2, 64)]
    n: u32,
    /// positions of the chunk
    #[input(asynchronous, sized)]
    actions: [f64; 64],
    /// number of the chunk: a changed number means a new chunk, 0 means none
    #[input(asynchronous)]
    number: i64,
    /// time of the first action, in ns of the system clock
    #[input(asynchronous)]
    observed: i64,
    /// position at the start
    #[input(asynchronous, unit = "=actions")]
    present: f64,
    /// output position
    #[output(unit = "=actions")]
    y: f64,
    /// derivative of the position, per second
    #[output]
    velocity: f64,
    /// time between two actions
    #[param(default = 0.02, unit = "s", range = "(0, inf)")]
    interval: f64,
    /// time in which the difference from a new chunk is reduced to 0
    #[param(default = 0.1, unit = "s", range = "[0, inf)")]
    blend: f64,
    /// more time than the preset has passed since the end of the chunk; the value is that time, in s
    #[condition(preset = 0.1, unit = "s", range = "[0, inf)")]
    stale: ConditionOf<f64>,
    /// chunk being played
    #[state(opaque)]
    played: Chunk,
    /// correction that began at the start of the chunk
    #[state(opaque)]
    correction: Correction,
}

/// Actions of one chunk.
#[derive(Clone, Copy)]
struct Chunk {
    actions: [f64; ACTIONS_MAX],
    number: i64,
    observed_ns: i64,
    /// True after the first invocation.
    is_begun: bool,
}

impl Default for Chunk {
    fn default() -> Chunk {
        Chunk { actions: [0.0; ACTIONS_MAX], number: 0, observed_ns: 0, is_begun: false }
    }
}

/// Cubic from a difference of position and velocity to zero.
#[derive(Clone, Copy, Default)]
struct Correction {
    since_ns: i64,
    position: f64,
    velocity: f64,
}

impl Step for ActionChunk {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        if !(self.interval > 0.0 && self.blend > 0.0) {
            return Outcome::Fault(NOT_POSITIVE);
        }
        let (now, n) = (invocation.now_ns, self.n as usize);
        if !self.played.is_begun {
            self.y = self.present;
            self.played.is_begun = true;
            self.played.actions = [self.present; ACTIONS_MAX];
            self.played.observed_ns = now;
        }
        if self.number != self.played.number {
            if self.observed > now {
                return Outcome::Fault(FUTURE);
            }
            let (position, velocity) = self.at(now, n);
            self.played = Chunk { actions: self.actions, number: self.number, observed_ns: self.observed, is_begun: true };
            let (begins, moves) = self.played.at(seconds(now - self.observed), self.interval, n);
            self.correction = Correction { since_ns: now, position: position - begins, velocity: velocity - moves };
        }
        (self.y, self.velocity) = self.at(now, n);
        let beyond = seconds(now - self.played.observed_ns) - (n - 1) as f64 * self.interval;
        if beyond > self.stale.preset && self.played.number != 0 {
            self.stale.report(beyond);
        }
        Outcome::Done
    }
}

impl ActionChunk {
    /// Returns the output position and velocity at a time.
    fn at(&self, now_ns: i64, n: usize) -> (f64, f64) {
        let (p, dp) = self.played.at(seconds(now_ns - self.played.observed_ns), self.interval, n);
        let (c, dc) = self.correction.at(seconds(now_ns - self.correction.since_ns), self.blend);
        (p + c, dp + dc)
    }
}

impl Chunk {
    /// Returns the spline and its derivative at time `t` after the chunk's first action.
    fn at(&self, t: f64, interval: f64, n: usize) -> (f64, f64) {
        let place = (t / interval).max(0.0);
        if place >= (n - 1) as f64 {
            return (self.actions[n - 1], 0.0);
        }
        let i = place as usize;
        let u = place - i as f64;
        let (a, b) = (self.actions[i], self.actions[i + 1]);
        let (da, db) = (self.slope(i, n), self.slope(i + 1, n));
        let (d, e) = (3.0 * (b - a) - 2.0 * da - db, da + db - 2.0 * (b - a));
        (a + u * (da + u * (d + u * e)), (da + u * (2.0 * d + u * 3.0 * e)) / interval)
    }

    /// Returns the slope at an action, per interval: half the difference of its neighbours, 0 at the end.
    fn slope(&self, i: usize, n: usize) -> f64 {
        match i {
            0 => self.actions[1] - self.actions[0],
            i if i == n - 1 => 0.0,
            i => 0.5 * (self.actions[i + 1] - self.actions[i - 1]),
        }
    }
}

impl Correction {
    /// Returns p(1 - 3 u² + 2 u³) + v T (u - 2 u² + u³), u = t / T, and its derivative.
    fn at(&self, t: f64, blend: f64) -> (f64, f64) {
        let u = t / blend;
        if u >= 1.0 {
            return (0.0, 0.0);
        }
        let (p, v) = (self.position, self.velocity);
        let position = p * (1.0 + u * u * (2.0 * u - 3.0)) + v * blend * u * (1.0 + u * (u - 2.0));
        let slope = p / blend * 6.0 * u * (u - 1.0) + v * (1.0 + u * (3.0 * u - 4.0));
        (position, slope)
    }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 * 1e-9
}
