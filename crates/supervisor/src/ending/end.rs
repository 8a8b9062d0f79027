// SPDX-License-Identifier: Apache-2.0
//! Ends of verb instances: every start has exactly one end, with one report.
use crate::alarms::causes::{alarm_of_condition, alarm_of_end};
use crate::core::Core;
use crate::ending::report::Report;
use crate::instances::cause::Cause;
use crate::instances::course::Course;
use crate::instances::following_errors::{gap_text, lost_beyond, servo_text};
use crate::instances::installed_verb::InstalledVerb;
use crate::instances::instance::{Instance, Life, State};
use crate::instances::output_values::{decode, reported};
use crate::movements::sequence::{Builder, Movement};
use crate::processors::farewell;
use crate::registry::{DeviceState, Registry};
use indexmap::IndexMap;
use kernel::{STAMP_LEN, SourceId};
use model::SystemCondition;
use model::plan::Target;
use model::value::Value;

impl Core {
    /// Ends the verbs that use a logical device.
    pub fn end_users(&mut self, device: &str, condition: SystemCondition, message: &str) {
        for user in self.users(device) {
            if condition == SystemCondition::DeviceDisabled
                && let Some(instance) = self.instances.get_mut(&user)
                && std::mem::replace(&mut instance.leaving.disabled, true)
            {
                continue;
            }
            self.course(user).end_by(condition, message.to_owned());
        }
    }
}

impl Core {
    /// Ends the verbs that use a logical device whose own verb has ended; `lost_s` is the lost time, if that is the reason.
    fn end_users_of_lost(&mut self, device: &str, lost_s: Option<f64>, message: &str) {
        match lost_s {
            Some(lost_s) => self.end_users_by_gap(device, lost_s, message),
            None => self.end_users(device, SystemCondition::DeviceLost, message),
        }
    }

    /// Handles a joint that its servo has brought to rest because of a gap in time: verbs that use the joint end, and the joint stays
    /// enabled.
    pub fn gap_of(&mut self, device: &str, lost_s: f64) {
        let gap_max_s = self.registry.logical.get(device).and_then(|record| record.gap_max_s);
        self.end_users_by_gap(device, lost_s, &gap_text(device, lost_s, gap_max_s));
    }

    fn end_users_by_gap(&mut self, device: &str, lost_s: f64, message: &str) {
        for user in self.users(device) {
            self.course(user).end_by_with(SystemCondition::TimeLost, Some(Value::Number(lost_s)), message.to_owned());
        }
    }

    /// Returns the instances that use a logical device, queued ones first.
    fn users(&self, device: &str) -> Vec<u64> {
        let mut users: Vec<u64> = self.instances.values().filter(|i| i.is_busy() && i.plan.devices.iter().any(|d| d == device)).map(|i| i.id).collect();
        self.instances.queued_first(&mut users);
        users
    }
}

