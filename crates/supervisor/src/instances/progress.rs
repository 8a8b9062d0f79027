// SPDX-License-Identifier: Apache-2.0
//! Where an instance stands between its start and its end: on its way to an end, coming to rest, in a stage.
use crate::ending::report::Report;
use crate::instances::cause::Cause;
use crate::instances::instance::{Entries, Instance, Life, Rest};
use crate::instances::output_values::decode;
use crate::movements::sequence::Movement;
use crate::refuse::invalid_state;
use indexmap::IndexMap;
use kernel::{Op, SourceId};
use model::plan::{InputOrigin, Plan, PlannedCommand, Target};
use model::refusal::Refusals;
use model::value::Value;
use model::{ORDERLY, SystemCondition};

/// More stages than these in one instant are a loop.
const ENTRIES_AN_INSTANT: u32 = 10_000;

impl Instance {
    /// Returns true while its ending list runs.
    pub fn is_in_ending(&self) -> bool {
        self.leaving.departure.as_ref().is_some_and(|d| d.ending_from.is_some())
    }

    /// Returns the list that τ leads to from the present one. An abort that τ does not name is as orderly as a halt, for what slows a motion down is
    /// there for both; but where another verb goes on with all of its devices from where they are.
    pub fn led_to(&self, condition: usize) -> Option<usize> {
        let transitions = &self.plan.lists[self.position.list].transitions;
        let to = |condition: usize| transitions.iter().find(|(c, _)| *c == condition).map(|(_, to)| *to);
        let is_abort = self.plan.conditions[condition].name == SystemCondition::Aborted.name() && !self.leaving.is_overtaken;
        to(condition).or_else(|| self.system(SystemCondition::Halted).filter(|_| is_abort).and_then(to))
    }

    /// Returns true if the condition begins an orderly end, which the report remembers.
    pub fn is_orderly(&self, condition: usize) -> bool {
        ORDERLY.contains(&self.plan.conditions[condition].name.as_str())
    }

    /// Returns the cause in the report of an end that comes now: that with which an orderly departure began, unless the end is not in order itself.
    /// While the ending list runs, always what it began with.
    pub fn remembered(&mut self, cause: Cause) -> Cause {
        let Some(departure) = self.leaving.departure.clone() else { return self.as_it_began(cause) };
        let came = &self.plan.conditions[cause.condition];
        let in_order = came.normal || self.is_orderly(cause.condition) || departure.ending_from.is_some();
        let (told, kept) = if in_order { (departure.cause, cause) } else { (cause, departure.cause) };
        let name = self.plan.conditions[kept.condition].name.clone();
        if kept.condition != told.condition && name != SystemCondition::Completed.name() {
            self.other(name, kept.block.unwrap_or_default(), kept.time_ns);
        }
        told
    }

    /// Returns the cause of an end by a condition that would have led on to further work, after a time limit or a loss: it ends the verb as that.
    fn as_it_began(&mut self, cause: Cause) -> Cause {
        let is_cut = self.plan.lists[self.position.list].cut.contains(&cause.condition);
        let Some(began) = self.leaving.began.clone().filter(|_| is_cut && self.plan.conditions[cause.condition].normal) else { return cause };
        let name = self.plan.conditions[cause.condition].name.clone();
        if name != SystemCondition::Completed.name() {
            self.other(name, cause.block.unwrap_or_default(), cause.time_ns);
        }
        began
    }

    /// Returns true if it is in its ending list, which a kernel entered with `stage`, and does not know why.
    pub fn is_ending_unnoticed(&self, stage: u16) -> bool {
        let ending = self.plan.ending.list;
        let is_there = ending == Some(self.position.list) && ending == Some(self.list_stage(stage).0);
        is_there && !self.is_in_ending() && !self.is_ending()
    }

    /// Returns true if something is set while the instance comes to rest, and the block whose condition tells that it has is active.
    pub fn comes_to_rest(&self) -> bool {
        self.plan.suspend.holdings().iter().any(|holding| self.is_active(holding.until.0))
    }

    pub fn is_active(&self, block: usize) -> bool {
        self.position.active.iter().any(|(active, _)| *active == self.plan.blocks[block].activation)
    }

    /// Returns true from the call that suspends it until it begins to stand still.
    pub fn is_coming_to_rest(&self) -> bool {
        matches!(self.life, Life::Running(Rest::Coming { .. } | Rest::Due))
    }

    /// Notes a condition that an instance waits for which comes to rest; returns true for one.
    pub fn come_to_rest(&mut self, block: Option<usize>, item: u8) -> bool {
        let mut holdings = self.plan.suspend.holdings().iter();
        let found = holdings.find(|holding| block == Some(holding.until.0) && usize::from(item) == holding.until.1);
        let Some(until) = found.map(|holding| holding.until) else { return false };
        let Life::Running(Rest::Coming { rested, .. }) = &mut self.life else { return false };
        if !rested.contains(&until) {
            rested.push(until);
        }
        true
    }

    /// Returns true if everything rests that is to come to rest and is active.
    pub fn has_come_to_rest(&self) -> bool {
        let has_come = |until| matches!(&self.life, Life::Running(Rest::Coming { rested, .. }) if rested.contains(until));
        let mut holdings = self.plan.suspend.holdings().iter();
        holdings.all(|holding| !self.is_active(holding.until.0) || has_come(&holding.until))
    }

