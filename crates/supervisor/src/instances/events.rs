// SPDX-License-Identifier: Apache-2.0
//! Handling of kernel events.
use crate::alarms::causes::{alarm_events_lost, alarm_lost, alarm_of_condition};
use crate::core::Core;
use crate::instances::cause::Cause;
use crate::instances::course::Course;
use crate::instances::floating_point::floats_text;
use crate::instances::instance::{Instance, State};
use crate::instances::messages::{fault_text, gap_message, stopped_text};
use crate::scripts::Purpose;
use crate::stopping::emergency_stop::watch_inputs;
use crate::stopping::lost_processors::{give_up_for_good, mark_lost, processor_lost};
use crate::stopping::standstill::stood_still;
use crate::transitions::stages::Answer;
use model::SystemCondition;

use kernel::{BlockId, Event, Fault, SourceId};
use std::sync::atomic::Ordering;

/// A condition as reported by a kernel.
struct ToldCondition {
    source: SourceId,
    process: u64,
    condition: usize,
    block: BlockId,
    item: u8,
    fault: Option<Fault>,
    time_ns: i64,
    /// True if no other condition was reported in the same firing.
    alone: bool,
    acted: bool,
    ended: bool,
    stage: Option<u16>,
    generation: u32,
    value: Vec<u8>,
    captured: Vec<u8>,
}

impl Core {
    /// Handles all pending events; returns true if there were any.
    pub fn drain(&mut self) -> bool {
        let mut came = false;
        while let Some(event) = self.host.poll() {
            self.take(event);
            came = true;
        }
        self.release_idle_forces();
        came
    }

    fn take(&mut self, event: Event) {
        match event {
            Event::Done { source, script, time_ns, captured, .. } => match self.scripts.acknowledged(script.id) {
                Purpose::Sequence { instance, epoch } => {
                    if self.instances.get_mut(&instance).is_some_and(|i| i.take_acknowledgement(epoch, source, captured)) {
                        self.course(instance).proceed();
                    }
                }
                Purpose::Read { ticket } => {
                    self.observation.reads.insert(ticket, (time_ns, captured));
                }
                Purpose::Carried { done } => done.store(true, Ordering::Release),
                Purpose::Nothing => {}
            },
            Event::Condition { source, process, generation, condition, block, item, fault, time_ns, alone, acted, ended, stage, value, captured, .. } => {
                self.condition(ToldCondition {
                    source,
                    process,
                    condition: usize::from(condition),
                    block,
                    item,
                    fault,
                    time_ns,
                    alone,
                    acted,
                    ended,
                    stage,
                    generation,
                    value,
                    captured,
                });
            }
            Event::Unwatched { process, block, item, fault, time_ns, value, .. } => {
                let Some(instance) = self.instances.get(&process) else { return };
                let kind = if fault.is_some() { "fault" } else { "condition" };
                let gap = if fault.is_none() { instance.gap_of_owner(block, item, &value) } else { None };
                let text = instance.unwatched(block, item, fault.map(|fault| (fault, value)));
                self.observation.log.add(time_ns, kind, &instance.name, text);
                if let Some((device, lost_s)) = gap {
                    self.gap_of(&device, lost_s);
                }
            }
            Event::Stopped { source, block, process, fault, time_ns } => self.stopped(source, block, process, &fault, time_ns),
            Event::Deaf { source, time_ns } => {
                let name = self.registry.source_name(source).to_owned();
                let why = format!("a block on source '{name}' does not return and has masked every signal: its time budget cannot end it; end the program");
                give_up_for_good(self, source, &why, time_ns);
            }
            Event::Ended { source, time_ns } => {
                let name = self.registry.source_name(source).to_owned();
                let why = format!(
                    "the operating system has ended the thread of source '{name}', as it does if a block restricts itself with seccomp; start the program again"
                );
                give_up_for_good(self, source, &why, time_ns);
            }
            Event::Replaced { text, time_ns } => self.observation.log.add(time_ns, "fault", "system", text),
            Event::DeviceLost { device, message, time_ns, .. } => self.device_lost(&device, &message, time_ns),
            Event::Asked { .. } => watch_inputs(self),
            Event::Overrun { source, reader, member, time_ns } => {
                let (writer, reader) = (self.registry.source_name(source).to_owned(), self.registry.source_name(reader).to_owned());
                self.observation.log.add(time_ns, "overrun", &reader, format!("the queue from '{writer}' to '{reader}' was full: value {member} was lost"));
                self.queue_overrun(source, &format!("the queue from '{writer}' to '{reader}' was full"));
            }
            Event::Late { source, member, time_ns } => {
                let reader = self.registry.source_name(source).to_owned();
                self.observation.log.add(time_ns, "late", &reader, format!("ratio input {member}: the new value had not arrived, so the old one was kept"));
            }
            Event::Gone { source, block, message, .. } => {
                let culprit = block.and_then(|block| self.instances.culprit(block));
                let ran = culprit.map(|(of, index)| format!("; it was running block '{}' of '{}'", of.plan.blocks[index].label, of.name));
                let why = format!("{message}{}", ran.unwrap_or_default());
                let why = self.remote.loss_of(self.registry.source_name(source), &why);
                processor_lost(self, source, &why);
            }
            Event::StoodStill { source, late_ns, is_unattended, time_ns } => stood_still(self, source, late_ns, is_unattended, time_ns),
            Event::Unconnected { writer, reader, message } => {
                let (writer, reader) = (self.registry.source_name(writer).to_owned(), self.registry.source_name(reader).to_owned());
                self.observation.log.add(self.host.now_ns(), "unconnected", &reader, format!("nothing arrives from '{writer}' at '{reader}': {message}"));
            }
            Event::Lost { source, count } => {
                let name = self.registry.source_name(source).to_owned();
                self.observation.log.add(
                    self.host.now_ns(),
                    "lost",
                    &name,
                    format!("{count} conditions or other events of the source were lost, because their queue was full"),
                );
                alarm_events_lost(self, &name, count);
            }
        }
    }