impl Course<'_> {
    /// Ends an instance because of a condition that no block reported. Does nothing if the instance is ending or not running.
    pub fn end_by(&mut self, condition: SystemCondition, message: String) {
        self.end_by_with(condition, None, message);
    }

    fn end_by_with(&mut self, condition: SystemCondition, value: Option<Value>, message: String) {
        let id = self.id;
        let Some(instance) = self.core.instances.get(&id) else { return };
        let Some(condition) = instance.system(condition) else { return };
        self.come_with(condition, value, message, false);
    }

    /// Applies a condition that does not come from a block: follows τ or ends the verb. `asked_for` is true if it was requested by the
    /// caller that waits for the end.
    pub fn come(&mut self, condition: usize, message: String, asked_for: bool) {
        self.come_with(condition, None, message, asked_for);
    }

    fn come_with(&mut self, condition: usize, value: Option<Value>, message: String, asked_for: bool) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        if instance.state() == State::Queued {
            return self.leave_queue(condition, &message, asked_for);
        }
        if !instance.is_started() {
            return;
        }
        let is_second = asked_for && instance.leaving.halting;
        let name = instance.plan.conditions[condition].name.clone();
        let is_under_way =
            instance.is_in_ending() || (name == SystemCondition::Aborted.name() && instance.leaving.departure.is_some() && !instance.leaving.is_overtaken);
        if is_under_way && !is_second && name != SystemCondition::Completed.name() {
            // The verb is already ending; a further halt is immediate.
            instance.leaving.halting |= asked_for;
            if !asked_for {
                instance.other(name, String::new(), now_ns);
            }
            return;
        }
        if !self.take_process(true) {
            return;
        }
        if self.core.safety.pause.is_held_back(id) {
            // Nothing of the start has run, so there is nothing to read.
            let time_ns = self.core.host.now_ns();
            return self.end_at_once(Cause { condition, block: None, value: None, message, time_ns, asked_for });
        }
        alarm_of_condition(self.core, id, condition, None, &message);
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        // Only now is the current list of the process certain.
        let condition = instance.condition(&instance.plan.conditions[condition].name).unwrap_or(condition);
        instance.leaving.halting |= asked_for;
        let cause = Cause { condition, block: None, value, message, time_ns: now_ns, asked_for };
        let to = instance.led_to(condition);
        match to {
            _ if is_second => self.end_at_once(cause),
            Some(list) => {
                self.depart(cause.clone());
                self.lead_on(&cause, list);
            }
            None => self.end(cause),
        }
    }

    /// Starts the final end: deactivates everything and makes it safe in every source, then reports. The process is already frozen.
    pub fn finish(&mut self, cause: Cause) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        if !instance.is_started() {
            return;
        }
        let condition = cause.condition;
        instance.ends(cause);
        instance.findings.expect_nothing();
        let is_through = std::mem::take(&mut instance.work.is_through) && !instance.is_under_way() && instance.ends_in_its_opening() == Some(condition);
        // A resume cancels the pause but must not start an ending instance.
        self.core.safety.pause.forget_start(id);
        let instance = self.core.instances.get_mut(&id).expect("found above");
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        if is_through {
            let source = instance.installed.sources[0];
            let outputs = of.outputs_in(source, condition);
            let len = outputs.iter().map(|output| of.piece_len(*output)).sum::<usize>() + STAMP_LEN;
            // The stamp after the outputs shows that the script ran to its end.
            if matches!(&instance.work.captured[..], [(_, captured)] if captured.len() == len) {
                instance.findings.captures.expect(source, outputs);
                return self.ended();
            }
        }
        let mut builder = Builder::default();
        for &source in &instance.installed.sources {
            let mut outputs = of.outputs_in(source, condition);
            instance.findings.captures.keep_missing(&mut outputs);
            of.end_in(&mut builder, source, &outputs);
            instance.findings.captures.expect(source, outputs);
        }
        builder.then(Movement::Ended);
        self.replace_sequence(builder.finish());
    }

    /// Catches up with a kernel that ended the verb in the same firing. The values captured by its script are the outputs of that source.
    /// `alone` is true if no further condition of that firing remains to be reported.
    pub fn ended_by_kernel(&mut self, source: SourceId, cause: Cause, captured: &[u8], alone: bool) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        (instance.position.list, instance.position.stage) = instance.list_stage(instance.installed.process.now().1);
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        // Ignore captures of the ending list: the outputs were read when it began.
        let outputs = if instance.is_in_ending() { Vec::new() } else { of.outputs_in(source, cause.condition) };
        instance.findings.captures.take(&of, &outputs, captured);
        let (told, is_read) = (cause.condition, instance.is_in_ending() && !instance.findings.captures.is_pending());
        let cause = instance.remembered(cause);
        let is_read = is_read || told == cause.condition;
        let done = is_read && alone && instance.installed.sources.len() == 1 && instance.work.outstanding == 0 && instance.work.sequence.is_empty();
        if done && instance.is_running() {
            // The reaction has done everything: all blocks are off and safe, and the outputs have been read.
            instance.findings.captures.expect_nothing();
            instance.ends(cause);
            return self.ended();
        }
        // Scripts of an unfinished start may have switched something on after the reaction: end once more in every source.
        self.finish(cause);
    }

    /// Completes the end after all acknowledgements: releases the claims and creates the report.
    pub fn ended(&mut self) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let Life::Ending { cause, .. } = &instance.life else { return };
        let cause = cause.clone();
        let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
        instance.findings.captures.take_scripts(&of, std::mem::take(&mut instance.work.captured));
        instance.position.active.clear();
        instance.position.wait_until_ns = None;
        let owner = instance.owner.clone();
        let departed = instance.leaving.departure.is_some();
        let report = report(instance, &self.core.registry, cause);
        instance.life = Life::Ended(Box::new(report.clone()));
        farewell::forget(&self.core.remote, &self.core.registry, &self.core.instances[&id]);
        let now_ns = self.core.host.now_ns();
        self.core.observation.log.add(
            if departed { now_ns } else { (report.time_s * 1e9) as i64 },
            "end",
            &report.instance,
            format!("{}{}", report.condition, if report.message.is_empty() { String::new() } else { format!(": {}", report.message) }),
        );
        let ended_as = report.condition.clone();
        let because = if report.message.is_empty() { String::new() } else { format!(": {}", report.message) };
        let unasked = owner.as_ref().filter(|o| self.core.registry.logical.get(*o).is_some_and(|l| l.state != DeviceState::Stopping));
        let plan = &self.core.instances[&id].plan;
        let is_in_fault = |device: &String| self.core.registry.logical.get(device).is_some_and(|record| record.state == DeviceState::Fault);
        // If the servo of a joint failed after a gap, its alarm covers this end.
        let is_told = ended_as == SystemCondition::TimeLost.name() && plan.devices.iter().any(is_in_fault);
        let has_own = is_told || plan.conditions.iter().any(|c| c.name == ended_as && c.alarm.is_some());
        if owner.is_none() || unasked.is_some() {
            alarm_of_end(self.core, &report, unasked.map(String::as_str), has_own);
        }
        self.core.safety.pause.forget_suspended(id);
        let lost_s = owner.as_ref().and_then(|owner| lost_beyond(&report, self.core.registry.logical.get(owner)?.gap_max_s));
        self.core.observation.ends.add(id, report);
        self.core.observation.ended += 1;
        if let Some(owner) = owner
            && !self.core.registry.servo_ended(&owner)
        {
            let message = format!("the verb of device '{owner}' ended with '{ended_as}'{because}");
            self.core.end_users_of_lost(&owner, lost_s, &message);
        }
        self.make_idle();
        // Its claims are released, and starts that wait for them follow at once, before any other.
        self.core.registry.claims.retain(|_, holder| *holder != id);
        self.core.serve_queue();
    }
}

