// SPDX-License-Identifier: Apache-2.0
//! A small family of blocks whose outputs can be verified: each value identifies the start and the invocation that stored it.
//!
//! A *tag* is the unique number of a start; it is passed in ψ. The *code* of an invocation combines its tag and its number. A producer
//! stores its code in one output and the negated code in the other: if one is not the negative of the other, they were stored by two
//! invocations.
use opengpac::abi::Descriptor;
use opengpac::{Condition, ConditionOf, FunctionBlock, Invocation, Outcome, Step};
use std::cell::RefCell;

/// Range of invocation numbers in a code.
const NUMBERS: i64 = 1 << 20;

/// Returns the value that invocation `number` of the start with `tag` stores.
pub fn code(tag: i64, number: u64) -> f64 {
    (tag * NUMBERS + (number as i64 % NUMBERS)) as f64
}

/// Returns the tag and number of a code, or `None` if the value was not stored by a block.
pub fn decode(value: f64) -> Option<(i64, u64)> {
    let value = value.abs();
    let whole = value as i64;
    (whole >= NUMBERS && whole as f64 == value).then_some((whole / NUMBERS, (whole % NUMBERS) as u64))
}

thread_local! {
    /// Violations that blocks have observed.
    static WRONG: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

/// Returns the violations that blocks of this thread's world have observed since the last call.
pub fn wrong() -> Vec<String> {
    WRONG.take()
}

fn tell(text: String) {
    WRONG.with_borrow_mut(|wrong| wrong.push(text));
}

/// Returns true if the two values of a pair belong together: the same invocation stored both, or at least one was stored by the program
/// instead of a block.
pub fn is_whole(u: f64, v: f64) -> bool {
    u == -v || decode(u).is_none() || decode(v).is_none()
}

/// Checks a pair that a block reads: it must be whole, and no older than the previous pair that the block read.
fn judge(who: &str, is_each: bool, last: &mut f64, u: f64, v: f64) {
    if !is_whole(u, v) {
        tell(format!("{who} read {:?} in one input and {:?} in the other: two invocations", decode(u), decode(v)));
    }
    if let (Some((tag, number)), Some((before_tag, before))) = (decode(u), decode(*last))
        && tag == before_tag
        && (number < before || is_each && number == before)
    {
        tell(format!("{who} read invocation {number} after {before} of start {tag}"));
    }
    *last = u;
}

/// A pair.
#[derive(FunctionBlock)]
pub struct Pair {
    /// the code
    #[output]
    a: f64,
    /// its negative value
    #[output]
    b: f64,
    /// number of the start
    #[param(default = 1)]
    tag: i64,
}

impl Step for Pair {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.a = code(self.tag, invocation.number);
        self.b = -self.a;
        Outcome::Done
    }
}

/// A pair that reports `reached`, with the code, in every `each`-th invocation.
#[derive(FunctionBlock)]
pub struct Reporter {
    /// the code
    #[output]
    a: f64,
    /// its negative value
    #[output]
    b: f64,
    /// number of the start
    #[param(default = 1)]
    tag: i64,
    /// period of the reports, in invocations; 0 for never
    #[param(default = 0)]
    each: u64,
    /// every `each`-th invocation, with the code
    #[condition(preset = 0.0)]
    reached: ConditionOf<f64>,
    /// the number of the invocation is above 30
    #[condition]
    late: Condition,
}

impl Step for Reporter {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.a = code(self.tag, invocation.number);
        self.b = -self.a;
        if self.each != 0 && invocation.number % self.each == self.each - 1 {
            let a = self.a;
            self.reached.report(a);
        }
        if invocation.number > 30 {
            self.late.report();
        }
        Outcome::Done
    }
}

/// A pair that faults in invocation `at`, after it has stored the first half. Kinds: 1 returns an error, 2 panics, 3 produces a
/// non-finite output.
#[derive(FunctionBlock)]
pub struct Faulty {
    /// the code
    #[output]
    a: f64,
    /// its negative value
    #[output]
    b: f64,
    /// number of the start
    #[param(default = 1)]
    tag: i64,
    /// invocation in which it faults
    #[param(default = 1_000_000)]
    at: u64,
    /// kind of the fault
    #[param(default = 1)]
    how: u32,
}

