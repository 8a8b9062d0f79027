// SPDX-License-Identifier: Apache-2.0
//! Processors that run elsewhere: in processes of their own, several in one, or on other hosts. They are configured, get code and devices,
//! are lost and revived here; everything else treats their sources like any other. Where they are is in `location.rs`.
//!
//! Those that share a process are one [`Processor`] of `rtp`: it has the sources of all of them, so that what is between them is within one
//! host there, as between threads here.
use crate::catalog::Catalog;
use crate::core::{Core, Purpose};
use crate::location::Location;
use crate::refuse::{refuse, refuse_at};
use crate::sequence::{Builder, Movement};
use crate::stages::Verbatim;
use crate::system::{Definitions, System};
use guard::Restarts;
use kernel::{Device, Script, SourceId, SourceSpec};
use model::definition::IfCutOff;
use model::plan::Plan;
use model::refusal::{Class, Place, Refusals};
use rtp::{Bounds, Module, Processor, Started};
use std::sync::Arc;
use std::time::Duration;

/// How a device was opened elsewhere, so that it can be opened again.
type Reopening = Option<(String, String)>;

impl System {
    /// Says where processors elsewhere come from; once, before the first of them.
    pub fn set_places(&self, places: Arc<dyn rtp::Places>) {
        let shared = Arc::downgrade(&self.shared);
        places.tell_to(Box::new(move |kind, about, text| {
            if let Some(shared) = shared.upgrade() {
                let mut core = shared.locked();
                let now_ns = core.host.now_ns();
                core.log.add(now_ns, kind, about, text);
            }
        }));
        // A second call would give what is there already.
        let _first = self.shared.places.set(places);
    }

    /// Lets other hosts join the system; `options` (JSON): where to listen, and who is let in.
    pub fn listen(&self, options: &str) -> Result<(), Refusals> {
        if self.shared.is_virtual {
            return Ok(());
        }
        let cannot = |why: String| refuse(Class::InvalidState, format!("system '{}' cannot listen for other hosts: {why}", self.name), "");
        let Some(places) = self.shared.places.get() else { return Err(cannot("it was made without a way to reach any".to_owned())) };
        places.listen(options, self.shared.host.epoch_ns()).map_err(cannot)
    }

    /// Brings a processor to where it is to run.
    pub(crate) fn settle(&self, definitions: &Definitions, name: &str, supervisor: bool, location: &Location, bounds: Bounds) -> Result<(), Refusals> {
        let beside = definitions.beside(name, location)?;
        self.settle_elsewhere(name, supervisor, location, beside, bounds)?;
        if let Some(process) = location.process(name) {
            self.shared.locked().processes.entry(process.to_owned()).or_default().push(name.to_owned());
        }
        Ok(())
    }

    /// Starts a processor that is not a thread, and tells it what the system has so far; one that shares a process with `beside` goes there.
    /// Nothing under the virtual clock.
    fn settle_elsewhere(&self, name: &str, supervisor: bool, location: &Location, beside: Option<&str>, bounds: Bounds) -> Result<(), Refusals> {
        if *location == Location::Thread || self.shared.is_virtual {
            return Ok(());
        }
        if supervisor {
            let remedy = "leave supervisor= out; the supervisor runs in the process that makes the system";
            return Err(refuse(Class::PlacementError, format!("processor '{name}' runs elsewhere, so it cannot be the supervisor"), remedy));
        }
        if let Some(beside) = beside {
            return self.settle_beside(name, beside, bounds);
        }
        let host = if let Location::Host(host) = location { Some(host.as_str()) } else { None };
        let processor = Processor::new(location.process(name).unwrap_or(name), host, bounds);
        let specs = self.shared.locked().specs.clone();
        for (number, spec) in specs.iter().enumerate() {
            processor.expect_source(SourceId(number as u32), spec, false);
        }
        self.attach(&processor).map_err(|why| cannot(name, &why))?;
        self.shared.locked().elsewhere.insert(name.to_owned(), processor);
        Ok(())
    }

    /// The process that `beside` is in takes one processor more.
    fn settle_beside(&self, name: &str, beside: &str, bounds: Bounds) -> Result<(), Refusals> {
        let mut core = self.shared.locked();
        let there = core.elsewhere[beside].clone();
        if !there.is_up() {
            let message = format!("cannot start processor '{name}': its process '{}', of processor '{beside}' too, is lost", there.name());
            return Err(refuse(Class::InvalidState, message, "see the log for why, then call reset()"));
        }
        if bounds != Bounds::default() && bounds != *there.bounds() {
            let message = format!("processor '{name}' shares process '{}', which was made with another lost_after= or patience=", there.name());
            return Err(refuse(Class::InUse, message, format!("say it where processor '{beside}' is made: a process has one of each")));
        }
        core.elsewhere.insert(name.to_owned(), there);
        Ok(())
    }

