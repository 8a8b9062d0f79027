// SPDX-License-Identifier: Apache-2.0
//! Suspension: running time stands still, and goes on. A verb says what its actuators do meanwhile: the last commands stay, the
//! channels that it writes go to their safe values, or its blocks come to rest first.
use crate::core::Core;
use crate::instance::{Instance, State, reached};
use crate::refuse::invalid_state;
use crate::sequence::{Builder, Movement};
use crate::stages::Verbatim;
use kernel::Op;
use model::plan::{Due, PlannedSuspend};
use model::refusal::Refusals;

impl Instance {
    /// What is set while the instance comes to rest, and the condition that tells that it has, where its block is active.
    fn comes_to_rest(&self) -> bool {
        self.plan.suspend.holdings().iter().any(|holding| self.is_active(holding.until.0))
    }

    fn is_active(&self, block: usize) -> bool {
        self.active.iter().any(|(active, _)| *active == self.plan.blocks[block].activation)
    }

    /// True from the call that suspends it until it begins to stand still.
    pub fn is_coming_to_rest(&self) -> bool {
        self.suspending || self.resting_until_ns.is_some()
    }

    /// True for a condition that an instance waits for which comes to rest: it has come.
    pub fn rests_at(&mut self, block: Option<usize>, item: u8) -> bool {
        let mut holdings = self.plan.suspend.holdings().iter();
        let found = holdings.find(|holding| block == Some(holding.until.0) && usize::from(item) == holding.until.1);
        let Some(until) = found.map(|holding| holding.until).filter(|_| self.resting_until_ns.is_some()) else { return false };
        if !self.rested.contains(&until) {
            self.rested.push(until);
        }
        true
    }

    /// True where everything rests that is to come to rest and is active.
    fn has_come_to_rest(&self) -> bool {
        let mut holdings = self.plan.suspend.holdings().iter();
        holdings.all(|holding| !self.is_active(holding.until.0) || self.rested.contains(&holding.until))
    }
}

impl Core {
    /// Stops the blocks without synchronous inputs; running time stands still. It is suspended when the kernels have done it; what is
    /// under way in a command list is carried out first.
    pub fn suspend(&mut self, id: u64) -> Result<(), Refusals> {
        let now_ns = self.host.now_ns();
        let instance = self.instance(id)?;
        if instance.state != State::Running || instance.ending.is_some() || instance.departure.is_some() {
            let state = if instance.departure.is_some() { "ending" } else { instance.state.name() };
            return Err(invalid_state(&format!("'{}'", instance.name), state, "suspend", "only a running instance can be suspended"));
        }
        if instance.comes_to_rest() {
            let ops = self.rest_ops(instance, true);
            let instance = self.instances.get_mut(&id).expect("found above");
            instance.resting_until_ns = Some(instance.running.at(now_ns) + instance.plan.ending.limit_ns);
            instance.rested.clear();
            self.append_sequence(id, ops);
        } else {
            self.rest(id);
        }
        Ok(())
    }

