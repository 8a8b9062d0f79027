// SPDX-License-Identifier: Apache-2.0
//! Departures: everything between the condition that ends a verb and its end. τ may lead from a halt, an abort or a disabled device to
//! another list; an ending list runs at every end except after an emergency stop, a lost processor or a second halt. The report contains
//! the condition that started the departure.
use crate::alarms::causes::alarm_of_condition;
use crate::core::Core;
use crate::instances::cause::Cause;
use crate::instances::course::Course;
use crate::instances::installed_verb::InstalledVerb;
use crate::instances::instance::Departure;
use crate::movements::sequence::Builder;
use kernel::SourceId;
use model::{ENDS, SystemCondition};

/// Conditions that end a verb without an ending list.
const IMMEDIATE: [&str; 2] = [SystemCondition::EmergencyStop.name(), SystemCondition::ProcessorLost.name()];

impl Core {
    /// Returns true if a source is still executing operations: it has neither been lost nor been stopped by a fault.
    fn stands(&self, source: SourceId) -> bool {
        !self.safety.lost.contains(&source) && self.remote.is_reached(self.registry.source_name(source)) && !self.host.statistics(source).stopped
    }
}

impl Course<'_> {
    /// Prepares to follow τ from a condition: records a condition that starts an orderly end, and limits the time available after an
    /// abort or after a device was disabled.
    pub fn depart(&mut self, cause: Cause) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        if !instance.is_orderly(cause.condition) {
            if ENDS.contains(&instance.plan.conditions[cause.condition].name.as_str()) {
                instance.leaving.began.get_or_insert(cause);
            }
            return;
        }
        self.rise();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let is_halt = instance.plan.conditions[cause.condition].name == SystemCondition::Halted.name();
        let until_ns = (!is_halt).then(|| instance.times.running.at(now_ns) + instance.plan.ending.limit_ns);
        let departure = instance.leaving.departure.get_or_insert(Departure { cause, ending_from: None, until_ns: None });
        departure.until_ns = departure.until_ns.or(until_ns);
    }

    /// Ends the verb because of a condition, through its ending list if one may run. Its process is already frozen.
    pub fn end(&mut self, cause: Cause) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        if !instance.is_started() {
            return;
        }
        let cause = instance.remembered(cause);
        match self.ending_list(&cause) {
            Some(list) => self.conclude(list, cause),
            None => self.finish(cause),
        }
    }

    /// Ends the verb without an ending list: after a second halt or an emergency stop.
    pub fn end_at_once(&mut self, cause: Cause) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let cause = instance.remembered(cause);
        self.finish(cause);
    }

    /// Returns the ending list to run for `cause`, if any.
    fn ending_list(&self, cause: &Cause) -> Option<usize> {
        let id = self.id;
        let instance = &self.core.instances[&id];
        let is_immediate = IMMEDIATE.contains(&instance.plan.conditions[cause.condition].name.as_str());
        let may_run = !is_immediate && !instance.is_in_ending() && instance.installed.sources.iter().all(|source| self.core.stands(*source));
        instance.plan.ending.list.filter(|_| may_run)
    }

    /// Handles sources of a verb instance that were lost or stopped by a fault; its process is already frozen. Follows τ if the next list
    /// needs only the remaining sources, and ends the verb otherwise.
    pub fn lose(&mut self, mut cause: Cause) {
        let id = self.id;
        if !self.core.instances.contains_key(&id) {
            return;
        }
        alarm_of_condition(self.core, id, cause.condition, cause.block.as_deref(), &cause.message);
        let instance = &self.core.instances[&id];
        let transition = instance.plan.lists[instance.position.list].transitions.iter().find(|(condition, _)| *condition == cause.condition);
        let Some(list) = transition.map(|(_, to)| *to).filter(|_| !instance.is_ending() && !instance.is_in_ending()) else {
            return self.end_of_loss(cause);
        };
        let of = instance.installed_verb(&self.core.registry.physical);
        match of.needed_by(list).into_iter().find(|source| !self.core.stands(*source)) {
            None => {
                let (about, name) = (instance.name.clone(), instance.plan.conditions[cause.condition].name.clone());
                self.core.observation.log.add(cause.time_ns, "condition", &about, format!("{name}: {}", cause.message));
                self.depart(cause.clone());
                self.lead_on(&cause, list);
            }
            Some(source) => {
                let (list, source) = (&instance.plan.lists[list].name, self.core.registry.source_name(source));
                cause.message = format!("{}; command list '{list}' cannot follow: it runs on '{source}', which is lost too", cause.message);
                self.end_of_loss(cause);
            }
        }
    }

    fn end_of_loss(&mut self, cause: Cause) {
        let id = self.id;
        let name = &self.core.instances[&id].plan.conditions[cause.condition].name;
        if IMMEDIATE.contains(&name.as_str()) { self.end_at_once(cause) } else { self.end(cause) }
    }

    /// Starts the ending list. Each source reads ω at the boundary at which it leaves the current list.
    fn conclude(&mut self, list: usize, cause: Cause) {
        let id = self.id;
        let condition = cause.condition;
        self.concluding(cause);
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        let mut builder = Builder::default();
        instance.findings.expect_nothing();
        for &source in &instance.installed.sources {
            let mut outputs = of.outputs_in(source, condition);
            instance.findings.captures.keep_missing(&mut outputs);
            of.capture_in(&mut builder, source, &outputs);
            instance.findings.captures.expect(source, outputs);
        }
        self.go_from(builder, list, 0);
    }

    /// Catches up with a kernel that entered the ending list in the firing in which the condition occurred. The values captured by its
    /// script are the outputs of that source.
    pub fn concluded_by_kernel(&mut self, source: SourceId, cause: Cause, captured: &[u8]) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        instance.findings.captures.take(&of, &of.concluding_outputs(source, cause.condition), captured);
        let cause = instance.remembered(cause);
        self.concluding(cause);
    }

    fn concluding(&mut self, cause: Cause) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        self.rise();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let until_ns = Some(instance.times.running.at(now_ns) + instance.plan.ending.limit_ns);
        let name = instance.plan.conditions[cause.condition].name.clone();
        instance.leaving.departure = Some(Departure { cause, ending_from: Some(instance.position.list), until_ns });
        instance.position.entries = crate::instances::instance::Entries::default();
        let about = instance.name.clone();
        self.core.observation.log.add(now_ns, "ending", &about, name);
    }

    /// Ends a departure whose time limit has expired.
    pub fn finish_departure(&mut self) {
        let id = self.id;
        if !self.take_process(true) {
            return;
        }
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let limit_s = instance.plan.ending.limit_ns as f64 * 1e-9;
        let list = instance.plan.lists[instance.position.list].name.clone();
        let Some(departure) = &mut instance.leaving.departure else { return };
        departure.until_ns = None;
        let mut cause = departure.cause.clone();
        let separator = if cause.message.is_empty() { "" } else { "; " };
        cause.message = format!("{}{separator}command list '{list}' was cut short after {limit_s} s", cause.message);
        departure.cause.message.clone_from(&cause.message);
        self.end(cause);
    }
}
