// SPDX-License-Identifier: Apache-2.0
//! Operations on a world, by callers, by the passage of time, and by faults. An operation identifies its target by a number modulo the
//! number of existing targets, so that a list of operations remains meaningful if some are omitted.
use crate::seed::Numbers;

/// Number of callers that call at the same time.
pub const CALLERS: usize = 3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    Define,
    Create,
    Start,
    Suspend,
    Resume,
    /// Starts a halt, and continues without waiting for it to end.
    Halt,
    /// Starts waiting for an instance to end.
    Wait,
    /// Waits at most a few milliseconds of the system's clock for an instance to end.
    WaitShortly,
    Delete,
    Set,
    Write,
    Look,
    Advance,
    Step,
    Request,
    EmergencyStop,
    Reset,
    Enable,
    Disable,
    Pause,
    ResumeProgram,
    /// Changes the message faults.
    Link,
    /// Disconnects or reconnects the plant.
    Plant,
    /// Opens or closes the gate.
    Gate,
    /// Kills or suspends the plant's process, its guard or the supervisor, and lets several seconds elapse.
    Hit,
    /// Cuts off a programming system.
    Abandon,
    /// Checks that repeating the same work of one instance does not become more expensive.
    Churn,
}

/// Kinds of operations, each with its weight and whether it is a fault that a seed may omit.
const KINDS: [(What, usize, bool); 27] = [
    (What::Define, 1, false),
    (What::Create, 10, false),
    (What::Start, 22, false),
    (What::Suspend, 7, true),
    (What::Resume, 9, false),
    (What::Halt, 8, false),
    (What::Wait, 4, false),
    (What::WaitShortly, 6, false),
    (What::Delete, 4, false),
    (What::Set, 3, false),
    (What::Write, 4, false),
    (What::Look, 3, false),
    (What::Advance, 30, false),
    (What::Step, 6, false),
    (What::Request, 4, false),
    (What::EmergencyStop, 2, true),
    (What::Reset, 4, false),
    (What::Enable, 5, false),
    (What::Disable, 3, true),
    (What::Pause, 3, true),
    (What::ResumeProgram, 4, false),
    (What::Link, 4, true),
    (What::Plant, 2, true),
    (What::Gate, 2, true),
    (What::Hit, 2, true),
    (What::Abandon, 2, true),
    (What::Churn, 0, true),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operation {
    pub what: What,
    pub caller: usize,
    pub a: usize,
    pub b: usize,
    pub c: usize,
}

/// Returns the operations of a seed. Each seed omits some kinds and executes others more often, because some faults show up only when few
/// kinds of operations occur.
pub fn random(numbers: &Numbers) -> Vec<Operation> {
    let mut draw = numbers.split("operations");
    let weights: Vec<usize> = (KINDS.iter())
        .map(|(_, weight, is_misfortune)| match draw.below(if *is_misfortune { 3 } else { 6 }) {
            0 if *is_misfortune => 0,
            1 => 3 * weight,
            _ => *weight,
        })
        .collect();
    let count = 20 + draw.below(60);
    let mut operations: Vec<Operation> = (0..2 + draw.below(5)).map(|_| drawn(What::Create, &mut draw)).collect();
    if draw.percent(60) {
        operations.push(Operation { a: 0, ..drawn(What::Enable, &mut draw) });
    }
    operations.extend((0..count).map(|_| drawn(KINDS[draw.weighted(&weights)].0, &mut draw)));
    if draw.percent(6) {
        operations.push(drawn(What::Churn, &mut draw));
    }
    operations
}

fn drawn(what: What, draw: &mut Numbers) -> Operation {
    let mut number = || draw.below(1 << 20);
    Operation { what, caller: number() % CALLERS, a: number(), b: number(), c: number() }
}