impl Step for Faulty {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.a = code(self.tag, invocation.number);
        if invocation.number == self.at {
            match self.how {
                2 => std::panic::panic_any("as asked for"),
                3 => {
                    self.b = f64::NAN;
                    return Outcome::Done;
                }
                code => return Outcome::Fault(code),
            }
        }
        self.b = -self.a;
        Outcome::Done
    }
}

/// An array whose elements all contain the code.
#[derive(FunctionBlock)]
pub struct Many {
    /// the code
    #[output]
    y: [f64; MANY],
    /// number of the start
    #[param(default = 1)]
    tag: i64,
}

/// Number of elements of [`Many`].
pub const MANY: usize = 256;

impl Step for Many {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.y = [code(self.tag, invocation.number); MANY];
        Outcome::Done
    }
}

/// Reads the newest pair.
#[derive(FunctionBlock)]
pub struct Newest {
    /// first half
    #[input(asynchronous, default = 0.0)]
    u: f64,
    /// second half
    #[input(asynchronous, default = 0.0)]
    v: f64,
    /// the first half that was read
    #[output]
    y: f64,
    /// value read in the last invocation
    #[state]
    last: f64,
}

impl Step for Newest {
    fn step(&mut self, _: &Invocation) -> Outcome {
        judge("one that takes the newest", false, &mut self.last, self.u, self.v);
        self.y = self.u;
        Outcome::Done
    }
}

/// Reads each pair.
#[derive(FunctionBlock)]
pub struct Each {
    /// first half
    #[input]
    u: f64,
    /// second half
    #[input]
    v: f64,
    /// the first half that was read
    #[output]
    y: f64,
    /// value read in the last invocation
    #[state]
    last: f64,
}

impl Step for Each {
    fn step(&mut self, _: &Invocation) -> Outcome {
        judge("one that takes each", true, &mut self.last, self.u, self.v);
        self.y = self.u;
        Outcome::Done
    }
}

/// Reads every third pair.
#[derive(FunctionBlock)]
pub struct Third {
    /// first half
    #[input(ratio = 3)]
    u: f64,
    /// second half
    #[input(ratio = 3)]
    v: f64,
    /// the first half that was read
    #[output]
    y: f64,
    /// value read in the last invocation
    #[state]
    last: f64,
}

impl Step for Third {
    fn step(&mut self, _: &Invocation) -> Outcome {
        judge("one that takes every third", true, &mut self.last, self.u, self.v);
        self.y = self.u;
        Outcome::Done
    }
}

/// Reads the newest array.
#[derive(FunctionBlock)]
pub struct All {
    /// the elements
    #[input(asynchronous)]
    u: [f64; MANY],
    /// the first element
    #[output]
    y: f64,
}

impl Step for All {
    fn step(&mut self, _: &Invocation) -> Outcome {
        if let Some(other) = self.u.iter().find(|x| **x != self.u[0] && decode(**x).is_some() && decode(self.u[0]).is_some()) {
            tell(format!("one that reads an array read {:?} in its first element and {:?} in another", decode(self.u[0]), decode(*other)));
        }
        self.y = self.u[0];
        Outcome::Done
    }
}

/// Drives a channel with the code.
#[derive(FunctionBlock)]
pub struct Drive {
    /// the channel
    #[device(write)]
    channel: f64,
    /// number of the start
    #[param(default = 1)]
    tag: i64,
}

impl Step for Drive {
    fn step(&mut self, invocation: &Invocation) -> Outcome {
        self.channel = code(self.tag, invocation.number);
        Outcome::Done
    }
}

/// The servo of a logical device: passes on the command and the sensor value.
#[derive(FunctionBlock)]
pub struct Servo {
    /// commanded value
    #[input(asynchronous, default = 0.0)]
    u: f64,
    /// value of the sensor channel
    #[device(read)]
    sensor: f64,
    /// value for the actuator channel
    #[device(write)]
    actuator: f64,
    /// sensed value
    #[output]
    sensed: f64,
}

impl Step for Servo {
    fn step(&mut self, _: &Invocation) -> Outcome {
        self.sensed = self.sensor;
        self.actuator = self.u;
        Outcome::Done
    }
}

/// Returns the blocks of module `sim`.
pub fn all() -> [&'static Descriptor; 10] {
    [
        Pair::descriptor(),
        Reporter::descriptor(),
        Faulty::descriptor(),
        Many::descriptor(),
        Newest::descriptor(),
        Each::descriptor(),
        Third::descriptor(),
        All::descriptor(),
        Drive::descriptor(),
        Servo::descriptor(),
    ]
}
