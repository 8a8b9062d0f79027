// SPDX-License-Identifier: Apache-2.0
//! Departures: what lies between the condition that ends a verb and its end. τ may lead on from a halt, an abort or a disabled
//! device; an ending list runs at every end but an emergency stop, a lost processor and a second halt. The report names the
//! condition with which the departure began.
use crate::core::Core;
use crate::instance::{Cause, Instance, State};
use crate::sequence::Builder;
use crate::stages::Verbatim;
use kernel::{Op, SourceId};
use model::ORDERLY;

/// An end that is on its way.
#[derive(Clone, Debug)]
pub(crate) struct Departure {
    /// What the report will say.
    pub cause: Cause,
    /// The ending list runs; the list that ran before it. Absent: τ has led on, and the end proper is still to come.
    pub ending_from: Option<usize>,
    /// Running time by which it must be over.
    pub until_ns: Option<i64>,
}

/// Ends that leave no time for an ending list.
const IMMEDIATE: [&str; 2] = ["emergency_stop", "processor_lost"];

impl Instance {
    /// True while its ending list runs.
    pub fn is_in_ending(&self) -> bool {
        self.departure.as_ref().is_some_and(|d| d.ending_from.is_some())
    }

    /// The list that τ leads to from the present one. An abort that τ does not name is as orderly as a halt, for what slows a motion down is
    /// there for both; but where another verb goes on with all of its devices from where they are.
    pub fn led_to(&self, condition: usize) -> Option<usize> {
        let transitions = &self.plan.lists[self.list].transitions;
        let to = |condition: usize| transitions.iter().find(|(c, _)| *c == condition).map(|(_, to)| *to);
        let is_abort = self.plan.conditions[condition].name == "aborted" && !self.is_overtaken;
        to(condition).or_else(|| self.condition("halted").filter(|_| is_abort).and_then(to))
    }

    /// True where the condition begins an orderly end, which the report remembers.
    pub fn is_orderly(&self, condition: usize) -> bool {
        ORDERLY.contains(&self.plan.conditions[condition].name.as_str())
    }
}

