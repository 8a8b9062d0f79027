// SPDX-License-Identifier: Apache-2.0
//! Parts of a system, and how they run.
use crate::sure;
use supervisor::{Entry, Geometry, InstalledInstances, Inventory, Names, Statistics, VerbForm, VerbSummary};

crate::calls! {
    /// Parts of a system, and how they run.
    pub(super) const OBSERVATION about "observation" = [
        /// Returns the names of what there is.
        Observe names() -> Names
            => |system| sure(system.names());
        /// Returns processors, sources, devices as their drivers describe them, device types.
        Observe configuration() -> Inventory: costs
            => |system| sure(system.inventory());
        /// Returns every instance with its blocks, ports, cells, command lists, conditions and transitions.
        Observe installed() -> InstalledInstances: costs
            => |system| sure(system.installed());
        /// Returns the verbs that are entered.
        Observe verbs() -> Vec<VerbSummary>: costs
            => |system| sure(system.verbs());
        /// Returns what a form that starts a verb needs: its arguments and input parameters.
        Observe verb_form(must name: String) -> VerbForm: costs
            => |system| system.verb_form(&name);
        /// Returns the bodies, joints, shapes and meshes of a physical device, for drawing.
        Observe geometry(must device: String) -> Geometry: costs
            => |system| system.geometry(&device);
        /// Returns how sources, instances and devices run.
        Observe statistics() -> Statistics
            => |system| sure(system.statistics());
        /// Visits the blocks of a source, or of all, one a firing: then `statistics` tells how long they take.
        Observe probe(
            may source: Option<String>,
            /// Amount of real time, an hour at most.
            must for_ns: u64,
        ) -> ()
            => |system| system.probe(source.as_deref(), for_ns);
        /// Returns commands, conditions, faults, transitions and ends.
        Observe log(
            /// The number of the first one.
            may since: u64,
        ) -> Vec<Entry>: costs
            => |system| sure(system.log_since(since));
    ];
}
