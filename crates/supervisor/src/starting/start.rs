// SPDX-License-Identifier: Apache-2.0
//! Starts: their checks, and everything from the claims to the end of the initial list's first stage.
use crate::claims::claiming::Admission;
use crate::core::Core;
use crate::instances::course::Course;
use crate::instances::instance::{Instance, Life, Limits, Rest, RunningTime, State};
use crate::instances::table::Request;
use crate::movements::sequence::Movement;
use crate::processors::farewell;
use crate::refuse::{invalid_state, refuse};
use crate::registry::{DeviceState, Registry};
use crate::starting::opening::opening;
use crate::starting::psi::{Psi, psi};
use crate::stopping::absent_devices::check_devices;
use crate::stopping::ages::check_age;
use indexmap::IndexMap;
use model::configuration::Configuration;
use model::refusal::{Class, Refusal, Refusals};
use model::value::Value;

impl Core {
    /// Checks the preconditions of a start: no emergency stop, a mode that permits it, enabled devices, running sources.
    pub fn check_start(&self, instance: &Instance) -> Result<(), Refusals> {
        self.safety.emergency.refuse("start", &instance.name)?;
        self.safety.modes.check(instance, &self.registry)?;
        check_enabled(&self.registry, instance)?;
        check_sources(self, instance)?;
        check_devices(&self.registry, instance)
    }

    /// Begins a start whose claims are all free: takes the claims and begins the initial list.
    pub fn begin(&mut self, request: Request) {
        let mut movements = self.prepare(&request);
        farewell::bid(&self.remote, &self.registry, &self.instances[&request.id]);
        if !self.hold_back(&request) {
            movements.extend(opening(&self.registry, &self.instances[&request.id], &request.stores));
        }
        self.course(request.id).append_sequence(movements);
    }

    /// Records the start in all state of the supervisor, and returns the kernel work that precedes it.
    pub fn prepare(&mut self, request: &Request) -> Vec<Movement> {
        let (id, stores, limits) = (request.id, &request.stores, request.limits);
        let Some(plan) = self.instances.get(&id).map(|i| i.plan.clone()) else { return Vec::new() };
        for claim in &plan.claims {
            self.registry.claims.insert(claim.clone(), id);
        }
        self.carrier().keep_stored(&plan, stores);
        let mut movements = self.carrier().take_over(id);
        let rows = self.renew_taps();
        if !rows.is_empty() {
            movements.push(Movement::Tables(rows));
        }
        let now_ns = self.host.now_ns();
        let overruns = self.instances.overruns(&self.host, id);
        let instance = self.instances.get_mut(&id).expect("found above");
        instance.life = Life::Running(Rest::Unasked);
        instance.times.started_ns = now_ns;
        instance.times.running = RunningTime::start(now_ns);
        instance.times.limits = limits;
        instance.inputs.clone_from(&request.inputs);
        instance.times.overruns_before = overruns;
        instance.generation = instance.installed.process.now().0 + 1;
        movements
    }
}

impl Course<'_> {
    /// Starts the instance (claims, ψ, initial command list), or queues the start if the devices that it needs declare so. If it is
    /// refused, nothing has changed.
    pub fn start(&mut self, values: &IndexMap<String, Value>, limits: Limits, configuration: &Configuration) -> Result<(), Refusals> {
        let id = self.id;
        let instance = self.core.instances.known(id)?;
        if !matches!(instance.state(), State::Created | State::Ended) {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state().name(), "start", "wait for it or halt it first"));
        }
        self.core.check_start(instance)?;
        check_age(self.core, instance, limits.age_max_ns)?;
        let Psi { stores, inputs } = psi(&instance.plan, values, configuration)?;
        let request = Request { id, stores, inputs, limits };
        let admission = self.core.arbitrate(&request)?;
        let instance = self.core.instances.get_mut(&id).expect("found above");
        instance.renew();
        let name = instance.name.clone();
        let now_ns = self.core.host.now_ns();
        match admission {
            Admission::Now => {
                self.core.observation.log.add(now_ns, "start", &name, "");
                self.core.begin(request);
            }
            Admission::Later(behind) => {
                self.core.observation.log.add(now_ns, "start", &name, format!("queued behind '{}'", behind.join("', '")));
                if let Some(instance) = self.core.instances.get_mut(&id) {
                    instance.life = Life::Queued;
                }
                self.core.instances.queue.push(request);
                self.core.serve_queue();
            }
        }
        Ok(())
    }
}

/// Checks that every logical device that the verb uses is enabled.
fn check_enabled(registry: &Registry, instance: &Instance) -> Result<(), Refusals> {
    let disabled: Refusals = (instance.plan.devices.iter())
        .filter(|d| registry.logical.get(*d).is_some_and(|l| l.state != DeviceState::Enabled))
        .map(|d| {
            let refusal = Refusal::new(Class::NotEnabled, format!("cannot start '{}': device '{d}' is not enabled", instance.name));
            refusal.end(format!("device '{d}'"), &None).remedy(format!("call enable() on '{d}' first"))
        })
        .collect();
    if disabled.is_empty() { Ok(()) } else { Err(disabled) }
}

/// Checks that none of the instance's sources was stopped by a fault.
fn check_sources(core: &Core, instance: &Instance) -> Result<(), Refusals> {
    for &source in &instance.installed.sources {
        if let Some(why) = core.safety.ended_for_good.get(&source) {
            let message = format!("cannot start '{}': {why}", instance.name);
            return Err(refuse(Class::InvalidState, message, "run it on another source until then"));
        }
        if core.safety.lost.contains(&source) {
            let source = core.registry.source_name(source);
            let message = format!("cannot start '{}': source '{source}' does not answer", instance.name);
            return Err(refuse(Class::InvalidState, message, "call reset() when its processor is available again"));
        }
        if core.host.statistics(source).stopped {
            let source = core.registry.source_name(source);
            return Err(refuse(
                Class::InvalidState,
                format!("cannot start '{}': source '{source}' was stopped by a fault in a block", instance.name),
                "fix the block and call reset()",
            ));
        }
    }
    Ok(())
}

impl Core {
    /// Holds a start back during a pause and logs this; returns true if the start was held back.
    fn hold_back(&mut self, request: &Request) -> bool {
        let now_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&request.id) else { return false };
        let is_held = self.safety.pause.hold_back(instance, &request.stores, now_ns);
        if is_held {
            self.observation.log.add(now_ns, "pause", &instance.name, "its start is deferred");
        }
        is_held
    }
}
