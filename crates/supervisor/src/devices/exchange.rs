// SPDX-License-Identifier: Apache-2.0
//! Exchange of a logical device's own verb while the device and the verbs that use it are running: between two firings, the blocks of the
//! old verb are deactivated and those of the new one are activated. Blocks with the same label and code keep their states, outputs and
//! invocation numbers, cells with the same name keep their values, and running time continues.
use crate::core::Core;
use crate::instances::cause::Cause;
use crate::instances::course::Course;
use crate::instances::instance::{Instance, Limits, State};
use crate::instances::table::{Instances, Request};
use crate::movements::sequence::{Builder, Movement};
use crate::refuse::{invalid_state, refuse};
use crate::registry::{DeviceState, Registry};
use crate::starting::opening::refresh;
use crate::starting::psi::{Psi, psi};
use indexmap::IndexMap;
use kernel::{Cell, Op, SourceId};
use model::SystemCondition;
use model::configuration::Configuration;
use model::interface::Kind;
use model::plan::{Binding, CellKind, PlannedBlock, Target};
use model::refusal::{Class, Refusals};

impl Core {
    /// Replaces the device's own verb instance by the instance `new`. Ends the old one, if any.
    pub fn exchange(&mut self, device: &str, new: u64, configuration: &Configuration) -> Result<Option<u64>, Refusals> {
        let record = self.registry.logical(device)?;
        let (state, old) = (record.state, record.instance);
        let idle = matches!(state, DeviceState::Disabled | DeviceState::Fault);
        let Some(old) = old.filter(|_| !idle) else {
            if !idle {
                return Err(invalid_state(&format!("device '{device}'"), "enabled without a verb", "exchange the verb of", "disable it first"));
            }
            self.registry.keep_with(device, new);
            return Ok(old);
        };
        check_exchange((&self.instances, &self.registry), device, state, old, new)?;
        let Psi { stores, inputs } = psi(&self.instances[&new].plan, &IndexMap::new(), configuration)?;
        let request = Request { id: new, stores, inputs, limits: Limits::default() };
        let (plan, name) = (self.instances[&new].plan.clone(), self.instances[&new].name.clone());
        let held = self.instances.held(&self.registry, &request, &plan, self.instances.queue.len());
        let refused: Refusals = held.iter().filter(|h| h.holder != old).map(|h| self.instances.second_writer(&self.registry, &name, &plan, h)).collect();
        if !refused.is_empty() {
            return Err(refused);
        }
        if !self.course(old).take_process(true) {
            return Err(invalid_state(&format!("device '{device}'"), "ending", "exchange the verb of", "enable it again first"));
        }
        self.registry.claims.retain(|_, holder| *holder != old);
        self.instances.get_mut(&new).expect("it was made for this").renew();
        let mut movements = self.prepare(&request);
        movements.extend(turn_over(&self.registry, (&self.instances[&old], &self.instances[&new]), &request.stores));
        let untold = untold(&self.instances[&old], &self.instances[&new]);
        self.observation.log.add(self.host.now_ns(), "exchange", device, format!("its verb is now '{}'{untold}", plan.verb));
        self.registry.keep_with(device, new);
        self.course(new).append_sequence(movements);
        self.course(old).end_exchanged(&plan.verb);
        Ok(Some(old))
    }
}

impl Course<'_> {
    /// Ends the start of the old verb without notifying the device.
    fn end_exchanged(&mut self, verb: &str) {
        let old = self.id;
        let time_ns = self.core.host.now_ns();
        let Some(instance) = self.core.instances.get_mut(&old) else { return };
        let Some(condition) = instance.system(SystemCondition::Aborted) else { return };
        instance.owner = None;
        instance.ends(Cause { condition, block: None, value: None, message: format!("exchanged for '{verb}'"), time_ns, asked_for: false });
        self.ended();
    }
}

