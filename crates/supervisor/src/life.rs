// SPDX-License-Identifier: Apache-2.0
//! The life of a verb instance: start, suspend, resume, halt, delete. A call that the state does not allow changes nothing.
use crate::core::{Core, DeviceState};
use crate::instance::{Instance, Limits, RunningTime, State};
use crate::refuse::{invalid_state, refuse};
use crate::retune::Intervals;
use crate::sequence::{Builder, Carried, Movement};
use crate::stages::Verbatim;
use crate::values::Stamped;
use indexmap::IndexMap;
use kernel::{Op, SourceId};
use model::configuration::{Configuration, SvvId};
use model::interface::Mode;
use model::plan::{Binding, CellKind, Claim, InputOrigin, Plan, PlannedCommand, Target};
use model::refusal::{Class, End, Refusal, Refusals};
use model::types::Type;
use model::value::Value;

impl Core {
    /// An instance that is not deleted.
    pub fn instance(&self, id: u64) -> Result<&Instance, Refusals> {
        self.instances.get(&id).ok_or_else(|| invalid_state("the verb instance", "deleted", "use", "make a new one with new_instance(…)"))
    }

    /// Starts it: claims, ψ, the initial command list. Nothing has changed where it refuses.
    pub fn start(&mut self, id: u64, values: &IndexMap<String, Value>, limits: Limits, configuration: &Configuration) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        if !matches!(instance.state, State::Created | State::Ended) {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state.name(), "start", "wait for it or halt it first"));
        }
        self.refuse_emergency("start", &instance.name)?;
        self.check_enabled(instance)?;
        self.check_sources(instance)?;
        self.check_age(instance, limits.age_max_ns)?;
        let stores = psi(&instance.plan, values, configuration)?;
        let (plan, name) = (instance.plan.clone(), instance.name.clone());
        self.check_stores(id, &plan, &stores)?;
        self.claim_all(id, &plan, &name)?;
        self.keep_stored(&plan, &stores);
        let mut movements: Vec<Movement> = self.take_over(id);
        let now_ns = self.host.now_ns();
        let overruns = self.overruns(id);
        let instance = self.instances.get_mut(&id).expect("found above");
        instance.state = State::Running;
        instance.starts += 1;
        instance.started_ns = now_ns;
        instance.running = RunningTime::start(now_ns);
        instance.limits = limits;
        instance.overruns_before = overruns;
        instance.generation = instance.installed.process.now().0 + 1;
        (instance.list, instance.stage) = (instance.plan.initial, 0);
        instance.report = None;
        instance.others.clear();
        instance.outputs.clear();
        instance.captured.clear();
        instance.halting = false;
        instance.suspending = false;
        instance.wait_until_ns = None;
        instance.target = (instance.list, instance.stage);
        movements.extend(self.opening(id, &stores));
        self.log.add(now_ns, "start", &name, "");
        self.append_sequence(id, movements);
        Ok(())
    }

    /// Every logical device that the verb uses is enabled.
    fn check_enabled(&self, instance: &Instance) -> Result<(), Refusals> {
        let disabled: Refusals = (instance.plan.devices.iter())
            .filter(|d| self.logical.get(*d).is_some_and(|l| l.state != DeviceState::Enabled))
            .map(|d| Refusal {
                class: Class::NotEnabled,
                message: format!("cannot start '{}': device '{d}' is not enabled", instance.name),
                ends: vec![End { what: format!("device '{d}'"), place: None }],
                remedy: format!("call enable() on '{d}' first"),
                place: None,
            })
            .collect();
        if disabled.is_empty() { Ok(()) } else { Err(disabled) }
    }

    /// No source of it was stopped by a fault.
    fn check_sources(&self, instance: &Instance) -> Result<(), Refusals> {
        for &source in &instance.installed.sources {
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

    /// No other instance has claimed an SVV that ψ stores into.
    fn check_stores(&self, id: u64, plan: &Plan, stores: &[(Target, Vec<u8>)]) -> Result<(), Refusals> {
        let holder = |svv: &SvvId, name: &str| self.claims.get(&Claim::Svv { id: *svv, name: name.to_owned() }).filter(|holder| **holder != id);
        let held: Refusals = (stored_svvs(plan, stores))
            .filter_map(|(svv, name, _)| Some((name, self.instances.get(holder(svv, name)?)?)))
            .flat_map(|(name, holder)| {
                refuse(
                    Class::SecondWriter,
                    format!("'{}' cannot store into SVV '{name}': it is written by '{}'", plan.verb, holder.name),
                    format!("wait for '{}' or halt it", holder.name),
                )
            })
            .collect();
        if held.is_empty() { Ok(()) } else { Err(held) }
    }

    /// What ψ stores into an SVV is its value for images that get it later.
    fn keep_stored(&mut self, plan: &Plan, stores: &[(Target, Vec<u8>)]) {
        let now_ns = self.host.now_ns();
        for (_, name, bytes) in stored_svvs(plan, stores) {
            if let Some(record) = self.svvs.get_mut(name) {
                record.keep(bytes, now_ns);
            }
        }
    }

    /// Claims all that the verb can write, or nothing.
    fn claim_all(&mut self, id: u64, plan: &Plan, name: &str) -> Result<(), Refusals> {
        let held: Refusals = (plan.claims.iter())
            .filter_map(|claim| self.claims.get(claim).filter(|holder| **holder != id).map(|holder| (claim, *holder)))
            .map(|(claim, holder)| {
                let what = self.claim_name(claim);
                let holder = self.instances.get(&holder).map_or("?", |i| i.name.as_str());
                Refusal {
                    class: Class::SecondWriter,
                    message: format!("cannot start '{name}': {what} is written by '{holder}'"),
                    ends: vec![End { what: what.clone(), place: None }, End { what: format!("'{holder}'"), place: None }],
                    remedy: format!("wait for '{holder}' or halt it"),
                    place: None,
                }
            })
            .collect();
        if !held.is_empty() {
            return Err(held);
        }
        for claim in &plan.claims {
            self.claims.insert(claim.clone(), id);
        }
        Ok(())
    }

    fn claim_name(&self, claim: &Claim) -> String {
        match claim {
            Claim::Svv { name, .. } => format!("SVV '{name}'"),
            Claim::Channel { device, channel } => {
                let name = self.physical.get(device).and_then(|p| p.device.channels().get(*channel).map(|c| c.name.clone()));
                format!("channel '{device}.{}'", name.unwrap_or_default())
            }
        }
    }

    /// The SVVs that the instance writes from now on belong to its sources: connections are made anew where the writer's source changes.
    fn take_over(&mut self, id: u64) -> Vec<Movement> {
        let instance = &self.instances[&id];
        let mut written: Vec<(String, SourceId)> = Vec::new();
        let mut stamps = Vec::new();
        let slowest = slowest(&instance.plan);
        for cell in &instance.plan.cells {
            if let (CellKind::Svv { name, .. }, Some((block, item))) = (&cell.kind, cell.writers.first()) {
                written.push((name.clone(), instance.installed.block_source[*block]));
                let ratio = match instance.installed.interfaces[*block].items[*item].mode {
                    Mode::Ratio(n) => u64::from(n),
                    _ => 1,
                };
                let stamp = instance.installed.stamps[instance.plan.blocks[*block].activation].clone();
                stamps.push(Stamped { stamp, ratio, firings: slowest * ratio as usize });
            }
        }
        let home = |svv: &str| self.svvs.get(svv).and_then(|s| s.home);
        let carried: Vec<Carried> =
            (written.iter()).filter_map(|(svv, to)| Some(Carried { svv: svv.clone(), from: home(svv).filter(|from| from != to)?, to: *to })).collect();
        let pairs = written.iter().flat_map(|(svv, source)| self.hand_over(svv, *source)).collect::<Vec<_>>();
        let rows = self.remake_rows(&written, stamps);
        let mut movements = Vec::new();
        if !carried.is_empty() {
            movements.extend([Movement::Carry(carried.clone()), Movement::Arrive(carried)]);
        }
        movements.extend(self.reconnect(pairs));
        movements.extend(self.turn_followers(id));
        if !rows.is_empty() {
            movements.push(Movement::Tables(rows));
        }
        movements
    }

    /// From the reset to the end of the initial list's first stage.
    fn opening(&self, id: u64, stores: &[(Target, Vec<u8>)]) -> Vec<Movement> {
        let instance = &self.instances[&id];
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        let mut builder = Builder::default();
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
            self.begin_delay(&mut builder, instance, *source, (*block, *item), delay);
        }
        for &source in &instance.installed.sources {
            builder.add(source, Op::StartClock(instance.installed.process.clone()));
        }
        for (target, bytes) in stores {
            self.store_target(&mut builder, instance, target, bytes);
        }
        for (source, op) in instance.fill_ops().into_iter().chain(instance.tune_ops(None)) {
            builder.add(source, op);
        }
        builder.barrier();
        if instance.owner.is_some() && !self.logical[instance.owner.as_ref().expect("checked")].copies.is_empty() {
            self.open_device(&mut builder, instance, &of);
        } else {
            of.engage(&mut builder);
            of.enter(&mut builder, &[], instance.plan.initial, 0, Some(instance.generation));
        }
        builder.finish().into()
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
        for command in &stage.commands[..leading] {
            of.command(builder, command, generation);
        }
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
        for command in &stage.commands[leading..] {
            of.command(builder, command, generation);
        }
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

    /// Halts it: τ on `halted`, or the end. A second halt is immediate.
    pub fn halt(&mut self, id: u64) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        if !matches!(instance.state, State::Running | State::Suspended) {
            return Err(invalid_state(&format!("'{}'", instance.name), instance.state.name(), "halt", "only a running or suspended instance can be halted"));
        }
        if let Some(condition) = instance.condition("halted") {
            self.come(id, condition, String::new(), true);
        }
        Ok(())
    }

    /// New values of tunable input parameters of a running instance, as one publication between two firings; with new intervals, and the
    /// plan that has them.
    pub fn set(&mut self, id: u64, values: &IndexMap<String, Value>, tuned: Option<(Intervals, &Plan)>) -> Result<(), Refusals> {
        let instance = self.instance(id)?;
        instance.check_settable()?;
        let mut refusals = Vec::new();
        let mut stores = Vec::new();
        for (name, value) in values {
            match instance.plan.inputs.iter().find(|i| i.name == *name) {
                None => refusals.extend(crate::refuse::unknown("input parameter", name, instance.plan.inputs.iter().map(|i| i.name.as_str()))),
                Some(input) if !input.tunable => refusals.extend(refuse(
                    Class::InvalidState,
                    format!("input parameter '{name}' of '{}' is not tunable", instance.plan.verb),
                    "declare it with gpac.input(…, tunable=True), or give it at the next start",
                )),
                Some(input) => match encode(&input.type_text, &input.unit, value) {
                    Ok(bytes) => stores.extend(input.targets.iter().map(|t| (t.clone(), bytes.clone()))),
                    Err(refusal) => refusals.push(named(refusal, name)),
                },
            }
        }
        if !refusals.is_empty() {
            return Err(refusals);
        }
        let mut builder = Builder::default();
        for (target, bytes) in &stores {
            self.store_target(&mut builder, instance, target, bytes);
        }
        if let Some((tuned, plan)) = tuned {
            self.tune_intervals(id, tuned, plan, &mut builder);
        }
        self.append_sequence(id, builder.finish());
        Ok(())
    }

    /// Overruns counted so far in the sources of an instance.
    pub fn overruns(&self, id: u64) -> u64 {
        self.instances[&id].installed.sources.iter().map(|s| self.host.statistics(*s).overruns).sum()
    }
}

