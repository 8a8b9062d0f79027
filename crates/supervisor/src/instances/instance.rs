// SPDX-License-Identifier: Apache-2.0
//! A verb instance: what it was made of, where it is in its life, what it still waits for.
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

/// Progress of a running instance towards its suspension.
pub(crate) enum Rest {
    /// No suspension was asked for.
    Unasked,
    /// The instance comes to rest first: the running time at which that has had its time, and the conditions of it which have come.
    Coming { until_ns: i64, rested: Vec<(usize, usize)> },
    /// The instance is suspended when the sequence under way is through.
    Due,
}

/// Where an instance is in its life, with what belongs to that.
pub(crate) enum Life {
    Created,
    /// Started, and waiting for what other instances hold.
    Queued,
    Running(Rest),
    /// Values of its channels in each source when they went safe.
    Suspended {
        held: Vec<(SourceId, Vec<u8>)>,
    },
    /// The end proper is being carried out, from one of those.
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
    /// Running time after which `time_limit` comes, ns.
    pub time_limit_ns: Option<i64>,
    /// Overruns of its sources after which `overrun` comes.
    pub overruns: Option<u64>,
    /// Age of a value from another source beyond which `late` (of a ratio input) or `link_lost` (of what a timer publishes in each
    /// firing) comes, ns.
    pub age_max_ns: Option<i64>,
}

impl Limits {
    /// Checks that the times are above 0.
    ///
    /// # Errors
    /// `OutOfRange` with the one that is not.
    pub fn check(&self) -> Result<(), Refusals> {
        for (name, limit) in [("time_limit", self.time_limit_ns), ("age_max", self.age_max_ns)] {
            if let Some(ns) = limit.filter(|ns| *ns <= 0) {
                let message = format!("'{name}' cannot be {} s: its range is above 0 s", ns as f64 * 1e-9);
                return Err(refuse(Class::OutOfRange, message, "give a time above 0, for example '10 s', or leave it out"));
            }
        }
        Ok(())
    }
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

    /// Returns true while it stands still.
    pub fn is_held(&self) -> bool {
        self.held_ns.is_some()
    }

    /// Returns the time on the clock at which a running time is reached; `None` while it stands still.
    pub fn clock_at(&self, running_ns: i64) -> Option<i64> {
        self.held_ns.is_none().then_some(self.offset_ns + running_ns)
    }

    pub fn at(&self, now_ns: i64) -> i64 {
        self.held_ns.unwrap_or(now_ns - self.offset_ns)
    }
}

/// An end that is on its way.
#[derive(Clone, Debug)]
pub(crate) struct Departure {
    /// Cause that the report will give.
    pub cause: Cause,
    /// The ending list runs; the list that ran before it. Absent: τ has led on, and the end proper is still to come.
    pub ending_from: Option<usize>,
    /// Running time by which it must be over.
    pub until_ns: Option<i64>,
}

/// Intervals by label, ns.
pub(crate) type Intervals = IndexMap<String, u64>;

/// Origin of an instance: its rates are checked again from this.
#[derive(Clone)]
pub(crate) struct Origin {
    pub checked: Arc<CheckedVerb>,
    pub application: Application,
}

/// Stages that an instance has left in the instant in which they were entered.
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
    /// Stage that the sequence under way leads to.
    pub target: (usize, usize),
    /// Activations that are on.
    pub active: Vec<(usize, u32)>,
    /// Running time at which the present wait for a time ends.
    pub wait_until_ns: Option<i64>,
    /// True if it has entered a list in this start.
    pub has_entered: bool,
    /// The stages that it has left in the instant in which they were entered.
    pub entries: Entries,
}

/// The time of one start, and its limits.
#[derive(Default)]
pub(crate) struct Times {
    pub running: RunningTime,
    pub started_ns: i64,
    pub limits: Limits,
    /// Overruns of its sources when it started.
    pub overruns_before: u64,
}

/// Work that the kernels have to do for it, one movement after the other.
#[derive(Default)]
pub(crate) struct Work {
    pub sequence: VecDeque<Movement>,
    /// Number of acknowledgements that the present movement lacks.
    pub outstanding: usize,
    /// Sources whose acknowledgement is lacking, and when they were asked.
    pub awaited: Vec<SourceId>,
    pub sent_ns: i64,
    /// Time at which it was seen that an answer is late, ns.
    pub last_call_ns: Option<i64>,
    /// The present movement changes tables: what follows waits for it, whatever happens to the instance.
    pub structural: bool,
    pub epoch: u64,
    /// The script under way, or the last one, ends the instance, where nothing comes between.
    pub is_through: bool,
    /// When it is looked again whether machines follow, ns on the clock; until then nothing goes on.
    pub look_ns: Option<i64>,
    /// Values that the scripts of the last movement captured.
    pub captured: Vec<(SourceId, Vec<u8>)>,
}

/// Findings that the report of one start will have beside its condition.
#[derive(Default)]
pub(crate) struct Findings {
    /// Outputs that the condition of its end returns.
    pub captures: Captures,
    pub others: Vec<Other>,
    /// The transitions before that, and what they returned.
    pub way: Way,
}

impl Findings {
    /// Expects no more captures.
    pub fn expect_nothing(&mut self) {
        self.captures.expect_nothing();
        self.way.captures.expect_nothing();
    }
}

