// SPDX-License-Identifier: Apache-2.0
//! Carrying sequences out: one movement after the other, each when the one before has been acknowledged.
use crate::core::{Core, DeviceState, Purpose};
use crate::instance::State;
use crate::sequence::{Inlet, Movement};
use crate::stages::Verbatim;
use kernel::{Op, SourceId};
use model::plan::Wait;

impl Core {
    /// Puts a new sequence in the place of what is left of the one before.
    pub fn replace_sequence(&mut self, id: u64, movements: impl IntoIterator<Item = Movement>) {
        if let Some(instance) = self.instances.get_mut(&id) {
            instance.sequence.clear();
            instance.sequence.extend(movements);
            instance.outstanding = 0;
            instance.epoch += 1;
        }
        self.proceed(id);
    }

    /// Adds to the sequence.
    pub fn append_sequence(&mut self, id: u64, movements: impl IntoIterator<Item = Movement>) {
        if let Some(instance) = self.instances.get_mut(&id) {
            instance.sequence.extend(movements);
        }
        self.proceed(id);
    }

    /// Carries out what can be carried out now.
    pub fn proceed(&mut self, id: u64) {
        while let Some(instance) = self.instances.get_mut(&id) {
            if instance.outstanding > 0 {
                return;
            }
            let Some(movement) = instance.sequence.pop_front() else { return };
            self.carry_out(id, movement);
        }
    }

    fn carry_out(&mut self, id: u64, movement: Movement) {
        match movement {
            Movement::Scripts(scripts) => self.send(id, scripts),
            Movement::Tables(sources) => self.swap_tables(id, sources),
            Movement::Inbound(inlets) => self.turn_to(id, inlets),
            Movement::CopyInitial => self.copy_initial(id),
            Movement::Ready => self.device_ready(id),
            Movement::Entered { list, stage } => self.entered(id, list, stage),
            Movement::Suspended => self.set_state(id, State::Suspended),
            Movement::Resumed => self.set_state(id, State::Running),
            Movement::Ended => self.ended(id),
        }
    }

    fn send(&mut self, id: u64, scripts: Vec<(SourceId, Vec<Op>)>) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        instance.outstanding = scripts.len();
        instance.captured.clear();
        let epoch = instance.epoch;
        for (source, ops) in scripts {
            self.submit(source, ops, Purpose::Sequence { instance: id, epoch });
        }
    }

    fn swap_tables(&mut self, id: u64, mut sources: Vec<SourceId>) {
        sources.sort();
        sources.dedup();
        let scripts = sources.into_iter().map(|source| (source, vec![self.table_op(source)])).collect();
        self.send(id, scripts);
    }

    fn turn_to(&mut self, id: u64, inlets: Vec<Inlet>) {
        let readers = inlets.iter().map(|i| i.reader).collect();
        for inlet in inlets {
            self.adopt(inlet);
        }
        self.swap_tables(id, readers);
    }

    /// A kernel has carried out a script of this instance's sequence.
    pub fn sequence_done(&mut self, id: u64, epoch: u64, source: SourceId, captured: Vec<u8>) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        if instance.epoch != epoch {
            return;
        }
        if !captured.is_empty() {
            instance.captured.push((source, captured));
        }
        instance.outstanding = instance.outstanding.saturating_sub(1);
        self.proceed(id);
    }

    fn set_state(&mut self, id: u64, state: State) {
        if let Some(instance) = self.instances.get_mut(&id) {
            instance.state = state;
        }
    }

    /// Sets what starts as a copy: the values that the script before captured, in every image.
    fn copy_initial(&mut self, id: u64) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let captured: Vec<u8> = std::mem::take(&mut instance.captured).into_iter().flat_map(|(_, bytes)| bytes).collect();
        let Some(owner) = instance.owner.clone() else { return };
        let copies = self.logical[&owner].copies.clone();
        let mut scripts: Vec<(SourceId, Vec<Op>)> = Vec::new();
        let mut offset = 0;
        for (to, _) in copies {
            let size = self.svvs[&to].size;
            let Some(bytes) = captured.get(offset..offset + size) else { continue };
            offset += size;
            for (source, op) in self.store_everywhere(&to, bytes) {
                match scripts.iter_mut().find(|(s, _)| *s == source) {
                    Some((_, ops)) => ops.push(op),
                    None => scripts.push((source, vec![op])),
                }
            }
        }
        self.send(id, scripts);
    }

    fn device_ready(&mut self, id: u64) {
        let owner = self.instances.get(&id).and_then(|i| i.owner.clone());
        if let Some(device) = owner.and_then(|o| self.logical.get_mut(&o)) {
            device.state = DeviceState::Enabled;
        }
    }

    /// The stage is entered: its wait starts to count; a stage that is over at once leads on.
    pub fn entered(&mut self, id: u64, list: usize, stage: usize) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let moved = instance.list != list;
        (instance.list, instance.stage) = (list, stage);
        let planned = &instance.plan.lists[list].stages[stage];
        instance.active = planned.active.clone();
        let running_ns = instance.running.at(now_ns);
        instance.wait_until_ns = match planned.wait {
            Some(Wait::Time(time_ns)) => Some(running_ns + time_ns),
            _ => None,
        };
        let idle = planned.active.is_empty();
        let (next_stage, through) = (matches!(planned.wait, Some(Wait::Idle)) && idle, planned.wait.is_none() && idle);
        if moved {
            let (name, text) = (instance.name.clone(), format!("command list '{}'", instance.plan.lists[list].name));
            self.log.add(now_ns, "transition", &name, text);
        }
        if next_stage {
            self.go(id, list, stage + 1);
        } else if through {
            self.end_by_name(id, "completed", String::new());
        }
    }

    /// What a reaction has done already is known here too.
    pub fn reacted(&mut self, id: u64, kernel_stage: u16) {
        let Some(instance) = self.instances.get(&id) else { return };
        let (list, stage) = instance.list_stage(kernel_stage);
        self.entered(id, list, stage);
    }

    /// The supervisor moves the instance to (list, stage). Its process is frozen, by the kernel or by a claim.
    pub fn go(&mut self, id: u64, list: usize, stage: usize) {
        let devices = self.device_sources();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let now = instance.installed.process.now().0;
        // Within a list it is the same process: conditions that came meanwhile still count.
        let generation = if instance.list == list && stage > 0 {
            instance.installed.process.claim(now);
            instance.installed.process.now().0
        } else {
            instance.installed.process.claim(now);
            instance.installed.process.now().0.max(now + 1)
        };
        instance.generation = generation;
        let mut builder = crate::sequence::Builder::default();
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &devices };
        of.enter(&mut builder, &instance.active, list, stage, Some(generation));
        self.replace_sequence(id, builder.finish());
    }
}
