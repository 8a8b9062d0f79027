// SPDX-License-Identifier: Apache-2.0
//! A verb instance: what it was made of, where it is in its life, what it still waits for.
use crate::connect::Pair;
use crate::ending::Departure;
use crate::install::Installed;
use crate::outputs::Piece;
use crate::report::{Other, Report};
use crate::sequence::Movement;
use kernel::{Cell, SourceId};
use model::plan::{Claim, Plan, Wait};
use model::value::Value;
use std::collections::VecDeque;
use std::sync::Arc;

/// created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    Created,
    /// Started, and waiting for what other instances hold.
    Queued,
    Running,
    Suspended,
    Ended,
}

impl State {
    pub fn name(self) -> &'static str {
        match self {
            State::Created => "created",
            State::Queued => "queued",
            State::Running => "running",
            State::Suspended => "suspended",
            State::Ended => "ended",
        }
    }
}

/// Why a start ends.
#[derive(Clone, Debug)]
pub(crate) struct Cause {
    /// Index into the plan's conditions.
    pub condition: usize,
    /// Flat label of the block that reported it.
    pub block: Option<String>,
    pub value: Option<Value>,
    pub message: String,
    pub time_ns: i64,
    /// Its end is normal, whatever the condition says (a halt asked for by the waiter).
    pub asked_for: bool,
}

/// Limits of one start.
#[derive(Clone, Copy, Debug, Default, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Limits {
    /// Running time after which `time_limit` comes, ns.
    pub time_limit_ns: Option<i64>,
    /// Overruns of its sources after which `overrun` comes.
    pub overruns: Option<u64>,
    /// Age of a value from another source beyond which `late` (of a ratio input) or `link_lost` (of what a timer publishes in each
    /// firing) comes, ns.
    pub age_max_ns: Option<i64>,
}

/// Running time: it stands still while the instance is suspended.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RunningTime {
    /// Time on the clock minus running time, while it runs.
    offset_ns: i64,
    /// Running time at which it stands still.
    held_ns: Option<i64>,
}

impl RunningTime {
    pub fn start(now_ns: i64) -> Self {
        RunningTime { offset_ns: now_ns, held_ns: None }
    }

    pub fn hold(&mut self, now_ns: i64) {
        self.held_ns = Some(now_ns - self.offset_ns);
    }

    pub fn go_on(&mut self, now_ns: i64) {
        if let Some(held) = self.held_ns.take() {
            self.offset_ns = now_ns - held;
        }
    }

    /// True while it stands still.
    pub fn is_held(&self) -> bool {
        self.held_ns.is_some()
    }

    /// Time on the clock at which a running time is reached; `None` while it stands still.
    pub fn clock_at(&self, running_ns: i64) -> Option<i64> {
        self.held_ns.is_none().then_some(self.offset_ns + running_ns)
    }

    pub fn at(&self, now_ns: i64) -> i64 {
        self.held_ns.unwrap_or(now_ns - self.offset_ns)
    }
}

