// SPDX-License-Identifier: Apache-2.0
//! The life of a verb instance while it runs: halt, new parameter values. A call that the state does not allow changes nothing.
use crate::core::Core;
use crate::instance::{Instance, State};
pub(crate) use crate::psi::{encode, named};
use crate::refuse::{invalid_state, refuse};
use crate::retune::Intervals;
use crate::sequence::Builder;
use indexmap::IndexMap;
use model::plan::Plan;
use model::refusal::{Class, Refusals};
use model::value::Value;

impl Core {
    /// An instance that is not deleted.
    pub fn instance(&self, id: u64) -> Result<&Instance, Refusals> {
        self.instances.get(&id).ok_or_else(|| invalid_state("the verb instance", "deleted", "use", "make a new one with new_instance(…)"))
    }

    /// Halts it: τ on `halted`, or the end. A second halt is immediate.
    pub fn halt(&mut self, id: u64) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        if !matches!(instance.state, State::Running | State::Suspended | State::Queued) {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state.name(), "halt", "only one that was started can be halted"));
        }
        if let Some(condition) = instance.condition("halted") {
            self.come(id, condition, String::new(), true);
        }
        Ok(())
    }

    /// New values of tunable input parameters of a running instance, as one publication between two firings; with new intervals, and the
    /// plan that has them.
    pub fn set(&mut self, id: u64, values: &IndexMap<String, Value>, tuned: Option<(Intervals, &Plan)>) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        instance.check_settable()?;
        let mut refusals = Vec::new();
        let mut stores = Vec::new();
        for (name, value) in values {
            match instance.plan.inputs.iter().find(|i| i.name == *name) {
                None => refusals.extend(crate::refuse::unknown("input parameter", name, instance.plan.inputs.iter().map(|i| i.name.as_str()))),
                Some(input) if !input.tunable => refusals.extend(refuse(
                    Class::InvalidState,
                    format!("input parameter '{name}' of '{}' is not tunable", instance.plan.verb),
                    "declare it with gpac.input(…, tunable=True), or give it at the next start",
                )),
                Some(input) => match encode(&input.type_text, &input.unit, value) {
                    Ok(bytes) => stores.extend(input.targets.iter().map(|t| (t.clone(), bytes.clone()))),
                    Err(refusal) => refusals.push(named(refusal, name)),
                },
            }
        }
        if !refusals.is_empty() {
            return Err(refusals);
        }
        let mut builder = Builder::default();
        for (target, bytes) in &stores {
            self.store_target(&mut builder, instance, target, bytes);
        }
        if let Some((tuned, plan)) = tuned {
            self.tune_intervals(id, tuned, plan, &mut builder);
        }
        self.append_sequence(id, builder.finish());
        Ok(())
    }

    /// Overruns counted so far in the sources of an instance.
    pub fn overruns(&self, id: u64) -> u64 {
        self.instances[&id].installed.sources.iter().map(|s| self.host.statistics(*s).overruns).sum()
    }
}