    /// It may stand still now: at once, or when what is under way is through.
    pub fn rest(&mut self, id: u64) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        instance.resting_until_ns = None;
        if instance.is_under_way() || !self.take_process(id, false) {
            self.instances.get_mut(&id).expect("found above").suspending = true;
        } else {
            self.hold(id);
        }
    }

    /// What was to come to rest has done so or is no longer active, or the time for that is over: it is suspended.
    pub fn rest_at_last(&mut self, id: u64) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get(&id) else { return };
        let is_over = instance.resting_until_ns.is_some_and(|until| instance.running.at(now_ns) >= until || instance.has_come_to_rest());
        if is_over {
            self.rest(id);
        }
    }

    /// What sets or clears the port that makes the instance come to rest.
    fn rest_ops(&self, instance: &Instance, is_set: bool) -> impl IntoIterator<Item = Movement> + use<> {
        let mut builder = Builder::default();
        self.set_rest(&mut builder, instance, is_set);
        builder.finish()
    }

    pub fn set_rest(&self, builder: &mut Builder, instance: &Instance, is_set: bool) {
        for holding in instance.plan.suspend.holdings() {
            self.store_target(builder, instance, &holding.set, &[u8::from(is_set)]);
        }
    }

    /// An instance that was on its way to be suspended is not any more: it ends.
    pub fn rise(&mut self, id: u64) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        instance.suspending = false;
        if instance.resting_until_ns.take().is_some() {
            let ops = self.rest_ops(&self.instances[&id], false);
            self.append_sequence(id, ops);
        }
    }

    /// Suspends an instance whose process was taken: intervals stop, what they drive runs dry, then what others drive stops.
    pub fn hold(&mut self, id: u64) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        instance.suspending = false;
        instance.running.hold(now_ns);
        instance.held.clear();
        let (plan, installed) = (&instance.plan, &instance.installed);
        let is_outside = |activation: usize| plan.activations[activation].blocks.iter().any(|b| !plan.blocks[*b].external_drivers.is_empty());
        let mut builder = Builder::default();
        for outside in [false, true] {
            for (activation, _) in &instance.active {
                let is_interval = matches!(plan.activations[*activation].due, Due::Interval);
                if if outside { is_outside(*activation) && !is_interval } else { is_interval } {
                    builder.add(installed.activation_source[*activation], Op::Off(installed.activations[*activation].clone()));
                }
            }
            builder.barrier();
        }
        let of = Verbatim { plan, installed, devices: &self.physical };
        for &source in &installed.sources {
            if plan.suspend == PlannedSuspend::Safe {
                for (device, channels) in of.channels_in(source) {
                    builder.add(source, Op::Capture(channels.iter().map(|c| device.cell(usize::from(*c))).collect()));
                    builder.add(source, Op::Safe { device, channels });
                }
            }
            builder.add(source, Op::StopClock(installed.process.clone()));
        }
        builder.then(Movement::Suspended);
        self.append_sequence(id, builder.finish());
    }

    /// The kernels have suspended it: what its channels held is kept for the time when it goes on.
    pub fn suspended(&mut self, id: u64) {
        let Some(instance) = self.instances.get_mut(&id) else { return };
        instance.state = State::Suspended;
        instance.held = std::mem::take(&mut instance.captured);
    }

    /// Goes on where it stood.
    pub fn resume(&mut self, id: u64) -> Result<(), Refusals> {
        let now_ns = self.host.now_ns();
        let instance = self.instance(id)?;
        if instance.state != State::Suspended || instance.ending.is_some() {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state.name(), "resume", "only a suspended instance can be resumed"));
        }
        self.refuse_emergency("resume", &instance.name)?;
        if instance.is_under_way() {
            return Ok(());
        }
        let process = instance.installed.process.clone();
        let mut builder = Builder::default();
        self.wake(&mut builder, instance, true);
        builder.barrier();
        let (stage, generation) = (reached(&instance.plan, instance.list, instance.stage), Some(instance.generation));
        builder.add(instance.installed.sources[0], Op::Stage { process, stage, generation });
        for (activation, every) in &instance.active {
            builder.add(instance.installed.activation_source[*activation], Op::On(instance.installed.activations[*activation].clone(), *every));
        }
        builder.then(Movement::Resumed);
        let instance = self.instances.get_mut(&id).expect("found above");
        instance.running.go_on(now_ns);
        self.append_sequence(id, builder.finish());
        Ok(())
    }

    /// Operations that let a suspended instance go on: its channels are its own again, its clock runs. `restores`: the channels hold
    /// what they held before, within their slew limits; else they stay safe until a block stores into them.
    pub fn wake(&self, builder: &mut Builder, instance: &Instance, restores: bool) {
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        for &source in &instance.installed.sources {
            if instance.plan.suspend == PlannedSuspend::Safe {
                let held = instance.held.iter().find(|(from, _)| *from == source).map_or(&[][..], |(_, bytes)| bytes);
                let mut at = 0;
                for (device, channels) in of.channels_in(source) {
                    for cell in channels.iter().map(|c| device.cell(usize::from(*c))) {
                        if let Some(bytes) = held.get(at..at + cell.len()).filter(|_| restores) {
                            builder.add(source, Op::Store(cell.clone(), bytes.into()));
                        }
                        at += cell.len();
                    }
                    builder.add(source, Op::Engage { device, channels });
                }
            }
            builder.add(source, Op::ResumeClock(instance.installed.process.clone()));
        }
        self.set_rest(builder, instance, false);
    }
}