pub(crate) struct Instance {
    pub id: u64,
    pub name: String,
    pub plan: Arc<Plan>,
    pub installed: Installed,
    /// Private cells that travel between sources.
    pub crossings: Vec<(Pair, Cell, Cell)>,
    /// The logical device that it keeps going.
    pub owner: Option<String>,
    /// What it was made from.
    pub origin: Option<crate::retune::Origin>,
    /// Intervals that were set while it ran, until the next start: label → ns.
    pub tuned: crate::retune::Intervals,
    /// Whom it follows: SVV → instance that writes it.
    pub followed: indexmap::IndexMap<String, u64>,
    pub state: State,
    /// Number of its starts.
    pub starts: u64,
    /// What kernel, supervisor and PS race on: the generation that this side believes in.
    pub generation: u32,
    /// Where it is in its command lists.
    pub list: usize,
    pub stage: usize,
    /// Where the sequence under way leads to.
    pub target: (usize, usize),
    /// What is on.
    pub active: Vec<(usize, u32)>,
    pub running: RunningTime,
    pub started_ns: i64,
    pub limits: Limits,
    /// Running time at which the present wait for a time ends.
    pub wait_until_ns: Option<i64>,
    /// Overruns of its sources when it started.
    pub overruns_before: u64,
    /// The end that is being carried out.
    pub ending: Option<Cause>,
    /// What has to be done, and how many acknowledgements the present movement lacks.
    pub sequence: VecDeque<Movement>,
    pub outstanding: usize,
    /// Sources whose acknowledgement is lacking, and when they were asked.
    pub awaited: Vec<SourceId>,
    pub sent_ns: i64,
    /// The present movement changes tables: what follows waits for it, whatever happens to the instance.
    pub structural: bool,
    pub epoch: u64,
    /// What the scripts of the last movement captured.
    pub captured: Vec<(SourceId, Vec<u8>)>,
    /// Values of its outputs, as far as they have been captured: (piece, bytes).
    pub outputs: Vec<(Piece, Vec<u8>)>,
    /// Outputs that the script under way captures in each source, in order.
    pub capturing: Vec<(SourceId, Vec<Piece>)>,
    pub others: Vec<Other>,
    pub report: Option<Report>,
    /// A second `halt` is immediate.
    pub halting: bool,
    /// It has entered a list in this start.
    pub has_entered: bool,
    /// An end that is on its way while lists still run.
    pub departure: Option<Departure>,
    /// `device_disabled` has come in this start: it comes once.
    pub disabled: bool,
    /// A later start has aborted it: once.
    pub aborted: bool,
    /// That one acts on all of its devices.
    pub is_overtaken: bool,
    /// To be suspended when the sequence under way is through.
    pub suspending: bool,
    /// It comes to rest before it is suspended: the running time at which that has had its time.
    pub resting_until_ns: Option<i64>,
    /// The conditions of that which have come.
    pub rested: Vec<(usize, usize)>,
    /// What its channels held in each source when they went safe for a suspension.
    pub held: Vec<(SourceId, Vec<u8>)>,
    /// An instant, and how many stages it has entered in it.
    pub entries: (i64, u32),
}

impl Instance {
    /// List and stage of a kernel's stage.
    pub fn list_stage(&self, kernel_stage: u16) -> (usize, usize) {
        let mut rest = usize::from(kernel_stage) / 2;
        for (index, list) in self.plan.lists.iter().enumerate() {
            if rest < list.stages.len() {
                return (index, rest);
            }
            rest -= list.stages.len();
        }
        (self.plan.initial, 0)
    }

    /// A start was accepted: nothing of the one before is left.
    pub fn renew(&mut self) {
        self.starts += 1;
        (self.list, self.stage) = (self.plan.initial, 0);
        self.target = (self.list, self.stage);
        self.report = None;
        self.others.clear();
        self.outputs.clear();
        self.captured.clear();
        self.capturing.clear();
        self.rested.clear();
        (self.halting, self.suspending, self.disabled, self.has_entered) = (false, false, false, false);
        (self.aborted, self.is_overtaken) = (false, false);
        self.departure = None;
        (self.wait_until_ns, self.resting_until_ns) = (None, None);
    }

    /// Index of a condition by name: its line for the present command list, where the list has one.
    pub fn condition(&self, name: &str) -> Option<usize> {
        let named = || self.plan.conditions.iter().enumerate().filter(|(_, c)| c.name == name);
        named().find(|(_, c)| c.holds_in(self.list)).or_else(|| named().next()).map(|(index, _)| index)
    }

    /// True while something is left to be done by the kernels.
    pub fn is_under_way(&self) -> bool {
        self.outstanding > 0 || !self.sequence.is_empty()
    }

    /// True for an action on devices: it uses logical devices or writes channels, and keeps none going.
    pub fn is_action(&self) -> bool {
        self.owner.is_none() && (!self.plan.devices.is_empty() || self.plan.claims.iter().any(|claim| matches!(claim, Claim::Channel { .. })))
    }

    pub fn is_busy(&self) -> bool {
        matches!(self.state, State::Queued | State::Running | State::Suspended) || self.ending.is_some()
    }
}

/// The kernel's stage while the commands of (list, stage) are carried out. Each stage is two of the kernel's: while its commands are
/// under way, what its wait is for is remembered; when they are through, the wait is reached.
pub(crate) fn under_way(plan: &Plan, list: usize, stage: usize) -> u16 {
    let before: usize = plan.lists[..list].iter().map(|l| l.stages.len()).sum();
    u16::try_from(2 * (before + stage)).expect("a verb has fewer than 32,768 stages")
}

/// The kernel's stage once the commands of (list, stage) are through.
pub(crate) fn reached(plan: &Plan, list: usize, stage: usize) -> u16 {
    under_way(plan, list, stage) + u16::from(matches!(plan.lists[list].stages[stage].wait, Some(Wait::Conditions(_))))
}