impl Core {
    /// τ leads on from a condition: one that begins an orderly end is remembered, and what follows an abort or a disabled device has
    /// its time.
    pub fn depart(&mut self, id: u64, cause: Cause) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        if !instance.is_orderly(cause.condition) {
            return;
        }
        self.rise(id);
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let is_halt = instance.plan.conditions[cause.condition].name == "halted";
        let until_ns = (!is_halt).then(|| instance.running.at(now_ns) + instance.plan.ending.limit_ns);
        let departure = instance.departure.get_or_insert(Departure { cause, ending_from: None, until_ns: None });
        departure.until_ns = departure.until_ns.or(until_ns);
    }

    /// What the report says of an end that comes now: what an orderly departure began with, unless the end is not in order itself.
    /// While the ending list runs, always what it began with.
    pub fn remembered(&mut self, id: u64, cause: Cause) -> Cause {
        let Some(instance) = self.instances.get_mut(&id) else { return cause };
        let Some(departure) = instance.departure.clone() else { return cause };
        let came = &instance.plan.conditions[cause.condition];
        let in_order = came.normal || instance.is_orderly(cause.condition) || departure.ending_from.is_some();
        let (told, kept) = if in_order { (departure.cause, cause) } else { (cause, departure.cause) };
        let name = instance.plan.conditions[kept.condition].name.clone();
        if kept.condition != told.condition && name != "completed" {
            self.other(id, name, kept.block.unwrap_or_default(), kept.time_ns);
        }
        told
    }

    /// A condition ends the verb: through its ending list, if it has one that may run. The process was taken.
    pub fn end(&mut self, id: u64, cause: Cause) {
        let Some(instance) = self.instances.get(&id) else { return };
        if instance.ending.is_some() || !matches!(instance.state, State::Running | State::Suspended) {
            return;
        }
        let cause = self.remembered(id, cause);
        match self.ending_list(id, &cause) {
            Some(list) => self.conclude(id, list, cause),
            None => self.finish(id, cause),
        }
    }

    /// The end without an ending list: a second halt, an emergency stop.
    pub fn end_at_once(&mut self, id: u64, cause: Cause) {
        let cause = self.remembered(id, cause);
        self.finish(id, cause);
    }

    /// The ending list that runs because of `cause`.
    fn ending_list(&self, id: u64, cause: &Cause) -> Option<usize> {
        let instance = &self.instances[&id];
        let is_immediate = IMMEDIATE.contains(&instance.plan.conditions[cause.condition].name.as_str());
        let may_run = !is_immediate && !instance.is_in_ending() && instance.installed.sources.iter().all(|source| self.stands(*source));
        instance.plan.ending.list.filter(|_| may_run)
    }

    /// True where a source runs what it is given: it is neither lost nor stopped by a fault.
    fn stands(&self, source: SourceId) -> bool {
        !self.lost.contains(&source) && self.is_reached(source) && !self.host.statistics(source).stopped
    }

    /// Sources of a verb instance are gone, lost or stopped by a fault, and its process was taken: τ, where the list that it leads to runs on
    /// sources that are left, else the end.
    pub fn lose(&mut self, id: u64, mut cause: Cause) {
        if !self.instances.contains_key(&id) {
            return;
        }
        self.alarm_of_condition(id, cause.condition, cause.block.as_deref(), &cause.message);
        let instance = &self.instances[&id];
        let transition = instance.plan.lists[instance.list].transitions.iter().find(|(condition, _)| *condition == cause.condition);
        let Some(list) = transition.map(|(_, to)| *to).filter(|_| instance.ending.is_none() && !instance.is_in_ending()) else {
            return self.end_of_loss(id, cause);
        };
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        match of.needed_by(list).into_iter().find(|source| !self.stands(*source)) {
            None => {
                let (about, name) = (instance.name.clone(), instance.plan.conditions[cause.condition].name.clone());
                self.log.add(cause.time_ns, "condition", &about, format!("{name}: {}", cause.message));
                self.go(id, list, 0);
            }
            Some(source) => {
                let (list, source) = (&instance.plan.lists[list].name, self.source_name(source));
                cause.message = format!("{}; command list '{list}' cannot follow: it runs on '{source}', which is gone too", cause.message);
                self.end_of_loss(id, cause);
            }
        }
    }

    fn end_of_loss(&mut self, id: u64, cause: Cause) {
        let name = &self.instances[&id].plan.conditions[cause.condition].name;
        if IMMEDIATE.contains(&name.as_str()) { self.end_at_once(id, cause) } else { self.end(id, cause) }
    }

    /// The ending list begins: in each source ω is read at the boundary at which the present list goes off.
    fn conclude(&mut self, id: u64, list: usize, cause: Cause) {
        let condition = cause.condition;
        self.concluding(id, cause);
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        let mut builder = Builder::default();
        instance.capturing.clear();
        for &source in &instance.installed.sources {
            let mut outputs = of.outputs_in(source, condition);
            outputs.retain(|o| !instance.outputs.iter().any(|(have, _)| have == o));
            if !outputs.is_empty() {
                builder.add(source, Op::Capture(of.cells_of(&outputs)));
                instance.capturing.push((source, outputs));
            }
        }
        self.go_from(id, builder, list, 0);
    }

    /// A kernel has entered the ending list in the firing of the condition; what its script captured are outputs in that source.
    pub fn concluded_by_kernel(&mut self, id: u64, source: SourceId, cause: Cause, captured: &[u8]) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        let outputs = of.concluding_outputs(source, cause.condition);
        let lens: Vec<usize> = outputs.iter().map(|o| of.piece_len(*o)).collect();
        crate::end::take_outputs(&mut instance.outputs, &outputs, &lens, captured);
        let cause = self.remembered(id, cause);
        self.concluding(id, cause);
    }

    fn concluding(&mut self, id: u64, cause: Cause) {
        let now_ns = self.host.now_ns();
        self.rise(id);
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let until_ns = Some(instance.running.at(now_ns) + instance.plan.ending.limit_ns);
        let name = instance.plan.conditions[cause.condition].name.clone();
        instance.departure = Some(Departure { cause, ending_from: Some(instance.list), until_ns });
        instance.entries = (0, 0);
        let about = instance.name.clone();
        self.log.add(now_ns, "ending", &about, name);
    }

    /// The time of a departure is over: the end follows at once.
    pub fn departure_is_over(&mut self, id: u64) {
        if !self.take_process(id, true) {
            return;
        }
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let limit_s = instance.plan.ending.limit_ns as f64 * 1e-9;
        let list = instance.plan.lists[instance.list].name.clone();
        let Some(departure) = &mut instance.departure else { return };
        departure.until_ns = None;
        let mut cause = departure.cause.clone();
        let separator = if cause.message.is_empty() { "" } else { "; " };
        cause.message = format!("{}{separator}command list '{list}' was cut short after {limit_s} s", cause.message);
        departure.cause.message.clone_from(&cause.message);
        self.end(id, cause);
    }
}
