// SPDX-License-Identifier: Apache-2.0
//! Checks made before a verb starts: its devices must meet its requirements, and its values must be within their ranges.
//!
//! The current values of SVVs are read at a boundary before the start; a change between this reading and the start is not detected.
use crate::starting::psi::{encode, named};
use crate::system::System;
use indexmap::IndexMap;
use model::configuration::Configuration;
use model::conformity;
use model::plan::{InputOrigin, Plan};
use model::refusal::{Class, Refusals};
use model::types::Type;
use model::value::Value;
use std::sync::Arc;

/// Returns refusals for values and defaults that do not match their types and units. Ranges are checked at the start.
pub(crate) fn unfit(plan: &Plan, values: &IndexMap<String, Value>, configuration: &Configuration) -> Refusals {
    let mut refusals = Refusals::new();
    for input in plan.inputs.iter().filter(|input| input.origin == InputOrigin::Given) {
        let is_counted = input.range.as_ref().is_some_and(|range| !range.counted_from.is_empty());
        let Some(value) = values.get(&input.name).or(input.default.as_ref()).filter(|_| !is_counted) else { continue };
        match conformity::settle(input, value, configuration, &IndexMap::new()) {
            Some(Err(wrong)) => refusals.extend(wrong.into_iter().filter(|refusal| refusal.class != Class::OutOfRange)),
            Some(Ok(_)) => {}
            None => refusals.extend(encode(&input.type_text, &input.unit, value).err().map(|refusal| named(refusal, &input.name))),
        }
    }
    refusals
}

impl System {
    /// Returns the values of a start, with fractions, quantities and defaults of ranges converted to numbers; refuses if a check fails.
    pub(crate) fn settled(
        &self,
        plan: &Arc<Plan>,
        values: &IndexMap<String, Value>,
        configuration: &Configuration,
    ) -> Result<IndexMap<String, Value>, Refusals> {
        let present = self.present(&conformity::asked(plan), configuration)?;
        let mut refusals = conformity::unmet(plan, configuration, &present);
        let mut settled = values.clone();
        for input in plan.inputs.iter().filter(|input| input.origin == InputOrigin::Given) {
            let Some(value) = values.get(&input.name).or(input.default.as_ref()) else { continue };
            match conformity::settle(input, value, configuration, &present) {
                Some(Ok(value)) => drop(settled.insert(input.name.clone(), value)),
                Some(Err(wrong)) => refusals.extend(wrong),
                None => {}
            }
        }
        if refusals.is_empty() { Ok(settled) } else { Err(refusals) }
    }

    /// Returns new values of tunable input parameters, converted and checked as for a start.
    pub(crate) fn settled_set(
        &self,
        plan: &Arc<Plan>,
        values: &IndexMap<String, Value>,
        configuration: &Configuration,
    ) -> Result<IndexMap<String, Value>, Refusals> {
        let counted: Vec<String> = (plan.inputs.iter().filter(|input| values.contains_key(&input.name)))
            .filter_map(|input| input.range.as_ref())
            .flat_map(|range| range.counted_from.iter().cloned())
            .collect();
        let present = self.present(&counted, configuration)?;
        let mut settled = values.clone();
        let mut refusals = Refusals::new();
        for input in &plan.inputs {
            match values.get(&input.name).and_then(|value| conformity::settle(input, value, configuration, &present)) {
                Some(Ok(value)) => drop(settled.insert(input.name.clone(), value)),
                Some(Err(wrong)) => refusals.extend(wrong),
                None => {}
            }
        }
        if refusals.is_empty() { Ok(settled) } else { Err(refusals) }
    }

    /// Returns the current values of SVVs.
    fn present(&self, names: &[String], configuration: &Configuration) -> Result<IndexMap<String, Value>, Refusals> {
        if names.is_empty() {
            return Ok(IndexMap::new());
        }
        let (_, readings) = self.read(names)?;
        let mut present = IndexMap::new();
        for (name, (bytes, ..)) in names.iter().zip(readings) {
            if let Some(svv) = configuration.svvs.get(name) {
                let of = Type::parse(&svv.type_text, &svv.types).map_err(|refusal| vec![refusal])?;
                present.insert(name.clone(), of.decode(&bytes));
            }
        }
        Ok(present)
    }
}
