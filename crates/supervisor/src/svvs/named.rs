// SPDX-License-Identifier: Apache-2.0
//! Cells by their interface names: private cells `INSTANCE:CELL`, such as `move#1:coefficients`, and channels of physical devices
//! `DEVICE.CHANNEL`. SVVs are in `svvs.rs`.
use crate::core::Core;
use crate::instances::instance::Instance;
use crate::observation::description::SvvAbout;
use crate::observation::drawn::CellKind as Kind;
use crate::wiring::ports::mode_of;
use indexmap::IndexMap;
use kernel::{Cell, SourceId};
use model::interface::Mode;
use model::plan::{CellKind, PlannedCell};
use model::types::Type;

/// A cell that is not an SVV.
pub(crate) struct NamedCell {
    /// Source that produces the value.
    pub source: SourceId,
    pub cell: Cell,
    /// Stamp with the number and time of its most recent value, and n of its writer's ratio output; `None` if no block writes it.
    pub stamp: Option<(Cell, u64)>,
    /// Properties of the cell: type, unit, kind, writers, readers.
    pub about: SvvAbout,
}

fn about(name: &str, kind: Kind, type_text: &str, unit: &str, [writers, readers]: [Vec<String>; 2]) -> Option<SvvAbout> {
    let types = IndexMap::new();
    let tree = Type::parse(type_text, &types).ok()?.tree();
    Some(SvvAbout {
        name: name.to_owned(),
        kind,
        type_text: type_text.to_owned(),
        types,
        tree,
        unit: unit.to_owned(),
        history: 0,
        device: None,
        writers,
        readers,
        bound: 1,
        own: None,
    })
}

/// Returns the interface name of a planned cell: the name of the SVV, `device.channel` for a channel, or otherwise `INSTANCE:CELL`.
pub(crate) fn cell_name(core: &Core, instance: &Instance, cell: &PlannedCell) -> String {
    match &cell.kind {
        CellKind::Svv { name, .. } => name.clone(),
        CellKind::Private { name } | CellKind::Constant { name } => format!("{}:{name}", instance.name),
        CellKind::Channel { device, channel, .. } => {
            let name = core.registry.physical.get(device).and_then(|record| record.device.channels().get(*channel)).map_or("?", |channel| &channel.name);
            format!("{device}.{name}")
        }
    }
}

/// Returns the cell with this name, if any.
pub(crate) fn other_cell(core: &Core, name: &str) -> Option<NamedCell> {
    private_cell(core, name).or_else(|| channel_cell(core, name))
}

fn private_cell(core: &Core, name: &str) -> Option<NamedCell> {
    let (instance, of) = core.instances.values().find_map(|i| Some((i, name.strip_prefix(i.name.as_str())?.strip_prefix(':')?)))?;
    let plan = &instance.plan;
    let index = plan.cells.iter().position(|cell| match &cell.kind {
        CellKind::Private { name } | CellKind::Constant { name } => name == of,
        _ => false,
    })?;
    let planned = &plan.cells[index];
    let (block, item) = *planned.writers.first().or(planned.readers.first())?;
    let source = instance.installed.home(plan, index)?;
    let cell = instance.installed.cell(index, source)?.clone();
    let ratio = if let Mode::Ratio(n) = mode_of(plan, block, item) { u64::from(n) } else { 1 };
    let own = instance.installed.own_stamps.get(&index).and_then(|stamps| stamps.get(&source));
    let stamp = match own {
        Some(own) => Some((own.clone(), 1)),
        None => (!planned.writers.is_empty()).then(|| (instance.installed.stamps[plan.blocks[block].activation].clone(), ratio)),
    };
    let port = |(block, item): &(usize, usize)| {
        let item = instance.installed.interfaces[*block].items.get(*item).map_or("?", |item| &item.name);
        format!("{}.{}.{item}", instance.name, plan.blocks[*block].label)
    };
    let kind = if matches!(planned.kind, CellKind::Constant { .. }) { Kind::Constant } else { Kind::Private };
    let about = about(name, kind, &planned.type_text, &planned.unit, [planned.writers.iter().map(port).collect(), planned.readers.iter().map(port).collect()])?;
    Some(NamedCell { source, cell, stamp, about })
}

fn channel_cell(core: &Core, name: &str) -> Option<NamedCell> {
    let (record, of) = core.registry.physical.iter().find_map(|(device, record)| Some((record, name.strip_prefix(device.as_str())?.strip_prefix('.')?)))?;
    let index = record.device.channels().iter().position(|channel| channel.name == of)?;
    let channel = &record.device.channels()[index];
    let about = about(name, Kind::Channel, &channel.type_text, &channel.unit, ends_of(core, name))?;
    Some(NamedCell { source: record.source, cell: record.device.cell(index), stamp: None, about })
}

/// Returns the ports that write and read a cell with this name, in all instances.
pub(crate) fn ends_of(core: &Core, name: &str) -> [Vec<String>; 2] {
    let mut ends = [Vec::new(), Vec::new()];
    for instance in core.instances.values() {
        for cell in instance.plan.cells.iter().filter(|cell| cell_name(core, instance, cell) == name) {
            for (ports, named) in [&cell.writers, &cell.readers].into_iter().zip(&mut ends) {
                named.extend(ports.iter().map(|(block, item)| {
                    let item = instance.installed.interfaces[*block].items.get(*item).map_or("?", |item| &item.name);
                    format!("{}.{}.{item}", instance.name, instance.plan.blocks[*block].label)
                }));
            }
        }
    }
    ends
}
