// SPDX-License-Identifier: Apache-2.0
//! Blocks for scenarios. What a probe sees goes into a trace, by its parameter `trace`.
use opengpac::abi::Descriptor;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::collections::HashMap;
use std::sync::Mutex;

/// What one invocation of a probe saw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    pub now_ns: i64,
    /// Running time.
    pub time_ns: i64,
    pub number: u64,
    pub u: f64,
}

static TRACES: Mutex<Option<HashMap<i64, Vec<Row>>>> = Mutex::new(None);

/// What the probes with this `trace` have seen since it was asked for last.
pub fn seen(trace: i64) -> Vec<Row> {
    TRACES.lock().unwrap().get_or_insert_default().remove(&trace).unwrap_or_default()
}

fn note(trace: i64, invocation: &Invocation, u: f64) {
    let row = Row { now_ns: invocation.now_ns, time_ns: invocation.time_ns, number: invocation.number, u };
    TRACES.lock().unwrap().get_or_insert_default().entry(trace).or_default().push(row);
}

/// Counts: y = start + number of invocations since the last reset.
#[derive(FunctionBlock)]
pub struct Count {
    /// the count
    #[output]
    y: f64,
    /// where it starts
    #[param(default = 0.0)]
    start: f64,
    /// invocations
    #[state]
    count: u32,
    /// invocations in the life of the instance
    #[state(keep)]
    life: u32,
    /// the count has reached `limit`
    #[condition]
    reached: Condition,
    /// the count is a multiple of `each`, with the count
    #[condition(preset = 0.0)]
    each: ConditionOf<f64>,
    /// when to report
    #[param(default = 0.0)]
    limit: f64,
    /// invocations ever, as a value
    #[output]
    total: f64,
}

impl Step for Count {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.count += 1;
        self.life += 1;
        self.total = f64::from(self.life);
        self.y = self.start + f64::from(self.count);
        if self.limit != 0.0 && self.y >= self.limit {
            self.reached.report();
        }
        if self.each.preset != 0.0 && self.y % self.each.preset == 0.0 {
            let y = self.y;
            self.each.report(y);
        }
        Outcome::Done
    }
}

/// Leaves a trace of what it reads, and passes it on: y = u.
#[derive(FunctionBlock)]
pub struct Probe {
    /// what it reads
    #[input]
    u: f64,
    /// the same
    #[output]
    y: f64,
    /// which trace
    #[param(default = 0)]
    trace: i64,
    /// u is above `limit`
    #[condition]
    above: Condition,
    /// when to report
    #[param(default = 1e300)]
    limit: f64,
}

impl Step for Probe {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        note(self.trace, invocation, self.u);
        self.y = self.u;
        if self.u > self.limit {
            self.above.report();
        }
        Outcome::Done
    }
}

/// Leaves a trace of what is newest: y = u.
#[derive(FunctionBlock)]
pub struct Watch {
    /// what it reads
    #[input(asynchronous, default = 0.0)]
    u: f64,
    /// the same
    #[output]
    y: f64,
    /// which trace
    #[param(default = 0)]
    trace: i64,
    /// u is above `limit`
    #[condition]
    above: Condition,
    /// when to report
    #[param(default = 1e300)]
    limit: f64,
}

impl Step for Watch {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        note(self.trace, invocation, self.u);
        self.y = self.u;
        if self.u > self.limit {
            self.above.report();
        }
        Outcome::Done
    }
}

/// Leaves a trace of every fourth value: y = u.
#[derive(FunctionBlock)]
pub struct Fourth {
    /// what it reads
    #[input(ratio = 4)]
    u: f64,
    /// the same
    #[output]
    y: f64,
    /// which trace
    #[param(default = 0)]
    trace: i64,
}

impl Step for Fourth {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        note(self.trace, invocation, self.u);
        self.y = self.u;
        Outcome::Done
    }
}

/// Stores its count every fourth invocation.
#[derive(FunctionBlock)]
pub struct Quarter {
    /// the count
    #[output(ratio = 4)]
    y: f64,
    /// invocations
    #[state]
    count: u32,
}

