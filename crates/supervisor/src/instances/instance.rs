// SPDX-License-Identifier: Apache-2.0
//! Verb instances: origin, life cycle state, and pending work.
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

/// State of an instance: created → (queued →) running ⇄ suspended → ended (→ running again by `start`) → deleted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    Created,
    /// Started, but waiting for claims held by other instances.
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
    /// No suspension has been requested.
    Unasked,
    /// The instance is coming to rest. Contains the running time at which the time limit for coming to rest expires, and the conditions
    /// that have occurred so far.
    Coming { until_ns: i64, rested: Vec<(usize, usize)> },
    /// The instance will be suspended when the running sequence is complete.
    Due,
}

/// Life cycle state of an instance, with its data.
pub(crate) enum Life {
    Created,
    /// Started, but waiting for claims held by other instances.
    Queued,
    Running(Rest),
    /// Suspended. Contains the values that its channels had in each source when they were made safe.
    Suspended {
        held: Vec<(SourceId, Vec<u8>)>,
    },
    /// Ending: the final end is in progress, and was started from one of these states.
    Ending {
        from: State,
        cause: Cause,
    },
    Ended(Box<Report>),
}

/// Limits that apply to one start.
#[derive(Clone, Copy, Debug, Default, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(default)]
pub struct Limits {
    /// Running time after which `time_limit` occurs, ns.
    pub time_limit_ns: Option<i64>,
    /// Number of overruns of the instance's sources after which `overrun` occurs.
    pub overruns: Option<u64>,
    /// Maximum age of a value from another source, ns; beyond it, `late` (for a ratio input) or `link_lost` (for a value that a timer
    /// publishes in each firing) occurs.
    pub age_max_ns: Option<i64>,
}

impl Limits {
    /// Checks that the times are positive.
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
    /// Difference between the clock and the running time, while the running time advances.
    offset_ns: i64,
    /// Running time while it is held; `None` while it advances.
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

    /// Returns the time on the clock at which a running time will be reached; `None` while it is held.
    pub fn clock_at(&self, running_ns: i64) -> Option<i64> {
        self.held_ns.is_none().then_some(self.offset_ns + running_ns)
    }

    pub fn at(&self, now_ns: i64) -> i64 {
        self.held_ns.unwrap_or(now_ns - self.offset_ns)
    }
}

/// End in progress.
#[derive(Clone, Debug)]
pub(crate) struct Departure {
    /// Cause to be reported.
    pub cause: Cause,
    /// List that was running before the ending list, if the ending list is running. `None` if τ has led to another list and the final end
    /// is still to come.
    pub ending_from: Option<usize>,
    /// Running time by which the departure must be complete.
    pub until_ns: Option<i64>,
}

/// Intervals by label, ns.
pub(crate) type Intervals = IndexMap<String, u64>;

/// Origin of an instance, used to recheck its rates.
#[derive(Clone)]
pub(crate) struct Origin {
    pub checked: Arc<CheckedVerb>,
    pub application: Application,
}

/// Stages that an instance left at the same instant at which it entered them.
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
    /// Currently active activations, as (activation, every).
    pub active: Vec<(usize, u32)>,
    /// Running time at which the current timed wait ends.
    pub wait_until_ns: Option<i64>,
    /// True if the instance has entered a list in this start.
    pub has_entered: bool,
    /// Stages that the instance left at the same instant at which it entered them.
    pub entries: Entries,
}

/// Times and limits of one start.
#[derive(Default)]
pub(crate) struct Times {
    pub running: RunningTime,
    pub started_ns: i64,
    pub limits: Limits,
    /// Number of overruns of the instance's sources before the start.
    pub overruns_before: u64,
}

/// Work that the kernels do for the instance, one movement at a time.
#[derive(Default)]
pub(crate) struct Work {
    pub sequence: VecDeque<Movement>,
    /// Number of acknowledgements still missing for the current movement.
    pub outstanding: usize,
    /// Sources whose acknowledgements are missing; `sent_ns` is the time at which the request was sent to them.
    pub awaited: Vec<SourceId>,
    pub sent_ns: i64,
    /// Time at which an answer was found to be late, ns.
    pub last_call_ns: Option<i64>,
    /// True if the current movement changes tables: subsequent movements wait for it, whatever happens to the instance.
    pub structural: bool,
    pub epoch: u64,
    /// True if the running or most recent script also ends the instance, unless another event intervenes.
    pub is_through: bool,
    /// Time of the next check that machines follow their commands, ns on the clock; no movement proceeds before this time.
    pub look_ns: Option<i64>,
    /// Values captured by the scripts of the most recent movement.
    pub captured: Vec<(SourceId, Vec<u8>)>,
}

