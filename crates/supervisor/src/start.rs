// SPDX-License-Identifier: Apache-2.0
//! Starts: what a start checks, and everything from the claims to the end of the initial list's first stage.
use crate::claims::{Admission, Request};
use crate::core::{Core, DeviceState};
use crate::homes::first_writer;
use crate::instance::{Instance, Limits, RunningTime, State};
use crate::psi::{psi, stored_svvs};
use crate::refuse::{invalid_state, refuse};
use crate::sequence::{Builder, Carried, Movement, Object};
use crate::stages::Verbatim;
use indexmap::IndexMap;
use kernel::{Op, SourceId};
use model::configuration::Configuration;
use model::interface::Mode;
use model::plan::{Binding, CellKind, Plan, PlannedCommand, Target};
use model::refusal::{Class, Refusal, Refusals};
use model::value::Value;

impl Core {
    /// Starts it: claims, ψ, the initial command list; or puts it into the queue, where the devices that it needs say so. Nothing has
    /// changed where it refuses.
    pub fn start(&mut self, id: u64, values: &IndexMap<String, Value>, limits: Limits, configuration: &Configuration) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        if !matches!(instance.state, State::Created | State::Ended) {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state.name(), "start", "wait for it or halt it first"));
        }
        self.refuse_emergency("start", &instance.name)?;
        self.check_mode(instance)?;
        self.check_enabled(instance)?;
        self.check_sources(instance)?;
        self.check_devices(instance)?;
        self.check_age(instance, limits.age_max_ns)?;
        let request = Request { id, stores: psi(&instance.plan, values, configuration)?, limits };
        let admission = self.arbitrate(&request)?;
        let instance = self.instances.get_mut(&id).expect("found above");
        instance.renew();
        let name = instance.name.clone();
        let now_ns = self.host.now_ns();
        match admission {
            Admission::Now => {
                self.log.add(now_ns, "start", &name, "");
                self.begin(request);
            }
            Admission::Later(behind) => {
                self.log.add(now_ns, "start", &name, format!("queued behind '{}'", behind.join("', '")));
                self.enqueue(request);
            }
        }
        Ok(())
    }

    /// What a start needs is free: it is claimed, and the initial list begins.
    pub fn begin(&mut self, request: Request) {
        let mut movements = self.prepare(&request);
        self.bid_farewell(request.id);
        if !self.hold_back(request.id, &request.stores) {
            movements.extend(self.opening(request.id, &request.stores));
        }
        self.append_sequence(request.id, movements);
    }

    /// The start is entered in everything that the supervisor keeps; what the kernels have to do before it begins.
    pub fn prepare(&mut self, request: &Request) -> Vec<Movement> {
        let (id, stores, limits) = (request.id, &request.stores, request.limits);
        let Some(plan) = self.instances.get(&id).map(|i| i.plan.clone()) else { return Vec::new() };
        for claim in &plan.claims {
            self.claims.insert(claim.clone(), id);
        }
        self.keep_stored(&plan, stores);
        let movements: Vec<Movement> = self.take_over(id);
        let now_ns = self.host.now_ns();
        let overruns = self.overruns(id);
        let instance = self.instances.get_mut(&id).expect("found above");
        instance.state = State::Running;
        instance.started_ns = now_ns;
        instance.running = RunningTime::start(now_ns);
        instance.limits = limits;
        instance.overruns_before = overruns;
        instance.generation = instance.installed.process.now().0 + 1;
        movements
    }

    /// Every logical device that the verb uses is enabled.
    pub fn check_enabled(&self, instance: &Instance) -> Result<(), Refusals> {
        let disabled: Refusals = (instance.plan.devices.iter())
            .filter(|d| self.logical.get(*d).is_some_and(|l| l.state != DeviceState::Enabled))
            .map(|d| {
                let refusal = Refusal::new(Class::NotEnabled, format!("cannot start '{}': device '{d}' is not enabled", instance.name));
                refusal.end(format!("device '{d}'"), &None).remedy(format!("call enable() on '{d}' first"))
            })
            .collect();
        if disabled.is_empty() { Ok(()) } else { Err(disabled) }
    }

    /// No source of it was stopped by a fault.
    pub fn check_sources(&self, instance: &Instance) -> Result<(), Refusals> {
        for &source in &instance.installed.sources {
            if self.lost.contains(&source) {
                let source = self.source_name(source);
                let message = format!("cannot start '{}': source '{source}' does not answer", instance.name);
                return Err(refuse(Class::InvalidState, message, "call reset() when its processor is back"));
            }
            if self.host.statistics(source).stopped {
                let source = self.source_name(source);
                return Err(refuse(
                    Class::InvalidState,
                    format!("cannot start '{}': source '{source}' was stopped by a fault in a block", instance.name),
                    "mend the block and call reset()",
                ));
            }
        }
        Ok(())
    }

    /// What ψ stores into an SVV is its value for images that get it later.
    fn keep_stored(&mut self, plan: &Plan, stores: &[(Target, Vec<u8>)]) {
        let now_ns = self.host.now_ns();
        for (_, name, bytes) in stored_svvs(plan, stores) {
            if let Some(record) = self.svvs.get_mut(name) {
                record.keep(bytes, now_ns);
                if record.home.is_none() {
                    self.taps.stored(name, now_ns, bytes);
                }
            }
        }
    }

    /// The SVVs that the instance writes from now on belong to its sources: connections are made anew where the writer's source changes.
    fn take_over(&mut self, id: u64) -> Vec<Movement> {
        let instance = &self.instances[&id];
        let plan = instance.plan.clone();
        let mut homes = instance.installed.homes.clone();
        let (mut written, mut begun) = (Vec::new(), Vec::new());
        for (index, cell) in plan.cells.iter().enumerate() {
            if let (CellKind::Svv { name, .. }, Some((block, item))) = (&cell.kind, first_writer(&plan, index)) {
                let source = instance.installed.block_source[block];
                homes.entry(index).and_modify(|home| *home = source);
                written.push((name.clone(), source));
                let ratio = if let Mode::Ratio(n) = instance.installed.interfaces[block].items[item].mode { u64::from(n) } else { 1 };
                begun.push((ratio, instance.installed.blocks[block].id(), cell.writers.len() > 1));
            }
        }
        let home = |svv: &str| self.svvs.get(svv).and_then(|s| s.home);
        let carried: Vec<Carried> = (written.iter())
            .filter_map(|(svv, to)| Some(Carried { object: Object::Svv(svv.clone()), from: home(svv).filter(|from| from != to)?, to: *to }))
            .collect();
        let pairs = written.iter().flat_map(|(svv, source)| self.hand_over(svv, *source)).collect::<Vec<_>>();
        let mut again = Vec::new();
        for ((name, _), (ratio, block, several)) in written.iter().zip(begun) {
            self.svvs.get_mut(name).expect("the plan was made from the SVVs that exist").ratio = ratio;
            if self.writes(name, block) && several {
                // Those that follow another instance turn below.
                let follows = |instance: &&Instance| instance.followed.get(name) == Some(&id);
                again.extend(self.instances.values().filter(follows).map(|instance| (instance.id, name.clone())));
            }
        }
        self.instances.get_mut(&id).expect("found above").installed.homes = homes;
        let rows = self.renew_taps();
        let mut movements = Vec::new();
        if !carried.is_empty() {
            movements.extend([Movement::Carry(carried.clone()), Movement::Arrive(carried)]);
        }
        movements.extend(self.reconnect(pairs));
        movements.extend(self.turn_followers(id));
        for (follower, svv) in again {
            movements.extend(self.turn(follower, &svv, id));
        }
        if !rows.is_empty() {
            movements.push(Movement::Tables(rows));
        }
        movements
    }

    /// From the reset to the end of the initial list's first stage.
    pub fn opening(&self, id: u64, stores: &[(Target, Vec<u8>)]) -> Vec<Movement> {
        let instance = &self.instances[&id];
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        let mut builder = Builder::at_home(instance.installed.homes.clone());
        self.refresh(&mut builder, instance, stores);
        builder.barrier();
        if instance.owner.is_some() && !self.logical[instance.owner.as_ref().expect("checked")].copies.is_empty() {
            self.open_device(&mut builder, instance, &of);
        } else {
            of.engage(&mut builder);
            of.enter(&mut builder, &[], instance.plan.initial, 0, Some(instance.generation));
        }
        builder.finish().into()
    }

    /// Everything of the instance is as at the first start, its clock at 0, ψ stored.
    pub fn refresh(&self, builder: &mut Builder, instance: &Instance, stores: &[(Target, Vec<u8>)]) {
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
            self.begin_delay(builder, instance, *source, (*block, *item), delay);
        }
        for &source in &instance.installed.sources {
            builder.add(source, Op::StartClock(instance.installed.process.clone()));
        }
        self.set_rest(builder, instance, false);
        for (target, bytes) in stores {
            self.store_target(builder, instance, target, bytes);
        }
        for (source, op) in instance.fill_ops().into_iter().chain(instance.tune_ops(None)) {
            builder.add(source, op);
        }
    }

    /// The first value of a ratio input: that of the object it is bound to, as it is in its source.
    fn begin_delay(&self, builder: &mut Builder, instance: &Instance, source: SourceId, port: (usize, usize), delay: &kernel::Cell) {
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

    /// The initial list of a device's own verb: what starts as a copy is copied after the leading executes, before the loop closes.
    fn open_device(&self, builder: &mut Builder, instance: &Instance, of: &Verbatim) {
        let (list, generation) = (instance.plan.initial, Some(instance.generation));
        let stage = &instance.plan.lists[list].stages[0];
        of.open(builder, list, 0, generation);
        let leading = stage.commands.iter().take_while(|c| matches!(c, PlannedCommand::Execute(_) | PlannedCommand::Install(_))).count();
        of.commands(builder, &stage.commands[..leading], generation);
        let copies = &self.logical[instance.owner.as_ref().expect("it has one")].copies;
        for (_, from) in copies {
            let svv = &self.svvs[from];
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

    /// One value of ψ, into every image that has its object.
    pub(crate) fn store_target(&self, builder: &mut Builder, instance: &Instance, target: &Target, bytes: &[u8]) {
        match target {
            Target::Cell(cell) => self.store_cell(builder, instance, *cell, bytes),
            Target::Cells(cells) if !cells.is_empty() => {
                for (cell, part) in cells.iter().zip(bytes.chunks(bytes.len() / cells.len())) {
                    self.store_cell(builder, instance, *cell, part);
                }
            }
            Target::Cells(_) => {}
            Target::Item { block, item } => {
                builder.add(instance.installed.block_source[*block], Op::Store(instance.installed.blocks[*block].value(*item), bytes.into()));
            }
            Target::Report { .. } => {}
        }
    }

    fn store_cell(&self, builder: &mut Builder, instance: &Instance, cell: usize, bytes: &[u8]) {
        if let CellKind::Svv { name, .. } = &instance.plan.cells[cell].kind {
            for (source, op) in self.svvs[name].store_ops(bytes) {
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
}
