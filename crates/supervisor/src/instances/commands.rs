// SPDX-License-Identifier: Apache-2.0
//! Commands to a running verb instance: halt, and new parameter values. A call that the state does not permit changes nothing.
use crate::instances::course::Course;
use crate::instances::instance::{Intervals, State};
use crate::movements::sequence::Builder;
use crate::refuse::{invalid_state, refuse};
use crate::starting::opening::store_target;
use crate::starting::psi::{InputValues, encode, named};
use indexmap::IndexMap;
use model::SystemCondition;
use model::plan::Plan;
use model::refusal::{Class, Refusals};
use model::value::Value;

impl Course<'_> {
    /// Halts the instance: follows τ on `halted`, or ends it. A second halt is immediate.
    pub fn halt(&mut self) -> Result<(), Refusals> {
        let id = self.id;
        let instance = self.core.instances.known(id)?;
        if !matches!(instance.state(), State::Running | State::Suspended | State::Queued) {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state().name(), "halt", "halt only an instance that was started"));
        }
        if let Some(condition) = instance.system(SystemCondition::Halted) {
            self.come(condition, String::new(), true);
        }
        Ok(())
    }

    /// Sets new values of tunable input parameters of a running instance in one publication between two firings. If intervals change,
    /// `tuned` also contains the plan with the new intervals.
    pub fn set(&mut self, values: &IndexMap<String, Value>, tuned: Option<(Intervals, &Plan)>) -> Result<(), Refusals> {
        let id = self.id;
        let instance = self.core.instances.known(id)?;
        instance.check_settable()?;
        let mut refusals = Vec::new();
        let (mut stores, mut inputs) = (Vec::new(), InputValues::new());
        for (name, value) in values {
            match instance.plan.inputs.iter().enumerate().find(|(_, i)| i.name == *name) {
                None => refusals.extend(crate::refuse::unknown("input parameter", name, instance.plan.inputs.iter().map(|i| i.name.as_str()))),
                Some((_, input)) if !input.tunable => refusals.extend(refuse(
                    Class::InvalidState,
                    format!("input parameter '{name}' of '{}' is not tunable", instance.plan.verb),
                    "declare it with gpac.input(…, tunable=True), or give it at the next start",
                )),
                Some((index, input)) => match encode(&input.type_text, &input.unit, value) {
                    Ok(bytes) => {
                        stores.extend(input.targets.iter().map(|t| (t.clone(), bytes.clone())));
                        inputs.insert(index, bytes);
                    }
                    Err(refusal) => refusals.push(named(refusal, name)),
                },
            }
        }
        if !refusals.is_empty() {
            return Err(refusals);
        }
        let mut builder = Builder::default();
        for (target, bytes) in &stores {
            store_target(&self.core.registry, &mut builder, instance, target, bytes);
        }
        if let Some(instance) = self.core.instances.get_mut(&id) {
            instance.inputs.extend(inputs);
            instance.changes += 1;
            if let Some((tuned, plan)) = tuned {
                instance.tuned = tuned;
                instance.tune_ops(Some(plan)).into_iter().for_each(|(source, op)| builder.add(source, op));
            }
        }
        self.append_sequence(builder.finish());
        Ok(())
    }
}