/// Information for the report of one start, in addition to its condition.
#[derive(Default)]
pub(crate) struct Findings {
    /// Outputs that the ending condition returns.
    pub captures: Captures,
    pub others: Vec<Other>,
    /// Earlier transitions, and the values they returned.
    pub way: Way,
}

impl Findings {
    /// Cancels all expected captures.
    pub fn expect_nothing(&mut self) {
        self.captures.expect_nothing();
        self.way.captures.expect_nothing();
    }
}

/// Events of one start that lead, or may lead, to its end.
#[derive(Default)]
pub(crate) struct EndingEvents {
    /// End in progress while lists are still running.
    pub departure: Option<Departure>,
    /// Time limit or loss that ordered the verb to end, if τ has led from it to another list.
    pub began: Option<Cause>,
    /// True if a halt has been requested; a second one is then immediate.
    pub halting: bool,
    /// True if `device_disabled` has occurred; it is handled only once.
    pub disabled: bool,
    /// True if a later start has aborted the instance; this happens only once.
    pub aborted: bool,
    /// True if the start that aborted the instance acts on all of its devices.
    pub is_overtaken: bool,
}

pub(crate) struct Instance {
    pub id: u64,
    pub name: String,
    pub plan: Arc<Plan>,
    pub installed: InstalledPlan,
    /// Logical device whose own verb this instance runs, if any.
    pub owner: Option<String>,
    /// Application from which the instance was created.
    pub origin: Option<Origin>,
    /// Intervals set at run time, which remain valid until the next start: label → ns.
    pub tuned: Intervals,
    /// Values of the instance's input parameters: those of the latest start, updated by later changes.
    pub inputs: InputValues,
    /// Number of changes to inputs or intervals.
    pub changes: u64,
    /// Instances that this one follows: SVV → instance that writes the SVV.
    pub followed: IndexMap<String, u64>,
    pub life: Life,
    /// Number of starts of the instance.
    pub starts: u64,
    /// Latest generation of the process that the supervisor knows of. Kernel, supervisor and PS race to advance it.
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

    /// Returns the list and stage that correspond to a kernel's stage.
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

    /// Returns the state as displayed, in which an end in progress is not visible.
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

    /// Returns true if the instance is running and its end is not in progress.
    pub fn is_running(&self) -> bool {
        matches!(self.life, Life::Running(_))
    }

    pub fn is_suspended(&self) -> bool {
        matches!(self.life, Life::Suspended { .. })
    }

    /// Returns true if the instance is running or suspended and its end is not in progress.
    pub fn is_started(&self) -> bool {
        self.is_running() || self.is_suspended()
    }

    /// Starts the end of the instance.
    pub fn ends(&mut self, cause: Cause) {
        self.life = Life::Ending { from: self.state(), cause };
    }

    /// Returns the report of the latest start, if it has ended.
    pub fn report(&self) -> Option<&Report> {
        if let Life::Ended(report) = &self.life { Some(report) } else { None }
    }

    /// Returns the running time at which the time limit for coming to rest expires, if the instance is coming to rest before a
    /// suspension.
    pub fn resting_until_ns(&self) -> Option<i64> {
        if let Life::Running(Rest::Coming { until_ns, .. }) = self.life { Some(until_ns) } else { None }
    }

    /// Sets the progress of a running instance towards its suspension.
    pub fn rests(&mut self, rest: Rest) {
        if let Life::Running(now) = &mut self.life {
            *now = rest;
        }
    }

    /// Resets the instance for an accepted start, discarding all state of the previous one.
    pub fn renew(&mut self) {
        self.starts += 1;
        let list = self.plan.initial;
        (self.position.list, self.position.stage, self.position.target) = (list, 0, (list, 0));
        (self.position.wait_until_ns, self.position.has_entered) = (None, false);
        self.work.captured.clear();
        self.work.is_through = false;
        (self.findings, self.leaving) = (Findings::default(), EndingEvents::default());
    }

    /// Returns the index of a condition with this name: its entry for the current command list, if there is one.
    pub fn condition(&self, name: &str) -> Option<usize> {
        let named = || self.plan.conditions.iter().enumerate().filter(|(_, c)| c.name == name);
        named().find(|(_, c)| c.holds_in(self.position.list)).or_else(|| named().next()).map(|(index, _)| index)
    }

    /// Returns the index of a system condition.
    pub fn system(&self, condition: SystemCondition) -> Option<usize> {
        self.condition(condition.name())
    }

    /// Returns true if the kernels have work left.
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

    /// Returns the maximum declared time budget for a firing of this source, ns; 0 if none is declared. Saturates at `i64::MAX`.
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