/// Returns, for each block of the new verb, the block of the old one whose state it continues: the block with the same label, size and
/// code.
fn kept_blocks(from: &Instance, to: &Instance) -> Vec<Option<usize>> {
    let same_label = |planned: &PlannedBlock| from.plan.blocks.iter().position(|b| b.label == planned.label && b.size == planned.size);
    let kept = |(at, planned): (usize, &PlannedBlock)| same_label(planned).filter(|of| from.installed.blocks[*of].is_same_code(&to.installed.blocks[at]));
    to.plan.blocks.iter().enumerate().map(kept).collect()
}

/// Returns the initial outputs of blocks that only the new verb has: the values that flow into their readers in the firing of the
/// exchange. A block inserted into a wire thus continues the wire's value, and its reader sees no jump. Each entry contains the block,
/// the source of the value, and the cell that the value initialises.
fn beginnings(from: &Instance, to: &Instance, source: SourceId) -> Vec<(usize, Cell, Cell)> {
    let kept = kept_blocks(from, to);
    let mut flowing: Vec<Option<Cell>> = vec![None; to.plan.cells.len()];
    let mut found = Vec::new();
    // Work backwards, so that the readers of a new block are known before it.
    for &block in to.plan.order.iter().flat_map(|(_, order)| order).rev() {
        let new = kept[block].is_none();
        let outputs = to.plan.blocks[block].bindings.iter().filter_map(|bound| {
            let Binding::Cell(cell) = bound.binding else { return None };
            let own = to.installed.blocks[block].published(bound.item).filter(|_| new)?;
            Some((cell, own, flowing[cell].clone()?))
        });
        let outputs: Vec<(usize, Cell, Cell)> = outputs.filter(|(_, own, flows)| own.len() == flows.len()).collect();
        for (cell, own, flows) in &outputs {
            found.push((block, flows.clone(), own.clone()));
            if let (CellKind::Private { .. }, Some(at)) = (&to.plan.cells[*cell].kind, to.installed.cell(*cell, source)) {
                found.push((block, flows.clone(), at.clone()));
            }
        }
        for bound in &to.plan.blocks[block].bindings {
            let Binding::Cell(cell) = bound.binding else { continue };
            let is_input = to.plan.cells[cell].readers.contains(&(block, bound.item));
            if flowing[cell].is_some() || !is_input {
                continue;
            }
            let type_text = &to.plan.cells[cell].type_text;
            flowing[cell] = match kept[block] {
                Some(of) => flows_into(from, of, bound.item, source).filter(|(_, of_type)| *of_type == type_text).map(|(flows, _)| flows.clone()),
                // Continue through a new block that passes its input on.
                None => outputs.iter().find(|(to_cell, ..)| to.plan.cells[*to_cell].type_text == *type_text).map(|(_, _, flows)| flows.clone()),
            };
        }
    }
    found
}

/// Lists the blocks that were inserted into a wire and have states of their own; these states start at their initial values.
fn untold(from: &Instance, to: &Instance) -> String {
    let has_states = |block: &usize| to.installed.interfaces[*block].items.iter().any(|item| item.kind == Kind::State);
    let mut blocks: Vec<usize> = beginnings(from, to, to.installed.sources[0]).into_iter().map(|(block, ..)| block).filter(has_states).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let labels: Vec<String> = blocks.iter().map(|block| format!("'{}'", to.plan.blocks[*block].label)).collect();
    if labels.is_empty() { String::new() } else { format!("; the states of {} are back at their initial values", labels.join(", ")) }
}

/// Returns the cell that an input of an old block reads, and its type.
fn flows_into(from: &Instance, block: usize, item: usize, source: SourceId) -> Option<(&Cell, &String)> {
    let bound = from.plan.blocks[block].bindings.iter().find(|bound| bound.item == item)?;
    let Binding::Cell(cell) = bound.binding else { return None };
    Some((from.installed.cell(cell, source)?, &from.plan.cells[cell].type_text))
}