    fn condition(&mut self, told: ToldCondition) {
        let Some(instance) = self.instances.get(&told.process) else { return };
        let id = instance.id;
        let block = instance.installed.blocks.iter().position(|b| b.id() == told.block);
        let label = block.map(|b| instance.plan.blocks[b].label.clone()).unwrap_or_default();
        let name = instance.plan.conditions.get(told.condition).map_or_else(|| "wait".to_owned(), |c| c.name.clone());
        let text = match &told.fault {
            Some(fault) if block.is_none() => stopped_text(&self.instances, &self.registry, told.source, told.block, fault),
            Some(fault) => fault_text(instance, block, fault, &told.value),
            None => format!("{name} (reported by '{label}')"),
        };
        let about = instance.name.clone();
        let runs = matches!(instance.state(), State::Running | State::Suspended);
        // A condition of an earlier generation is recorded but not acted on: another one moved the process first.
        let acts = told.acted && runs && !instance.is_ending() && told.generation == instance.generation;
        self.observation.log.add(told.time_ns, if told.fault.is_some() { "fault" } else { "condition" }, &about, text.clone());
        let value = self.instances[&id].reported_value(block, told.item, &told.value);
        let message = if told.fault.is_some() { text } else { gap_message(&self.instances[&id], &self.registry, block, told.item, value.as_ref()) };
        let cause = Cause { condition: told.condition, block: block.map(|_| label.clone()), value, message, time_ns: told.time_ns, asked_for: false };
        if !acts {
            let led_to = told.stage.filter(|_| runs && told.acted && !told.ended).map(|stage| self.instances[&id].list_stage(stage));
            // The process was frozen after the kernel had entered the ending list, so it is in that list.
            if runs && told.acted && told.stage.is_some_and(|stage| self.instances[&id].is_ending_unnoticed(stage)) {
                self.course(id).concluded_by_kernel(told.source, cause, &told.captured);
            } else if let Some((list, 0)) = led_to
                // The ending list is not part of τ: the condition that began it is one of the others.
                && self.instances[&id].plan.ending.list != Some(list)
                && cause.condition < self.instances[&id].plan.conditions.len()
                && self.course(id).led_on_before_take(told.source, told.generation, list, &cause, &told.captured)
            {
                alarm_of_condition(self, id, told.condition, block.map(|_| label.as_str()), &cause.message);
            } else if runs && self.instances.get_mut(&id).is_some_and(|i| i.come_to_rest(block, told.item)) {
                self.course(id).rest_at_last();
            } else if matches!(told.fault, Some(Fault::Signal(_) | Fault::Budget | Fault::Lost(_) | Fault::Forked)) {
                // The consequences were decided when the source stopped.
            } else if let Some(instance) = self.instances.get_mut(&id).filter(|i| runs && told.condition < i.plan.conditions.len()) {
                instance.other(name, label, told.time_ns);
            }
            return;
        }
        alarm_of_condition(self, id, told.condition, block.map(|_| label.as_str()), &cause.message);
        if told.ended {
            self.course(id).ended_by_kernel(told.source, cause, &told.captured, told.alone);
        } else if let Some(stage) = told.stage {
            let (list, stage) = self.instances[&id].list_stage(stage);
            self.course(id).replace_sequence([]);
            let instance = &self.instances[&id];
            if instance.plan.ending.list == Some(list) && !instance.is_in_ending() {
                self.course(id).concluded_by_kernel(told.source, cause, &told.captured);
            } else if stage == 0 && cause.condition < instance.plan.conditions.len() {
                self.course(id).led_on_by_kernel(told.source, &cause, &told.captured);
            }
            self.course(id).entered(list, stage);
        } else {
            self.course(id).frozen(block.map(|b| (b, usize::from(told.item))), cause);
        }
    }