/// The SVVs that ψ stores into, with their values.
fn stored_svvs<'a>(plan: &'a Plan, stores: &'a [(Target, Vec<u8>)]) -> impl Iterator<Item = (&'a SvvId, &'a str, &'a [u8])> {
    let parts = stores.iter().flat_map(|(target, bytes)| {
        let cells = match target {
            Target::Cell(cell) => std::slice::from_ref(cell),
            Target::Cells(cells) => cells,
            Target::Item { .. } | Target::Report { .. } => &[],
        };
        let len = bytes.len() / cells.len().max(1);
        cells.iter().zip(bytes.chunks(len.max(1)))
    });
    parts.filter_map(|(cell, bytes)| match &plan.cells[*cell].kind {
        CellKind::Svv { id, name } => Some((id, name.as_str(), bytes)),
        _ => None,
    })
}

/// The most firings from one invocation to the next that any interval of the verb asks for; of one that other instances drive,
/// what a slow one would.
pub(crate) fn slowest(plan: &Plan) -> usize {
    let driven = plan.activations.iter().any(|a| matches!(a.due, model::plan::Due::Queued { .. }));
    let active = plan.lists.iter().flat_map(|l| &l.stages).flat_map(|s| &s.active);
    active.map(|(_, every)| *every as usize).max().unwrap_or(1).max(if driven { DRIVEN_FIRINGS } else { 1 })
}

