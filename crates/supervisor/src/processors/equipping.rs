// SPDX-License-Identifier: Apache-2.0
//! Equips processors: sets them up at their locations with sources, devices and code, and revives them.
use crate::definitions::catalog::Catalog;
use crate::definitions::system_definitions::Definitions;
use crate::processors::location::Location;
use crate::processors::remote::processor_of;
use crate::processors::revival::revived;
use crate::refuse::{refuse, refuse_at};
use crate::stopping::lost_processors::refuse_lost_plan;
use crate::system::System;
use device::Beside;
use kernel::{Device, SourceId, SourceSpec};
use model::plan::Plan;
use model::refusal::{Class, Refusals, SourceLocation};
use process_kit::Restarts;
use rtp::{Bounds, Module, Processor, StartedProcessor};
use std::ffi::OsString;
use std::sync::Arc;
use std::time::Duration;

/// Kind and options for reopening a remote device.
type Reopening = Option<(String, String)>;

impl System {
    /// Sets the provider of remote processors. Must be called once, before the first remote processor is created.
    pub fn set_places(&self, places: Arc<dyn rtp::Places>) {
        let shared = Arc::downgrade(&self.shared);
        places.tell_to(Box::new(move |kind, about, text| {
            if let Some(shared) = shared.upgrade() {
                let mut core = shared.locked();
                let now_ns = core.host.now_ns();
                core.observation.log.add(now_ns, kind, about, text);
            }
        }));
        // A second call would set the same provider.
        let _first = self.shared.places.set(places);
    }

    /// Returns the command line of a process that replays a recording, and the interpreter that tests its modules; `None` if this is not
    /// available.
    pub fn replay_command(&self) -> Option<(Vec<OsString>, OsString)> {
        self.shared.places.get().and_then(|places| places.replay())
    }

    /// Allows other hosts to join the system. `options` (JSON) contains the address on which to listen, and the hosts to admit.
    pub fn listen(&self, options: &str) -> Result<(), Refusals> {
        if self.shared.is_virtual {
            return Ok(());
        }
        let cannot = |why: String| refuse(Class::InvalidState, format!("system '{}' cannot listen for other hosts: {why}", self.name), "");
        let Some(places) = self.shared.places.get() else { return Err(cannot("it has no links between hosts".to_owned())) };
        places.listen(options, self.shared.host.epoch_ns()).map_err(cannot)
    }

    /// Sets up a processor at its location.
    pub(crate) fn settle(&self, definitions: &Definitions, name: &str, supervisor: bool, location: &Location, bounds: Bounds) -> Result<(), Refusals> {
        let beside = definitions.beside(name, location)?;
        self.settle_remote(name, supervisor, location, beside, bounds)?;
        if let Some(process) = location.process(name) {
            self.shared.locked().remote.processes.entry(process.to_owned()).or_default().push(name.to_owned());
        }
        Ok(())
    }

    /// Starts a processor that is not a thread and sends it the current configuration. If `beside` is passed, it joins the process of
    /// that processor. Does nothing under the virtual clock.
    fn settle_remote(&self, name: &str, supervisor: bool, location: &Location, beside: Option<&str>, bounds: Bounds) -> Result<(), Refusals> {
        if let (Location::Thread, Some(lost_after)) = (location, bounds.lost_after) {
            self.shared.guarded.bound(name, lost_after);
            self.shared.host.allow_standstill(lost_after);
        }
        if *location == Location::Thread || self.shared.is_virtual {
            return Ok(());
        }
        if supervisor {
            let remedy = "leave supervisor= out; the supervisor runs in the process that creates the system";
            return Err(refuse(Class::PlacementError, format!("processor '{name}' is remote, so it cannot be the supervisor"), remedy));
        }
        if let Some(beside) = beside {
            return self.settle_beside(name, beside, bounds);
        }
        let host = if let Location::Host(host) = location { Some(host.as_str()) } else { None };
        let processor = Processor::new(location.process(name).unwrap_or(name), host, bounds);
        let specs = self.shared.locked().registry.specs.clone();
        for (number, spec) in specs.iter().enumerate() {
            processor.expect_source(SourceId(number as u32), spec, false);
        }
        self.attach(&processor).map_err(|why| cannot(name, &why))?;
        self.shared.locked().remote.processors.insert(name.to_owned(), processor);
        Ok(())
    }

