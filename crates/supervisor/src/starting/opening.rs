// SPDX-License-Identifier: Apache-2.0
//! Kernel operations that begin or resume an instance, as pure functions of the configuration and the instance.
use crate::instances::installed_verb::InstalledVerb;
use crate::instances::instance::{Instance, Life};
use crate::movements::sequence::{Builder, Movement};
use crate::registry::Registry;
use crate::starting::operating::{looks, operating};
use crate::suspension::idle_values::idle_channels;
use kernel::{Op, SourceId};
use model::plan::{Binding, CellKind, PlannedCommand, PlannedSuspend, Target};

/// Returns the movements from the reset to the end of the initial list's first stage.
pub(crate) fn opening(registry: &Registry, instance: &Instance, stores: &[(Target, Vec<u8>)]) -> Vec<Movement> {
    let of = instance.installed_verb(&registry.physical);
    let mut builder = Builder::at_home(instance.installed.homes.clone());
    let operating = operating(registry, instance);
    let ends = instance.ends_in_its_opening().filter(|_| operating.is_empty());
    refresh(registry, &mut builder, instance, stores);
    builder.barrier();
    if !operating.is_empty() {
        of.engage(&mut builder);
        builder.divide();
        looks(&operating).for_each(|(source, op)| builder.add(source, op));
        builder.then(Movement::Operating(operating));
        // Start its time now, so that clock-based blocks do not make up for the wait.
        for &source in &instance.installed.sources {
            builder.add(source, Op::StartClock(instance.installed.process.clone()));
        }
        builder.barrier();
    }
    if instance.owner.is_some() && !registry.logical[instance.owner.as_ref().expect("checked")].copies.is_empty() {
        open_device(registry, &mut builder, instance, &of);
    } else {
        let (list, generation) = (instance.plan.initial, Some(instance.generation));
        of.engage(&mut builder);
        of.open(&mut builder, list, 0, generation);
        of.commands(&mut builder, &instance.plan.lists[list].stages[0].commands, generation);
        if let Some(condition) = ends {
            let source = instance.installed.sources[0];
            of.end_in(&mut builder, source, &of.outputs_in(source, condition));
            builder.add(source, Op::Capture(vec![instance.installed.stamps[0].clone()]));
        }
        of.reach(&mut builder, list, 0, generation);
    }
    let mut movements: Vec<Movement> = builder.finish().into();
    if let Some(Movement::Scripts(scripts)) = movements.first_mut() {
        let scripts = std::mem::take(scripts);
        movements[0] = Movement::Opening { scripts, stores: stores.to_vec(), ends: ends.is_some() };
    }
    movements
}

/// Makes up for a replaced start: resets everything and stores ψ if that has not been sent yet, and claims the channels, except those of
/// a device that starts from its current state, which is not known yet.
pub(crate) fn make_up(registry: &Registry, builder: &mut Builder, instance: &Instance) {
    if instance.position.has_entered {
        return;
    }
    let unsent = instance.work.sequence.iter().find_map(|movement| if let Movement::Opening { stores, .. } = movement { Some(stores) } else { None });
    if let Some(stores) = unsent {
        refresh(registry, builder, instance, stores);
        builder.barrier();
    }
    if instance.owner.is_none() {
        instance.installed_verb(&registry.physical).engage(builder);
    }
}

/// Resets everything in the instance to its state at a first start, with its clock at 0 and ψ stored.
pub(crate) fn refresh(registry: &Registry, builder: &mut Builder, instance: &Instance, stores: &[(Target, Vec<u8>)]) {
    for (index, block) in instance.installed.blocks.iter().enumerate() {
        builder.add(instance.installed.block_source[index], Op::Reset(block.clone()));
    }
    for (index, cell) in instance.plan.cells.iter().enumerate() {
        if matches!(cell.kind, CellKind::Private { .. } | CellKind::Constant { .. }) {
            for (source, at) in &instance.installed.cells[index] {
                builder.add(*source, Op::Store(at.clone(), cell.initial.clone().into()));
            }
        }
    }
    for (source, block, item, delay) in &instance.installed.delays {
        begin_delay(builder, instance, *source, (*block, *item), delay);
    }
    for &source in &instance.installed.sources {
        builder.add(source, Op::StartClock(instance.installed.process.clone()));
    }
    set_rest(registry, builder, instance, false);
    for (target, bytes) in stores {
        store_target(registry, builder, instance, target, bytes);
    }
    for (source, op) in instance.fill_ops().into_iter().chain(instance.tune_ops(None)) {
        builder.add(source, op);
    }
}

/// Sets the initial value of a ratio input to the value of its data object in its source.
fn begin_delay(builder: &mut Builder, instance: &Instance, source: SourceId, port: (usize, usize), delay: &kernel::Cell) {
    let bound = instance.plan.blocks[port.0].bindings.iter().find(|b| b.item == port.1);
    let cells = match bound.map(|b| &b.binding) {
        Some(Binding::Cell(cell)) => std::slice::from_ref(cell),
        Some(Binding::Cells(list)) => list,
        None => return,
    };
    let mut at = 0;
    for from in cells.iter().filter_map(|cell| instance.installed.cell(*cell, source)) {
        builder.add(source, Op::Copy(from.clone(), delay.part(at, from.len())));
        at += from.len();
    }
}

