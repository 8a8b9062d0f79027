// SPDX-License-Identifier: Apache-2.0
//! Carrying sequences out: one movement after the other, each when the one before has been acknowledged.
use crate::core::{Core, DeviceState, Purpose};
use crate::end::take_captured;
use crate::instance::{Cause, State};
use crate::sequence::{Builder, Carried, Inlet, Movement, Object, by_source};
use crate::stages::Verbatim;
use kernel::{Cell, Op, SourceId, Taken};
use model::plan::{PlannedCommand, Wait};
use std::collections::BTreeMap;

impl Core {
    /// Puts a new sequence in the place of what is left of the one before, but for what the system needs of that.
    pub fn replace_sequence(&mut self, id: u64, movements: impl IntoIterator<Item = Movement>) {
        if let Some(instance) = self.instances.get_mut(&id) {
            instance.sequence.retain(Movement::is_structural);
            instance.sequence.extend(movements);
            if !instance.structural {
                instance.outstanding = 0;
                instance.awaited.clear();
                instance.epoch += 1;
                instance.captured.clear();
            }
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
            instance.structural = movement.is_structural();
            self.carry_out(id, movement);
        }
    }

    fn carry_out(&mut self, id: u64, movement: Movement) {
        match movement {
            Movement::Scripts(scripts) => self.send(id, scripts),
            Movement::Tables(sources) => self.swap_tables(id, sources),
            Movement::Follow { sources, follows } => {
                let scripts = self.follow_ops(sources, follows);
                self.send(id, scripts);
            }
            Movement::Inbound(inlets) => self.turn_to(id, inlets),
            Movement::Home(cells) => self.bring_home(id, &cells),
            Movement::Carry(carried) => self.carry(id, &carried),
            Movement::Arrive(carried) => self.arrive(id, &carried),
            Movement::CopyInitial => self.copy_initial(id),
            Movement::Ready => self.device_ready(id),
            Movement::Entered { list, stage } => self.entered(id, list, stage),
            Movement::Suspended => {
                self.suspended(id);
                self.go_on_after_pause(id);
            }
            Movement::Resumed => {
                self.set_state(id, State::Running);
                self.follow(id);
            }
            Movement::Ended => self.ended(id),
        }
    }