    /// Adds a processor to the process of `beside`.
    fn settle_beside(&self, name: &str, beside: &str, bounds: Bounds) -> Result<(), Refusals> {
        let mut core = self.shared.locked();
        let there = core.remote.processors[beside].clone();
        if !there.is_up() {
            let message = format!("cannot start processor '{name}': its process '{}', which processor '{beside}' uses too, is lost", there.name());
            return Err(refuse(Class::InvalidState, message, "see the log for the reason, then call reset()"));
        }
        if bounds != Bounds::default() && bounds != *there.bounds() {
            let message = format!("processor '{name}' shares process '{}', which was created with a different lost_after= or patience=", there.name());
            return Err(refuse(Class::InUse, message, format!("set them for processor '{beside}': a process has only one value of each")));
        }
        core.remote.processors.insert(name.to_owned(), there);
        Ok(())
    }

    fn attach(&self, processor: &Arc<Processor>) -> Result<(), String> {
        let Some(places) = self.shared.places.get() else { return Err("this system has no way to start processes".to_owned()) };
        let name = processor.name();
        let started: StartedProcessor = match runtime::Remote::host(&**processor) {
            Some(host) => places.host(host, name)?,
            None => places.process(name, processor.bounds())?,
        };
        processor.attach(&self.shared.host, &self.name, started)
    }

    /// Creates a source in the process in which its processor runs, and reports it to every remote processor.
    pub(crate) fn add_source(&self, processor: &str, spec: SourceSpec) -> Result<SourceId, Refusals> {
        let name = spec.name.clone();
        let cannot = |why: String| refuse(Class::InvalidState, format!("cannot start source '{name}': {why}"), "close other programs and try again");
        let (own, remote) = {
            let core = self.shared.locked();
            (core.remote.processors.get(processor).cloned(), core.remote.places())
        };
        let source = match &own {
            Some(remote) if !remote.is_up() => return Err(cannot("its processor is lost".to_owned())),
            Some(remote) => self.shared.host.add_remote_source(spec.clone(), remote.clone()),
            None => self.shared.host.add_source(spec.clone()).map_err(|why| cannot(why.to_string()))?,
        };
        if own.is_none() {
            self.shared.guarded.runs(source);
        }
        self.shared.locked().registry.specs.push(spec.clone());
        let mut made = Ok(source);
        for processor in &remote {
            let here = own.as_ref().is_some_and(|own| Arc::ptr_eq(own, processor));
            let told = processor.add_source(source, &spec, here);
            if let (Err(why), true) = (told, here) {
                made = Err(cannot(why));
            }
        }
        made
    }

    /// Makes a channel of a local device raise a remote source.
    pub(crate) fn pass_on(&self, device: &str, source: &str) -> Result<(), Refusals> {
        let (id, remote, is_here) = {
            let core = self.shared.locked();
            let of = |source: &str| core.remote.processors.get(processor_of(source)).cloned();
            let is_here = core.registry.physical.get(device).is_some_and(|physical| of(core.registry.source_name(physical.source)).is_none());
            (core.registry.sources[source], of(source), is_here)
        };
        let Some(remote) = remote.filter(|_| is_here) else { return Ok(()) };
        let passed = self.shared.host.pass_on(id, Box::new(move || runtime::Remote::request(&*remote, id)));
        passed.map_err(|why| refuse(Class::InvalidState, format!("cannot raise remote source '{source}': {why}"), "close other programs and try again"))
    }

    /// Opens a device in the process in which its processor runs. Returns the device, its driver's description, and its kind and options
    /// for reopening.
    pub(crate) fn open_device(
        &self,
        processor: &str,
        name: &str,
        kind: &str,
        options: &serde_json::Value,
    ) -> Result<(Arc<Device>, Beside, serde_json::Value, Reopening), String> {
        let remote = self.shared.locked().remote.processors.get(processor).cloned();
        let Some(remote) = remote else {
            let (driver, description) = drivers::open(kind, options).map_err(|why| why.to_string())?;
            let beside = Beside::of(kind, &*driver);
            let device = Device::open(name, driver, self.shared.host.now_ns()).map_err(|why| why.message)?;
            self.guard_device(processor, &device);
            return Ok((device, beside, description, None));
        };
        let opened = remote.open(name, kind, &options.to_string())?;
        let description = serde_json::from_str(&opened.description).map_err(|why| format!("the description of its driver is not JSON: {why}"))?;
        Ok((remote.device(name, opened.channels)?, Beside::default(), description, Some((kind.to_owned(), options.to_string()))))
    }

    /// Closes a device that was just opened and to which nothing is bound.
    pub(crate) fn shut(&self, processor: &str, name: &str) {
        let remote = self.shared.locked().remote.processors.get(processor).cloned();
        match remote {
            Some(remote) => remote.shut(name),
            None => self.shared.guarded.release(name),
        }
    }

