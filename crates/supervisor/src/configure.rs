// SPDX-License-Identifier: Apache-2.0
//! Configuration: hardware, code, definitions, SVVs. It can change at any time, as long as nothing that runs is affected.
use crate::catalog::Code;
use crate::core::PhysicalRecord;
use crate::location::{Location, Patience, Processor};
use crate::refuse::{invalid_state, known_unit, refuse, refuse_at, unknown};
use crate::svvs::SvvRecord;
use crate::system::System;
use crate::tables::SourceTable;
use indexmap::IndexMap;
use kernel::{Direction, Number, SourceSpec};
use model::configuration::{Channel, PhysicalDevice, Source, SourceKind, Svv, SvvId};
use model::definition::{DeviceType, Graph, Initial, SvvSpecification, Verb};
use model::plan::CellKind;
use model::refusal::{Class, Place, Refusals};
use model::types::Type;
use model::{CheckedVerb, Composition, check_graph, compose};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// An SVV as it is asked for: its specification, and the struct types that its type needs.
#[derive(Clone, Debug, serde::Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct SvvRequest {
    #[serde(flatten)]
    pub specification: SvvSpecification,
    #[serde(default)]
    pub types: IndexMap<String, String>,
}

impl System {
    /// A real-time processor. `core`: where its sources' threads are pinned. The first is the supervisor, unless another says so.
    pub fn processor(&self, name: &str, core: Option<usize>, supervisor: bool) -> Result<(), Refusals> {
        self.processor_in(name, core, supervisor, Location::Thread)
    }

    /// The same, in a process of its own, in one with others, or on another host. Under the virtual clock all are threads of one.
    pub fn processor_in(&self, name: &str, core: Option<usize>, supervisor: bool, location: Location) -> Result<(), Refusals> {
        self.processor_within(name, core, supervisor, location, Patience::default())
    }

    /// The same, with how long its process and its supervisor may stand still.
    pub fn processor_within(&self, name: &str, core: Option<usize>, supervisor: bool, location: Location, patience: Patience) -> Result<(), Refusals> {
        let bounds = patience.bounds(name, &location)?;
        let mut definitions = self.shared.definitions();
        crate::sane::name("a processor", name)?;
        if definitions.configuration.processors.iter().any(|p| p == name) {
            return Err(refuse(Class::InUse, format!("there is a processor '{name}' already"), "give it another name"));
        }
        if let Some(core) = core.filter(|c| *c >= cores()) {
            return Err(refuse(
                Class::PlacementError,
                format!("processor '{name}' asks for core {core}, this machine has cores 0 to {}", cores() - 1),
                "give one of those, or leave it out",
            ));
        }
        if let Some((other, _)) = definitions.processors.iter().find(|(_, p)| supervisor && p.supervisor && p.asked) {
            return Err(refuse(
                Class::InUse,
                format!("processor '{name}' cannot be the supervisor: '{other}' is"),
                "a system has one supervisor; leave supervisor= out",
            ));
        }
        self.settle(&definitions, name, supervisor, &location, bounds)?;
        let first = definitions.processors.is_empty();
        if supervisor {
            definitions.processors.values_mut().for_each(|p| p.supervisor = false);
        }
        definitions.processors.insert(name.to_owned(), Processor { core, supervisor: supervisor || first, asked: supervisor, location });
        definitions.configuration.processors.push(name.to_owned());
        Ok(())
    }

