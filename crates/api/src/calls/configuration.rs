// SPDX-License-Identifier: Apache-2.0
//! Calls for processors, interrupt sources and physical devices.
use crate::answered::Outcome;
use crate::effect::DriverArgument;
use crate::waits::lasting;
use indexmap::IndexMap;
use model::configuration::SourceKind;
use model::refusal::{Class, Refusal, Refusals, SourceLocation};
use model::value::Value;
use serde_json::{Map, Value as Json, json};
use std::time::Duration;
use supervisor::{InProcess, Location, Patience, PhysicalDeviceAbout, System, TakenOver};

crate::calls! {
    /// Calls for processors, interrupt sources and physical devices.
    pub(super) const CONFIGURATION about "configuration" = [
        /// Creates a real-time processor.
        Configure processor(
            must name: String,
            /// CPU core to which the processor is bound.
            may core: Option<usize>,
            /// True if the supervisor runs on the processor; by default it runs on the first one.
            may supervisor: bool,
            /// True for its own process, or the name of a shared process.
            may process: InProcess,
            /// Name of a host that has joined the system.
            may host: Option<String>,
            /// Maximum time for which the process may hang before it counts as lost.
            may lost_after_ns: Option<u64>,
            /// Maximum time for which the process may be without a supervisor.
            may patience_ns: Option<u64>,
        ) -> (): commands("name")
            => |system| {
                let location = Location::of(&name, process, host)?;
                system.processor_within(&name, core, supervisor, location, Patience { lost_after_ns, patience_ns })
            };
        /// Allows other hosts to join the system.
        Download listen(
            /// "tcp/HOST:PORT" or "tls/HOST:PORT".
            must endpoint: String,
            /// Name of this host.
            must name: String,
            /// File of the certificate authority that signs the other hosts' certificates.
            may authority: Option<String>,
            may certificate: Option<String>,
            may key: Option<String>,
            /// Secret that a host must present to join.
            may token: Option<String>,
            /// Maximum difference between the clocks.
            may clock_limit_ns: Option<u64>,
        ) -> (): commands("endpoint"), secret(&["token"])
            => |system| {
                let mut options = json!({ "endpoint": endpoint, "name": name });
                for (what, given) in [("authority", authority), ("certificate", certificate), ("key", key), ("token", token)] {
                    if let Some(given) = given {
                        options[what] = given.into();
                    }
                }
                if let Some(limit_ns) = clock_limit_ns {
                    options["clock_limit_ns"] = limit_ns.into();
                }
                system.listen(&options.to_string())
            };
        /// Takes over processes that lost a system with this name, and continues everything that runs in them; the system must be opened
        /// with "adopt": true.
        Configure take_over() -> TakenOver: commands(""), unjournalled, moves
            => |system| system.take_over();
        /// Creates an interrupt source on a processor.
        Configure source(
            must processor: String,
            must name: String,
            /// "timer", "trigger" or "software".
            must kind: String,
            /// Period of a timer.
            may period_ns: u64,
            must priority: u8,
            /// Duration of a firing under the virtual clock.
            may virtual_cost_ns: u64,
        ) -> (): commands("name")
            => |system| system.source(&processor, &name, source_kind(&kind, period_ns)?, priority, virtual_cost_ns);
        /// Requests one firing of a software source.
        Operate request(
            /// "processor.source".
            must source: String,
        ) -> (): commands("source"), told
            => |system| system.request(&source);
        /// Opens a device on a source. Returns its channels and parts.
        Configure physical_device(
            must processor: String,
            must name: String,
            /// Driver: "mujoco", "loopback", "scripted", ...
            must kind: String,
            /// Options of the driver.
            may options: Option<Map<String, Json>>,
            must source: String,
            may place: Option<SourceLocation>,
        ) -> PhysicalDeviceAbout: commands("name"), for_driver(DriverArgument::Options)
            => |system| {
                let options = Json::Object(options.unwrap_or_default());
                system.physical_device(&processor, &name, &kind, &options, &source, place)
            };
        /// Calls an acyclic service of a device's driver. Returns the service's answer.
        Operate device_service(
            must device: String,
            /// Service declared by the driver, as listed by `configuration`.
            must service: String,
            /// Arguments of the service.
            may arguments: Option<Map<String, Json>>,
        ) -> Option<Value>: commands("device"), told, lasts, moves, for_driver(DriverArgument::OfService)
            => |system, slice| {
                let errand = system.service(&device, &service, Json::Object(arguments.unwrap_or_default()))?;
                served(system, errand, slice)
            };
        /// Searches the host of the system for devices that a driver could open; does not move any machine. Returns a description of each
        /// device, and the options that open it.
        Configure scan_devices(
            /// Name of the driver.
            must kind: String,
            /// Options of the driver that define the search.
            may options: Option<Map<String, Json>>,
        ) -> Option<Value>: unjournalled, lasts, free, for_driver(DriverArgument::Options)
            => |system, slice| {
                let errand = system.scan(&kind, Json::Object(options.unwrap_or_default()))?;
                served(system, errand, slice)
            };
        /// Waits for a service or search in progress. Returns its answer, but only once.
        Operate device_served(must errand: u64) -> Option<Value>: lasts, free
            => |system, slice| served(system, errand, slice);
        /// Reopens a lost device with all its bindings.
        Operate reopen_physical_device(must name: String) -> (): commands("name"), told, moves
            => |system| system.reopen(&name);
        /// Closes a device.
        Configure delete_physical_device(must name: String) -> (): commands("name")
            => |system| system.delete_physical_device(&name);
        /// Makes a channel of a device raise a source.
        Configure raises(must device: String, must channel: String, must source: String, may place: Option<SourceLocation>) -> ():
            commands("device"), goes_with("delete_physical_device", "device")
            => |system| system.raise(&device, &channel, &source, place);
        /// Sets the placement of blocks that are not placed otherwise: label pattern → source.
        Configure place(whole placement: IndexMap<String, String>) -> (): commands("")
            => |system| system.place(placement);
    ];
}

fn served(system: &System, errand: u64, slice: Duration) -> Result<Outcome<Option<Value>>, Refusals> {
    Ok(lasting(system.served(errand, slice)?, None, "device_served", || json!({ "errand": errand })))
}

/// Returns the kind of interrupt source with this name; a timer requires a period.
fn source_kind(kind: &str, period_ns: u64) -> Result<SourceKind, Refusals> {
    match kind {
        "timer" => Ok(SourceKind::Timer { period_ns }),
        "trigger" => Ok(SourceKind::Trigger),
        "software" => Ok(SourceKind::Software),
        other => Err(vec![
            Refusal::new(Class::DefinitionError, format!("there is no kind of source '{other}'")).remedy("use \"timer\", \"trigger\" or \"software\""),
        ]),
    }
}
