// SPDX-License-Identifier: Apache-2.0
//! Blocks for scenarios. A probe's observations go into a trace, chosen by its parameter `trace`.
mod devices;

use devices::*;
use opengpac::abi::Descriptor;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::collections::HashMap;
use std::sync::Mutex;

/// Observation of one invocation of a probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    pub now_ns: i64,
    /// Running time.
    pub time_ns: i64,
    pub number: u64,
    pub u: f64,
}

static TRACES: Mutex<Option<HashMap<i64, Vec<Row>>>> = Mutex::new(None);

/// Returns the rows of the probes with this `trace` since the last call.
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
    /// first value
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
    /// value at which it reports
    #[param(default = 0.0)]
    limit: f64,
    /// invocations in total, as a value
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

/// Traces its input and passes it on: y = u.
#[derive(FunctionBlock)]
pub struct Probe {
    /// value that it reads
    #[input]
    u: f64,
    /// same value
    #[output]
    y: f64,
    /// number of the trace
    #[param(default = 0)]
    trace: i64,
    /// u is above `limit`
    #[condition]
    above: Condition,
    /// value at which it reports
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

/// Traces the newest value: y = u.
#[derive(FunctionBlock)]
pub struct Watch {
    /// value that it reads
    #[input(asynchronous, default = 0.0)]
    u: f64,
    /// same value
    #[output]
    y: f64,
    /// number of the trace
    #[param(default = 0)]
    trace: i64,
    /// u is above `limit`
    #[condition]
    above: Condition,
    /// value at which it reports
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

/// Traces every fourth value: y = u.
#[derive(FunctionBlock)]
pub struct Fourth {
    /// value that it reads
    #[input(ratio = 4)]
    u: f64,
    /// same value
    #[output]
    y: f64,
    /// number of the trace
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
    /// kind of the fault
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

/// Stores one number in two outputs: a pair.
#[derive(FunctionBlock)]
pub struct Pair {
    /// invocations in the life of the instance
    #[output]
    a: f64,
    /// same value
    #[output]
    b: f64,
    /// same value
    #[state(keep)]
    life: u32,
}

impl Step for Pair {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.life += 1;
        self.a = f64::from(self.life);
        self.b = self.a;
        Outcome::Done
    }
}

/// Traces the difference between the halves of a pair.
#[derive(FunctionBlock)]
pub struct Halves {
    /// one half
    #[input]
    u: f64,
    /// other half
    #[input]
    v: f64,
    /// difference
    #[output]
    y: f64,
    /// number of the trace
    #[param(default = 0)]
    trace: i64,
}

impl Step for Halves {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.y = self.u - self.v;
        note(self.trace, invocation, self.y);
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

/// Writes to an invalid address in invocation `at`.
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
            // SAFETY: none; the fault is the subject of the test, and the kernel contains it.
            unsafe { nowhere.write_volatile(1) };
        }
        Outcome::Done
    }
}

/// Returns the blocks of a separate module, which is no longer trusted after they crash.
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
        Pair::descriptor(),
        Halves::descriptor(),
        Spread::descriptor(),
        Gather::descriptor(),
        ReadChannel::descriptor(),
        Drive::descriptor(),
        Ramp::descriptor(),
        Glide::descriptor(),
        Follow::descriptor(),
    ]
}
