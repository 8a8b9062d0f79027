// SPDX-License-Identifier: Apache-2.0
//! Verb instances: origin, state of life, and pending work.
use crate::ending::report::{Other, Report};
use crate::instances::captures::Captures;
use crate::instances::cause::Cause;
use crate::instances::installed_verb::InstalledVerb;
use crate::movements::sequence::Movement;
use crate::refuse::refuse;
use crate::registry::PhysicalRecord;
use crate::starting::psi::InputValues;
use crate::transitions::route::Way;
use crate::wiring::installed::InstalledPlan;
use indexmap::IndexMap;
use kernel::SourceId;
use model::definition::Application;
use model::plan::{Claim, Plan};
use model::refusal::{Class, Refusals};
use model::{CheckedVerb, SystemCondition};
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

/// created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    Created,
    /// Started, and waiting for claims held by other instances.
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

/// Progress of a running instance towards its suspension.
pub(crate) enum Rest {
    /// No suspension was requested.
    Unasked,
    /// The instance comes to rest first: running time at which the time limit for this expires, and the conditions that have occurred so
    /// far.
    Coming { until_ns: i64, rested: Vec<(usize, usize)> },
    /// The instance is suspended when the running sequence is complete.
    Due,
}

/// State of an instance's life, with its data.
pub(crate) enum Life {
    Created,
    /// Started, and waiting for claims held by other instances.
    Queued,
    Running(Rest),
    /// Suspended, with the values of its channels in each source when they became safe.
    Suspended {
        held: Vec<(SourceId, Vec<u8>)>,
    },
    /// The final end is in progress, from one of these states.
    Ending {
        from: State,
        cause: Cause,
    },
    Ended(Box<Report>),
}

/// Limits of one start.
#[derive(Clone, Copy, Debug, Default, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Limits {
    /// Running time after which `time_limit` occurs, ns.
    pub time_limit_ns: Option<i64>,
    /// Overruns of its sources after which `overrun` occurs.
    pub overruns: Option<u64>,
    /// Age of a value from another source, ns, above which `late` (for a ratio input) or `link_lost` (for a value that a timer publishes
    /// in each firing) occurs.
    pub age_max_ns: Option<i64>,
}

impl Limits {
    /// Checks that the times are above 0.
    ///
    /// # Errors
    /// `OutOfRange` with the offending limit.
    pub fn check(&self) -> Result<(), Refusals> {
        for (name, limit) in [("time_limit", self.time_limit_ns), ("age_max", self.age_max_ns)] {
            if let Some(ns) = limit.filter(|ns| *ns <= 0) {
                let message = format!("'{name}' must be above 0 s, not {} s", ns as f64 * 1e-9);
                return Err(refuse(Class::OutOfRange, message, "give a time above 0, for example '10 s', or leave it out"));
            }
        }
        Ok(())
    }
}

/// Running time, which is held while the instance is suspended.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RunningTime {
    /// Time on the clock minus running time, while the running time advances.
    offset_ns: i64,
    /// Running time at which it is held.
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

    /// Returns true while the running time is held.
    pub fn is_held(&self) -> bool {
        self.held_ns.is_some()
    }

    /// Returns the time on the clock at which a running time is reached; `None` while it is held.
    pub fn clock_at(&self, running_ns: i64) -> Option<i64> {
        self.held_ns.is_none().then_some(self.offset_ns + running_ns)
    }

    pub fn at(&self, now_ns: i64) -> i64 {
        self.held_ns.unwrap_or(now_ns - self.offset_ns)
    }
}

/// An end in progress.
#[derive(Clone, Debug)]
pub(crate) struct Departure {
    /// Cause for the report.
    pub cause: Cause,
    /// List that ran before the ending list, if that is running. Absent if τ has led on and the final end is still to come.
    pub ending_from: Option<usize>,
    /// Running time by which the departure must be complete.
    pub until_ns: Option<i64>,
}

/// Intervals by label, ns.
pub(crate) type Intervals = IndexMap<String, u64>;

/// Origin of an instance, from which its rates are checked again.
#[derive(Clone)]
pub(crate) struct Origin {
    pub checked: Arc<CheckedVerb>,
    pub application: Application,
}

