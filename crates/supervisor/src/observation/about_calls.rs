// SPDX-License-Identifier: Apache-2.0
//! Descriptions of single items by name, and the names of all items.
use crate::observation::description::{BlockAbout, InstanceAbout, Names, SvvAbout, SvvOwn};
use crate::observation::drawn::CellKind;
use crate::observation::states::InstanceState;
use crate::observation::statistics::seconds;
use crate::refuse::unknown;
use crate::svvs::named::{ends_of, other_cell};
use crate::system::System;
use indexmap::IndexMap;
use model::refusal::Refusals;
use model::types::Type;

impl System {
    /// Returns the kind, type, unit, history, writers and readers of an SVV, a private cell or a channel.
    pub fn svv_about(&self, name: &str) -> Result<SvvAbout, Refusals> {
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let (name, record) = core.registry.asked(name)?;
        let (Some(svv), Some(record)) = (definitions.configuration.svvs.get(name), record) else {
            return other_cell(&core, name).map(|named| named.about).ok_or_else(|| unknown("SVV", name, core.registry.svvs.keys().map(String::as_str)));
        };
        let of = Type::parse(&svv.type_text, &svv.types).map_err(|r| vec![r])?;
        let writers = definitions.configuration.writers.get(name).into_iter().flatten().map(|w| format!("{}.{}", w.instance, w.port)).collect();
        let [_, readers] = ends_of(&core, name);
        let own = SvvOwn {
            id: svv.id.0,
            within: record.within.and_then(|range| range.ends()),
            source: record.home.map(|home| core.registry.source_name(home).to_owned()),
        };
        Ok(SvvAbout {
            name: name.to_owned(),
            kind: CellKind::Svv,
            type_text: svv.type_text.clone(),
            types: svv.types.clone(),
            tree: of.tree(),
            unit: svv.unit.clone(),
            history: record.past.history,
            device: svv.device.clone(),
            writers,
            readers,
            bound: record.bound,
            own: Some(own),
        })
    }

    /// Returns the name, verb, state and blocks of an instance.
    pub fn instance_about(&self, instance: u64) -> Result<InstanceAbout, Refusals> {
        let core = self.shared.locked();
        let i = core.instances.known(instance)?;
        let plan = &i.plan;
        let blocks = plan.blocks.iter().map(|b| BlockAbout { label: b.label.clone(), block: b.block.clone(), source: b.source.clone() });
        Ok(InstanceAbout {
            name: i.name.clone(),
            verb: plan.verb.clone(),
            state: InstanceState::named(i.state().name()),
            blocks: blocks.collect(),
            lists: plan.lists.iter().filter(|list| list.copy_of.is_none()).map(|list| list.name.clone()).collect(),
            list: plan.lists[i.position.list].name.clone(),
            conditions: plan.conditions.iter().map(|condition| condition.name.clone()).collect(),
            inputs: i.present_inputs(),
            outputs: plan.outputs.iter().map(|output| output.name.clone()).collect(),
            owner: i.owner.clone(),
            starts: i.starts,
            running_s: seconds(i.times.running.at(core.host.now_ns())),
            remarks: plan.remarks.iter().map(|remark| remark.text.clone()).collect(),
        })
    }

    /// Returns the names of all items, by kind.
    pub fn names(&self) -> Names {
        let definitions = self.shared.definitions();
        let core = self.shared.locked();
        let c = &definitions.configuration;
        Names {
            processors: c.processors.clone(),
            processes: core.remote.processes.clone(),
            supervisor: definitions.processors.iter().find(|(_, p)| p.supervisor).map(|(name, _)| name.clone()),
            sources: names_of(&c.sources),
            devices: names_of(&c.devices),
            svvs: names_of(&c.svvs),
            logical_devices: names_of(&c.logical_devices),
            verbs: names_of(&c.verbs),
            device_types: names_of(&c.device_types),
            modules: names_of(&definitions.catalog.modules),
            blocks: names_of(&c.interfaces),
            instances: core.instances.values().map(|instance| instance.name.clone()).collect(),
        }
    }
}

fn names_of<T>(of: &IndexMap<String, T>) -> Vec<String> {
    of.keys().cloned().collect()
}
