// SPDX-License-Identifier: Apache-2.0
//! Calls that create processors and interrupt sources, and that raise sources.
use crate::processors::location::{Location, Patience, Processor};
use crate::refuse::{refuse, refuse_at, unknown};
use crate::system::System;
use crate::wiring::tables::SourceTable;
use kernel::{Number, SourceSpec};
use model::configuration::{Source, SourceKind};
use model::refusal::{Class, Refusals, SourceLocation};

impl System {
    /// Creates a real-time processor. `core` is the CPU core to which the threads of its sources are pinned. The first processor is the
    /// supervisor unless another one is declared to be.
    pub fn processor(&self, name: &str, core: Option<usize>, supervisor: bool) -> Result<(), Refusals> {
        self.processor_in(name, core, supervisor, Location::Thread)
    }

    /// Creates a processor in its own process, in a shared process, or on another host. Under the virtual clock, all processors are
    /// threads of this process.
    pub fn processor_in(&self, name: &str, core: Option<usize>, supervisor: bool, location: Location) -> Result<(), Refusals> {
        self.processor_within(name, core, supervisor, location, Patience::default())
    }

    /// Creates a processor, with the maximum times for which its process and its supervisor may hang.
    pub fn processor_within(&self, name: &str, core: Option<usize>, supervisor: bool, location: Location, patience: Patience) -> Result<(), Refusals> {
        let bounds = patience.bounds(name, &location)?;
        let mut definitions = self.shared.definitions();
        crate::definitions::sane::check_name("the name of a processor", name)?;
        if definitions.configuration.processors.iter().any(|p| p == name) {
            return Err(refuse(Class::InUse, format!("there is already a processor '{name}'"), "give it another name"));
        }
        if let Some(core) = core.filter(|c| *c >= cores()) {
            return Err(refuse(
                Class::PlacementError,
                format!("processor '{name}' asks for core {core}, but this machine has cores 0 to {}", cores() - 1),
                "give one of those, or leave it out",
            ));
        }
        if let Some((other, _)) = definitions.processors.iter().find(|(_, p)| supervisor && p.supervisor && p.asked) {
            return Err(refuse(
                Class::InUse,
                format!("processor '{name}' cannot be the supervisor: '{other}' is"),
                "leave supervisor= out: a system has only one supervisor",
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

    /// Creates an interrupt source on a processor. `kind` is `timer`, `trigger` or `software`.
    pub fn source(&self, processor: &str, name: &str, kind: SourceKind, priority: u8, virtual_cost_ns: u64) -> Result<(), Refusals> {
        let mut definitions = self.shared.definitions();
        let Some(rtp) = definitions.processors.get_index_of(processor) else {
            return Err(unknown("processor", processor, definitions.processors.keys().map(String::as_str)));
        };
        crate::definitions::sane::check_name("the name of a source", name)?;
        let full = format!("{processor}.{name}");
        if definitions.configuration.sources.contains_key(&full) {
            return Err(refuse(Class::InUse, format!("there is already a source '{full}'"), "give it another name"));
        }
        if !(1..=98).contains(&priority) {
            return Err(refuse(
                Class::ValueRefused,
                format!("the priority of source '{full}' must be 1 to 98, not {priority}"),
                "choose one in this range; 1 is the lowest",
            ));
        }
        if let SourceKind::Timer { period_ns } = kind
            && period_ns < PERIOD_NS_MIN
        {
            return Err(refuse(
                Class::ValueRefused,
                format!("the period of source '{full}' cannot be {} ms, which is shorter than 10 us", period_ns as f64 * 1e-6),
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
            core.registry.sources.insert(full.clone(), id);
            core.wiring.tables.insert(id, SourceTable::default());
            Ok(())
        })?;
        definitions.configuration.sources.insert(full, Source { processor: processor.to_owned(), kind, priority });
        self.post_supervisor(&definitions);
        Ok(())
    }

    /// Moves the supervisor's thread to the core of its processor, with a priority above that of its sources.
    fn post_supervisor(&self, definitions: &crate::definitions::system_definitions::Definitions) {
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
                Err(refuse(Class::InvalidState, format!("source '{source}' is a timer"), "request only triggers and software sources"))
            }
            Some(_) => self.shared.command(|core| {
                if core.host.is_full() {
                    let message = format!("source '{source}' cannot be requested again: 10,000 requests already wait for their firings at this instant");
                    return Err(refuse(Class::SchedulingError, message, "let time pass between requests: advance() serves them"));
                }
                core.host.request(core.registry.sources[source]);
                Ok(())
            }),
        }
    }

    /// Connects a read channel of a physical device to a trigger or software source of any processor: each time the channel changes from
    /// zero to nonzero, the source is raised. The channel is checked in each firing of the device's source.
    pub fn raise(&self, device: &str, channel: &str, source: &str, place: Option<SourceLocation>) -> Result<(), Refusals> {
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
            let Some(physical) = core.registry.physical.get(device) else {
                return Err(unknown("physical device", device, core.registry.physical.keys().map(String::as_str)));
            };
            let edge = kernel::Edge::new(&physical.device, index, number, core.registry.sources[source]);
            let exchange = physical.source;
            let table = core.wiring.tables.get_mut(&exchange).expect("a source has its table as long as the system lives");
            table.edges.push((device.to_owned(), edge));
            let op = core.carrier().table_op(exchange);
            core.submit(exchange, vec![op], crate::scripts::Purpose::Nothing);
            Ok(())
        })
    }
}

/// Minimum period of a timer.
const PERIOD_NS_MIN: u64 = 10_000;

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}