fn report(instance: &Instance, registry: &Registry, cause: Cause) -> Report {
    let (condition, way) = (&instance.plan.conditions[cause.condition], &instance.findings.way);
    let of = instance.installed_verb(&registry.physical);
    let mut outputs = IndexMap::new();
    let on_the_way = way.conditions.iter().flat_map(|passed| &instance.plan.conditions[*passed].returns).map(|output| (output, &way.captures));
    for (&output, captured) in on_the_way.chain(condition.returns.iter().map(|output| (output, &instance.findings.captures))) {
        let planned = &instance.plan.outputs[output];
        if let Some(bytes) = captured.whole(&of, output) {
            let (value, was_reported) = match planned.target {
                Target::Report { item, .. } => reported(&bytes, item),
                _ => (bytes.as_slice(), true),
            };
            let value = was_reported.then(|| decode(&planned.type_text, matches!(planned.target, Target::Cells(_)), value));
            outputs.insert(planned.name.clone(), value);
        }
    }
    let message = match cause.message {
        message if message.is_empty() => servo_text(registry, &condition.name, instance.owner.as_deref(), cause.value.as_ref(), &outputs),
        message => message,
    };
    Report {
        instance: instance.name.clone(),
        verb: instance.plan.verb.clone(),
        start: instance.starts,
        condition: condition.name.clone(),
        normal: condition.normal || (cause.asked_for && condition.name == SystemCondition::Halted.name()),
        command_list: instance.plan.lists[instance.leaving.departure.as_ref().and_then(|d| d.ending_from).unwrap_or(instance.position.list)].name.clone(),
        block: cause.block,
        time_s: cause.time_ns as f64 * 1e-9,
        started_s: instance.times.started_ns as f64 * 1e-9,
        value: cause.value,
        message,
        outputs,
        others: instance.findings.others.clone(),
        way: way.told(),
    }
}
