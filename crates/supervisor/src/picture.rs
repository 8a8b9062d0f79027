// SPDX-License-Identifier: Apache-2.0
//! What is installed, drawn out: blocks with their ports, cells with who writes and reads them, command lists, conditions, τ. What a
//! page shows of a running system as a graph and a state diagram comes from here.
use crate::core::Core;
use crate::instance::Instance;
use crate::refuse::unknown;
use crate::system::System;
use indexmap::IndexMap;
use kernel::SourceKind;
use model::configuration::Rate;
use model::interface::{Interface, Item, Kind, Mode};
use model::plan::{Binding, CellKind, Due, Plan, PlannedBlock, PlannedCell, PlannedCommand, PlannedStage, Wait};
use model::refusal::Refusals;
use model::types::Type;
use serde_json::{Value as Json, json};
use std::hash::{DefaultHasher, Hash, Hasher};

impl System {
    /// Every instance with its blocks, ports, cells, command lists, conditions and transitions: `{"instances": […]}`.
    pub fn installed_json(&self) -> Json {
        let core = self.shared.locked();
        let instances: Vec<Json> = core.instances.values().map(|instance| Picture { core: &core, instance }.json()).collect();
        json!({ "instances": instances })
    }

    /// A number that changes whenever what [`System::installed_json`] says may have changed.
    pub fn installed_version(&self) -> u64 {
        let core = self.shared.locked();
        let mut hasher = DefaultHasher::new();
        for (id, i) in &core.instances {
            (id, i.state.name(), i.list, i.stage, i.starts, &i.active, std::sync::Arc::as_ptr(&i.plan) as usize).hash(&mut hasher);
        }
        hasher.finish()
    }

    /// What a form that starts a verb needs: its arguments and input parameters, and the definition itself.
    pub fn verb_form_json(&self, name: &str) -> Result<Json, Refusals> {
        let mut definitions = self.shared.definitions();
        let Some(verb) = definitions.configuration.verbs.get(name).cloned() else {
            return Err(unknown("verb", name, definitions.configuration.verbs.keys().map(String::as_str)));
        };
        let checked = definitions.checked(name)?;
        Ok(json!({
            "name": verb.name, "doc": verb.doc, "manual": verb.manual, "arguments": checked.form_arguments(), "inputs": checked.form_inputs(), "defined": verb,
        }))
    }
}

/// The name by which the interface calls a planned cell: of an SVV its own, of a channel `device.channel`, else `INSTANCE:CELL`.
pub(crate) fn cell_name(core: &Core, instance: &Instance, cell: &PlannedCell) -> String {
    match &cell.kind {
        CellKind::Svv { name, .. } => name.clone(),
        CellKind::Private { name } | CellKind::Constant { name } => format!("{}:{name}", instance.name),
        CellKind::Channel { device, channel, .. } => {
            let name = core.physical.get(device).and_then(|record| record.device.channels().get(*channel)).map_or("?", |channel| &channel.name);
            format!("{device}.{name}")
        }
    }
}

/// One instance, while it is drawn.
struct Picture<'a> {
    core: &'a Core,
    instance: &'a Instance,
}