/// Events of one start that lead to its end, or may.
#[derive(Default)]
pub(crate) struct EndingEvents {
    /// An end that is on its way while lists still run.
    pub departure: Option<Departure>,
    /// The time limit or loss that told it to end, where τ has led on from it.
    pub began: Option<Cause>,
    /// A second `halt` is immediate.
    pub halting: bool,
    /// `device_disabled` has come: it comes once.
    pub disabled: bool,
    /// A later start has aborted it: once.
    pub aborted: bool,
    /// The later start acts on all of its devices.
    pub is_overtaken: bool,
}

pub(crate) struct Instance {
    pub id: u64,
    pub name: String,
    pub plan: Arc<Plan>,
    pub installed: InstalledPlan,
    /// The logical device that it keeps going.
    pub owner: Option<String>,
    /// Origin from which it was made.
    pub origin: Option<Origin>,
    /// Intervals that were set while it ran, until the next start: label → ns.
    pub tuned: Intervals,
    /// The values of its input parameters: of its latest start, and what was set since.
    pub inputs: InputValues,
    /// Number of times that inputs or intervals were set.
    pub changes: u64,
    /// The instances that it follows: SVV → its writer.
    pub followed: IndexMap<String, u64>,
    pub life: Life,
    /// Number of its starts.
    pub starts: u64,
    /// Generation that this side believes in: kernel, supervisor and PS race on it.
    pub generation: u32,
    pub position: Position,
    pub times: Times,
    pub work: Work,
    pub findings: Findings,
    pub leaving: EndingEvents,
}

impl Instance {
    /// Returns its verb as it is installed, with the devices that there are.
    pub fn installed_verb<'a>(&'a self, devices: &'a IndexMap<String, PhysicalRecord>) -> InstalledVerb<'a> {
        InstalledVerb { plan: &self.plan, installed: &self.installed, devices }
    }

    /// Returns list and stage of a kernel's stage.
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

    /// Its state, as people see it: an end that is being carried out does not show.
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

    /// Returns true while its end is being carried out.
    pub fn is_ending(&self) -> bool {
        matches!(self.life, Life::Ending { .. })
    }

    /// Returns true while it runs, and its end is not being carried out.
    pub fn is_running(&self) -> bool {
        matches!(self.life, Life::Running(_))
    }

    pub fn is_suspended(&self) -> bool {
        matches!(self.life, Life::Suspended { .. })
    }

    /// Returns true while it runs or is suspended, and its end is not being carried out.
    pub fn is_started(&self) -> bool {
        self.is_running() || self.is_suspended()
    }

    /// Begins its end.
    pub fn ends(&mut self, cause: Cause) {
        self.life = Life::Ending { from: self.state(), cause };
    }

    /// Returns the report of the latest start, if that has ended.
    pub fn report(&self) -> Option<&Report> {
        if let Life::Ended(report) = &self.life { Some(report) } else { None }
    }

    /// Returns, while it comes to rest before it is suspended, the running time at which that has had its time.
    pub fn resting_until_ns(&self) -> Option<i64> {
        if let Life::Running(Rest::Coming { until_ns, .. }) = self.life { Some(until_ns) } else { None }
    }

    /// Sets how a running instance comes to be suspended.
    pub fn rests(&mut self, rest: Rest) {
        if let Life::Running(now) = &mut self.life {
            *now = rest;
        }
    }

    /// Renews it for a start that was accepted: nothing of the one before is left.
    pub fn renew(&mut self) {
        self.starts += 1;
        let list = self.plan.initial;
        (self.position.list, self.position.stage, self.position.target) = (list, 0, (list, 0));
        (self.position.wait_until_ns, self.position.has_entered) = (None, false);
        self.work.captured.clear();
        self.work.is_through = false;
        (self.findings, self.leaving) = (Findings::default(), EndingEvents::default());
    }

    /// Returns the index of a condition by name: its line for the present command list, if the list has one.
    pub fn condition(&self, name: &str) -> Option<usize> {
        let named = || self.plan.conditions.iter().enumerate().filter(|(_, c)| c.name == name);
        named().find(|(_, c)| c.holds_in(self.position.list)).or_else(|| named().next()).map(|(index, _)| index)
    }

    /// Returns the index of a condition of the system.
    pub fn system(&self, condition: SystemCondition) -> Option<usize> {
        self.condition(condition.name())
    }

    /// Returns true while something is left to be done by the kernels.
    pub fn is_under_way(&self) -> bool {
        self.work.outstanding > 0 || !self.work.sequence.is_empty()
    }

    /// Returns true for an action on devices: it uses logical devices or writes channels, and keeps none going.
    pub fn is_action(&self) -> bool {
        self.owner.is_none() && (!self.plan.devices.is_empty() || self.plan.claims.iter().any(|claim| matches!(claim, Claim::Channel { .. })))
    }

    pub fn is_busy(&self) -> bool {
        !matches!(self.life, Life::Created | Life::Ended(_))
    }

    /// Returns the longest time budget declared for a firing of this source, ns; 0 if none is. More than fits is `i64::MAX`.
    pub fn budget_ns(&self, source: SourceId) -> i64 {
        let there = self.plan.activations.iter().zip(&self.installed.activation_source).filter(|(_, at)| **at == source);
        let longest = there.filter_map(|(of, _)| of.budget_ns).max().unwrap_or(0);
        i64::try_from(longest).unwrap_or(i64::MAX)
    }

    /// Returns another condition that came while one was acting.
    pub fn other(&mut self, condition: String, block: String, time_ns: i64) {
        self.findings.others.push(Other { condition, block, time_s: time_ns as f64 * 1e-9 });
    }
}
