// SPDX-License-Identifier: Apache-2.0
//! Calls that observe the items of a system and their run-time data.
use crate::sure;
use supervisor::{Entry, Geometry, InstalledInstances, Inventory, Names, Statistics, VerbForm, VerbSummary};

crate::calls! {
    /// Calls that observe the items of a system and their run-time data.
    pub(super) const OBSERVATION about "observation" = [
        /// Returns the names of all items.
        Observe names() -> Names
            => |system| sure(system.names());
        /// Returns the processors, sources, devices as described by their drivers, and device types.
        Observe configuration() -> Inventory: costs
            => |system| sure(system.inventory());
        /// Returns all instances with their blocks, ports, cells, command lists, conditions and transitions.
        Observe installed() -> InstalledInstances: costs
            => |system| sure(system.installed());
        /// Returns the defined verbs.
        Observe verbs() -> Vec<VerbSummary>: costs
            => |system| sure(system.verbs());
        /// Returns the contents of a form for starting a verb: its arguments and input parameters.
        Observe verb_form(must name: String) -> VerbForm: costs
            => |system| system.verb_form(&name);
        /// Returns the bodies, joints, shapes and meshes of a physical device, for drawing.
        Observe geometry(must device: String) -> Geometry: costs
            => |system| system.geometry(&device);
        /// Returns run-time data of sources, instances and devices.
        Observe statistics() -> Statistics
            => |system| sure(system.statistics());
        /// Starts a probe that measures the blocks of a source, or of all sources, one per firing; `statistics` then includes their
        /// durations.
        Observe probe(
            may source: Option<String>,
            /// Duration in real time, at most an hour.
            must for_ns: u64,
        ) -> ()
            => |system| system.probe(source.as_deref(), for_ns);
        /// Returns the log: commands, conditions, faults, transitions and ends.
        Observe log(
            /// Number of the first entry.
            may since: u64,
        ) -> Vec<Entry>: costs
            => |system| sure(system.log_since(since));
    ];
}
