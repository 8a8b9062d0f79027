// SPDX-License-Identifier: Apache-2.0
//! Blocks that read and drive devices, and the sources of their set-points.
use opengpac::{Condition, FunctionBlock, Invocation, Outcome, Step};

/// Reads a channel of a device.
#[derive(FunctionBlock)]
pub struct ReadChannel {
    /// the channel
    #[device(read, unit = "rad")]
    channel: f64,
    /// its value
    #[output(unit = "rad")]
    y: f64,
}

impl Step for ReadChannel {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.channel;
        Outcome::Done
    }
}

/// Drives a channel: channel = gain · u.
#[derive(FunctionBlock)]
pub struct Drive {
    /// value to write
    #[input(asynchronous, default = 0.0)]
    u: f64,
    /// the channel
    #[device(write, unit = "N.m")]
    channel: f64,
    /// gain
    #[param(default = 1.0)]
    gain: f64,
}

impl Step for Drive {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.channel = self.gain * self.u;
        Outcome::Done
    }
}

/// Adds v to y each time; v rises to 3, or falls to 0 while `holding`.
#[derive(FunctionBlock)]
pub struct Ramp {
    /// comes to rest
    #[input(asynchronous, default = false)]
    holding: bool,
    /// distance so far
    #[output]
    y: f64,
    /// speed
    #[output]
    v: f64,
    /// at rest
    #[condition]
    held: Condition,
}

impl Step for Ramp {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.v = if self.holding { (self.v - 1.0).max(0.0) } else { (self.v + 1.0).min(3.0) };
        self.y += self.v;
        if self.holding && self.v == 0.0 {
            self.held.report();
        }
        Outcome::Done
    }
}

/// Moves from `present`, read once, towards `goal`, by `stride` per invocation: y is the present position.
#[derive(FunctionBlock)]
pub struct Glide {
    /// initial position
    #[input(asynchronous)]
    present: f64,
    /// target position
    #[param(default = 0.0)]
    goal: f64,
    /// present position
    #[output]
    y: f64,
    /// distance of each step
    #[param(default = 0.001)]
    stride: f64,
    /// true after the first invocation
    #[state]
    begun: bool,
    /// present position
    #[state]
    at: f64,
    /// target reached
    #[condition]
    there: Condition,
}

impl Step for Glide {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if !self.begun {
            (self.begun, self.at) = (true, self.present);
        }
        self.at += (self.goal - self.at).clamp(-self.stride, self.stride);
        self.y = self.at;
        if self.at == self.goal {
            self.there.report();
        }
        Outcome::Done
    }
}

/// A servo: channel = gain · (u - q).
#[derive(FunctionBlock)]
pub struct Follow {
    /// set-point
    #[input(asynchronous)]
    u: f64,
    /// present position
    #[input]
    q: f64,
    /// the channel
    #[device(write, unit = "N.m")]
    channel: f64,
    /// gain
    #[param(default = 50.0)]
    gain: f64,
}

impl Step for Follow {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.channel = self.gain * (self.u - self.q);
        Outcome::Done
    }
}