/// Opens the initial list of a device's own verb. SVVs that start as copies are copied after the leading `execute` commands, before the
/// loop is closed.
fn open_device(registry: &Registry, builder: &mut Builder, instance: &Instance, of: &InstalledVerb) {
    let (list, generation) = (instance.plan.initial, Some(instance.generation));
    let stage = &instance.plan.lists[list].stages[0];
    of.open(builder, list, 0, generation);
    let leading = stage.commands.iter().take_while(|c| matches!(c, PlannedCommand::Execute(_) | PlannedCommand::Install(_))).count();
    of.commands(builder, &stage.commands[..leading], generation);
    let copies = &registry.logical[instance.owner.as_ref().expect("it has one")].copies;
    for (_, from) in copies {
        let svv = &registry.svvs[from];
        let source = svv.home.filter(|s| svv.cells.contains_key(s)).or_else(|| svv.cells.keys().min().copied());
        if let Some(source) = source {
            builder.add(source, Op::Capture(vec![svv.cells[&source].clone()]));
        }
    }
    builder.then(Movement::CopyInitial);
    of.engage(builder);
    of.commands(builder, &stage.commands[leading..], generation);
    of.reach(builder, list, 0, generation);
}

/// Stores one value of ψ in every image that contains its object.
pub(crate) fn store_target(registry: &Registry, builder: &mut Builder, instance: &Instance, target: &Target, bytes: &[u8]) {
    match target {
        Target::Cell(cell) => store_cell(registry, builder, instance, *cell, bytes),
        Target::Cells(cells) if !cells.is_empty() => {
            for (cell, part) in cells.iter().zip(bytes.chunks(bytes.len() / cells.len())) {
                store_cell(registry, builder, instance, *cell, part);
            }
        }
        Target::Cells(_) => {}
        Target::Item { block, item } => {
            builder.add(instance.installed.block_source[*block], Op::Store(instance.installed.blocks[*block].value(*item), bytes.into()));
        }
        Target::Report { .. } => {}
    }
}

fn store_cell(registry: &Registry, builder: &mut Builder, instance: &Instance, cell: usize, bytes: &[u8]) {
    if let CellKind::Svv { name, .. } = &instance.plan.cells[cell].kind {
        for (source, op) in registry.svvs[name].store_ops(bytes) {
            builder.add(source, op);
        }
    } else {
        for (source, at) in &instance.installed.cells[cell] {
            builder.add(*source, Op::Store(at.clone(), bytes.into()));
        }
        for (source, op) in instance.append_ops(cell) {
            builder.add(source, op);
        }
    }
}

/// Returns the movements that set or clear the port that brings the instance to rest.
pub(crate) fn rest_ops(registry: &Registry, instance: &Instance, is_set: bool) -> impl IntoIterator<Item = Movement> + use<> {
    let mut builder = Builder::default();
    set_rest(registry, &mut builder, instance, is_set);
    builder.finish()
}

pub(crate) fn set_rest(registry: &Registry, builder: &mut Builder, instance: &Instance, is_set: bool) {
    for holding in instance.plan.suspend.holdings() {
        store_target(registry, builder, instance, &holding.set, &[u8::from(is_set)]);
    }
}

/// Adds the operations that resume a suspended instance: it reclaims its channels, and its clock runs again. If `restores` is true, the
/// channels return to their previous values, within their slew limits; otherwise they stay safe until a block stores a value in them.
pub(crate) fn wake(registry: &Registry, builder: &mut Builder, instance: &Instance, restores: bool) {
    let of = instance.installed_verb(&registry.physical);
    let held = if let Life::Suspended { held } = &instance.life { held.as_slice() } else { &[] };
    for &source in &instance.installed.sources {
        if instance.plan.suspend == PlannedSuspend::Safe {
            let held = held.iter().find(|(from, _)| *from == source).map_or(&[][..], |(_, bytes)| bytes);
            let mut at = 0;
            for (device, channels) in of.channels_in(source) {
                for cell in channels.iter().map(|c| device.cell(usize::from(*c))) {
                    if let Some(bytes) = held.get(at..at + cell.len()).filter(|_| restores) {
                        builder.add(source, Op::Store(cell.clone(), bytes.into()));
                    }
                    at += cell.len();
                }
                builder.add(source, Op::Engage { device, channels });
            }
        }
        if instance.plan.suspend.idles() {
            for (device, channels) in idle_channels(registry, &instance.plan, source) {
                builder.add(source, Op::Engage { device, channels });
            }
        }
        builder.add(source, Op::ResumeClock(instance.installed.process.clone()));
    }
    set_rest(registry, builder, instance, false);
}