    /// Handles a source that was stopped by a signal or an exhausted budget in a block: verbs with blocks on it receive `fault`, from
    /// which τ may lead to lists on other sources. No new instances of the block's module are accepted.
    fn stopped(&mut self, source: SourceId, block: BlockId, process: u64, fault: &Fault, time_ns: i64) {
        let name = self.registry.source_name(source).to_owned();
        let stopped = stopped_text(&self.instances, &self.registry, source, block, fault);
        self.observation.log.add(time_ns, "fault", &name, stopped.clone());
        let culprit = self.instances.culprit(block).map(|(instance, index)| {
            let module = instance.plan.blocks[index].block.split('.').next().unwrap_or("").to_owned();
            (module, fault_text(instance, Some(index), fault, &[]))
        });
        let text = match fault {
            Fault::Floats => floats_text(&self.instances, &self.registry, source),
            _ => culprit.as_ref().map_or_else(String::new, |(_, text)| text.clone()),
        };
        if matches!(fault, Fault::Lost(_)) {
            self.safety.ended_for_good.insert(source, stopped.clone());
        }
        // The block that changed the floating-point state is not known for certain, so no module is refused for it.
        if let Some((module, text)) = culprit.filter(|_| *fault != Fault::Floats) {
            self.safety.poisoned.insert(module, format!("was stopped by a fault ({text})"));
        }
        let there: Vec<u64> = self.instances.values().filter(|i| i.is_busy() && i.installed.sources.contains(&source)).map(|i| i.id).collect();
        for id in there {
            let label = if id == process { culprit_label(self, id, block) } else { None };
            if !self.course(id).take_process(true) {
                continue;
            }
            let Some(condition) = self.instances[&id].system(SystemCondition::Fault) else { continue };
            let message = if id == process && label.is_some() { text.clone() } else { stopped.clone() };
            self.course(id).lose(Cause { condition, block: label, value: None, message, time_ns, asked_for: false });
        }
    }

    pub fn device_lost(&mut self, device: &str, message: &str, time_ns: i64) {
        mark_lost(&mut self.registry, &mut self.observation.log, device, message, time_ns);
        alarm_lost(self, device, message);
        self.end_bound(device, message);
    }

    /// Ends the verbs bound to a channel of a lost device.
    fn end_bound(&mut self, device: &str, message: &str) {
        if self.registry.physical.get(device).is_some_and(|physical| self.safety.lost.contains(&physical.source)) {
            // Users of its channels run there and have received `processor_lost`.
            return;
        }
        let uses = |i: &Instance| i.plan.cells.iter().any(|c| matches!(&c.kind, model::plan::CellKind::Channel { device: d, .. } if d == device));
        let users: Vec<u64> = self.instances.values().filter(|i| i.is_busy() && uses(i)).map(|i| i.id).collect();
        for user in users {
            self.course(user).end_by(SystemCondition::DeviceLost, format!("device '{device}' was lost: {message}"));
        }
    }

    fn queue_overrun(&mut self, writer: SourceId, message: &str) {
        let limited: Vec<u64> = (self.instances.values())
            .filter(|i| i.state() == State::Running && i.times.limits.overruns.is_some() && i.installed.sources.contains(&writer))
            .map(|i| i.id)
            .collect();
        for id in limited {
            self.course(id).end_by(SystemCondition::Overrun, message.to_owned());
        }
    }
}

impl Course<'_> {
    /// Handles a kernel's answer that it has frozen a process.
    fn frozen(&mut self, reported: Option<(usize, usize)>, cause: Cause) {
        let id = self.id;
        if !self.take_process(true) {
            return;
        }
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get(&id) else { return };
        let of = instance.installed_verb(&self.core.registry.physical);
        let condition = (cause.condition < instance.plan.conditions.len()).then_some(cause.condition);
        match of.answer(instance.position.list, instance.position.stage, condition, reported) {
            Some(Answer::Go(list, stage)) => match self.core.instances.get_mut(&id).and_then(|instance| instance.enters_again(now_ns)) {
                Some(cause) => self.end(cause),
                None if stage == 0 && condition.is_some() => self.lead_on(&cause, list),
                None => self.go(list, stage),
            },
            Some(Answer::End) => self.end(cause),
            None => self.core.carrier().go_on(id),
        }
    }
}

fn culprit_label(core: &Core, id: u64, block: BlockId) -> Option<String> {
    let instance = core.instances.get(&id)?;
    let index = instance.installed.blocks.iter().position(|b| b.id() == block)?;
    Some(instance.plan.blocks[index].label.clone())
}
