// SPDX-License-Identifier: Apache-2.0
//! Suspension and resumption: the running time is held, and continues afterwards. A verb declares the behaviour of its actuators in the
//! meantime: driving outputs (an effort, a speed) take their idle values while all others keep their last commands, all channels take
//! their safe values, or its blocks first come to rest.
use crate::instances::course::Course;
use crate::instances::installed_verb::InstalledVerb;
use crate::instances::instance::Rest;
use crate::movements::sequence::{Builder, Movement};
use crate::refuse::invalid_state;
use crate::scripts::Purpose;
use crate::starting::opening::{rest_ops, wake};
use crate::suspension::idle_values::{idle_channels, idle_svvs};
use crate::transitions::stages::reached;
use kernel::{Op, SourceId};
use model::plan::{Due, PlannedSuspend};
use model::refusal::Refusals;

impl Course<'_> {
    /// Stops the blocks without synchronous inputs and holds the running time. The instance is suspended when the kernels have done so;
    /// if a step of a command list is running, it is completed first.
    pub fn suspend(&mut self) -> Result<(), Refusals> {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let instance = self.core.instances.known(id)?;
        if !instance.is_running() || instance.leaving.departure.is_some() {
            let state = if instance.leaving.departure.is_some() { "ending" } else { instance.state().name() };
            return Err(invalid_state(&format!("'{}'", instance.name), state, "suspend", "suspend only a running instance"));
        }
        if instance.comes_to_rest() {
            let ops = rest_ops(&self.core.registry, instance, true);
            let instance = self.core.instances.get_mut(&id).expect("found above");
            let until_ns = instance.times.running.at(now_ns) + instance.plan.ending.limit_ns;
            instance.rests(Rest::Coming { until_ns, rested: Vec::new() });
            self.append_sequence(ops);
        } else {
            self.rest();
        }
        Ok(())
    }

    /// Holds the instance: immediately, or after the running sequence.
    pub fn rest(&mut self) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        instance.rests(Rest::Unasked);
        if instance.is_under_way() || !self.take_process(false) {
            self.core.instances.get_mut(&id).expect("found above").rests(Rest::Due);
        } else {
            self.hold();
        }
    }

    /// Suspends an instance that has come to rest, or whose time limit for coming to rest has expired.
    pub fn rest_at_last(&mut self) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get(&id) else { return };
        let is_over = instance.resting_until_ns().is_some_and(|until| instance.times.running.at(now_ns) >= until || instance.has_come_to_rest());
        if is_over {
            self.rest();
        }
    }

    /// Cancels the suspension of an instance that was coming to rest, because the instance ends.
    pub fn rise(&mut self) {
        let id = self.id;
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        let was_coming = instance.resting_until_ns().is_some();
        instance.rests(Rest::Unasked);
        if was_coming {
            let ops = rest_ops(&self.core.registry, &self.core.instances[&id], false);
            self.append_sequence(ops);
        }
    }

    /// Suspends an instance whose process has been taken: first intervals stop, then the blocks that they drive run dry, then the blocks
    /// driven by others stop.
    pub fn hold(&mut self) {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let idle = self.idle_stores();
        let Some(instance) = self.core.instances.get_mut(&id) else { return };
        instance.rests(Rest::Unasked);
        instance.times.running.hold(now_ns);
        // Values captured by an earlier script are not those that its channels hold now.
        instance.work.captured.clear();
        instance.work.is_through = false;
        let (plan, installed) = (&instance.plan, &instance.installed);
        let is_outside = |activation: usize| plan.activations[activation].blocks.iter().any(|b| !plan.blocks[*b].external_drivers.is_empty());
        let mut builder = Builder::default();
        for outside in [false, true] {
            for (activation, _) in &instance.position.active {
                let is_interval = matches!(plan.activations[*activation].due, Due::Interval);
                if if outside { is_outside(*activation) && !is_interval } else { is_interval } {
                    builder.add(installed.activation_source[*activation], Op::Off(installed.activations[*activation].clone()));
                }
            }
            builder.barrier();
        }
        let of = InstalledVerb { plan, installed, devices: &self.core.registry.physical };
        idle.into_iter().for_each(|(source, op)| builder.add(source, op));
        for &source in &installed.sources {
            if plan.suspend == PlannedSuspend::Safe {
                for (device, channels) in of.channels_in(source) {
                    builder.add(source, Op::Capture(channels.iter().map(|c| device.cell(usize::from(*c))).collect()));
                    builder.add(source, Op::Safe { device, channels });
                }
            } else if plan.suspend.idles() {
                for (device, channels) in idle_channels(&self.core.registry, plan, source) {
                    builder.add(source, Op::Safe { device, channels });
                }
            }
            builder.add(source, Op::StopClock(installed.process.clone()));
        }
        builder.then(Movement::Suspended);
        self.append_sequence(builder.finish());
    }

    /// Returns the operations that store the idle values of the SVVs that the instance writes, unless its verb declares that it holds
    /// them.
    fn idle_stores(&mut self) -> Vec<(SourceId, Op)> {
        let Some(plan) = self.core.instances.get(&self.id).map(|instance| instance.plan.clone()) else { return Vec::new() };
        if plan.suspend == PlannedSuspend::HoldLast {
            return Vec::new();
        }
        let idle = idle_svvs(&self.core.registry, &self.core.instances, &plan);
        idle.into_iter().flat_map(|(svv, value)| self.core.carrier().store_everywhere(&svv, &value)).collect()
    }

    /// Sets the driving SVVs that the instance wrote to their idle values.
    pub fn make_idle(&mut self) {
        let Some(plan) = self.core.instances.get(&self.id).map(|instance| instance.plan.clone()) else { return };
        for (svv, value) in idle_svvs(&self.core.registry, &self.core.instances, &plan) {
            for (source, op) in self.core.carrier().store_everywhere(&svv, &value) {
                self.core.submit(source, vec![op], Purpose::Nothing);
            }
        }
    }

    /// Resumes the instance from its position.
    pub fn resume(&mut self) -> Result<(), Refusals> {
        let id = self.id;
        let now_ns = self.core.host.now_ns();
        let instance = self.core.instances.known(id)?;
        if !instance.is_suspended() {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state().name(), "resume", "resume only a suspended instance"));
        }
        self.core.safety.emergency.refuse("resume", &instance.name)?;
        if instance.is_under_way() {
            return Ok(());
        }
        let process = instance.installed.process.clone();
        let mut builder = Builder::default();
        wake(&self.core.registry, &mut builder, instance, true);
        builder.barrier();
        let (stage, generation) = (reached(&instance.plan, instance.position.list, instance.position.stage), Some(instance.generation));
        builder.add(instance.installed.sources[0], Op::Stage { process, stage, generation });
        for (activation, every) in &instance.position.active {
            builder.add(instance.installed.activation_source[*activation], Op::On(instance.installed.activations[*activation].clone(), *every));
        }
        builder.then(Movement::Resumed);
        let instance = self.core.instances.get_mut(&id).expect("found above");
        instance.times.running.go_on(now_ns);
        self.append_sequence(builder.finish());
        Ok(())
    }
}

impl Course<'_> {
    /// Resumes an instance suspended by a pause that has ended. If the instance is still being suspended, it resumes as soon as the
    /// suspension is complete.
    pub fn go_on_after_pause(&mut self) {
        let id = self.id;
        let Some(instance) = self.core.instances.get(&id) else { return };
        if instance.is_coming_to_rest() {
            self.rise();
            self.core.safety.pause.suspended.remove(&id);
        } else if instance.is_suspended() && !self.core.safety.pause.covers(&self.core.instances[&id]) && self.core.safety.pause.suspended.remove(&id) {
            // The instance is suspended and nothing is latched, so it resumes.
            let _resumed = self.resume();
        }
    }
}