impl Step for Quarter {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.count += 1;
        self.y = f64::from(self.count);
        Outcome::Done
    }
}

/// Faults in invocation `at`: 1 returned, 2 panic, 3 an output that is not finite.
#[derive(FunctionBlock)]
pub struct Faulty {
    /// invocations that succeeded
    #[output]
    y: f64,
    /// in which invocation (from 0)
    #[param(default = 3)]
    at: u64,
    /// how
    #[param(default = 1)]
    how: u32,
    /// invocations that succeeded
    #[state]
    count: u32,
}

impl Step for Faulty {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.count += 1;
        self.y = f64::from(self.count);
        if invocation.number == self.at {
            match self.how {
                2 => panic!("as asked for"),
                3 => self.y = f64::NAN,
                code => return Outcome::Fault(code),
            }
        }
        Outcome::Done
    }
}

/// Spreads: y_i = u + i.
#[derive(FunctionBlock)]
pub struct Spread {
    /// base
    #[input(asynchronous, default = 0.0)]
    u: f64,
    /// three values
    #[output]
    y: [f64; 3],
}

impl Step for Spread {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = [self.u, self.u + 1.0, self.u + 2.0];
        Outcome::Done
    }
}

/// Adds up: y = u_0 + 10 u_1 + 100 u_2.
#[derive(FunctionBlock)]
pub struct Gather {
    /// three values
    #[input(asynchronous)]
    u: [f64; 3],
    /// their digits
    #[output]
    y: f64,
}

impl Step for Gather {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.y = self.u[0] + 10.0 * self.u[1] + 100.0 * self.u[2];
        Outcome::Done
    }
}

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
    /// what to write
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

/// Moves y on by v each time; v grows to 3, or, while `holding`, falls to 0.
#[derive(FunctionBlock)]
pub struct Ramp {
    /// come to rest
    #[input(asynchronous, default = false)]
    holding: bool,
    /// how far it is
    #[output]
    y: f64,
    /// how fast it is
    #[output]
    v: f64,
    /// it rests
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

/// Goes from `present`, read once, towards `goal`, by `stride` an invocation: y is where it is.
#[derive(FunctionBlock)]
pub struct Glide {
    /// where it begins
    #[input(asynchronous)]
    present: f64,
    /// where it goes
    #[param(default = 0.0)]
    goal: f64,
    /// where it is
    #[output]
    y: f64,
    /// how far it goes each time
    #[param(default = 0.001)]
    stride: f64,
    /// it has begun
    #[state]
    begun: bool,
    /// where it is
    #[state]
    at: f64,
    /// it is there
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
    /// where it shall be
    #[input(asynchronous)]
    u: f64,
    /// where it is
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

/// Writes where nothing is, in invocation `at`.
#[derive(FunctionBlock)]
pub struct Crash {
    /// invocations
    #[output]
    y: f64,
    /// in which invocation (from 0)
    #[param(default = 3)]
    at: u64,
}

impl Step for Crash {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.y += 1.0;
        if invocation.number == self.at {
            let nowhere = std::hint::black_box(16 as *mut u32);
            // SAFETY: none; the fault is what the test is about, and the kernel contains it.
            unsafe { nowhere.write_volatile(1) };
        }
        Outcome::Done
    }
}

/// Blocks of a module of their own, which is not trusted after they crash.
pub fn crashing() -> Vec<&'static Descriptor> {
    vec![Crash::descriptor()]
}

pub fn all() -> Vec<&'static Descriptor> {
    vec![
        Count::descriptor(),
        Probe::descriptor(),
        Watch::descriptor(),
        Fourth::descriptor(),
        Quarter::descriptor(),
        Faulty::descriptor(),
        Spread::descriptor(),
        Gather::descriptor(),
        ReadChannel::descriptor(),
        Drive::descriptor(),
        Ramp::descriptor(),
        Glide::descriptor(),
        Follow::descriptor(),
    ]
}
