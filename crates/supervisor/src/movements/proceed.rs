// SPDX-License-Identifier: Apache-2.0
//! Execution of sequences: one movement at a time, each after the previous one has been acknowledged.
use crate::alarms::causes::alarm_enabled;
use crate::instances::course::Course;
use crate::instances::installed_verb::InstalledVerb;
use crate::instances::instance::{Life, Rest, State};
use crate::movements::sequence::{Builder, Movement, by_source};
use crate::starting::opening::{make_up, set_rest, wake};
use crate::starting::operating::looks;
use kernel::{Cell, SourceId, TakeResult};
use model::SystemCondition;
use model::plan::{PlannedCommand, Wait};

/// Interval for checking whether a machine follows its commands yet, ns.
const LOOK_NS: i64 = 1_000_000;

impl Course<'_> {
    /// Replaces the remaining sequence, except for movements that the system needs.
    pub fn replace_sequence(&mut self, movements: impl IntoIterator<Item = Movement>) {
        let id = self.id;
        if let Some(instance) = self.core.instances.get_mut(&id) {
            instance.work.sequence.retain(Movement::is_structural);
            instance.work.sequence.extend(movements);
            instance.work.is_through = false;
            instance.work.look_ns = None;
            if !instance.work.structural {
                instance.work.outstanding = 0;
                instance.work.awaited.clear();
                instance.work.epoch += 1;
                instance.work.captured.clear();
            }
        }
        self.proceed();
    }

    /// Appends movements to the sequence.
    pub fn append_sequence(&mut self, movements: impl IntoIterator<Item = Movement>) {
        let id = self.id;
        if let Some(instance) = self.core.instances.get_mut(&id) {
            instance.work.sequence.extend(movements);
        }
        self.proceed();
    }

    /// Executes all movements that can proceed now.
    pub fn proceed(&mut self) {
        let id = self.id;
        while let Some(instance) = self.core.instances.get_mut(&id) {
            if instance.work.outstanding > 0 || instance.work.look_ns.is_some() {
                return;
            }
            let Some(movement) = instance.next_movement() else { return };
            instance.work.structural = movement.is_structural();
            self.carry_out(movement);
        }
    }

    fn carry_out(&mut self, movement: Movement) {
        let id = self.id;
        match movement {
            Movement::Scripts(scripts) => self.core.carrier().send(id, scripts),
            Movement::Opening { scripts, ends, .. } => {
                self.note_through(ends);
                self.core.carrier().send(id, scripts);
            }
            Movement::Tables(sources) => self.core.carrier().swap_tables(id, sources),
            Movement::Together { source, ops, ends } => {
                self.note_through(ends);
                self.core.carrier().swap_and_go_on(id, source, ops);
            }
            Movement::Follow { sources, follows } => {
                let scripts = self.core.carrier().follow_ops(sources, follows);
                self.core.carrier().send(id, scripts);
            }
            Movement::Inbound(inlets) => self.core.carrier().turn_to(id, inlets),
            Movement::Home(cells) => {
                let mut movements = self.core.carrier().bring_home(id, &cells);
                let rows = self.core.renew_taps();
                if !rows.is_empty() {
                    movements.push(Movement::Tables(rows));
                }
                if let Some(instance) = self.core.instances.get_mut(&id) {
                    movements.into_iter().rev().for_each(|movement| instance.work.sequence.push_front(movement));
                }
            }
            Movement::Carry(carried) => self.core.carrier().carry(id, &carried),
            Movement::Arrive(carried) => self.core.carrier().arrive(id, &carried),
            Movement::Operating(cells) => self.await_operation(cells),
            Movement::CopyInitial => self.core.carrier().copy_initial(id),
            Movement::Ready => {
                if let Some(owner) = self.core.instances.get(&id).and_then(|i| i.owner.clone())
                    && self.core.registry.note_ready(&owner)
                {
                    alarm_enabled(self.core, &owner);
                }
            }
            Movement::Entered { list, stage } => self.entered(list, stage),
            Movement::Suspended => {
                if let Some(instance) = self.core.instances.get_mut(&id) {
                    // Keep the values of its channels for the resumption.
                    instance.life = Life::Suspended { held: std::mem::take(&mut instance.work.captured) };
                }
                self.go_on_after_pause();
            }
            Movement::Resumed => {
                if let Some(instance) = self.core.instances.get_mut(&id) {
                    instance.life = Life::Running(Rest::Unasked);
                }
                self.follow();
            }
            Movement::Ended => self.ended(),
        }
    }

    /// Proceeds if the values captured by the previous script show that every machine follows its commands; otherwise schedules another
    /// check.
    fn await_operation(&mut self, cells: Vec<(SourceId, Cell)>) {
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&self.id) else { return };
        let captured = std::mem::take(&mut instance.work.captured);
        let told: usize = captured.iter().map(|(_, bytes)| bytes.len()).sum();
        if told == cells.len() && captured.iter().flat_map(|(_, bytes)| bytes).all(|follows| *follows != 0) {
            return;
        }
        let look = Movement::Scripts(by_source(looks(&cells)));
        instance.work.sequence.push_front(Movement::Operating(cells));
        instance.work.sequence.push_front(look);
        instance.work.look_ns = Some(now_ns + LOOK_NS);
    }

    fn note_through(&mut self, ends: bool) {
        if let Some(instance) = self.core.instances.get_mut(&self.id) {
            instance.work.is_through = ends;
        }
    }

    /// Records that a stage has been entered: its wait starts. If the stage is already complete, it leads to the next one.
    pub fn entered(&mut self, list: usize, stage: usize) {
        let id = self.id;
        self.enter_stage(list, stage, stage == 0);
        if let Some(instance) = self.core.instances.get_mut(&id).filter(|i| i.is_in_ending() && i.findings.captures.is_pending()) {
            let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
            instance.findings.captures.take_scripts(&of, std::mem::take(&mut instance.work.captured));
        } else if let Some(instance) = self.core.instances.get_mut(&id).filter(|i| i.findings.way.captures.is_pending()) {
            let of = InstalledVerb { plan: &instance.plan, installed: &instance.installed, devices: &self.core.registry.physical };
            instance.findings.way.captures.take_scripts(&of, std::mem::take(&mut instance.work.captured));
        }
        let turned = self.core.carrier().follow_writers(id);
        if !turned.is_empty() {
            self.append_sequence(turned);
        }
        self.rest_at_last();
        let Some(instance) = self.core.instances.get(&id) else { return };
        if instance.times.running.is_held() {
            return;
        }
        if matches!(instance.life, Life::Running(Rest::Due)) && self.take_process(false) {
            return self.hold();
        }
        self.follow();
    }

    /// Stores the position of the instance. `begins` is true if the list starts from its beginning, even if it is the same list again.
    fn enter_stage(&mut self, list: usize, stage: usize, begins: bool) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let (before, moved) = (instance.position.list, instance.position.list != list || (begins && instance.position.has_entered));
        instance.position.has_entered = true;
        (instance.position.list, instance.position.stage) = (list, stage);
        instance.position.target = (list, stage);
        let planned = &instance.plan.lists[list].stages[stage];
        instance.position.active = planned.active.clone();
        instance.position.wait_until_ns = match planned.wait {
            Some(Wait::Time(time_ns)) => Some(instance.times.running.at(now_ns) + time_ns),
            _ => None,
        };
        let commands = || instance.plan.lists.iter().flat_map(|l| &l.stages).flat_map(|s| &s.commands);
        // A device whose verb does not use `gpac.ready()` is ready as soon as its verb runs.
        let is_ready = instance.owner.is_some() && !commands().any(|c| matches!(c, PlannedCommand::Ready));
        let owner = instance.owner.clone();
        if moved {
            let lists = &instance.plan.lists;
            let (name, text) = (instance.name.clone(), format!("command list '{}' after '{}'", lists[list].name, lists[before].name));
            self.core.observation.log.add(now_ns, "transition", &name, text);
        }
        if let Some(owner) = owner.filter(|_| is_ready)
            && self.core.registry.note_ready(&owner)
        {
            alarm_enabled(self.core, &owner);
        }
    }

    /// Proceeds from a stage that is already complete.
    fn follow(&mut self) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let planned = &instance.plan.lists[instance.position.list].stages[instance.position.stage];
        if !planned.active.is_empty() || !matches!(planned.wait, None | Some(Wait::Idle)) {
            return;
        }
        let is_through = planned.wait.is_none();
        if let Some(cause) = instance.enters_again(now_ns) {
            if self.take_process(true) {
                self.end(cause);
            }
        } else if is_through {
            self.end_by(SystemCondition::Completed, String::new());
        } else if self.take_process(false) {
            let (list, stage) = (self.core.instances[&id].position.list, self.core.instances[&id].position.stage);
            self.go(list, stage + 1);
        }
    }

    /// Takes the process from the kernels, so that nothing advances it until a stage is entered, and updates the instance's position.
    /// Returns false if a kernel was faster and its event has not arrived yet. With `insist`, a process that a kernel has frozen is taken
    /// too, but never one that has ended.
    pub fn take_process(&mut self, insist: bool) -> bool {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return false };
        let (list, stage) = match instance.installed.process.take(instance.generation, insist) {
            TakeResult::Late => return false,
            TakeResult::Before => instance.position.target,
            TakeResult::From(stage) => {
                instance.findings.way.process_taken(instance.generation, instance.position.list);
                instance.list_stage(stage)
            }
        };
        instance.generation += 1;
        if (list, stage) != (instance.position.list, instance.position.stage) {
            self.enter_stage(list, stage, false);
        }
        true
    }

    /// Moves the instance to (list, stage). Its process must already have been taken.
    pub fn go(&mut self, list: usize, stage: usize) {
        self.go_from(Builder::default(), list, stage);
    }

    /// Moves the instance as [`Course::go`] does, after the operations in `builder`. A suspended instance resumes.
    pub fn go_from(&mut self, mut builder: Builder, list: usize, stage: usize) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        // Within a list the process is the same: conditions that occurred meanwhile still count.
        instance.generation += u32::from(stage == 0);
        instance.position.target = (list, stage);
        if instance.state() == State::Suspended || instance.times.running.is_held() {
            instance.life = Life::Running(Rest::Unasked);
            instance.times.running.go_on(now_ns);
            wake(&self.core.registry, &mut builder, &self.core.instances[&id], false);
        }
        let instance = &self.core.instances[&id];
        if instance.leaving.departure.is_some() {
            set_rest(&self.core.registry, &mut builder, instance, false);
        }
        if !instance.work.sequence.iter().any(|movement| matches!(movement, Movement::Home(_))) {
            builder.homes.clone_from(&instance.installed.homes);
        }
        make_up(&self.core.registry, &mut builder, instance);
        let of = instance.installed_verb(&self.core.registry.physical);
        // Also switch off everything that scripts on their way will switch on.
        let all: Vec<usize> = (0..instance.plan.activations.len()).collect();
        of.enter(&mut builder, &all, list, stage, Some(instance.generation));
        self.replace_sequence(builder.finish());
    }
}