    fn attach(&self, processor: &Arc<Processor>) -> Result<(), String> {
        let Some(places) = self.shared.places.get() else { return Err("this system was made without a way to start processes".to_owned()) };
        let name = processor.name();
        let started: Started = match kernel::Far::host(&**processor) {
            Some(host) => places.host(host, name)?,
            None => places.process(name, processor.bounds())?,
        };
        processor.attach(&self.shared.host, &self.name, started)
    }

    /// Makes a source where its processor runs; every processor elsewhere learns of it.
    pub(crate) fn add_source(&self, processor: &str, spec: SourceSpec) -> Result<SourceId, Refusals> {
        let name = spec.name.clone();
        let cannot = |why: String| refuse(Class::InvalidState, format!("cannot start source '{name}': {why}"), "close other programs and try again");
        let (own, elsewhere) = {
            let core = self.shared.locked();
            (core.elsewhere.get(processor).cloned(), core.places_elsewhere())
        };
        let source = match &own {
            Some(far) if !far.is_up() => return Err(cannot("its processor is lost".to_owned())),
            Some(far) => self.shared.host.add_far_source(spec.clone(), far.clone()),
            None => self.shared.host.add_source(spec.clone()).map_err(|why| cannot(why.to_string()))?,
        };
        self.shared.locked().specs.push(spec.clone());
        let mut made = Ok(source);
        for far in &elsewhere {
            let here = own.as_ref().is_some_and(|own| Arc::ptr_eq(own, far));
            let told = far.add_source(source, &spec, here);
            if let (Err(why), true) = (told, here) {
                made = Err(cannot(why));
            }
        }
        made
    }

    /// A channel of a device here may raise a source elsewhere.
    pub(crate) fn pass_on(&self, device: &str, source: &str) -> Result<(), Refusals> {
        let (id, far, is_here) = {
            let core = self.shared.locked();
            let of = |source: &str| core.elsewhere.get(processor_of(source)).cloned();
            let is_here = core.physical.get(device).is_some_and(|physical| of(core.source_name(physical.source)).is_none());
            (core.sources[source], of(source), is_here)
        };
        let Some(far) = far.filter(|_| is_here) else { return Ok(()) };
        let passed = self.shared.host.pass_on(id, Box::new(move || kernel::Far::request(&*far, id)));
        passed.map_err(|why| refuse(Class::InvalidState, format!("cannot raise source '{source}' elsewhere: {why}"), "close other programs and try again"))
    }

    /// Opens a device where its processor runs: the device, what the driver says of itself, and how to open it again.
    pub(crate) fn open_device(
        &self,
        processor: &str,
        name: &str,
        kind: &str,
        options: &serde_json::Value,
    ) -> Result<(Arc<Device>, serde_json::Value, Reopening), String> {
        let far = self.shared.locked().elsewhere.get(processor).cloned();
        let Some(far) = far else {
            let (driver, description) = drivers::open(kind, options).map_err(|why| why.to_string())?;
            let device = Device::open(name, driver, self.shared.host.now_ns()).map_err(|why| why.message)?;
            return Ok((device, description, None));
        };
        let opened = far.open(name, kind, &options.to_string())?;
        let description = serde_json::from_str(&opened.description).map_err(|why| format!("what its driver says of itself is no JSON: {why}"))?;
        Ok((far.device(name, opened.channels)?, description, Some((kind.to_owned(), options.to_string()))))
    }

    /// Brings the code of a plan to where it runs; refuses one that would run where nobody is.
    pub(crate) fn send_code(&self, catalog: &Catalog, plan: &Plan, place: &Option<Place>) -> Result<(), Refusals> {
        let elsewhere = self.shared.command(|core| {
            core.refuse_lost_plan(plan)?;
            Ok(core.elsewhere.clone())
        })?;
        if elsewhere.is_empty() {
            return Ok(());
        }
        for block in &plan.blocks {
            let processor = processor_of(&block.source);
            let (Some(far), Some(code)) = (elsewhere.get(processor), catalog.blocks.get(&block.block)) else { continue };
            let sent = match Module::of(&code.module) {
                Some(module) => far.ensure(module),
                None => Err("its code is part of this program, so it cannot be sent".to_owned()),
            };
            sent.map_err(|why| {
                let message = format!("cannot run block '{}' ({}) on processor '{processor}': {why}", block.label, block.block);
                refuse_at(Class::ModuleError, message, "", place.clone())
            })?;
        }
        Ok(())
    }

