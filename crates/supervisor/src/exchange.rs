// SPDX-License-Identifier: Apache-2.0
//! Exchanging the verb that keeps a logical device going, while it and the verbs that use it run: between two firings the blocks of
//! one go off and those of the other on. Blocks of the same label and code keep their states, outputs and invocation numbers, cells
//! of the same name their values, and running time goes on.
use crate::apply::leave_writers;
use crate::claims::Request;
use crate::core::{Core, DeviceState};
use crate::instance::{Cause, Instance, Limits, State};
use crate::psi::psi;
use crate::refuse::{invalid_state, refuse, unknown};
use crate::sequence::{Builder, Movement};
use crate::stages::Verbatim;
use crate::system::System;
use indexmap::IndexMap;
use kernel::{Op, SourceId};
use model::configuration::Configuration;
use model::definition::Application;
use model::plan::CellKind;
use model::refusal::{Class, Place, Refusals};

impl System {
    /// Replaces the verb of a device by another one, with the same arguments. Within one firing where the device is enabled.
    ///
    /// # Errors
    /// Everything that creating and starting the other verb may refuse; then nothing has changed. `PlacementError` where one of them
    /// lies in several sources; `InvalidState` where the device is neither enabled nor idle, or another verb takes one of its SVVs
    /// synchronously.
    pub fn exchange_verb(&self, device: &str, verb: &str, place: Option<Place>) -> Result<(), Refusals> {
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

impl Core {
    /// The instance `new` takes the place of the one that keeps the device going; that one is over, if there was one.
    fn exchange(&mut self, device: &str, new: u64, configuration: &Configuration) -> Result<Option<u64>, Refusals> {
        let record = self.logical(device)?;
        let (state, old) = (record.state, record.instance);
        let idle = matches!(state, DeviceState::Disabled | DeviceState::Fault);
        let Some(old) = old.filter(|_| !idle) else {
            if !idle {
                return Err(invalid_state(&format!("device '{device}'"), "enabled without a verb", "exchange the verb of", "disable it first"));
            }
            self.is_kept_by(device, new);
            return Ok(old);
        };
        self.check_exchange(device, state, old, new)?;
        let request = Request { id: new, stores: psi(&self.instances[&new].plan, &IndexMap::new(), configuration)?, limits: Limits::default() };
        let (plan, name) = (self.instances[&new].plan.clone(), self.instances[&new].name.clone());
        let held = self.held(&request, &plan, self.queue.len());
        let refused: Refusals = held.iter().filter(|h| h.holder != old).map(|h| self.second_writer(&name, &plan, h)).collect();
        if !refused.is_empty() {
            return Err(refused);
        }
        if !self.take_process(old, true) {
            return Err(invalid_state(&format!("device '{device}'"), "ending", "exchange the verb of", "enable it again first"));
        }
        self.claims.retain(|_, holder| *holder != old);
        self.instances.get_mut(&new).expect("it was made for this").renew();
        let mut movements = self.prepare(&request);
        movements.extend(self.turn_over(old, &request));
        self.log.add(self.host.now_ns(), "exchange", device, format!("its verb is '{}'", plan.verb));
        self.is_kept_by(device, new);
        self.append_sequence(new, movements);
        self.is_over(old, &plan.verb);
        Ok(Some(old))
    }

    fn is_kept_by(&mut self, device: &str, instance: u64) {
        if let Some(record) = self.logical.get_mut(device) {
            record.instance = Some(instance);
        }
    }

    /// Both lie in one source, the device is enabled and at rest in a command list, and nobody waits for the values of the old verb.
    fn check_exchange(&self, device: &str, state: DeviceState, old: u64, new: u64) -> Result<(), Refusals> {
        let (from, to) = (&self.instances[&old], &self.instances[&new]);
        if state != DeviceState::Enabled || from.state != State::Running || from.is_under_way() || from.departure.is_some() {
            let now = self.device_state(device)?;
            return Err(invalid_state(&format!("device '{device}'"), now, "exchange the verb of", "enable it first, or wait until it is enabled"));
        }
        if from.installed.sources != to.installed.sources || to.installed.sources.len() != 1 {
            return Err(refuse(
                Class::PlacementError,
                format!("cannot exchange '{}' for '{}' in one firing: they lie in several interrupt sources", from.name, to.name),
                "place both in one source, or disable the device first",
            ));
        }
        let writes = |svv: &str| from.plan.cells.iter().any(|c| !c.writers.is_empty() && matches!(&c.kind, CellKind::Svv { name, .. } if name == svv));
        let waits = |i: &&Instance| i.id != old && i.id != new && i.plan.blocks.iter().flat_map(|b| &b.external_drivers).any(|(_, svv)| writes(svv));
        match self.instances.values().find(waits) {
            Some(reader) => Err(refuse(
                Class::InvalidState,
                format!("cannot exchange '{}': '{}' takes one of its SVVs synchronously", from.name, reader.name),
                "relax that input with modes={…: 'asynchronous'}, or delete that instance first",
            )),
            None => Ok(()),
        }
    }

    /// One script: the old blocks off, the new ones as at a start but for what is kept, and on.
    fn turn_over(&self, old: u64, request: &Request) -> impl IntoIterator<Item = Movement> + use<> {
        let (from, to) = (&self.instances[&old], &self.instances[&request.id]);
        let source: SourceId = to.installed.sources[0];
        let mut builder = Builder::default();
        for activation in &from.installed.activations {
            builder.add(source, Op::Off(activation.clone()));
        }
        self.refresh(&mut builder, to, &request.stores);
        builder.add(source, Op::KeepClock(to.installed.process.clone(), from.installed.process.clone()));
        builder.add(source, Op::StopClock(from.installed.process.clone()));
        for (block, planned) in to.installed.blocks.iter().zip(&to.plan.blocks) {
            let kept = from.plan.blocks.iter().position(|b| b.label == planned.label && b.size == planned.size).map(|at| &from.installed.blocks[at]);
            if let Some(kept) = kept.filter(|kept| kept.is_same_code(block)) {
                builder.add(source, Op::Keep(block.clone(), kept.clone()));
            }
        }
        for (index, cell) in to.plan.cells.iter().enumerate() {
            let is_same = |c: &&model::plan::PlannedCell| c.kind == cell.kind && c.type_text == cell.type_text;
            let kept = from.plan.cells.iter().position(|c| is_same(&c)).filter(|_| matches!(cell.kind, CellKind::Private { .. }));
            if let (Some(kept), Some(cell)) = (kept.and_then(|at| from.installed.cell(at, source)), to.installed.cell(index, source)) {
                builder.add(source, Op::Copy(kept.clone(), cell.clone()));
            }
        }
        let of = Verbatim { plan: &to.plan, installed: &to.installed, devices: &self.physical };
        let before = Verbatim { plan: &from.plan, installed: &from.installed, devices: &self.physical };
        let written = of.channels_in(source);
        for (device, mut channels) in before.channels_in(source) {
            channels.retain(|c| !written.iter().any(|(of, now)| of.name() == device.name() && now.contains(c)));
            builder.add(source, Op::Safe { device, channels });
        }
        of.engage(&mut builder);
        of.enter(&mut builder, &[], to.plan.initial, 0, Some(to.generation));
        builder.finish()
    }

    /// The start of the old verb has its end too; the device is not told of it.
    fn is_over(&mut self, old: u64, verb: &str) {
        let time_ns = self.host.now_ns();
        let Some(instance) = self.instances.get_mut(&old) else { return };
        let Some(condition) = instance.condition("aborted") else { return };
        instance.owner = None;
        instance.ending = Some(Cause { condition, block: None, value: None, message: format!("exchanged for '{verb}'"), time_ns, asked_for: false });
        self.ended(old);
    }
}