/// Stages that an instance left at the instant at which it entered them.
#[derive(Default)]
pub(crate) struct Entries {
    pub at_ns: i64,
    pub count: u32,
    pub lists: BTreeSet<usize>,
}

/// Position of an instance in its command lists.
#[derive(Default)]
pub(crate) struct Position {
    pub list: usize,
    pub stage: usize,
    /// Stage to which the running sequence leads.
    pub target: (usize, usize),
    /// Activations that are on.
    pub active: Vec<(usize, u32)>,
    /// Running time at which the current timed wait ends.
    pub wait_until_ns: Option<i64>,
    /// True if the instance has entered a list in this start.
    pub has_entered: bool,
    /// Stages that the instance left at the instant at which it entered them.
    pub entries: Entries,
}

/// Times of one start, and its limits.
#[derive(Default)]
pub(crate) struct Times {
    pub running: RunningTime,
    pub started_ns: i64,
    pub limits: Limits,
    /// Overruns of the instance's sources at the start.
    pub overruns_before: u64,
}

/// Work of the kernels for the instance, one movement at a time.
#[derive(Default)]
pub(crate) struct Work {
    pub sequence: VecDeque<Movement>,
    /// Number of acknowledgements that the current movement still lacks.
    pub outstanding: usize,
    /// Sources whose acknowledgements are missing; `sent_ns` is the time at which they were asked.
    pub awaited: Vec<SourceId>,
    pub sent_ns: i64,
    /// Time at which an answer was found to be late, ns.
    pub last_call_ns: Option<i64>,
    /// True if the current movement changes tables: the following ones wait for it, whatever happens to the instance.
    pub structural: bool,
    pub epoch: u64,
    /// True if the running or last script also ends the instance, unless something intervenes.
    pub is_through: bool,
    /// Time of the next check whether machines follow, ns on the clock; nothing proceeds before.
    pub look_ns: Option<i64>,
    /// Values captured by the scripts of the last movement.
    pub captured: Vec<(SourceId, Vec<u8>)>,
}

/// Findings for the report of one start, in addition to its condition.
#[derive(Default)]
pub(crate) struct Findings {
    /// Outputs that the ending condition returns.
    pub captures: Captures,
    pub others: Vec<Other>,
    /// Earlier transitions, and the values they returned.
    pub way: Way,
}

impl Findings {
    /// Expects no more captures.
    pub fn expect_nothing(&mut self) {
        self.captures.expect_nothing();
        self.way.captures.expect_nothing();
    }
}

/// Events of one start that lead, or may lead, to its end.
#[derive(Default)]
pub(crate) struct EndingEvents {
    /// End in progress while lists still run.
    pub departure: Option<Departure>,
    /// Time limit or loss that told the verb to end, if τ has led on from it.
    pub began: Option<Cause>,
    /// True if a second `halt` is immediate.
    pub halting: bool,
    /// True if `device_disabled` has occurred; it is handled only once.
    pub disabled: bool,
    /// True if a later start has aborted the instance; this happens only once.
    pub aborted: bool,
    /// True if the later start acts on all devices of the instance.
    pub is_overtaken: bool,
}

pub(crate) struct Instance {
    pub id: u64,
    pub name: String,
    pub plan: Arc<Plan>,
    pub installed: InstalledPlan,
    /// Logical device whose own verb the instance is.
    pub owner: Option<String>,
    /// Origin from which the instance was created.
    pub origin: Option<Origin>,
    /// Intervals set at run time, valid until the next start: label → ns.
    pub tuned: Intervals,
    /// Values of its input parameters: those of the latest start, with later changes.
    pub inputs: InputValues,
    /// Number of changes to inputs or intervals.
    pub changes: u64,
    /// Instances that it follows: SVV → its writer.
    pub followed: IndexMap<String, u64>,
    pub life: Life,
    /// Number of starts of the instance.
    pub starts: u64,
    /// Generation of the process as the supervisor knows it: kernel, supervisor and PS race to advance it.
    pub generation: u32,
    pub position: Position,
    pub times: Times,
    pub work: Work,
    pub findings: Findings,
    pub leaving: EndingEvents,
}

impl Instance {
    /// Returns the installed verb of the instance, with the existing devices.
    pub fn installed_verb<'a>(&'a self, devices: &'a IndexMap<String, PhysicalRecord>) -> InstalledVerb<'a> {
        InstalledVerb { plan: &self.plan, installed: &self.installed, devices }
    }

