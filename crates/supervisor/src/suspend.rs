// SPDX-License-Identifier: Apache-2.0
//! Suspension: running time stands still, and goes on.
use crate::core::Core;
use crate::instance::{State, reached};
use crate::refuse::invalid_state;
use crate::sequence::{Builder, Movement};
use kernel::Op;
use model::plan::Due;
use model::refusal::Refusals;

impl Core {
    /// Stops the blocks without synchronous inputs; running time stands still. It is suspended when the kernels have done it; what is
    /// under way in a command list is carried out first.
    pub fn suspend(&mut self, id: u64) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        if instance.state != State::Running || instance.ending.is_some() || instance.departure.is_some() {
            let state = if instance.departure.is_some() { "ending" } else { instance.state.name() };
            return Err(invalid_state(&format!("'{}'", instance.name), state, "suspend", "only a running instance can be suspended"));
        }
        if instance.is_under_way() || !self.take_process(id, false) {
            self.instances.get_mut(&id).expect("found above").suspending = true;
        } else {
            self.hold(id);
        }
        Ok(())
    }

    /// Suspends an instance whose process was taken: intervals stop, what they drive runs dry, then what others drive stops.
    pub fn hold(&mut self, id: u64) {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&id) else { return };
        instance.suspending = false;
        instance.running.hold(now_ns);
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
        for &source in &installed.sources {
            builder.add(source, Op::StopClock(installed.process.clone()));
        }
        builder.then(Movement::Suspended);
        self.append_sequence(id, builder.finish());
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
        for &source in &instance.installed.sources {
            builder.add(source, Op::ResumeClock(process.clone()));
        }
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
}