    /// The code of the instances that are there goes to a new process before their tables.
    fn send_code_again(&self, far: &Arc<Processor>) -> Result<(), Refusals> {
        let keepers: Vec<_> = {
            let core = self.shared.locked();
            let installed = core.instances.values().map(|instance| &instance.installed);
            let blocks = installed.flat_map(|of| of.blocks.iter().zip(&of.block_source)).filter(|(_, source)| core.runs_in(**source, far));
            blocks.map(|(block, _)| block.module().clone()).collect()
        };
        keepers.iter().filter_map(Module::of).try_for_each(|module| far.ensure(module)).map_err(|why| self.cannot_revive(far, &why))
    }

    fn cannot_revive(&self, far: &Processor, why: &str) -> Refusals {
        refuse(Class::InvalidState, format!("cannot start {} again: {why}", self.shared.locked().called(far)), "mend that and call reset() again")
    }

    /// Refuses a new process where one was lost too often, however many processors it has: what kills it again and again is for people to find.
    fn refuse_restart(&self, far: &Processor) -> Result<(), Refusals> {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        let allowed = core.restarts.entry(far.name().to_owned()).or_insert_with(|| Restarts::new(RESTARTS_MAX, RESTARTS_WITHIN)).allow(now_ns);
        if allowed {
            return Ok(());
        }
        let (most, seconds) = (RESTARTS_MAX, RESTARTS_WITHIN.as_secs());
        let message = format!("{} was lost more than {most} times within {seconds} s", core.called(far));
        Err(refuse(Class::InvalidState, message, "see the log for why, mend that, and call reset() later"))
    }

    /// Ends the processes of processors without a source, of which no kernel knows; the others have ended with the host.
    pub(crate) fn close_elsewhere(&self) {
        let places = self.shared.core.lock().map(|core| core.places_elsewhere()).unwrap_or_default();
        places.iter().for_each(|far| kernel::Far::close(&**far));
    }

    /// Gives processors that were lost a new process: sources and devices as before, tables as they are now, SVVs with the values that were
    /// known last.
    pub(crate) fn revive(&self) -> Result<(), Refusals> {
        // What was told of the losses is taken in first.
        self.shared.command(|_| Ok(()))?;
        let lost: Vec<Arc<Processor>> = self.shared.locked().places_elsewhere().into_iter().filter(|far| !far.is_up()).collect();
        for far in lost {
            self.refuse_restart(&far)?;
            self.attach(&far).map_err(|why| self.cannot_revive(&far, &why))?;
            let devices: Vec<(String, Arc<Device>, (String, String))> = {
                let core = self.shared.locked();
                let own = core.physical.iter().filter(|(_, physical)| core.runs_in(physical.source, &far));
                own.filter_map(|(device, physical)| Some((device.clone(), physical.device.clone(), physical.opened.clone()?))).collect()
            };
            for (device, mirror, (kind, options)) in devices {
                far.open(&device, &kind, &options)
                    .map_err(|why| refuse(Class::DeviceFailed, format!("cannot open device '{device}' again: {why}"), "mend it and call reset() again"))?;
                mirror.renew();
            }
            self.send_code_again(&far)?;
            self.shared.command(|core| {
                core.processors_in(&far).iter().for_each(|processor| core.revived(processor));
                Ok(())
            })?;
        }
        Ok(())
    }
}

impl Core {
    /// What runs sources elsewhere: processes, each once however many processors it has, and processors on other hosts.
    pub fn places_elsewhere(&self) -> Vec<Arc<Processor>> {
        let mut places: Vec<Arc<Processor>> = Vec::new();
        for far in self.elsewhere.values() {
            if !places.iter().any(|known| Arc::ptr_eq(known, far)) {
                places.push(far.clone());
            }
        }
        places
    }

    /// A place elsewhere, for people: by its processor, or where several may share it, by its process.
    pub fn called(&self, far: &Processor) -> String {
        let what = if self.elsewhere.contains_key(far.name()) { "processor" } else { "process" };
        format!("{what} '{}'", far.name())
    }

    /// What goes with a source when its processor is lost: the process where several share one, else the processor.
    pub fn lost_place(&self, source: SourceId) -> String {
        let processor = processor_of(self.source_name(source));
        self.elsewhere.get(processor).map_or(processor, |far| far.name()).to_owned()
    }