    /// Returns the list and stage of a kernel's stage.
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

    /// Returns the state shown to people, in which an end in progress is not visible.
    pub fn state(&self) -> State {
        match &self.life {
            Life::Created => State::Created,
            Life::Queued => State::Queued,
            Life::Running(_) => State::Running,
            Life::Suspended { .. } => State::Suspended,
            Life::Ending { from, .. } => *from,
            Life::Ended(_) => State::Ended,
        }
    }

    /// Returns true while the end is in progress.
    pub fn is_ending(&self) -> bool {
        matches!(self.life, Life::Ending { .. })
    }

    /// Returns true while the instance runs and its end is not in progress.
    pub fn is_running(&self) -> bool {
        matches!(self.life, Life::Running(_))
    }

    pub fn is_suspended(&self) -> bool {
        matches!(self.life, Life::Suspended { .. })
    }

    /// Returns true while the instance runs or is suspended and its end is not in progress.
    pub fn is_started(&self) -> bool {
        self.is_running() || self.is_suspended()
    }

    /// Begins the end of the instance.
    pub fn ends(&mut self, cause: Cause) {
        self.life = Life::Ending { from: self.state(), cause };
    }

    /// Returns the report of the latest start, if that has ended.
    pub fn report(&self) -> Option<&Report> {
        if let Life::Ended(report) = &self.life { Some(report) } else { None }
    }

    /// Returns the running time at which the time limit for coming to rest expires, while the instance comes to rest before a suspension.
    pub fn resting_until_ns(&self) -> Option<i64> {
        if let Life::Running(Rest::Coming { until_ns, .. }) = self.life { Some(until_ns) } else { None }
    }

    /// Sets the progress of a running instance towards its suspension.
    pub fn rests(&mut self, rest: Rest) {
        if let Life::Running(now) = &mut self.life {
            *now = rest;
        }
    }

    /// Resets the instance for an accepted start, discarding everything of the previous one.
    pub fn renew(&mut self) {
        self.starts += 1;
        let list = self.plan.initial;
        (self.position.list, self.position.stage, self.position.target) = (list, 0, (list, 0));
        (self.position.wait_until_ns, self.position.has_entered) = (None, false);
        self.work.captured.clear();
        self.work.is_through = false;
        (self.findings, self.leaving) = (Findings::default(), EndingEvents::default());
    }

    /// Returns the index of a condition by name: its line for the current command list, if there is one.
    pub fn condition(&self, name: &str) -> Option<usize> {
        let named = || self.plan.conditions.iter().enumerate().filter(|(_, c)| c.name == name);
        named().find(|(_, c)| c.holds_in(self.position.list)).or_else(|| named().next()).map(|(index, _)| index)
    }

    /// Returns the index of a system condition.
    pub fn system(&self, condition: SystemCondition) -> Option<usize> {
        self.condition(condition.name())
    }

    /// Returns true while the kernels have work left.
    pub fn is_under_way(&self) -> bool {
        self.work.outstanding > 0 || !self.work.sequence.is_empty()
    }

    /// Returns true for an action on devices: an instance that uses logical devices or writes channels, and is not a device's own verb.
    pub fn is_action(&self) -> bool {
        self.owner.is_none() && (!self.plan.devices.is_empty() || self.plan.claims.iter().any(|claim| matches!(claim, Claim::Channel { .. })))
    }

    pub fn is_busy(&self) -> bool {
        !matches!(self.life, Life::Created | Life::Ended(_))
    }

    /// Returns the maximum time budget declared for a firing of this source, ns; 0 if none is declared. Saturates at `i64::MAX`.
    pub fn budget_ns(&self, source: SourceId) -> i64 {
        let there = self.plan.activations.iter().zip(&self.installed.activation_source).filter(|(_, at)| **at == source);
        let longest = there.filter_map(|(of, _)| of.budget_ns).max().unwrap_or(0);
        i64::try_from(longest).unwrap_or(i64::MAX)
    }

    /// Records another condition that occurred while one was being handled.
    pub fn other(&mut self, condition: String, block: String, time_ns: i64) {
        self.findings.others.push(Other { condition, block, time_s: time_ns as f64 * 1e-9 });
    }
}
