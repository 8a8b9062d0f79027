// SPDX-License-Identifier: Apache-2.0
//! A program under way, every set-point of which is checked.
use super::programs::{Program, new_path};
use library::queue::{QueuedMove, QueuedPath, Refusal, Run, Sample};

pub const CYCLE_S: f64 = 1e-3;

/// A program under way: it is stepped, and every step is checked.
pub struct Travel<'a> {
    pub program: &'a Program,
    pub path: Box<QueuedPath>,
    pub run: Run,
    pub before: Sample,
    pub appended: usize,
    pub steps: u64,
    /// Bits of everything that was commanded.
    pub digest: u64,
}

impl<'a> Travel<'a> {
    pub fn begin(program: &'a Program) -> Travel<'a> {
        let mut path = new_path();
        path.clear(&program.start, program.n);
        let run = Run::default();
        let before = run.sample(&path);
        Travel { program, path, run, before, appended: 0, steps: 0, digest: 0 }
    }

    /// Appends the next move, if there is room.
    pub fn append(&mut self, change: impl Fn(&mut QueuedMove)) -> bool {
        let Some(mut asked) = self.program.moves.get(self.appended).copied() else { return false };
        change(&mut asked);
        let arm = self.program.chain.read(self.program.n).expect("a chain");
        match self.path.append(&asked, &self.program.around(&arm), &self.run) {
            Ok(()) => self.appended += 1,
            Err(Refusal::Full) => return false,
            Err(refusal) => panic!("move {} is refused: {refusal:?}", asked.number),
        }
        self.run.renew();
        true
    }

    pub fn step(&mut self, cycle_s: f64, rate: f64, seed: u64) -> Sample {
        self.run.advance(&self.path, cycle_s, rate);
        let (now, before, t) = (self.run.sample(&self.path), self.before, cycle_s);
        self.steps += 1;
        assert!(self.steps < 4_000_000, "seed {seed}: it never ends: {:?}", self.run);
        for (i, joint) in self.program.joints.iter().enumerate() {
            let (q, v, a) = (now.q[i], now.velocity[i], now.acceleration[i]);
            let at = || format!("seed {seed}, step {}, joint {i}, move {} at {}: {:?}", self.steps, now.number, now.fraction, self.run);
            assert!(v.abs() <= joint.speed * (1.0 + 1e-9), "speed {v} of {}: {}", joint.speed, at());
            assert!(a.abs() <= joint.acceleration * (1.0 + 1e-9), "acceleration {a} of {}: {}", joint.acceleration, at());
            let jerk = (a - before.acceleration[i]) / t;
            assert!(jerk.abs() <= joint.jerk * (1.0 + 1e-9) + 1e-9, "jerk {jerk} of {}: {}", joint.jerk, at());
            let speeds = v - before.velocity[i] - before.acceleration[i] * t;
            assert!(speeds.abs() <= joint.jerk * t * t / 2.0 * (1.0 + 1e-6) + 1e-12, "the speed jumps by {speeds}: {}", at());
            let positions = q - before.q[i] - t * (before.velocity[i] + t / 2.0 * before.acceleration[i]);
            assert!(positions.abs() <= joint.jerk * t * t * t / 6.0 * (1.0 + 1e-6) + 1e-13, "the position jumps by {positions}: {}", at());
            self.digest = (self.digest.rotate_left(5) ^ q.to_bits() ^ v.to_bits().rotate_left(20)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        self.before = now;
        now
    }

    pub fn is_over(&self) -> bool {
        self.appended == self.program.moves.len() && self.run.is_at_end(&self.path)
    }

    /// Goes to the end at full speed; returns the duration.
    pub fn finish(&mut self, seed: u64, change: impl Fn(&mut QueuedMove) + Copy) -> f64 {
        let begun = self.steps;
        while self.append(change) {}
        while !self.is_over() {
            self.step(CYCLE_S, 1.0, seed);
            self.append(change);
        }
        (self.steps - begun) as f64 * CYCLE_S
    }
}
