// SPDX-License-Identifier: Apache-2.0
//! Operations of callers, time and misfortune on a world. An operation names what it is about by numbers that are taken modulo what there is,
//! so that a list of operations still means something when some of them are left out.
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
    /// Begins a halt, and goes on without waiting for its end.
    Halt,
    /// Begins a wait for an end.
    Wait,
    /// Waits for an end, some ms of the system's clock at the most.
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
    /// The messages' faults change.
    Link,
    /// The plant goes away, or comes back.
    Plant,
    /// The gate opens or closes.
    Gate,
    /// The plant's process, its guard or the supervisor is killed, or stands still, and some seconds pass.
    Hit,
    /// A programming system is cut off.
    Abandon,
    /// The same work of one instance, again and again, costs what it cost.
    Churn,
}

/// Each kind with its weight, and whether it is a misfortune that a seed may do without.
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

/// The operations of a seed. Each seed leaves some kinds out and does others more often: what hides when everything happens shows when
/// little does.
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