    /// Counts stages that are left in the instant in which they were entered: stages that are over at once, and those that a condition ends
    /// which one of their executes reports. The end of an instance for which there are too many.
    pub fn enters_again(&mut self, now_ns: i64) -> Option<Cause> {
        if self.position.entries.at_ns != now_ns {
            self.position.entries = Entries { at_ns: now_ns, ..Entries::default() };
        }
        self.position.entries.count += 1;
        self.position.entries.lists.insert(self.position.list);
        if self.position.entries.count <= ENTRIES_AN_INSTANT {
            return None;
        }
        let condition = self.system(SystemCondition::Fault).expect("it is in every verb");
        let lists: Vec<String> = self.position.entries.lists.iter().map(|list| format!("'{}'", self.plan.lists[*list].name)).collect();
        let message = format!(
            "more than {ENTRIES_AN_INSTANT} stages in one instant: command lists of verb '{}' lead to each other without time passing ({}); let one of them wait",
            self.plan.verb,
            lists.join(", ")
        );
        Some(Cause { condition, block: None, value: None, message, time_ns: now_ns, asked_for: false })
    }

    /// Returns the report of its latest start; none before its end. One that was never started is refused.
    pub fn ended(&self) -> Result<Option<Report>, Refusals> {
        match &self.life {
            Life::Ended(report) => Ok(Some(Report::clone(report))),
            Life::Created => Err(invalid_state(&format!("'{}'", self.name), "created, not started", "wait for", "start it first")),
            _ => Ok(None),
        }
    }

    /// Returns the condition that ends it if its initial list is over as soon as it is entered and one source has all of it: its first script
    /// does what that end asks for, too. What a block reports in that script comes before, and nothing behind it is carried out then.
    pub fn ends_in_its_opening(&self) -> Option<usize> {
        let stage = &self.plan.lists[self.plan.initial].stages[0];
        let is_over = stage.active.is_empty() && stage.wait.is_none() && !stage.commands.iter().any(|c| matches!(c, PlannedCommand::Ready));
        let is_simple = self.owner.is_none() && self.plan.ending.list.is_none() && self.installed.sources.len() == 1 && !self.installed.stamps.is_empty();
        let completed = self.system(SystemCondition::Completed).filter(|_| is_over && is_simple && self.position.list == self.plan.initial)?;
        self.led_to(completed).is_none().then_some(completed)
    }

    /// Returns the next movement of its sequence. A new table for its only source and what is to be done there behind it go together: that acts
    /// between two firings as one, and the source is woken once.
    pub fn next_movement(&mut self) -> Option<Movement> {
        let movement = self.work.sequence.pop_front()?;
        let [source] = self.installed.sources[..] else { return Some(movement) };
        if !movement.is_table_of(source) {
            return Some(movement);
        }
        // A table is made as the system is when it goes: the first has what those right behind it would have.
        while self.work.sequence.front().is_some_and(|next| next.is_table_of(source)) {
            self.work.sequence.pop_front();
        }
        let (scripts, ends) = match self.work.sequence.front_mut() {
            Some(Movement::Scripts(scripts)) => (scripts, false),
            Some(Movement::Opening { scripts, ends, .. }) => (scripts, *ends),
            _ => return Some(movement),
        };
        match &mut scripts[..] {
            [(of, ops)] if *of == source => {
                let ops = std::mem::take(ops);
                self.work.sequence.pop_front();
                Some(Movement::Together { source, ops, ends })
            }
            _ => Some(movement),
        }
    }

    /// Notes that a kernel has carried out a script of its sequence; returns true if it was waited for.
    pub fn take_acknowledgement(&mut self, epoch: u64, source: SourceId, captured: Vec<u8>) -> bool {
        let Some(at) = self.work.awaited.iter().position(|awaited| *awaited == source).filter(|_| self.work.epoch == epoch) else { return false };
        self.work.awaited.swap_remove(at);
        if !captured.is_empty() {
            self.work.captured.push((source, captured));
        }
        self.work.outstanding = self.work.awaited.len();
        true
    }

    /// Refuses where its parameters cannot be set now.
    pub fn check_settable(&self) -> Result<(), Refusals> {
        if self.is_started() {
            return Ok(());
        }
        Err(invalid_state(&format!("'{}'", self.name), self.state().name(), "set a parameter of", "give the value at the next start"))
    }

    /// The present values of its input parameters: of its latest start, and what was set since; before the first one the defaults.
    pub fn present_inputs(&self) -> IndexMap<String, Option<Value>> {
        let given = self.plan.inputs.iter().enumerate().filter(|(_, input)| input.origin == InputOrigin::Given);
        let present = given.map(|(index, input)| {
            let several = input.targets.iter().any(|target| matches!(target, Target::Cells(_)));
            let value = self.inputs.get(&index).map(|bytes| decode(&input.type_text, several, bytes));
            (input.name.clone(), value.or_else(|| input.default.clone()))
        });
        present.collect()
    }

    /// Operations that give its tunable activations the intervals of a plan; without one, the declared ones.
    pub fn tune_ops(&self, plan: Option<&Plan>) -> Vec<(SourceId, Op)> {
        let tunable = self.plan.activations.iter().enumerate().filter(|(_, activation)| activation.tunable);
        let ops = tunable.map(|(index, _)| {
            let every = plan.and_then(|plan| plan.every(index)).unwrap_or(0);
            (self.installed.activation_source[index], Op::Tune(self.installed.activations[index].clone(), every))
        });
        ops.collect()
    }
}
