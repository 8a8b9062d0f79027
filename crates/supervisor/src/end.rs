// SPDX-License-Identifier: Apache-2.0
//! Ends: every start of a verb instance has exactly one, with its report.
use crate::core::{Core, DeviceState};
use crate::instance::{Cause, State};
use crate::outputs::Piece;
use crate::report::{Other, Report};
use crate::sequence::{Builder, Movement};
use crate::stages::Verbatim;
use indexmap::IndexMap;
use kernel::{Op, SourceId};
use model::plan::Target;
use model::types::Type;
use model::value::Value;

impl Core {
    /// Ends an instance by a condition that no block reported. Nothing where it is ending or not running.
    pub fn end_by_name(&mut self, id: u64, condition: &str, message: String) {
        let Some(instance) = self.instances.get(&id) else { return };
        let Some(condition) = instance.condition(condition) else { return };
        self.come(id, condition, message, false);
    }

    /// A condition comes from outside the blocks: τ, or the end. `asked_for`: by the waiter.
    pub fn come(&mut self, id: u64, condition: usize, message: String, asked_for: bool) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        if instance.state == State::Queued {
            let name = instance.plan.conditions[condition].name.clone();
            return self.leave_queue(id, &name, &message, asked_for);
        }
        if !matches!(instance.state, State::Running | State::Suspended) || instance.ending.is_some() {
            return;
        }
        let is_second = asked_for && instance.halting;
        let name = instance.plan.conditions[condition].name.clone();
        let is_under_way = instance.is_in_ending() || (name == "aborted" && instance.departure.is_some() && !instance.is_overtaken);
        if is_under_way && !is_second && name != "completed" {
            // The end is on its way already; a halt after this one is immediate.
            instance.halting |= asked_for;
            if !asked_for {
                self.other(id, name, String::new(), now_ns);
            }
            return;
        }
        if !self.take_process(id, true) {
            return;
        }
        if self.pause.is_held_back(id) {
            return self.end_before_it_began(id, condition, message, asked_for);
        }
        self.alarm_of_condition(id, condition, None, &message);
        let Some(instance) = self.instances.get_mut(&id) else { return };
        // Only now is it certain in which list the process is.
        let condition = instance.condition(&instance.plan.conditions[condition].name).unwrap_or(condition);
        instance.halting |= asked_for;
        let cause = Cause { condition, block: None, value: None, message, time_ns: now_ns, asked_for };
        let to = instance.led_to(condition);
        match to {
            _ if is_second => self.end_at_once(id, cause),
            Some(list) => {
                self.depart(id, cause);
                self.go(id, list, 0);
            }
            None => self.end(id, cause),
        }
    }

    /// The end proper begins: everything off and safe in every source, then the report. The process is frozen.
    pub fn finish(&mut self, id: u64, cause: Cause) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        if instance.ending.is_some() || !matches!(instance.state, State::Running | State::Suspended) {
            return;
        }
        let condition = cause.condition;
        instance.ending = Some(cause);
        instance.suspending = false;
        instance.capturing.clear();
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        let mut builder = Builder::default();
        for &source in &instance.installed.sources {
            of.stop_in(&mut builder, source);
            builder.add(source, Op::StopClock(instance.installed.process.clone()));
            let mut outputs = of.outputs_in(source, condition);
            outputs.retain(|o| !instance.outputs.iter().any(|(have, _)| have == o));
            if !outputs.is_empty() {
                builder.add(source, Op::Capture(of.cells_of(&outputs)));
                instance.capturing.push((source, outputs));
            }
        }
        builder.then(Movement::Ended);
        self.replace_sequence(id, builder.finish());
    }

    /// A kernel has ended it in the same firing; what its script captured are outputs in that source. `alone`: no other condition
    /// of that firing is still to be told.
    pub fn ended_by_kernel(&mut self, id: u64, source: SourceId, cause: Cause, captured: &[u8], alone: bool) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        (instance.list, instance.stage) = instance.list_stage(instance.installed.process.now().1);
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        // What the ending list captured is nothing: the outputs were read when it began.
        let outputs = if instance.is_in_ending() { Vec::new() } else { of.outputs_in(source, cause.condition) };
        let lens: Vec<usize> = outputs.iter().map(|o| of.piece_len(*o)).collect();
        take_outputs(&mut instance.outputs, &outputs, &lens, captured);
        let (told, is_read) = (cause.condition, instance.is_in_ending() && instance.capturing.is_empty());
        let cause = self.remembered(id, cause);
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let is_read = is_read || told == cause.condition;
        let done = is_read && alone && instance.installed.sources.len() == 1 && instance.outstanding == 0 && instance.sequence.is_empty();
        if done && instance.state == State::Running && instance.ending.is_none() {
            // The reaction has done all of it: everything is off and safe, the outputs are here.
            instance.capturing.clear();
            instance.ending = Some(cause);
            return self.ended(id);
        }
        // Scripts of a start that was still under way may have switched something on behind the reaction: the end goes through
        // every source once more.
        self.finish(id, cause);
    }

    /// Everything has been acknowledged: claims are free, the report is made.
    pub fn ended(&mut self, id: u64) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let Some(cause) = instance.ending.take() else { return };
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        take_captured(&of, &mut instance.outputs, &mut instance.capturing, std::mem::take(&mut instance.captured));
        instance.state = State::Ended;
        instance.active.clear();
        instance.wait_until_ns = None;
        let owner = instance.owner.clone();
        let departed = instance.departure.is_some();
        self.forget_farewell(id);
        let now_ns = self.host.now_ns();
        let report = self.report(id, cause);
        self.log.add(
            if departed { now_ns } else { (report.time_s * 1e9) as i64 },
            "end",
            &report.instance,
            format!("{}{}", report.condition, if report.message.is_empty() { String::new() } else { format!(": {}", report.message) }),
        );
        let ended_as = report.condition.clone();
        let unasked = owner.as_ref().filter(|o| self.logical.get(*o).is_some_and(|l| l.state != DeviceState::Stopping));
        let has_own = self.instances[&id].plan.conditions.iter().any(|c| c.name == ended_as && c.alarm.is_some());
        if owner.is_none() || unasked.is_some() {
            self.alarm_of_end(&report, unasked.map(String::as_str), has_own);
        }
        self.forget_pause(id);
        self.ends.add(id, report.clone());
        if let Some(instance) = self.instances.get_mut(&id) {
            instance.report = Some(report);
        }
        self.ended += 1;
        if let Some(owner) = owner {
            self.servo_ended(&owner, &ended_as);
        }
        self.release_claims(id);
    }

    fn report(&self, id: u64, cause: Cause) -> Report {
        let instance = &self.instances[&id];
        let condition = &instance.plan.conditions[cause.condition];
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        let mut outputs = IndexMap::new();
        for &output in &condition.returns {
            let planned = &instance.plan.outputs[output];
            if let Some(bytes) = whole(&of, &instance.outputs, output) {
                let (value, was_reported) = match planned.target {
                    Target::Report { item, .. } => reported(&bytes, item),
                    _ => (bytes.as_slice(), true),
                };
                let value = was_reported.then(|| decode(&planned.type_text, matches!(planned.target, Target::Cells(_)), value));
                outputs.insert(planned.name.clone(), value);
            }
        }
        Report {
            instance: instance.name.clone(),
            verb: instance.plan.verb.clone(),
            start: instance.starts,
            condition: condition.name.clone(),
            normal: condition.normal || (cause.asked_for && condition.name == "halted"),
            command_list: instance.plan.lists[instance.departure.as_ref().and_then(|d| d.ending_from).unwrap_or(instance.list)].name.clone(),
            block: cause.block,
            time_s: cause.time_ns as f64 * 1e-9,
            started_s: instance.started_ns as f64 * 1e-9,
            value: cause.value,
            message: cause.message,
            outputs,
            others: instance.others.clone(),
        }
    }

    /// A logical device's own verb has ended: the device is disabled, and the verbs that use it lose it.
    fn servo_ended(&mut self, device: &str, condition: &str) {
        let Some(record) = self.logical.get_mut(device) else { return };
        let asked = record.state == DeviceState::Stopping;
        record.state = if asked { DeviceState::Disabled } else { DeviceState::Fault };
        if !asked {
            let message = format!("the verb of device '{device}' ended with '{condition}'");
            self.end_users(device, "device_lost", &message);
        }
    }

    /// Ends the verbs that use a logical device.
    pub fn end_users(&mut self, device: &str, condition: &str, message: &str) {
        let mut users: Vec<u64> = self.instances.values().filter(|i| i.is_busy() && i.plan.devices.iter().any(|d| d == device)).map(|i| i.id).collect();
        self.queued_first(&mut users);
        for user in users {
            if condition == "device_disabled"
                && let Some(instance) = self.instances.get_mut(&user)
                && std::mem::replace(&mut instance.disabled, true)
            {
                continue;
            }
            self.end_by_name(user, condition, message.to_owned());
        }
    }

    /// Another condition that came while one was acting.
    pub fn other(&mut self, id: u64, condition: String, block: String, time_ns: i64) {
        if let Some(instance) = self.instances.get_mut(&id) {
            instance.others.push(Other { condition, block, time_s: time_ns as f64 * 1e-9 });
        }
    }
}