    /// Sends the code of a plan to its processors; refuses a plan that uses a source on a lost processor.
    pub(crate) fn send_code(&self, catalog: &Catalog, plan: &Plan, place: &Option<SourceLocation>) -> Result<(), Refusals> {
        let remote = self.shared.command(|core| {
            refuse_lost_plan(core, plan)?;
            Ok(core.remote.processors.clone())
        })?;
        if remote.is_empty() {
            return Ok(());
        }
        for block in &plan.blocks {
            let processor = processor_of(&block.source);
            let (Some(remote), Some(code)) = (remote.get(processor), catalog.blocks.get(&block.block)) else { continue };
            let sent = match Module::of(&code.module) {
                Some(module) => remote.ensure(module),
                None => Err("its code is part of this program, so it cannot be sent".to_owned()),
            };
            sent.map_err(|why| {
                let message = format!("cannot run block '{}' ({}) on processor '{processor}': {why}", block.label, block.block);
                refuse_at(Class::ModuleError, message, "", place.clone())
            })?;
        }
        Ok(())
    }

    /// Sends the code of the existing instances to a new process, before their tables.
    fn send_code_again(&self, remote: &Arc<Processor>) -> Result<(), Refusals> {
        let keepers: Vec<_> = {
            let core = self.shared.locked();
            let installed = core.instances.values().map(|instance| &instance.installed);
            let blocks = installed
                .flat_map(|of| of.blocks.iter().zip(&of.block_source))
                .filter(|(_, source)| core.remote.runs_in(core.registry.source_name(**source), remote));
            blocks.map(|(block, _)| block.module().clone()).collect()
        };
        keepers.iter().filter_map(Module::of).try_for_each(|module| remote.ensure(module)).map_err(|why| self.cannot_revive(remote, &why))
    }

    fn cannot_revive(&self, remote: &Processor, why: &str) -> Refusals {
        refuse(Class::InvalidState, format!("cannot start {} again: {why}", self.shared.locked().remote.called(remote)), "fix that and call reset() again")
    }

    /// Refuses to replace a process that has been lost too often, because a person must find the reason. The limit does not depend on the
    /// number of processors in the process.
    fn refuse_restart(&self, remote: &Processor) -> Result<(), Refusals> {
        let mut core = self.shared.locked();
        let now_ns = core.host.now_ns();
        let allowed = core.remote.restarts.entry(remote.name().to_owned()).or_insert_with(|| Restarts::new(RESTARTS_MAX, RESTARTS_WITHIN)).allow(now_ns);
        if allowed {
            return Ok(());
        }
        let (most, seconds) = (RESTARTS_MAX, RESTARTS_WITHIN.as_secs());
        let message = format!("{} was lost more than {most} times within {seconds} s", core.remote.called(remote));
        Err(refuse(Class::InvalidState, message, "see the log for the reason, fix the problem, then wait a minute and call reset()"))
    }

    /// Terminates the processes of processors without a source, which no kernel knows about; the other processes have ended with the
    /// host.
    pub(crate) fn close_remote(&self) {
        let places = if self.shared.core.is_poisoned() { Default::default() } else { self.shared.locked().remote.places() };
        places.iter().for_each(|remote| runtime::Remote::close(&**remote));
    }

    /// Restarts lost processors in a new process, with the same sources and devices, current tables, and the last known values of SVVs.
    pub(crate) fn revive(&self) -> Result<(), Refusals> {
        // Process reported losses first.
        self.shared.command(|_| Ok(()))?;
        let places = self.shared.locked().remote.places();
        // A loss that is being reported takes the core's lock, so do not hold it here.
        for remote in places.into_iter().filter(|remote| remote.is_down()) {
            self.refuse_restart(&remote)?;
            self.attach(&remote).map_err(|why| self.cannot_revive(&remote, &why))?;
            let devices: Vec<(String, Arc<Device>, (String, String))> = {
                let core = self.shared.locked();
                let own = core.registry.physical.iter().filter(|(_, physical)| core.remote.runs_in(core.registry.source_name(physical.source), &remote));
                own.filter_map(|(device, physical)| Some((device.clone(), physical.device.clone(), physical.opened.clone()?))).collect()
            };
            for (device, mirror, (kind, options)) in devices {
                remote
                    .open(&device, &kind, &options)
                    .map_err(|why| refuse(Class::DeviceFailed, format!("cannot open device '{device}' again: {why}"), "fix that and call reset() again"))?;
                runtime::remote_device::renew(&mirror);
            }
            self.send_code_again(&remote)?;
            self.shared.command(|core| {
                core.remote.processors_in(&remote).iter().for_each(|processor| revived(core, processor));
                Ok(())
            })?;
        }
        Ok(())
    }
}

/// Maximum number of times that a process is replaced, and the period in which this is counted.
const RESTARTS_MAX: u32 = 20;

const RESTARTS_WITHIN: Duration = Duration::from_secs(60);

fn cannot(processor: &str, why: &str) -> Refusals {
    refuse(Class::InvalidState, format!("cannot start processor '{processor}': {why}"), "fix that and try again")
}