/// Firings between two values where only the driving instance knows.
const DRIVEN_FIRINGS: usize = 20;

/// The values of ψ: what was given, else the defaults; those of device parameters as they are now.
fn psi(plan: &Plan, values: &IndexMap<String, Value>, configuration: &Configuration) -> Result<Vec<(Target, Vec<u8>)>, Refusals> {
    let mut refusals: Refusals = Vec::new();
    let mut stores = Vec::new();
    let given = |name: &str| plan.inputs.iter().any(|i| i.name == name && i.origin == InputOrigin::Given);
    for name in values.keys().filter(|n| !given(n)) {
        let known = plan.inputs.iter().filter(|i| i.origin == InputOrigin::Given).map(|i| i.name.as_str());
        refusals.extend(
            crate::refuse::unknown(&format!("input parameter of '{}' named", plan.verb), name, known)
                .into_iter()
                .map(|r| Refusal { class: Class::CallError, ..r }),
        );
    }
    for input in &plan.inputs {
        let value = match &input.origin {
            InputOrigin::Given => values.get(&input.name).cloned().or_else(|| input.default.clone()),
            InputOrigin::Preset => input.default.clone(),
            InputOrigin::DeviceParameter { devices, parameter } => device_values(configuration, devices, parameter, &input.type_text),
        };
        let Some(value) = value else {
            refusals.extend(refuse(Class::CallError, format!("'{}' needs its input parameter '{}'", plan.verb, input.name), "give it, or declare a default"));
            continue;
        };
        match encode(&input.type_text, &input.unit, &value) {
            Ok(bytes) => stores.extend(input.targets.iter().map(|t| (t.clone(), bytes.clone()))),
            Err(refusal) => refusals.push(named(refusal, &input.name)),
        }
    }
    if refusals.is_empty() { Ok(stores) } else { Err(refusals) }
}

/// The present values of a parameter of logical devices: one alone as it is, several as a list.
fn device_values(configuration: &Configuration, devices: &[String], parameter: &str, type_text: &str) -> Option<Value> {
    let values: Vec<Value> = devices.iter().map(|d| configuration.logical_devices.get(d)?.parameters.get(parameter).cloned()).collect::<Option<_>>()?;
    let is_array = type_text.ends_with(']');
    if values.len() == 1 && !is_array { values.into_iter().next() } else { Some(Value::List(values)) }
}

pub(crate) fn encode(type_text: &str, unit: &str, value: &Value) -> Result<Vec<u8>, Refusal> {
    Type::parse(type_text, &IndexMap::new())?.encode(value, unit)
}

/// The same refusal, with the parameter's name in front.
pub(crate) fn named(refusal: Refusal, name: &str) -> Refusal {
    Refusal { message: format!("'{name}': {}", refusal.message), ..refusal }
}