    /// An interrupt source of a processor. `kind`: `timer`, `trigger` or `software`.
    pub fn source(&self, processor: &str, name: &str, kind: SourceKind, priority: u8, virtual_cost_ns: u64) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let Some(rtp) = definitions.processors.get_index_of(processor) else {
            return Err(unknown("processor", processor, definitions.processors.keys().map(String::as_str)));
        };
        crate::sane::name("a source", name)?;
        let full = format!("{processor}.{name}");
        if definitions.configuration.sources.contains_key(&full) {
            return Err(refuse(Class::InUse, format!("there is a source '{full}' already"), "give it another name"));
        }
        if !(1..=98).contains(&priority) {
            return Err(refuse(Class::ValueRefused, format!("priority {priority} of source '{full}' is not in 1 to 98"), "1 is the lowest"));
        }
        if let SourceKind::Timer { period_ns } = kind
            && period_ns < PERIOD_NS_MIN
        {
            return Err(refuse(
                Class::ValueRefused,
                format!("the period of source '{full}' is {} ms, shorter than 10 us", period_ns as f64 * 1e-6),
                "give at least \"10 us\"",
            ));
        }
        let spec = SourceSpec {
            rtp: u16::try_from(rtp).expect("fewer than 65,536 processors"),
            name: full.clone(),
            kind: match &kind {
                SourceKind::Timer { period_ns } => kernel::SourceKind::Timer { period_ns: *period_ns },
                SourceKind::Trigger | SourceKind::Software => kernel::SourceKind::Software,
            },
            priority,
            core: definitions.processors[rtp].core,
            virtual_cost_ns,
        };
        let id = self.add_source(processor, spec)?;
        self.shared.command(|core| {
            core.sources.insert(full.clone(), id);
            core.tables.insert(id, SourceTable::default());
            Ok(())
        })?;
        definitions.configuration.sources.insert(full, Source { processor: processor.to_owned(), kind, priority });
        self.post_supervisor(&definitions);
        Ok(())
    }

    /// The supervisor's thread runs on the core of its processor, above the sources there.
    fn post_supervisor(&self, definitions: &crate::system::Definitions) {
        let Some((name, processor)) = definitions.processors.iter().find(|(_, p)| p.supervisor) else { return };
        let sources = definitions.configuration.sources.values().filter(|s| s.processor == *name);
        let Some(highest) = sources.map(|s| s.priority).max() else { return };
        let wanted = Some((highest + 1, processor.core));
        let mut post = self.shared.post.lock().expect("nobody panics with the lock held");
        if post.wanted != wanted {
            (post.wanted, post.taken) = (wanted, false);
            drop(post);
            self.shared.host.unpark();
        }
    }

    /// Requests a firing of a trigger or software source.
    pub fn request(&self, source: &str) -> Result<(), Refusals> {
        let definitions = self.shared.definitions();
        match definitions.configuration.sources.get(source) {
            None => Err(unknown("source", source, definitions.configuration.sources.keys().map(String::as_str))),
            Some(Source { kind: SourceKind::Timer { .. }, .. }) => {
                Err(refuse(Class::InvalidState, format!("source '{source}' is a timer"), "only triggers and software sources can be requested"))
            }
            Some(_) => self.shared.command(|core| {
                if core.host.is_full() {
                    let message = format!("source '{source}' takes no request: 10,000 requests wait for their firings at this instant");
                    return Err(refuse(Class::SchedulingError, message, "let time pass between requests: advance() serves them"));
                }
                core.host.request(core.sources[source]);
                Ok(())
            }),
        }
    }

    /// Lets a channel that a physical device reads raise a trigger or software source, of any processor, each time it goes from zero to
    /// something else. It is looked at in each firing of the device's source.
    pub fn raise(&self, device: &str, channel: &str, source: &str, place: Option<Place>) -> Result<(), Refusals> {
        let definitions = self.shared.definitions();
        let Some(of) = definitions.configuration.devices.get(device) else {
            return Err(unknown("physical device", device, definitions.configuration.devices.keys().map(String::as_str)));
        };
        let Some((index, found)) = of.channels.iter().enumerate().find(|(_, known)| known.name == channel) else {
            return Err(unknown(&format!("channel of '{device}' named"), channel, of.channels.iter().map(|known| known.name.as_str())));
        };
        let refused = |class, why: &str, remedy: &str| {
            Err(refuse_at(class, format!("channel '{device}.{channel}' cannot raise source '{source}': {why}"), remedy, place.clone()))
        };
        match definitions.configuration.sources.get(source).map(|source| &source.kind) {
            None => return Err(unknown("source", source, definitions.configuration.sources.keys().map(String::as_str))),
            Some(SourceKind::Timer { .. }) => return refused(Class::InvalidState, "it is a timer", "name a trigger or software source"),
            Some(SourceKind::Trigger | SourceKind::Software) => {}
        }
        let number = match found.type_text.as_str() {
            _ if found.write => return refused(Class::TypeMismatch, "the channel is written", "name a channel that is read"),
            "double" => Number::Double,
            "float" => Number::Float,
            text if text == "bool" || (text.ends_with("_t") && !text.contains('[')) => Number::Whole,
            text => return refused(Class::TypeMismatch, &format!("it is a {text}"), "name a channel with one number"),
        };
        self.pass_on(device, source)?;
        self.shared.command(|core| {
            let Some(physical) = core.physical.get(device) else { return Err(unknown("physical device", device, core.physical.keys().map(String::as_str))) };
            let edge = kernel::Edge::new(&physical.device, index, number, core.sources[source]);
            let exchange = physical.source;
            let table = core.tables.get_mut(&exchange).expect("a source has its table as long as the system lives");
            table.edges.push((device.to_owned(), edge));
            let op = core.table_op(exchange);
            core.submit(exchange, vec![op], crate::core::Purpose::Nothing);
            Ok(())
        })
    }

    /// Opens a physical device. Returns its channels and what the driver says of itself (JSON).
    pub fn physical_device(
        &self,
        processor: &str,
        name: &str,
        kind: &str,
        options: &serde_json::Value,
        source: &str,
        place: Option<Place>,
    ) -> Result<serde_json::Value, Refusals> {
        let mut definitions = self.shared.definitions();
        crate::sane::name("a physical device", name)?;
        let configuration = &definitions.configuration;
        if configuration.devices.contains_key(name) {
            return Err(refuse_at(Class::InUse, format!("there is a physical device '{name}' already"), "give it another name", place));
        }
        match configuration.sources.get(source) {
            None => return Err(unknown("source", source, configuration.sources.keys().map(String::as_str))),
            Some(s) if s.processor != processor => {
                return Err(refuse_at(
                    Class::PlacementError,
                    format!("device '{name}' of processor '{processor}' cannot be exchanged by source '{source}'"),
                    format!("name a source of '{processor}'"),
                    place,
                ));
            }
            Some(_) => {}
        }
        // Under the virtual clock nothing can run at a pace of its own.
        let (kind, options) = if self.shared.is_virtual { drivers::plant_process::in_place(kind, options) } else { (kind.to_owned(), options.clone()) };
        let (device, description, opened) = (self.open_device(processor, name, &kind, &options))
            .map_err(|why| refuse_at(Class::DeviceFailed, format!("cannot open device '{name}': {}", model::wording::plain_within(&why)), "", place.clone()))?;
        let channels: Vec<Channel> = (device.channels().iter())
            .map(|c| Channel { name: c.name.clone(), write: c.direction == Direction::Write, type_text: c.type_text.clone(), unit: c.unit.clone() })
            .collect();
        for channel in &channels {
            known_unit(&channel.unit, &format!("channel '{name}.{}'", channel.name), &place)?;
        }
        self.shared.command(|core| {
            let id = core.sources[source];
            device.obey(core.emergency.stop.clone());
            core.tables.get_mut(&id).expect("a source has its table as long as the system lives").devices.push(device.clone());
            core.physical
                .insert(name.to_owned(), PhysicalRecord { device, source: id, lost: None, opened, driver: (kind, options), about: description.clone() });
            let op = core.table_op(id);
            core.submit(id, vec![op], crate::core::Purpose::Nothing);
            Ok(())
        })?;
        let mut json = description;
        json["channels"] = serde_json::json!(channels);
        definitions
            .configuration
            .devices
            .insert(name.to_owned(), PhysicalDevice { processor: processor.to_owned(), source: source.to_owned(), channels, place });
        Ok(json)
    }

    /// Closes a physical device that nothing is bound to.
    pub fn delete_physical_device(&self, name: &str) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        self.shared.command(|core| {
            let Some(physical) = core.physical.get(name) else {
                return Err(unknown("physical device", name, core.physical.keys().map(String::as_str)));
            };
            let bound = |i: &&crate::instance::Instance| i.plan.cells.iter().any(|c| matches!(&c.kind, CellKind::Channel { device, .. } if device == name));
            if let Some(user) = core.instances.values().find(bound) {
                return Err(invalid_state(
                    &format!("physical device '{name}'"),
                    &format!("bound by '{}'", user.name),
                    "delete",
                    "delete that instance or device first",
                ));
            }
            if core.emergency.inputs.iter().any(|input| input.device == name) || core.modes.enabling.as_ref().is_some_and(|(device, _)| device == name) {
                let what = "needed: a channel of it is an emergency stop input or the enabling switch";
                return Err(invalid_state(&format!("physical device '{name}'"), what, "delete", "keep it as long as the system"));
            }
            let (source, device) = (physical.source, physical.device.clone());
            core.physical.shift_remove(name);
            core.alarm_closed(name);
            let table = core.tables.get_mut(&source).expect("a source has its table as long as the system lives");
            table.devices.retain(|d| !Arc::ptr_eq(d, &device));
            table.edges.retain(|(of, _)| of != name);
            let op = core.table_op(source);
            core.submit(source, vec![op], crate::core::Purpose::Nothing);
            core.shut_elsewhere(source, name);
            Ok(())
        })?;
        definitions.configuration.devices.shift_remove(name);
        Ok(())
    }

    /// Patterns over `verb.label` → source.
    pub fn place(&self, placement: IndexMap<String, String>) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        for source in placement.values() {
            if !definitions.configuration.sources.contains_key(source) {
                return Err(unknown("source", source, definitions.configuration.sources.keys().map(String::as_str)));
            }
        }
        definitions.configuration.placement.extend(placement);
        Ok(())
    }

    /// Enters a verb. An equal definition is nothing; another one of the name is refused while an instance runs.
    pub fn define_verb(&self, verb: Verb) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        if definitions.configuration.verbs.get(&verb.name) == Some(&verb) && definitions.checked.contains_key(&verb.name) {
            return Ok(());
        }
        self.refuse_busy(&verb.name, "redefine")?;
        let checked = CheckedVerb::new(&verb, &definitions.configuration)?;
        definitions.checked.insert(verb.name.clone(), Arc::new(checked));
        definitions.configuration.verbs.insert(verb.name.clone(), verb);
        Ok(())
    }

    /// Refuses where an instance of the verb runs or is suspended.
    fn refuse_busy(&self, verb: &str, call: &str) -> Result<(), Refusals> {
        let core = self.shared.locked();
        match core.instances.values().find(|i| i.plan.verb == verb && i.is_busy()) {
            None => Ok(()),
            Some(busy) => Err(refuse(
                Class::InUse,
                format!("cannot {call} verb '{verb}': its instance '{}' is {}", busy.name, busy.state.name()),
                format!("halt '{}' first", busy.name),
            )),
        }
    }

    /// Every refusal of a graph's definition.
    pub fn check_graph(&self, graph: &Graph) -> Result<(), Refusals> {
        let refusals = check_graph(graph, &self.shared.definitions().configuration);
        if refusals.is_empty() { Ok(()) } else { Err(refusals) }
    }

    /// Makes a verb of several; nothing is entered.
    pub fn compose(&self, composition: &Composition) -> Result<Verb, Refusals> {
        compose(composition, &self.shared.definitions().configuration)
    }

    /// Enters a logical device type.
    pub fn define_device_type(&self, of: DeviceType) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        if definitions.configuration.device_types.get(&of.name) == Some(&of) {
            return Ok(());
        }
        if let Some(verb) = of.verb.as_ref().filter(|v| !definitions.configuration.verbs.contains_key(*v)) {
            return Err(unknown("verb", verb, definitions.configuration.verbs.keys().map(String::as_str)));
        }
        let device = definitions.configuration.logical_devices.iter().find(|(_, d)| d.device_type == of.name);
        if let Some((device, _)) = device {
            return Err(refuse_at(
                Class::InUse,
                format!("cannot redefine device type '{}': device '{device}' is of it", of.name),
                format!("delete '{device}' first"),
                of.place,
            ));
        }
        let units = of.svvs.iter().map(|(name, svv)| (name, &svv.unit)).chain(of.parameters.iter().map(|(name, parameter)| (name, &parameter.unit)));
        for (name, unit) in units {
            known_unit(unit, &format!("'{name}' of device type '{}'", of.name), &of.place)?;
        }
        for (name, svv) in &of.svvs {
            Type::parse(&svv.type_text, &IndexMap::new()).map_err(|r| vec![crate::life::named(r, name)])?;
        }
        definitions.configuration.device_types.insert(of.name.clone(), of);
        Ok(())
    }

    /// Makes an SVV of the system.
    pub fn svv(&self, name: &str, request: &SvvRequest, place: Option<Place>) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        self.make_svv(&mut definitions, name, request, None, place)
    }

    pub(crate) fn make_svv(
        &self,
        definitions: &mut crate::system::Definitions,
        name: &str,
        request: &SvvRequest,
        device: Option<&str>,
        place: Option<Place>,
    ) -> Result<(), Refusals> {
        if definitions.configuration.svvs.contains_key(name) {
            return Err(refuse_at(Class::InUse, format!("there is an SVV '{name}' already"), "give it another name, or delete that one first", place));
        }
        let asked = &request.specification;
        let of = Type::parse(&asked.type_text, &request.types).map_err(|r| vec![crate::life::named(r, name)])?;
        crate::sane::svv(name, asked, of.size())?;
        known_unit(&asked.unit, &format!("SVV '{name}'"), &place)?;
        let stored = match &asked.initial {
            Some(Initial::Value(value)) => of.encode(value, &asked.unit).map_err(|r| vec![crate::life::named(r, name)])?,
            _ => vec![0; of.size()],
        };
        let (type_text, now_ns) = (of.normalised(), self.shared.host.now_ns());
        let id = self.shared.command(|core| {
            core.svvs_made += 1;
            let id = SvvId(core.svvs_made);
            core.svvs.insert(
                name.to_owned(),
                SvvRecord {
                    id,
                    type_text: type_text.clone(),
                    unit: asked.unit.clone(),
                    size: of.size(),
                    within: asked.within,
                    history: asked.history,
                    cells: BTreeMap::new(),
                    readers: BTreeMap::new(),
                    home: None,
                    stored,
                    stored_ns: now_ns,
                    writers: Vec::new(),
                    written_by: None,
                    bound: 0,
                    stamps: BTreeMap::new(),
                    ratio: 1,
                    rings: BTreeMap::new(),
                    stays: VecDeque::new(),
                    windows: Vec::new(),
                    stores: VecDeque::new(),
                },
            );
            core.widen_taps();
            Ok(id)
        })?;
        let svv = Svv {
            id,
            type_text: asked.type_text.clone(),
            unit: asked.unit.clone(),
            types: request.types.clone(),
            history: asked.history,
            device: device.map(str::to_owned),
            shared: false,
            place,
        };
        definitions.configuration.svvs.insert(name.to_owned(), svv);
        Ok(())
    }

    /// Deletes an SVV that nothing is bound to.
    pub fn delete_svv(&self, name: &str) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let name = self.shared.locked().name_of(name)?;
        let Some(svv) = definitions.configuration.svvs.get(name) else {
            return Err(unknown("SVV", name, definitions.configuration.svvs.keys().map(String::as_str)));
        };
        if let Some(device) = &svv.device {
            return Err(invalid_state(&format!("SVV '{name}'"), &format!("part of device '{device}'"), "delete", "delete the device"));
        }
        self.shared.command(|core| {
            let bound = core.instances.values().find(|i| i.plan.cells.iter().any(|c| matches!(&c.kind, CellKind::Svv { name: n, .. } if n == name)));
            if let Some(instance) = bound {
                return Err(invalid_state(&format!("SVV '{name}'"), &format!("bound by '{}'", instance.name), "delete", "delete that instance first"));
            }
            core.svvs.shift_remove(name);
            core.recorded.retain(|(of, _), _| of != name);
            Ok(())
        })?;
        definitions.configuration.svvs.shift_remove(name);
        Ok(())
    }

    /// The library's blocks, as module `library`.
    pub(crate) fn enter_library(&self) {
        let types: Vec<_> = library::types().iter().filter_map(|t| opengpac::read::TypeFace::read(t).ok()).collect();
        let blocks = library::blocks();
        let faces: Vec<_> =
            blocks.iter().map(|d| opengpac::read::BlockFace::read(d, &types).expect("the library's own blocks are in order: its tests check it")).collect();
        self.enter_module("library", &faces, &types, Arc::new(rtp::Module::library()));
    }

    /// Enters blocks that are part of this program (Rust blocks linked into it) as module `module`; a module of that name is
    /// redefined. For code that comes while the system runs see [`System::download`]. Refused where a descriptor is not in order
    /// (`ModuleError`), or an instance of the module's blocks runs (`InUse`).
    pub fn enter(&self, module: &str, blocks: &[&'static opengpac::abi::Descriptor], types: &[&'static opengpac::abi::TypeDescriptor]) -> Result<(), Refusals> {
        self.refuse_busy_module(module)?;
        let wrong = |why: String| refuse(Class::ModuleError, format!("cannot enter module '{module}': {why}"), "");
        let types = types.iter().map(|t| opengpac::read::TypeFace::read(t)).collect::<Result<Vec<_>, _>>().map_err(|why| wrong(why.to_string()))?;
        let faces = blocks.iter().map(|d| opengpac::read::BlockFace::read(d, &types)).collect::<Result<Vec<_>, _>>().map_err(|why| wrong(why.to_string()))?;
        self.enter_module(module, &faces, &types, Arc::new(()));
        Ok(())
    }

    /// Enters blocks under a module's name; verbs that use them are checked again when they are applied next.
    pub(crate) fn enter_module(
        &self,
        module: &str,
        blocks: &[opengpac::read::BlockFace],
        types: &[opengpac::read::TypeFace],
        keep: Arc<dyn std::any::Any + Send + Sync>,
    ) {
        let mut definitions = self.shared.definitions();
        let types: IndexMap<String, String> = types.iter().map(|t| (t.name.clone(), t.declaration.clone())).collect();
        let code: Vec<Code> = (blocks.iter())
            .map(|face| Code { descriptor: face.descriptor, module: keep.clone(), interface: Arc::new(crate::faces::interface(module, face, &types)) })
            .collect();
        let prefix = format!("{module}.");
        definitions.configuration.interfaces.retain(|name, _| !name.starts_with(&prefix));
        for entry in &code {
            definitions.configuration.interfaces.insert(entry.interface.name.clone(), (*entry.interface).clone());
        }
        definitions.catalog.enter(module, types, code);
        definitions.checked.clear();
        drop(definitions);
        // A module that comes anew is trusted anew.
        self.shared.locked().poisoned.remove(module);
    }

    /// Verb instances of the module's blocks that run or are suspended keep it from being redefined.
    pub(crate) fn refuse_busy_module(&self, module: &str) -> Result<(), Refusals> {
        let core = self.shared.locked();
        let prefix = format!("{module}.");
        match core.instances.values().find(|i| i.is_busy() && i.plan.blocks.iter().any(|b| b.block.starts_with(&prefix))) {
            None => Ok(()),
            Some(busy) => Err(refuse(
                Class::InUse,
                format!("cannot download module '{module}' again: instance '{}' of its blocks is {}", busy.name, busy.state.name()),
                format!("halt '{}' first", busy.name),
            )),
        }
    }

    /// Stores a value from the PS.
    pub fn write(&self, name: &str, value: &model::value::Value) -> Result<(), Refusals> {
        self.shared.command(|core| core.write(name, value))
    }
}

/// The shortest period of a timer.
const PERIOD_NS_MIN: u64 = 10_000;

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