impl Picture<'_> {
    fn plan(&self) -> &Plan {
        &self.instance.plan
    }

    fn json(&self) -> Json {
        let (i, plan) = (self.instance, self.plan());
        let name = |list: usize| plan.lists[list].name.as_str();
        let blocks: Vec<Json> = (0..plan.blocks.len()).map(|block| self.block(block)).collect();
        let cells: Vec<Json> = plan.cells.iter().map(|cell| self.cell(cell)).collect();
        let lists: Vec<Json> = plan.lists.iter().map(|list| json!({ "name": list.name, "commands": self.commands(&list.stages) })).collect();
        let conditions: Vec<Json> = plan
            .conditions
            .iter()
            .map(|c| {
                json!({
                    "name": c.name, "of": c.on.iter().map(|port| self.port_name(*port)).collect::<Vec<_>>(), "system": c.on.is_empty(),
                    "returns": c.returns.iter().map(|o| plan.outputs[*o].name.as_str()).collect::<Vec<_>>(), "raises": !c.normal,
                    "during": c.during.iter().map(|list| name(*list)).collect::<Vec<_>>(), "priority": c.priority, "alarm": c.alarm,
                })
            })
            .collect();
        let lines = plan.lists.iter().flat_map(|list| list.transitions.iter().map(move |line| (list, line)));
        let transitions: Vec<Json> =
            lines.map(|(list, (condition, to))| json!({ "from": list.name, "condition": plan.conditions[*condition].name, "to": name(*to) })).collect();
        json!({
            "id": i.id, "name": i.name, "verb": plan.verb, "state": i.state.name(), "list": name(i.list), "stage": i.stage, "owner": i.owner,
            "starts": i.starts, "device": i.owner.as_ref().or(plan.devices.first()), "devices": plan.devices, "blocks": blocks, "cells": cells,
            "lists": lists, "conditions": conditions, "transitions": transitions, "initial": name(plan.initial), "ending": plan.ending.list.map(name),
        })
    }

    fn block(&self, index: usize) -> Json {
        let (planned, interface) = (&self.plan().blocks[index], &self.instance.installed.interfaces[index]);
        let ports = interface.items.iter().enumerate().filter(|(_, item)| item.kind != Kind::State);
        let ports: Vec<Json> = ports.map(|(at, item)| self.port(planned, interface, at, item)).collect();
        let activation = &self.plan().activations[planned.activation];
        let every = self.instance.active.iter().find(|(active, _)| *active == planned.activation).map(|(_, every)| *every);
        let (due, by) = match &activation.due {
            Due::Interval => ("interval", &[][..]),
            Due::Driven { by } => ("driven", &by[..]),
            Due::Queued { by } => ("queued", &by[..]),
        };
        let labels = |activation: usize| self.plan().activations[activation].blocks.iter().map(|b| self.plan().blocks[*b].label.as_str());
        let rates: IndexMap<&str, &Rate> = activation.rates.iter().map(|(list, rate)| (self.plan().lists[*list].name.as_str(), rate)).collect();
        json!({
            "label": planned.label, "block": planned.block, "doc": interface.doc, "source": planned.source, "size": planned.size, "file": interface.file,
            "every_ns": self.every_ns(planned, every), "ports": ports,
            "activation": {
                "on": every.is_some(), "due": due, "by": by.iter().flat_map(|(a, _)| labels(*a)).collect::<Vec<_>>(), "rates": rates,
                "budget_ns": activation.budget_ns, "tunable": activation.tunable,
            },
        })
    }

    /// At which interval a block runs, or would in the first list in which it does; nothing where no timer says.
    fn every_ns(&self, planned: &PlannedBlock, every: Option<u32>) -> Option<u64> {
        let activation = &self.plan().activations[planned.activation];
        let source = self.core.sources.get(&planned.source).and_then(|id| self.core.specs.get(id.0 as usize));
        if let (Due::Interval, Some(every), Some(SourceKind::Timer { period_ns })) = (&activation.due, every, source.map(|spec| &spec.kind)) {
            return Some(u64::from(every) * period_ns);
        }
        let here = activation.rates.iter().find(|(list, _)| *list == self.instance.list).or(activation.rates.first());
        here.and_then(|(_, rate)| if let Rate::Interval { period_ns } = rate { Some(*period_ns) } else { None })
    }

    fn port(&self, planned: &PlannedBlock, interface: &Interface, at: usize, item: &Item) -> Json {
        let bound = planned.bindings.iter().find(|bound| bound.item == at);
        let cells: Vec<&PlannedCell> =
            bound.map(|bound| crate::install::cells_of(&bound.binding)).into_iter().flatten().map(|c| &self.plan().cells[*c]).collect();
        let names: Vec<String> = cells.iter().map(|cell| cell_name(self.core, self.instance, cell)).collect();
        let of = Type::parse_sized(&item.type_text, &interface.types, planned.size).ok();
        let mut port = json!({
            "name": item.name, "direction": direction(item.kind), "writes": matches!(item.kind, Kind::Output | Kind::DeviceWrite),
            "type_text": of.as_ref().map_or_else(|| item.type_text.clone(), Type::normalised), "unit": item.unit,
            "mode": mode(bound.map_or(item.mode, |bound| bound.mode)), "doc": item.doc,
            "cell": names.first().filter(|_| names.len() == 1), "required": item.kind == Kind::Input && !item.has_default,
        });
        if let Some(Binding::Cells(_)) = bound.map(|bound| &bound.binding) {
            port["cells"] = json!(names);
        }
        match (item.kind, of) {
            (Kind::Size, _) => port["value"] = json!(planned.size),
            (Kind::Parameter | Kind::Input, Some(of)) if bound.is_none() => {
                let given = planned.values.iter().find(|(of, _)| *of == at).map_or(&item.default, |(_, bytes)| bytes);
                if given.len() == of.size() {
                    port["value"] = json!(of.decode(given));
                }
            }
            _ => {}
        }
        port
    }

    fn cell(&self, cell: &PlannedCell) -> Json {
        let kind = match cell.kind {
            CellKind::Svv { .. } => "svv",
            CellKind::Private { .. } => "private",
            CellKind::Constant { .. } => "constant",
            CellKind::Channel { .. } => "channel",
        };
        let ends =
            |ports: &[(usize, usize)]| -> Vec<Json> { ports.iter().map(|(block, item)| json!([self.label(*block), self.item(*block, *item)])).collect() };
        let mut shown = json!({
            "name": cell_name(self.core, self.instance, cell), "kind": kind, "type_text": cell.type_text, "unit": cell.unit,
            "writers": ends(&cell.writers), "readers": ends(&cell.readers),
        });
        if let (CellKind::Constant { .. }, Ok(of)) = (&cell.kind, Type::parse(&cell.type_text, &IndexMap::new())) {
            shown["value"] = json!(of.decode(&cell.initial));
        }
        shown
    }

    fn label(&self, block: usize) -> &str {
        &self.plan().blocks[block].label
    }

    fn item(&self, block: usize, item: usize) -> &str {
        self.instance.installed.interfaces[block].items.get(item).map_or("?", |item| &item.name)
    }

    fn port_name(&self, (block, item): (usize, usize)) -> String {
        format!("{}.{}", self.label(block), self.item(block, item))
    }

    /// The commands of a list as a program would write them.
    fn commands(&self, stages: &[PlannedStage]) -> Vec<String> {
        let mut texts = Vec::new();
        for stage in stages {
            texts.extend(stage.commands.iter().map(|command| self.command(command)));
            texts.extend(stage.wait.as_ref().map(|wait| match wait {
                Wait::Conditions(ports) => format!("wait for {}", ports.iter().map(|port| self.port_name(*port)).collect::<Vec<_>>().join(" or ")),
                Wait::Time(ns) => format!("wait {}", time(u64::try_from(*ns).unwrap_or(0))),
                Wait::Idle => "wait until nothing is active".to_owned(),
            }));
        }
        texts
    }

    fn command(&self, command: &PlannedCommand) -> String {
        let all = |blocks: &[usize]| blocks.iter().map(|block| self.label(*block)).collect::<Vec<_>>().join(", ");
        let plan = self.plan();
        match command {
            PlannedCommand::Install(blocks) => format!("install {}", all(blocks)),
            PlannedCommand::Execute(blocks) => format!("execute {}", all(blocks)),
            PlannedCommand::On { activation, every } => {
                let of = &plan.activations[*activation];
                let spec = self.core.sources.get(&of.source).and_then(|id| self.core.specs.get(id.0 as usize));
                let interval = match (&of.due, spec.map(|spec| &spec.kind)) {
                    (Due::Interval, Some(SourceKind::Timer { period_ns })) => format!(" every {}", time(u64::from(*every) * period_ns)),
                    _ => String::new(),
                };
                format!("activate {}{interval}", all(&of.blocks))
            }
            PlannedCommand::Off(activation) => format!("deactivate {}", all(&plan.activations[*activation].blocks)),
            PlannedCommand::Ready => "ready".to_owned(),
        }
    }
}

fn direction(kind: Kind) -> &'static str {
    match kind {
        Kind::Input => "input",
        Kind::Output => "output",
        Kind::DeviceRead | Kind::DeviceWrite => "device",
        Kind::Condition => "condition",
        Kind::Parameter | Kind::Size | Kind::State => "parameter",
    }
}

fn mode(mode: Mode) -> String {
    match mode {
        Mode::Synchronous => "synchronous".to_owned(),
        Mode::Ratio(n) => format!("ratio {n}"),
        Mode::Asynchronous => "asynchronous".to_owned(),
    }
}

/// A time in the unit that fits it.
fn time(ns: u64) -> String {
    let (per, unit) = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")].into_iter().find(|(per, _)| ns >= *per).unwrap_or((1, "ns"));
    format!("{} {unit}", ns as f64 / per as f64)
}
