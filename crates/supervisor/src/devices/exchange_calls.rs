// SPDX-License-Identifier: Apache-2.0
//! Calls for exchanging a logical device's own verb.
use crate::instances::apply::leave_writers;
use crate::refuse::unknown;
use crate::system::System;
use indexmap::IndexMap;
use model::definition::Application;
use model::refusal::{Refusals, SourceLocation};

impl System {
    /// Replaces the verb of a device with another one that has the same arguments. If the device is enabled, the exchange takes place
    /// within one firing.
    ///
    /// # Errors
    /// Fails with any refusal that creating or starting the other verb would return; in that case nothing has changed. Fails with `PlacementError` if one of the two verbs is spread over several sources, and with `InvalidState` if the device is neither enabled nor idle, or if one of its SVVs drives another verb.
    pub fn exchange_verb(&self, device: &str, verb: &str, place: Option<SourceLocation>) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let Some(record) = definitions.configuration.logical_devices.get(device) else {
            return Err(unknown("logical device", device, definitions.configuration.logical_devices.keys().map(String::as_str)));
        };
        let application = Application {
            verb: verb.to_owned(),
            name: Some(format!("{device}.{verb}")),
            arguments: record.arguments.clone(),
            placement: record.source.iter().map(|source| ("*".to_owned(), source.clone())).collect(),
            every: IndexMap::new(),
            values: IndexMap::new(),
            owner: Some(device.to_owned()),
            place,
        };
        let new = self.create_in(&mut definitions, &application)?;
        let exchanged = self.shared.command(|core| core.exchange(device, new, &definitions.configuration));
        let settled = exchanged.and_then(|old| self.until_settled(new, |i| !i.is_under_way()).map(|()| old));
        let gone = settled.as_ref().map_or(Some(new), |old| *old);
        let removed = self.shared.command(|core| {
            let found = gone.and_then(|id| core.instances.get(&id)).map(|i| (i.name.clone(), i.plan.clone()));
            gone.into_iter().for_each(|id| core.remove(id));
            Ok(found)
        })?;
        if let Some((name, plan)) = removed {
            leave_writers(&mut definitions, &plan, &name);
        }
        settled.map(|_| ())
    }
}
