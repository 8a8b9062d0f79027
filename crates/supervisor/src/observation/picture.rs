// SPDX-License-Identifier: Apache-2.0
//! Picture of the installed instances: blocks with their ports, cells with their writers and readers, command lists, conditions, τ. The
//! studio's pages use it to show a running system as a graph and a state diagram.
use crate::core::Core;
use crate::instances::instance::Instance;
use crate::observation::drawn::{
    CellKind, DueBy, InstalledActivation, InstalledBlock, InstalledCell, InstalledCondition, InstalledCourse, InstalledInstance, InstalledInstances,
    InstalledList, InstalledPort, InstalledTransition, PortDirection, PortValue,
};
use crate::observation::states::InstanceState;
use crate::svvs::named::cell_name;
use crate::system::System;
use indexmap::IndexMap;
use kernel::SourceKind;
use model::configuration::Rate;
use model::interface::{Interface, Item, Kind, Mode};
use model::plan::{
    Binding, CellKind as PlannedCellKind, Due, Plan, PlannedActivation, PlannedBlock, PlannedCell, PlannedCommand, PlannedCondition, PlannedList, PlannedStage,
    Wait,
};
use model::types::Type;
use std::hash::{DefaultHasher, Hash, Hasher};

impl System {
    /// Returns all instances with their blocks, ports, cells, command lists, conditions and transitions.
    pub fn installed(&self) -> InstalledInstances {
        let ids: Vec<u64> = self.shared.locked().instances.keys().copied().collect();
        // One at a time, so that no command waits for all of them.
        let draw = |id: &u64| {
            let core = self.shared.locked();
            core.instances.get(id).map(|instance| Picture { core: &core, instance }.drawn())
        };
        InstalledInstances { instances: ids.iter().filter_map(draw).collect() }
    }

    /// Returns a number that changes whenever the result of [`System::installed`] may have changed.
    pub fn installed_version(&self) -> u64 {
        let core = self.shared.locked();
        let mut hasher = DefaultHasher::new();
        for i in core.instances.values() {
            (i.id, i.state().name(), i.position.list, i.position.stage, i.starts, i.changes, &i.position.active, std::sync::Arc::as_ptr(&i.plan) as usize)
                .hash(&mut hasher);
        }
        hasher.finish()
    }
}

/// An instance whose picture is being created.
struct Picture<'a> {
    core: &'a Core,
    instance: &'a Instance,
}

