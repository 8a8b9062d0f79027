// SPDX-License-Identifier: Apache-2.0
//! Code modules, definitions, SVVs.
use model::compose::Composition;
use model::definition::{DeviceType, Graph, Verb};
use model::interface::Interface;
use model::refusal::{Refusal, SourceLocation};
use model::{Drawing, PortName, Verdict};
use schemars::JsonSchema;
use serde::Serialize;
use std::path::PathBuf;
use supervisor::{FusedBlocks, ModuleAbout, SvvRequest};

/// The interpreter that tries a code module in a process of its own, where no `opengpac-probe` lies beside the program.
const PYTHON: &str = "python3";

/// Reason why two ports cannot be wired; of one port and all others, a list.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum PortVerdicts {
    Two(Option<String>),
    All(Vec<Verdict>),
}

crate::calls! {
    /// Software installed on a system.
    pub(super) const SOFTWARE about "software" = [
        /// Loads a code module. Returns its blocks.
        Download download(
            must path: PathBuf,
            /// Name of the module; by default the name of the file.
            may name: Option<String>,
            /// The interpreter that tries it in a process of its own.
            may python: Option<String>,
        ) -> ModuleAbout: commands("name"), local
            => |system| system.download(&path, name.as_deref(), python.as_deref().unwrap_or(PYTHON));
        /// Enters a verb.
        Configure define_verb(whole verb: Verb) -> (): commands("name"), defines("name")
            => |system| system.define_verb(verb);
        /// Refuses a data flow graph that is wrong; nothing is entered.
        Observe check_graph(whole graph: Graph) -> (): costs
            => |system| system.check_graph(&graph);
        /// Returns all that is wrong with a graph or a verb, each with "where"; nothing is entered.
        Observe check_definition(whole drawing: Drawing) -> Vec<Refusal>: costs
            => |system| system.check_definition(&drawing);
        /// Returns all that is wrong with a graph or a verb, as `check_definition` does, and what installing it would refuse whatever it
        /// is given: constants, defaults, members of objects, second writers in a list. Nothing is entered.
        Observe check_drawing(whole drawing: Drawing) -> Vec<Refusal>: costs
            => |system| system.check_drawing(&drawing);
        /// Returns why two ports of a graph or a verb cannot be wired, or null; without `to`, why each other one cannot.
        Observe compatible(
            must from: PortName,
            may to: Option<PortName>,
            whole drawing: Drawing,
        ) -> PortVerdicts: costs
            => |system| match to {
                Some(to) => system.compatible(&drawing, &from, &to).map(PortVerdicts::Two),
                None => system.compatible_with(&drawing, &from).map(PortVerdicts::All),
            };
        /// Enters a type of logical devices.
        Configure define_device_type(whole device_type: DeviceType) -> (): commands("name"), defines("name")
            => |system| system.define_device_type(device_type);
        /// Returns the verb that a composition of verbs is; nothing is entered.
        Observe compose(whole composition: Composition) -> Verb: costs
            => |system| system.compose(&composition);
        /// Makes an SVV.
        Configure svv(must name: String, may place: Option<SourceLocation>, whole specification: SvvRequest) -> (): commands("name"), goes_with("delete_svv", "name")
            => |system| system.svv(&name, &specification, place);
        /// Deletes an SVV that nothing is bound to.
        Configure delete_svv(must name: String) -> (): commands("name")
            => |system| system.delete_svv(&name);
        /// Returns every block: of the library, of code modules.
        Observe library() -> Vec<Interface>: costs
            => |system| crate::sure(system.blocks());
        /// Fuses blocks in C that are always due together, for a second; with groups `waiting` it is to be called again. Returns what is fused.
        Configure fuse(
            /// False undoes it.
            may on: Option<bool>,
        ) -> FusedBlocks: commands(""), unjournalled, costs
            => |system| system.fuse(on.unwrap_or(true));
        /// Returns what is fused, and what is not and why.
        Observe fused() -> FusedBlocks: costs
            => |system| crate::sure(system.fused());
    ];
}