    /// The processors of a process, in the order in which they were made.
    pub fn processors_in(&self, far: &Arc<Processor>) -> Vec<String> {
        self.elsewhere.iter().filter(|(_, own)| Arc::ptr_eq(own, far)).map(|(name, _)| name.clone()).collect()
    }

    /// False where a source belongs to a process or host that is gone, whether or not that was told of this source yet.
    pub fn is_reached(&self, source: SourceId) -> bool {
        self.runs_at(source).is_none_or(|far| far.is_up())
    }

    /// True where a source belongs to a processor of this process.
    fn runs_in(&self, source: SourceId, far: &Arc<Processor>) -> bool {
        self.runs_at(source).is_some_and(|own| Arc::ptr_eq(own, far))
    }

    /// Why a source is lost, in full: of which processor it is, and with which process that went.
    pub fn loss_of(&self, source: SourceId, why: &str) -> String {
        let processor = processor_of(self.source_name(source));
        let process = self.elsewhere.get(processor).map(|far| far.name()).filter(|process| *process != processor);
        let process = process.map(|process| format!(" with process '{process}'")).unwrap_or_default();
        format!("processor '{processor}' was lost{process}: {why}")
    }

    /// True where a source belongs to this processor.
    pub fn runs_on(&self, source: SourceId, processor: &str) -> bool {
        processor_of(self.source_name(source)) == processor
    }

    /// Closes a device that lies elsewhere.
    pub fn shut_elsewhere(&self, source: SourceId, device: &str) {
        if let Some(far) = self.runs_at(source) {
            far.shut(device);
        }
    }

    /// Tells processors elsewhere what becomes of an instance there if this process is gone: by the word `if_cut_off` of its verb.
    pub fn bid_farewell(&self, id: u64) {
        let Some(instance) = self.instances.get(&id).filter(|_| !self.elsewhere.is_empty()) else { return };
        let of = Verbatim { plan: &instance.plan, installed: &instance.installed, devices: &self.physical };
        for &source in &instance.installed.sources {
            let Some(far) = self.runs_at(source) else { continue };
            let script = (instance.if_cut_off() != IfCutOff::Continue).then(|| {
                let mut builder = Builder::default();
                of.stop_in(&mut builder, source);
                let scripts = builder.finish().into_iter().filter_map(|movement| if let Movement::Scripts(scripts) = movement { Some(scripts) } else { None });
                Script { id: 0, ops: scripts.flatten().flat_map(|(_, ops)| ops).collect() }
            });
            far.farewell(instance.installed.process.id(), source, Some(script.as_ref()));
        }
    }

    /// The instance has ended: nothing is to be done for it any more.
    pub fn forget_farewell(&self, id: u64) {
        let Some(instance) = self.instances.get(&id).filter(|_| !self.elsewhere.is_empty()) else { return };
        for &source in &instance.installed.sources {
            if let Some(far) = self.runs_at(source) {
                far.farewell(instance.installed.process.id(), source, None);
            }
        }
    }

    /// Where a source runs, if not in this process.
    pub fn far_of(&self, source: SourceId) -> Option<Arc<Processor>> {
        self.runs_at(source).cloned()
    }

    fn runs_at(&self, source: SourceId) -> Option<&Arc<Processor>> {
        self.elsewhere.get(processor_of(self.source_name(source)))
    }

    /// A processor has a new process: its sources get their tables and the values that were known last.
    fn revived(&mut self, processor: &str) {
        let sources: Vec<SourceId> = self.sources.values().copied().filter(|source| self.runs_on(*source, processor)).collect();
        for source in &sources {
            self.lost.remove(source);
            let mut ops = vec![self.table_op(*source)];
            let known = self.svvs.values().flat_map(|svv| svv.known_ops(*source));
            ops.extend(known);
            self.submit(*source, ops, Purpose::Nothing);
        }
        let open: Vec<String> = self.physical.iter().filter(|(_, physical)| sources.contains(&physical.source)).map(|(device, _)| device.clone()).collect();
        for device in open {
            self.physical[&device].lost = None;
            self.alarm_closed(&device);
        }
        let now_ns = self.host.now_ns();
        self.log.add(now_ns, "processor", processor, "has a new process".to_owned());
    }
}

/// New processes in the place of one, and within which time.
const RESTARTS_MAX: u32 = 20;
const RESTARTS_WITHIN: Duration = Duration::from_secs(60);

/// The processor of a source, by their name `processor.source`.
fn processor_of(source: &str) -> &str {
    source.split('.').next().unwrap_or_default()
}

fn cannot(processor: &str, why: &str) -> Refusals {
    refuse(Class::InvalidState, format!("cannot start processor '{processor}': {why}"), "mend that and try again")
}