    fn send(&mut self, id: u64, scripts: Vec<(SourceId, Vec<Op>)>) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        // One that is lost carries it out if it comes back.
        instance.awaited.clear();
        instance.awaited.extend(scripts.iter().map(|(source, _)| *source).filter(|source| !self.lost.contains(source)));
        instance.outstanding = instance.awaited.len();
        instance.sent_ns = now_ns;
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
        let Some(at) = instance.awaited.iter().position(|awaited| *awaited == source).filter(|_| instance.epoch == epoch) else { return };
        instance.awaited.swap_remove(at);
        if !captured.is_empty() {
            instance.captured.push((source, captured));
        }
        instance.outstanding = instance.awaited.len();
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
        let mut stores = Vec::new();
        let mut offset = 0;
        for (to, _) in copies {
            let size = self.svvs[&to].size;
            let Some(bytes) = captured.get(offset..offset + size) else { continue };
            offset += size;
            stores.extend(self.store_everywhere(&to, bytes));
        }
        self.send(id, by_source(stores));
    }

    fn device_ready(&mut self, id: u64) {
        let owner = self.instances.get(&id).and_then(|i| i.owner.clone());
        if let Some(device) = owner.and_then(|o| self.logical.get_mut(&o)).filter(|device| device.state == DeviceState::Enabling) {
            device.state = DeviceState::Enabled;
            let device = self.instances[&id].owner.clone().expect("it has one");
            self.alarm_enabled(&device);
        }
    }

    /// The stage is entered: its wait starts to count; a stage that is over at once leads on.
    pub fn entered(&mut self, id: u64, list: usize, stage: usize) {
        self.is_in(id, list, stage, stage == 0);
        if let Some(instance) = self.instances.get_mut(&id).filter(|i| i.is_in_ending() && !i.capturing.is_empty()) {
            let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
            take_captured(&of, &mut instance.outputs, &mut instance.capturing, std::mem::take(&mut instance.captured));
        }
        let turned = self.follow_writers(id);
        if !turned.is_empty() {
            self.append_sequence(id, turned);
        }
        self.rest_at_last(id);
        let Some(instance) = self.instances.get(&id) else { return };
        if instance.running.is_held() {
            return;
        }
        if instance.suspending && self.take_process(id, false) {
            return self.hold(id);
        }
        self.follow(id);
    }

    /// Where the instance is now. `begins`: the list begins, also where it is the one that ran before.
    fn is_in(&mut self, id: u64, list: usize, stage: usize, begins: bool) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let (before, moved) = (instance.list, instance.list != list || (begins && instance.has_entered));
        instance.has_entered = true;
        (instance.list, instance.stage) = (list, stage);
        instance.target = (list, stage);
        let planned = &instance.plan.lists[list].stages[stage];
        instance.active = planned.active.clone();
        instance.wait_until_ns = match planned.wait {
            Some(Wait::Time(time_ns)) => Some(instance.running.at(now_ns) + time_ns),
            _ => None,
        };
        let commands = || instance.plan.lists.iter().flat_map(|l| &l.stages).flat_map(|s| &s.commands);
        // A device whose verb does not say when it is ready is so as soon as its verb runs.
        let is_ready = instance.owner.is_some() && !commands().any(|c| matches!(c, PlannedCommand::Ready));
        if moved {
            let lists = &instance.plan.lists;
            let (name, text) = (instance.name.clone(), format!("command list '{}' after '{}'", lists[list].name, lists[before].name));
            self.log.add(now_ns, "transition", &name, text);
        }
        if is_ready {
            self.device_ready(id);
        }
    }

    /// Goes on from a stage that is over at once.
    fn follow(&mut self, id: u64) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let planned = &instance.plan.lists[instance.list].stages[instance.stage];
        if !planned.active.is_empty() || !matches!(planned.wait, None | Some(Wait::Idle)) {
            return;
        }
        let is_through = planned.wait.is_none();
        instance.entries = if instance.entries.0 == now_ns { (now_ns, instance.entries.1 + 1) } else { (now_ns, 1) };
        if instance.entries.1 > ENTRIES_AN_INSTANT {
            let condition = instance.condition("fault").expect("it is in every verb");
            let message = format!(
                "more than {ENTRIES_AN_INSTANT} stages in one instant: its command lists lead to each other without time passing; let one of them wait"
            );
            if self.take_process(id, true) {
                self.end(id, Cause { condition, block: None, value: None, message, time_ns: now_ns, asked_for: false });
            }
        } else if is_through {
            self.end_by_name(id, "completed", String::new());
        } else if self.take_process(id, false) {
            let (list, stage) = (self.instances[&id].list, self.instances[&id].stage);
            self.go(id, list, stage + 1);
        }
    }

    /// Takes the process from the kernels: nothing moves it until a stage is entered, and the instance knows where it was. False
    /// where a kernel was faster and its event is on the way (`insist`: a freeze is taken over, an end never).
    pub fn take_process(&mut self, id: u64, insist: bool) -> bool {
        let Some(instance) = self.instances.get_mut(&id) else { return false };
        let (list, stage) = match instance.installed.process.take(instance.generation, insist) {
            Taken::Late => return false,
            Taken::Before => instance.target,
            Taken::From(stage) => instance.list_stage(stage),
        };
        instance.generation += 1;
        if (list, stage) != (instance.list, instance.stage) {
            self.is_in(id, list, stage, false);
        }
        true
    }

    /// The supervisor moves the instance to (list, stage). Its process was taken.
    pub fn go(&mut self, id: u64, list: usize, stage: usize) {
        self.go_from(id, Builder::default(), list, stage);
    }

    /// The same, behind what `builder` holds. A suspended instance runs again.
    pub fn go_from(&mut self, id: u64, mut builder: Builder, list: usize, stage: usize) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        // Within a list it is the same process: conditions that came meanwhile still count.
        instance.generation += u32::from(stage == 0);
        instance.target = (list, stage);
        if instance.state == State::Suspended || instance.running.is_held() {
            (instance.state, instance.suspending) = (State::Running, false);
            instance.running.go_on(now_ns);
            self.wake(&mut builder, &self.instances[&id], false);
        }
        let instance = &self.instances[&id];
        if instance.departure.is_some() {
            self.set_rest(&mut builder, instance, false);
        }
        if !instance.sequence.iter().any(|movement| matches!(movement, Movement::Home(_))) {
            builder.homes.clone_from(&instance.installed.homes);
        }
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        // What scripts on their way still switch on goes off too.
        let all: Vec<usize> = (0..instance.plan.activations.len()).collect();
        of.enter(&mut builder, &all, list, stage, Some(instance.generation));
        self.replace_sequence(id, builder.finish());
    }

    /// What goes to another source with a cell: (cell there, cell here).
    fn carried(&self, id: u64, Carried { object, from, to }: &Carried) -> Vec<(Cell, Cell)> {
        let pair = |cells: &BTreeMap<SourceId, Cell>| cells.get(from).cloned().zip(cells.get(to).cloned());
        match object {
            Object::Svv(name) => {
                let Some(svv) = self.svvs.get(name) else { return Vec::new() };
                pair(&svv.cells).into_iter().chain(pair(&svv.stamps)).chain(svv.carried_windows(*from, *to)).collect()
            }
            Object::Private(cell) => {
                let Some(installed) = self.instances.get(&id).map(|instance| &instance.installed) else { return Vec::new() };
                let stamps = installed.own_stamps.get(cell).and_then(pair);
                pair(&installed.cells[*cell]).into_iter().chain(stamps).chain(installed.crossing_windows(*cell, *from, *to)).collect()
            }
        }
    }

    /// Captures the values that go to another source.
    fn carry(&mut self, id: u64, carried: &[Carried]) {
        let cells = |c: &Carried| self.carried(id, c).into_iter().map(|(from, _)| from).collect();
        let captures = by_source(carried.iter().map(|c| (c.from, Op::Capture(cells(c)))));
        self.send(id, captures);
    }

    /// Stores the values that come from another source.
    fn arrive(&mut self, id: u64, carried: &[Carried]) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        let mut captured = std::mem::take(&mut instance.captured);
        let mut stores = Vec::new();
        for c in carried {
            let Some((_, bytes)) = captured.iter_mut().find(|(source, _)| *source == c.from) else { continue };
            for (_, cell) in self.carried(id, c) {
                let value: Box<[u8]> = bytes.drain(..cell.len().min(bytes.len())).collect();
                // What came to be between the two scripts was not captured.
                if value.len() == cell.len() {
                    stores.push((c.to, Op::Store(cell, value)));
                }
            }
        }
        self.send(id, by_source(stores));
    }
}

/// More stages than these in one instant are a loop.
const ENTRIES_AN_INSTANT: u32 = 10_000;