/// What the scripts of an end captured in each source becomes outputs.
pub(crate) fn take_captured(
    of: &Verbatim,
    outputs: &mut Vec<(Piece, Vec<u8>)>,
    capturing: &mut Vec<(SourceId, Vec<Piece>)>,
    captured: Vec<(SourceId, Vec<u8>)>,
) {
    for (source, bytes) in captured {
        if let Some((_, asked)) = capturing.iter().find(|(s, _)| *s == source) {
            let lens: Vec<usize> = asked.iter().map(|o| of.piece_len(*o)).collect();
            take_outputs(outputs, asked, &lens, &bytes);
        }
    }
    capturing.clear();
}

/// The bytes of an output whose pieces have all been captured.
fn whole(of: &Verbatim, have: &[(Piece, Vec<u8>)], output: usize) -> Option<Vec<u8>> {
    let piece = |part| have.iter().find(|(piece, _)| *piece == (output, part)).map(|(_, bytes)| bytes.as_slice());
    (0..of.parts(output)).map(piece).collect::<Option<Vec<_>>>().map(|pieces| pieces.concat())
}

/// Splits captured bytes into pieces of outputs.
pub(crate) fn take_outputs(have: &mut Vec<(Piece, Vec<u8>)>, outputs: &[Piece], lens: &[usize], bytes: &[u8]) {
    let mut offset = 0;
    for (output, len) in outputs.iter().zip(lens) {
        if let Some(part) = bytes.get(offset..offset + len) {
            have.push((*output, part.to_vec()));
        }
        offset += len;
    }
}

/// The value of a condition, and whether it was reported: the word behind the value has a bit for each item of its block.
fn reported(bytes: &[u8], item: usize) -> (&[u8], bool) {
    match bytes.split_last_chunk() {
        Some((value, word)) => (value, u64::from_ne_bytes(*word) >> item & 1 == 1),
        None => (bytes, false),
    }
}

/// A value of a normalised type; of several cells of it, a list.
pub(crate) fn decode(type_text: &str, several: bool, bytes: &[u8]) -> Value {
    let Ok(of) = Type::parse(type_text, &IndexMap::new()) else { return Value::List(Vec::new()) };
    if several && of.size() > 0 && bytes.len() != of.size() {
        return Value::List(bytes.chunks(of.size()).map(|part| of.decode(part)).collect());
    }
    of.decode(bytes)
}