/// Checks that both instances are on the same single source, that the device is enabled and at rest in a command list, and that no caller
/// is waiting for values of the old verb.
fn check_exchange((instances, registry): (&Instances, &Registry), device: &str, state: DeviceState, old: u64, new: u64) -> Result<(), Refusals> {
    let (from, to) = (&instances[&old], &instances[&new]);
    if state != DeviceState::Enabled || from.state() != State::Running || from.is_under_way() || from.leaving.departure.is_some() {
        let now = instances.device_state(registry, device)?;
        return Err(invalid_state(&format!("device '{device}'"), now, "exchange the verb of", "enable it first, or wait until it is enabled"));
    }
    if from.installed.sources != to.installed.sources || to.installed.sources.len() != 1 {
        return Err(refuse(
            Class::PlacementError,
            format!("cannot exchange '{}' for '{}' in one firing: they run on several interrupt sources", from.name, to.name),
            "place both on one source, or disable the device first",
        ));
    }
    let writes = |svv: &str| from.plan.cells.iter().any(|c| !c.writers.is_empty() && matches!(&c.kind, CellKind::Svv { name, .. } if name == svv));
    let others = instances.values().filter(|i| i.id != old && i.id != new);
    let mut drivers = others.flat_map(|i| i.plan.blocks.iter().flat_map(move |b| b.external_drivers.iter().map(move |(_, svv)| (i, &b.label, svv))));
    match drivers.find(|(_, _, svv)| writes(svv)) {
        Some((reader, block, svv)) => Err(refuse(
            Class::InvalidState,
            format!("cannot exchange '{}': block '{block}' of '{}' reads its SVV '{svv}' synchronously", from.name, reader.name),
            format!("relax that input of verb '{}' with modes=, or delete '{}' first", reader.plan.verb, reader.name),
        )),
        None => Ok(()),
    }
}

/// Returns one script that deactivates the old blocks, initialises the new ones as at a start except for kept values, and activates them.
fn turn_over(registry: &Registry, (from, to): (&Instance, &Instance), stores: &[(Target, Vec<u8>)]) -> impl IntoIterator<Item = Movement> + use<> {
    let source: SourceId = to.installed.sources[0];
    let mut builder = Builder::default();
    for activation in &from.installed.activations {
        builder.add(source, Op::Off(activation.clone()));
    }
    refresh(registry, &mut builder, to, stores);
    builder.add(source, Op::KeepClock(to.installed.process.clone(), from.installed.process.clone()));
    builder.add(source, Op::StopClock(from.installed.process.clone()));
    for (block, kept) in to.installed.blocks.iter().zip(kept_blocks(from, to)) {
        if let Some(kept) = kept {
            builder.add(source, Op::Keep(block.clone(), from.installed.blocks[kept].clone()));
        }
    }
    for (index, cell) in to.plan.cells.iter().enumerate() {
        let is_same = |c: &&model::plan::PlannedCell| c.kind == cell.kind && c.type_text == cell.type_text;
        let kept = from.plan.cells.iter().position(|c| is_same(&c)).filter(|_| matches!(cell.kind, CellKind::Private { .. }));
        if let (Some(kept), Some(cell)) = (kept.and_then(|at| from.installed.cell(at, source)), to.installed.cell(index, source)) {
            builder.add(source, Op::Copy(kept.clone(), cell.clone()));
        }
    }
    for (_, flows, begins) in beginnings(from, to, source) {
        builder.add(source, Op::Copy(flows, begins));
    }
    let of = to.installed_verb(&registry.physical);
    let before = from.installed_verb(&registry.physical);
    let written = of.channels_in(source);
    for (device, mut channels) in before.channels_in(source) {
        channels.retain(|c| !written.iter().any(|(of, now)| of.name() == device.name() && now.contains(c)));
        builder.add(source, Op::Safe { device, channels });
    }
    of.engage(&mut builder);
    of.enter(&mut builder, &[], to.plan.initial, 0, Some(to.generation));
    builder.finish()
}
