// SPDX-License-Identifier: Apache-2.0
//! What the kernels tell.
use crate::core::{Core, Purpose};
use crate::instance::{Cause, Instance, State};
use crate::stages::{Answer, Verbatim};
use kernel::{BlockId, Event, Fault, SourceId};
use model::types::Type;
use model::value::Value;
use opengpac::signal_text;
use std::sync::atomic::Ordering;

/// A condition as the kernel told it.
struct Told {
    source: SourceId,
    process: u64,
    condition: usize,
    block: BlockId,
    item: u8,
    fault: Option<Fault>,
    time_ns: i64,
    /// No other condition came in the firing.
    alone: bool,
    acted: bool,
    ended: bool,
    stage: Option<u16>,
    generation: u32,
    value: Vec<u8>,
    captured: Vec<u8>,
}

impl Core {
    /// Takes every event that is there.
    pub fn drain(&mut self) {
        while let Some(event) = self.host.poll() {
            self.take(event);
        }
    }

    fn take(&mut self, event: Event) {
        match event {
            Event::Done { source, script, time_ns, captured, .. } => match self.acknowledged(script.id) {
                Purpose::Sequence { instance, epoch } => self.sequence_done(instance, epoch, source, captured),
                Purpose::Read { ticket } => {
                    self.reads.insert(ticket, (time_ns, captured));
                }
                Purpose::Carried { done } => done.store(true, Ordering::Release),
                Purpose::Nothing => {}
            },
            Event::Condition { source, process, generation, condition, block, item, fault, time_ns, alone, acted, ended, stage, value, captured, .. } => {
                self.condition(Told {
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
                self.unwatched(process, block, item, fault.map(|fault| (fault, value)), time_ns)
            }
            Event::Stopped { source, block, process, fault, time_ns } => self.stopped(source, block, process, &fault, time_ns),
            Event::DeviceLost { device, message, time_ns, .. } => self.device_lost(&device, &message, time_ns),
            Event::Asked { .. } => self.watch_inputs(),
            Event::Overrun { source, reader, member, time_ns } => {
                let (writer, reader) = (self.source_name(source).to_owned(), self.source_name(reader).to_owned());
                self.log.add(time_ns, "overrun", &reader, format!("the queue from '{writer}' to '{reader}' was full: value {member} was lost"));
                self.queue_overrun(source, &format!("the queue from '{writer}' to '{reader}' was full"));
            }
            Event::Late { source, member, time_ns } => {
                let reader = self.source_name(source).to_owned();
                self.log.add(time_ns, "late", &reader, format!("ratio input {member}: the value was not there yet, the old one is kept"));
            }
            Event::Gone { source, block, message, .. } => {
                let culprit = block.and_then(|block| self.culprit(block));
                let ran = culprit.map(|(of, index)| format!("; it ran block '{}' of '{}'", of.plan.blocks[index].label, of.name));
                let why = format!("{message}{}", ran.unwrap_or_default());
                self.processor_lost(source, &self.loss_of(source, &why));
            }
            Event::Unconnected { writer, reader, message } => {
                let (writer, reader) = (self.source_name(writer).to_owned(), self.source_name(reader).to_owned());
                self.log.add(self.host.now_ns(), "unconnected", &reader, format!("nothing comes from '{writer}' to '{reader}': {message}"));
            }
            Event::Lost { source, count } => {
                let name = self.source_name(source).to_owned();
                self.log.add(self.host.now_ns(), "lost", &name, format!("{count} conditions or other events of the source found no place"));
                self.alarm_events_lost(&name, count);
            }
        }
    }

    fn condition(&mut self, told: Told) {
        let Some(instance) = self.instances.get(&told.process) else { return };
        let id = instance.id;
        let block = instance.installed.blocks.iter().position(|b| b.id() == told.block);
        let label = block.map(|b| instance.plan.blocks[b].label.clone()).unwrap_or_default();
        let name = instance.plan.conditions.get(told.condition).map_or_else(|| "wait".to_owned(), |c| c.name.clone());
        let text = match &told.fault {
            Some(fault) if block.is_none() => self.stopped_text(told.source, told.block, fault),
            Some(fault) => fault_text(instance, block, fault, &told.value),
            None => format!("{name} (reported by '{label}')"),
        };
        let about = instance.name.clone();
        let runs = matches!(instance.state, State::Running | State::Suspended);
        // Of an earlier generation it is recorded, never served: somebody else was faster.
        let acts = told.acted && runs && instance.ending.is_none() && told.generation == instance.generation;
        self.log.add(told.time_ns, if told.fault.is_some() { "fault" } else { "condition" }, &about, text.clone());
        let value = self.reported_value(id, block, told.item, &told.value);
        let message = if told.fault.is_some() { text } else { String::new() };
        let cause = Cause { condition: told.condition, block: block.map(|_| label.clone()), value, message, time_ns: told.time_ns, asked_for: false };
        if !acts {
            // Somebody took the process where the kernel had entered the ending list already: that is where it is.
            if runs && told.acted && told.stage.is_some_and(|stage| self.is_ending_unnoticed(id, stage)) {
                self.concluded_by_kernel(id, told.source, cause, &told.captured);
            } else if runs && self.instances.get_mut(&id).is_some_and(|i| i.rests_at(block, told.item)) {
                self.rest_at_last(id);
            } else if matches!(told.fault, Some(Fault::Signal(_) | Fault::Budget)) {
                // What became of it was decided when the source stopped.
            } else if runs && told.condition < self.instances[&id].plan.conditions.len() {
                self.other(id, name, label, told.time_ns);
            }
            return;
        }
        self.alarm_of_condition(id, told.condition, block.map(|_| label.as_str()), &cause.message);
        if told.ended {
            self.ended_by_kernel(id, told.source, cause, &told.captured, told.alone);
        } else if let Some(stage) = told.stage {
            let (list, stage) = self.instances[&id].list_stage(stage);
            self.replace_sequence(id, []);
            if self.instances[&id].plan.ending.list == Some(list) && !self.instances[&id].is_in_ending() {
                self.concluded_by_kernel(id, told.source, cause, &told.captured);
            }
            self.entered(id, list, stage);
        } else {
            self.frozen(id, block.map(|b| (b, usize::from(told.item))), cause);
        }
    }

    /// True where an instance is in its ending list, which a kernel entered with `stage`, and does not know why.
    fn is_ending_unnoticed(&self, id: u64, stage: u16) -> bool {
        let instance = &self.instances[&id];
        let ending = instance.plan.ending.list;
        ending.is_some()
            && ending == Some(instance.list)
            && ending == Some(instance.list_stage(stage).0)
            && !instance.is_in_ending()
            && instance.ending.is_none()
    }

    /// The kernel has frozen the process: the supervisor answers.
    fn frozen(&mut self, id: u64, reported: Option<(usize, usize)>, cause: Cause) {
        if !self.take_process(id, true) {
            return;
        }
        let Some(instance) = self.instances.get(&id) else { return };
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        let condition = (cause.condition < instance.plan.conditions.len()).then_some(cause.condition);
        match of.answer(instance.list, instance.stage, condition, reported) {
            Some(Answer::Go(list, stage)) => self.go(id, list, stage),
            Some(Answer::End) => self.end(id, cause),
            None => self.go_on(id),
        }
    }

    /// Nothing answers it: the process, which was taken, goes on.
    pub fn go_on(&mut self, id: u64) {
        let Some(instance) = self.instances.get(&id) else { return };
        let (process, source) = (instance.installed.process.clone(), instance.installed.sources[0]);
        let (stage, generation) = (process.now().1, Some(instance.generation));
        self.submit(source, vec![kernel::Op::Stage { process, stage, generation }], Purpose::Nothing);
    }

    fn unwatched(&mut self, process: u64, block: BlockId, item: u8, fault: Option<(Fault, Vec<u8>)>, time_ns: i64) {
        let Some(instance) = self.instances.get(&process) else { return };
        let index = instance.installed.blocks.iter().position(|b| b.id() == block);
        let text = match &fault {
            Some((fault, what)) => fault_text(instance, index, fault, what),
            None => {
                let item = index.and_then(|b| item_name(instance, b, item));
                format!(
                    "'{}' reported '{}', which no termination condition stands for now",
                    index.map_or("?", |b| instance.plan.blocks[b].label.as_str()),
                    item.unwrap_or_default()
                )
            }
        };
        let about = instance.name.clone();
        self.log.add(time_ns, if fault.is_some() { "fault" } else { "condition" }, &about, text);
    }

    /// The value that a condition reported, if it has one.
    fn reported_value(&self, id: u64, block: Option<usize>, item: u8, bytes: &[u8]) -> Option<Value> {
        let interface = self.instances.get(&id)?.installed.interfaces.get(block?)?;
        let declared = &interface.items.get(usize::from(item))?.type_text;
        let of = Type::parse(declared, &interface.types).ok()?;
        (!bytes.is_empty() && bytes.len() == of.size()).then(|| of.decode(bytes))
    }

    /// A source was stopped by a signal or a spent budget in a block: for verbs with blocks there `fault` comes, which τ may lead on to what
    /// runs on other sources; the module takes no new instance.
    fn stopped(&mut self, source: SourceId, block: BlockId, process: u64, fault: &Fault, time_ns: i64) {
        let name = self.source_name(source).to_owned();
        let stopped = self.stopped_text(source, block, fault);
        self.log.add(time_ns, "fault", &name, stopped.clone());
        let culprit = self.culprit(block).map(|(instance, index)| {
            let module = instance.plan.blocks[index].block.split('.').next().unwrap_or("").to_owned();
            (module, fault_text(instance, Some(index), fault, &[]))
        });
        let text = culprit.as_ref().map_or_else(String::new, |(_, text)| text.clone());
        if let Some((module, text)) = culprit {
            self.poisoned.insert(module, format!("was stopped by a fault ({text})"));
        }
        let there: Vec<u64> = self.instances.values().filter(|i| i.is_busy() && i.installed.sources.contains(&source)).map(|i| i.id).collect();
        for id in there {
            let label = if id == process { culprit_label(self, id, block) } else { None };
            if !self.take_process(id, true) {
                continue;
            }
            let Some(condition) = self.instances[&id].condition("fault") else { continue };
            let message = if id == process && label.is_some() { text.clone() } else { stopped.clone() };
            self.lose(id, Cause { condition, block: label, value: None, message, time_ns, asked_for: false });
        }
    }

    /// The instance that an installed block is of, and its index there.
    fn culprit(&self, block: BlockId) -> Option<(&Instance, usize)> {
        self.instances.values().find_map(|i| Some((i, i.installed.blocks.iter().position(|b| b.id() == block)?)))
    }

    /// A source that was stopped, in words.
    fn stopped_text(&self, source: SourceId, block: BlockId, fault: &Fault) -> String {
        let why = self
            .culprit(block)
            .map_or_else(|| "a block that is gone".to_owned(), |(of, index)| format!("{}, of '{}'", fault_text(of, Some(index), fault, &[]), of.name));
        format!("source '{}' stopped: {why}", self.source_name(source))
    }

    pub fn device_lost(&mut self, device: &str, message: &str, time_ns: i64) {
        self.mark_lost(device, message, time_ns);
        self.alarm_lost(device, message);
        self.end_bound(device, message);
    }

    /// Marks a device as lost. Where it is lost with its processor nothing else follows: that has the alarm, and ends who runs there.
    pub fn mark_lost(&mut self, device: &str, message: &str, time_ns: i64) {
        self.log.add(time_ns, "device", device, format!("device '{device}' was lost: {message}"));
        if let Some(physical) = self.physical.get_mut(device) {
            physical.lost = Some(message.to_owned());
        }
    }

    /// Ends the verbs that are bound to a channel of a lost device.
    fn end_bound(&mut self, device: &str, message: &str) {
        if self.physical.get(device).is_some_and(|physical| self.lost.contains(&physical.source)) {
            // Who uses its channels runs there: to them `processor_lost` has come.
            return;
        }
        let uses = |i: &Instance| i.plan.cells.iter().any(|c| matches!(&c.kind, model::plan::CellKind::Channel { device: d, .. } if d == device));
        let users: Vec<u64> = self.instances.values().filter(|i| i.is_busy() && uses(i)).map(|i| i.id).collect();
        for user in users {
            self.end_by_name(user, "device_lost", format!("device '{device}' was lost: {message}"));
        }
    }

    fn queue_overrun(&mut self, writer: SourceId, message: &str) {
        let limited: Vec<u64> = (self.instances.values())
            .filter(|i| i.state == State::Running && i.limits.overruns.is_some() && i.installed.sources.contains(&writer))
            .map(|i| i.id)
            .collect();
        for id in limited {
            self.end_by_name(id, "overrun", message.to_owned());
        }
    }
}

fn culprit_label(core: &Core, id: u64, block: BlockId) -> Option<String> {
    let instance = core.instances.get(&id)?;
    let index = instance.installed.blocks.iter().position(|b| b.id() == block)?;
    Some(instance.plan.blocks[index].label.clone())
}

/// A fault in words, naming the block and its code; `said` is what its exception says.
fn fault_text(instance: &Instance, block: Option<usize>, fault: &Fault, said: &[u8]) -> String {
    let of = block.map(|b| &instance.plan.blocks[b]);
    let what = of.map_or("a block".to_owned(), |b| format!("block '{}' ({})", b.label, b.block));
    match fault {
        Fault::Returned(code) => match block.and_then(|b| fault_meaning(&instance.installed.interfaces[b].doc, *code)) {
            Some(meaning) => format!("{what}: {meaning} (fault {code})"),
            None => format!("{what} returned fault {code}"),
        },
        Fault::Panic => format!("{what} panicked"),
        Fault::NonFinite(item) => {
            let item = block.and_then(|b| item_name(instance, b, *item)).unwrap_or_default();
            format!("output '{item}' of {what} was not finite")
        }
        Fault::Signal(signal) => format!("{what}: {}", signal_text(*signal)),
        Fault::Budget => format!("{what} used up its time budget"),
        Fault::Threw => format!("{what} threw an exception: {}", String::from_utf8_lossy(said)),
    }
}

/// Name of an item of an installed block.
fn item_name(instance: &Instance, block: usize, item: u8) -> Option<String> {
    instance.installed.interfaces.get(block)?.items.get(usize::from(item)).map(|i| i.name.clone())
}

/// What a block's description says of a fault code: `Faults: 1 a limit is not above 0; 2 a goal is out of range.`
fn fault_meaning(doc: &str, code: u32) -> Option<&str> {
    let faults = doc.lines().find_map(|line| line.strip_prefix("Faults: "))?;
    faults.split(';').find_map(|entry| entry.trim().strip_prefix(&format!("{code} "))).map(|meaning| meaning.trim_end_matches('.'))
}
