// SPDX-License-Identifier: Apache-2.0
//! Progress of an instance between its start and its end: within a stage, while coming to rest, or towards an end.
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

/// Maximum number of stages entered at one instant; more are considered an infinite loop.
const ENTRIES_AN_INSTANT: u32 = 10_000;

impl Instance {
    /// Returns true if the ending list is running.
    pub fn is_in_ending(&self) -> bool {
        self.leaving.departure.as_ref().is_some_and(|d| d.ending_from.is_some())
    }

    /// Returns the list to which τ leads from the current one. An abort for which τ has no entry follows the entry for a halt, whose
    /// deceleration suits both, unless another verb takes over all devices in motion.
    pub fn led_to(&self, condition: usize) -> Option<usize> {
        let transitions = &self.plan.lists[self.position.list].transitions;
        let to = |condition: usize| transitions.iter().find(|(c, _)| *c == condition).map(|(_, to)| *to);
        let is_abort = self.plan.conditions[condition].name == SystemCondition::Aborted.name() && !self.leaving.is_overtaken;
        to(condition).or_else(|| self.system(SystemCondition::Halted).filter(|_| is_abort).and_then(to))
    }

    /// Returns true if the condition starts an orderly end, which is then recorded for the report.
    pub fn is_orderly(&self, condition: usize) -> bool {
        ORDERLY.contains(&self.plan.conditions[condition].name.as_str())
    }

    /// Returns the cause to report for an end that occurs now: the one that started an orderly departure, unless the end is itself
    /// abnormal. If the ending list is running, it is always the original cause.
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

    /// Returns the time limit or loss that ordered the verb to end, if this condition would otherwise have led to further work.
    fn as_it_began(&mut self, cause: Cause) -> Cause {
        let is_cut = self.plan.lists[self.position.list].cut.contains(&cause.condition);
        let Some(began) = self.leaving.began.clone().filter(|_| is_cut && self.plan.conditions[cause.condition].normal) else { return cause };
        let name = self.plan.conditions[cause.condition].name.clone();
        if name != SystemCondition::Completed.name() {
            self.other(name, cause.block.unwrap_or_default(), cause.time_ns);
        }
        began
    }

    /// Returns true if a kernel entered the ending list with `stage` and the instance does not know the cause yet.
    pub fn is_ending_unnoticed(&self, stage: u16) -> bool {
        let ending = self.plan.ending.list;
        let is_there = ending == Some(self.position.list) && ending == Some(self.list_stage(stage).0);
        is_there && !self.is_in_ending() && !self.is_ending()
    }

    /// Returns true if the suspension first sets an input, and the block whose condition reports that the instance is at rest is active.
    pub fn comes_to_rest(&self) -> bool {
        self.plan.suspend.holdings().iter().any(|holding| self.is_active(holding.until.0))
    }

    pub fn is_active(&self, block: usize) -> bool {
        self.position.active.iter().any(|(active, _)| *active == self.plan.blocks[block].activation)
    }

    /// Returns true from the call that requests a suspension until the instance is held.
    pub fn is_coming_to_rest(&self) -> bool {
        matches!(self.life, Life::Running(Rest::Coming { .. } | Rest::Due))
    }

    /// Records a condition that an instance needs to come to rest; returns false for any other condition.
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

    /// Returns true if all active blocks that must come to rest have done so.
    pub fn has_come_to_rest(&self) -> bool {
        let has_come = |until| matches!(&self.life, Life::Running(Rest::Coming { rested, .. }) if rested.contains(until));
        let mut holdings = self.plan.suspend.holdings().iter();
        holdings.all(|holding| !self.is_active(holding.until.0) || has_come(&holding.until))
    }

    /// Counts stages that are left at the instant at which they were entered: stages that are complete on entry, or that end because of a
    /// condition reported by one of their `execute` commands. Returns the cause of an end if there are too many.
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

    /// Returns the report of the latest start; `None` if it has not ended. Refuses an instance that was never started.
    pub fn ended(&self) -> Result<Option<Report>, Refusals> {
        match &self.life {
            Life::Ended(report) => Ok(Some(Report::clone(report))),
            Life::Created => Err(invalid_state(&format!("'{}'", self.name), "created, not started", "wait for", "start it first")),
            _ => Ok(None),
        }
    }

    /// Returns the condition that ends the instance if its initial list is complete on entry and is located on one source: its first
    /// script then also performs the end. A condition reported by a block in that script takes precedence, and the rest of the script is
    /// skipped.
    pub fn ends_in_its_opening(&self) -> Option<usize> {
        let stage = &self.plan.lists[self.plan.initial].stages[0];
        let is_over = stage.active.is_empty() && stage.wait.is_none() && !stage.commands.iter().any(|c| matches!(c, PlannedCommand::Ready));
        let is_simple = self.owner.is_none() && self.plan.ending.list.is_none() && self.installed.sources.len() == 1 && !self.installed.stamps.is_empty();
        let completed = self.system(SystemCondition::Completed).filter(|_| is_over && is_simple && self.position.list == self.plan.initial)?;
        self.led_to(completed).is_none().then_some(completed)
    }

    /// Returns the next movement of the sequence. A new table for the only source of the instance is combined with the operations that
    /// follow: both take effect together between two firings, and the source is woken only once.
    pub fn next_movement(&mut self) -> Option<Movement> {
        let movement = self.work.sequence.pop_front()?;
        let [source] = self.installed.sources[..] else { return Some(movement) };
        if !movement.is_table_of(source) {
            return Some(movement);
        }
        // A table reflects the system when it is sent, so several in a row are equal to the first.
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

    /// Records that a kernel has executed a script of the sequence; returns true if the instance was waiting for it.
    pub fn take_acknowledgement(&mut self, epoch: u64, source: SourceId, captured: Vec<u8>) -> bool {
        let Some(at) = self.work.awaited.iter().position(|awaited| *awaited == source).filter(|_| self.work.epoch == epoch) else { return false };
        self.work.awaited.swap_remove(at);
        if !captured.is_empty() {
            self.work.captured.push((source, captured));
        }
        self.work.outstanding = self.work.awaited.len();
        true
    }

    /// Fails if the parameters of the instance cannot be set now.
    pub fn check_settable(&self) -> Result<(), Refusals> {
        if self.is_started() {
            return Ok(());
        }
        Err(invalid_state(&format!("'{}'", self.name), self.state().name(), "set a parameter of", "give the value at the next start"))
    }

    /// Returns the current values of the input parameters: those of the latest start, updated by later changes, or the defaults before
    /// the first start.
    pub fn present_inputs(&self) -> IndexMap<String, Option<Value>> {
        let given = self.plan.inputs.iter().enumerate().filter(|(_, input)| input.origin == InputOrigin::Given);
        let present = given.map(|(index, input)| {
            let several = input.targets.iter().any(|target| matches!(target, Target::Cells(_)));
            let value = self.inputs.get(&index).map(|bytes| decode(&input.type_text, several, bytes));
            (input.name.clone(), value.or_else(|| input.default.clone()))
        });
        present.collect()
    }

    /// Returns the operations that set the intervals of tunable activations to those of a plan or, without a plan, to the declared
    /// intervals.
    pub fn tune_ops(&self, plan: Option<&Plan>) -> Vec<(SourceId, Op)> {
        let tunable = self.plan.activations.iter().enumerate().filter(|(_, activation)| activation.tunable);
        let ops = tunable.map(|(index, _)| {
            let every = plan.and_then(|plan| plan.every(index)).unwrap_or(0);
            (self.installed.activation_source[index], Op::Tune(self.installed.activations[index].clone(), every))
        });
        ops.collect()
    }
}
