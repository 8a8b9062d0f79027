// SPDX-License-Identifier: Apache-2.0
//! Calls that create, write and delete state vector variables.
use crate::refuse::{invalid_state, known_unit, refuse, refuse_at, unknown};
use crate::svvs::cells::{Past, SvvRecord};
use crate::svvs::values::store_value;
use crate::system::System;
use indexmap::IndexMap;
use model::configuration::{Svv, SvvId};
use model::definition::{Bound, Initial, SvvSpecification, Within};
use model::plan::CellKind;
use model::range::Range;
use model::refusal::{Class, Refusals, SourceLocation};
use model::types::Type;
use std::collections::BTreeMap;

/// A requested SVV: its specification, and the struct types used by its type.
#[derive(Clone, Debug, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SvvRequest {
    #[serde(flatten)]
    pub specification: SvvSpecification,
    #[serde(default)]
    pub types: IndexMap<String, String>,
}

impl System {
    /// Creates an SVV of the system.
    pub fn svv(&self, name: &str, request: &SvvRequest, place: Option<SourceLocation>) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        self.make_svv(&mut definitions, name, request, None, place)
    }

    pub(crate) fn make_svv(
        &self,
        definitions: &mut crate::definitions::system_definitions::Definitions,
        name: &str,
        request: &SvvRequest,
        device: Option<&str>,
        place: Option<SourceLocation>,
    ) -> Result<(), Refusals> {
        if definitions.configuration.svvs.contains_key(name) {
            return Err(refuse_at(Class::InUse, format!("there is already an SVV '{name}'"), "give it another name, or delete that one first", place));
        }
        let asked = &request.specification;
        let of = Type::parse(&asked.type_text, &request.types).map_err(|r| vec![crate::starting::psi::named(r, name)])?;
        crate::definitions::sane::svv(name, asked, of.size())?;
        known_unit(&asked.unit, &format!("SVV '{name}'"), &place)?;
        let within = range_of(name, asked)?;
        let stored = match &asked.initial {
            Some(Initial::Value(value)) => of.encode(value, &asked.unit).map_err(|r| vec![crate::starting::psi::named(r, name)])?,
            _ => vec![0; of.size()],
        };
        let (type_text, now_ns) = (of.normalised(), self.shared.host.now_ns());
        let id = self.shared.command(|core| {
            core.registry.svvs_made += 1;
            let id = SvvId(core.registry.svvs_made);
            core.registry.svvs.insert(
                name.to_owned(),
                SvvRecord {
                    id,
                    type_text: type_text.clone(),
                    unit: asked.unit.clone(),
                    size: of.size(),
                    first: stored.clone(),
                    within,
                    cells: BTreeMap::new(),
                    readers: BTreeMap::new(),
                    home: None,
                    writers: Vec::new(),
                    written_by: None,
                    bound: 0,
                    stamps: BTreeMap::new(),
                    ratio: 1,
                    windows: Vec::new(),
                    past: Past { history: asked.history, stored, stored_ns: now_ns, ..Past::default() },
                },
            );
            let (taps, seen) = core.taps();
            taps.widen(&seen);
            Ok(id)
        })?;
        let svv = Svv {
            id,
            type_text: asked.type_text.clone(),
            unit: asked.unit.clone(),
            types: request.types.clone(),
            history: asked.history,
            device: device.map(str::to_owned),
            shared: false,
            place,
        };
        definitions.configuration.svvs.insert(name.to_owned(), svv);
        Ok(())
    }

    /// Deletes an SVV to which no port is bound.
    pub fn delete_svv(&self, name: &str) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let name = self.shared.locked().registry.name_of(name)?;
        let Some(svv) = definitions.configuration.svvs.get(name) else {
            return Err(unknown("SVV", name, definitions.configuration.svvs.keys().map(String::as_str)));
        };
        if let Some(device) = &svv.device {
            return Err(invalid_state(&format!("SVV '{name}'"), &format!("part of device '{device}'"), "delete", "delete the device"));
        }
        self.shared.command(|core| {
            let bound = core.instances.values().find(|i| i.plan.cells.iter().any(|c| matches!(&c.kind, CellKind::Svv { name: n, .. } if n == name)));
            if let Some(instance) = bound {
                return Err(invalid_state(&format!("SVV '{name}'"), &format!("bound by '{}'", instance.name), "delete", "delete that instance first"));
            }
            core.registry.svvs.shift_remove(name);
            core.observation.recorded.retain(|(of, _), _| of != name);
            Ok(())
        })?;
        definitions.configuration.svvs.shift_remove(name);
        Ok(())
    }

    /// Stores a value from the PS.
    pub fn write(&self, name: &str, value: &model::value::Value) -> Result<(), Refusals> {
        self.shared.command(|core| store_value(core, name, value))
    }
}

/// Returns the range of an SVV; refuses if it does not contain the initial value.
fn range_of(name: &str, asked: &SvvSpecification) -> Result<Option<Range>, Refusals> {
    let range = match &asked.within {
        None => return Ok(None),
        Some(Within::Range(range)) => *range,
        Some(Within::Between(Bound::Number(least), Bound::Number(most))) => Range::closed(*least, *most),
        Some(Within::Between(..)) => {
            let message = format!("the range of SVV '{name}' names a parameter, but it is not an SVV of a device");
            return Err(refuse(Class::ValueRefused, message, "give two numbers: within=(0, 1)"));
        }
    };
    if let Some((least, most)) = range.reversed() {
        let message = format!("the range of SVV '{name}' is reversed: {least} to {most}");
        return Err(refuse(Class::ValueRefused, message, format!("give the lower end first: within=({most}, {least})")));
    }
    if let Some(Initial::Value(value)) = &asked.initial {
        range.check(&format!("SVV '{name}'"), &asked.unit, value).map_err(|refusal| vec![refusal])?;
    }
    Ok(Some(range))
}