impl Picture<'_> {
    fn plan(&self) -> &Plan {
        &self.instance.plan
    }

    fn drawn(&self) -> InstalledInstance {
        let (i, plan) = (self.instance, self.plan());
        let lists = plan
            .lists
            .iter()
            .filter(|list| list.copy_of.is_none())
            .map(|list| InstalledList { name: list.name.clone(), commands: self.commands(&list.stages) });
        InstalledInstance {
            id: i.id,
            name: i.name.clone(),
            verb: plan.verb.clone(),
            state: InstanceState::named(i.state().name()),
            list: self.list(i.position.list),
            stage: i.position.stage,
            owner: i.owner.clone(),
            starts: i.starts,
            device: i.owner.as_ref().or(plan.devices.first()).cloned(),
            devices: plan.devices.clone(),
            inputs: i.present_inputs(),
            blocks: (0..plan.blocks.len()).map(|block| self.block(block)).collect(),
            cells: plan.cells.iter().map(|cell| self.cell(cell)).collect(),
            course: InstalledCourse {
                lists: lists.collect(),
                conditions: plan.conditions.iter().map(|condition| self.condition(condition)).collect(),
                transitions: self.transitions(),
                initial: self.list(plan.initial),
                ending: plan.ending.list.map(|list| self.list(list)),
            },
        }
    }

    /// Returns the name of a list.
    fn list(&self, index: usize) -> String {
        self.plan().lists[index].name.clone()
    }

    fn condition(&self, of: &PlannedCondition) -> InstalledCondition {
        InstalledCondition {
            name: of.name.clone(),
            of: of.on.iter().map(|port| self.port_name(*port)).collect(),
            system: of.on.is_empty(),
            returns: of.returns.iter().map(|output| self.plan().outputs[*output].name.clone()).collect(),
            raises: !of.normal,
            during: of.during.iter().filter(|list| self.plan().lists[**list].copy_of.is_none()).map(|list| self.list(*list)).collect(),
            priority: of.priority,
            alarm: of.alarm.clone(),
        }
    }

    fn transitions(&self) -> Vec<InstalledTransition> {
        let plan = self.plan();
        let lines = plan.lists.iter().filter(|list| list.copy_of.is_none()).flat_map(|list| list.transitions.iter().map(move |line| (list, line)));
        let transition = |(list, (condition, to)): (&PlannedList, &(usize, usize))| InstalledTransition {
            from: list.name.clone(),
            condition: plan.conditions[*condition].name.clone(),
            to: self.list(*to),
        };
        lines.map(transition).collect()
    }

    fn block(&self, index: usize) -> InstalledBlock {
        let (planned, interface) = (&self.plan().blocks[index], &self.instance.installed.interfaces[index]);
        let ports = interface.items.iter().enumerate().filter(|(_, item)| item.kind != Kind::State);
        let every = self.instance.position.active.iter().find(|(active, _)| *active == planned.activation).map(|(_, every)| *every);
        InstalledBlock {
            label: planned.label.clone(),
            block: planned.block.clone(),
            doc: interface.doc.clone(),
            source: planned.source.clone(),
            size: planned.size,
            file: interface.file.clone(),
            every_ns: self.every_ns(planned, every),
            ports: ports.map(|(at, item)| self.port(planned, interface, at, item)).collect(),
            activation: self.activation(&self.plan().activations[planned.activation], every.is_some()),
        }
    }

    fn activation(&self, of: &PlannedActivation, on: bool) -> InstalledActivation {
        let plan = self.plan();
        let (due, by) = match &of.due {
            Due::Interval => (DueBy::Interval, &[][..]),
            Due::Driven { by } => (DueBy::Driven, &by[..]),
            Due::Queued { by } => (DueBy::Queued, &by[..]),
        };
        let labels = |activation: usize| plan.activations[activation].blocks.iter().map(|block| self.label(*block).to_owned());
        InstalledActivation {
            on,
            due,
            by: by.iter().flat_map(|(activation, _)| labels(*activation)).collect(),
            rates: of.rates.iter().map(|(list, rate)| (self.list(*list), rate.clone())).collect(),
            budget_ns: of.budget_ns,
            tunable: of.tunable,
        }
    }

    /// Returns the interval at which a block runs, or would run in the first list that activates it; `None` if no timer determines it.
    fn every_ns(&self, planned: &PlannedBlock, every: Option<u32>) -> Option<u64> {
        let activation = &self.plan().activations[planned.activation];
        let source = self.core.registry.sources.get(&planned.source).and_then(|id| self.core.registry.specs.get(id.0 as usize));
        if let (Due::Interval, Some(every), Some(SourceKind::Timer { period_ns })) = (&activation.due, every, source.map(|spec| &spec.kind)) {
            return Some(u64::from(every) * period_ns);
        }
        let here = activation.rates.iter().find(|(list, _)| *list == self.instance.position.list).or(activation.rates.first());
        here.and_then(|(_, rate)| if let Rate::Interval { period_ns } = rate { Some(*period_ns) } else { None })
    }

    fn port(&self, planned: &PlannedBlock, interface: &Interface, at: usize, item: &Item) -> InstalledPort {
        let bound = planned.bindings.iter().find(|bound| bound.item == at);
        let cells: Vec<&PlannedCell> =
            bound.map(|bound| crate::wiring::ports::cells_of(&bound.binding)).into_iter().flatten().map(|c| &self.plan().cells[*c]).collect();
        let names: Vec<String> = cells.iter().map(|cell| cell_name(self.core, self.instance, cell)).collect();
        let of = Type::parse_sized(&item.type_text, &interface.types, planned.size).ok();
        let type_text = of.as_ref().map_or_else(|| item.type_text.clone(), Type::normalised);
        let value = match (item.kind, of) {
            (Kind::Size, _) => Some(PortValue::Size(planned.size)),
            (Kind::Parameter | Kind::Input, Some(of)) if bound.is_none() => {
                let given = planned.values.iter().find(|(of, _)| *of == at).map_or(&item.default, |(_, bytes)| bytes);
                (given.len() == of.size()).then(|| PortValue::Of(of.decode(given)))
            }
            _ => None,
        };
        InstalledPort {
            name: item.name.clone(),
            direction: direction(item.kind),
            writes: matches!(item.kind, Kind::Output | Kind::DeviceWrite),
            type_text,
            unit: item.unit.clone(),
            mode: mode(bound.map_or(item.mode, |bound| bound.mode)),
            doc: item.doc.clone(),
            cell: names.first().filter(|_| names.len() == 1).cloned(),
            required: item.kind == Kind::Input && !item.has_default,
            cells: matches!(bound.map(|bound| &bound.binding), Some(Binding::Cells(_))).then_some(names),
            value,
        }
    }

    fn cell(&self, cell: &PlannedCell) -> InstalledCell {
        let kind = match cell.kind {
            PlannedCellKind::Svv { .. } => CellKind::Svv,
            PlannedCellKind::Private { .. } => CellKind::Private,
            PlannedCellKind::Constant { .. } => CellKind::Constant,
            PlannedCellKind::Channel { .. } => CellKind::Channel,
        };
        let ends = |ports: &[(usize, usize)]| ports.iter().map(|(block, item)| (self.label(*block).to_owned(), self.item(*block, *item).to_owned())).collect();
        let constant = || Some(Type::parse(&cell.type_text, &IndexMap::new()).ok()?.decode(&cell.initial));
        InstalledCell {
            name: cell_name(self.core, self.instance, cell),
            kind,
            type_text: cell.type_text.clone(),
            unit: cell.unit.clone(),
            writers: ends(&cell.writers),
            readers: ends(&cell.readers),
            value: (kind == CellKind::Constant).then(constant).flatten(),
        }
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

    /// Returns the commands of a list in the syntax of a program.
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
                let spec = self.core.registry.sources.get(&of.source).and_then(|id| self.core.registry.specs.get(id.0 as usize));
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

fn direction(kind: Kind) -> PortDirection {
    match kind {
        Kind::Input => PortDirection::Input,
        Kind::Output => PortDirection::Output,
        Kind::DeviceRead | Kind::DeviceWrite => PortDirection::Device,
        Kind::Condition => PortDirection::Condition,
        Kind::Parameter | Kind::Size | Kind::State => PortDirection::Parameter,
    }
}

fn mode(mode: Mode) -> String {
    match mode {
        Mode::Synchronous => "synchronous".to_owned(),
        Mode::Ratio(n) => format!("ratio {n}"),
        Mode::Asynchronous => "asynchronous".to_owned(),
    }
}

/// Formats a duration in a suitable unit.
fn time(ns: u64) -> String {
    let (per, unit) = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us")].into_iter().find(|(per, _)| ns >= *per).unwrap_or((1, "ns"));
    format!("{} {unit}", ns as f64 / per as f64)
}
