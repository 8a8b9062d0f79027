// SPDX-License-Identifier: Apache-2.0
//! Calls for code modules, definitions and SVVs.
use model::compose::Composition;
use model::definition::{DeviceType, Graph, Verb};
use model::interface::Interface;
use model::refusal::{Refusal, SourceLocation};
use model::{Drawing, PortName, Verdict};
use schemars::JsonSchema;
use serde::Serialize;
use std::path::PathBuf;
use supervisor::{FusedBlocks, ModuleAbout, SvvRequest};

/// Default interpreter for testing a code module in a separate process, used if there is no `opengpac-probe` next to the program.
const PYTHON: &str = "python3";

/// Reason why two ports cannot be wired together; if only one port is passed, a list with the reason for every other port.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum PortVerdicts {
    Two(Option<String>),
    All(Vec<Verdict>),
}

crate::calls! {
    /// Calls for the software installed on a system.
    pub(super) const SOFTWARE about "software" = [
        /// Loads a code module. Returns its blocks.
        Download download(
            must path: PathBuf,
            /// Name of the module; by default the name of the file.
            may name: Option<String>,
            /// Interpreter that tests the module in a separate process.
            may python: Option<String>,
        ) -> ModuleAbout: commands("name"), local
            => |system| system.download(&path, name.as_deref(), python.as_deref().unwrap_or(PYTHON));
        /// Defines a verb.
        Configure define_verb(whole verb: Verb) -> (): commands("name"), defines("name")
            => |system| system.define_verb(verb);
        /// Checks a data flow graph, and refuses it if it has mistakes. Does not define it.
        Observe check_graph(whole graph: Graph) -> (): costs
            => |system| system.check_graph(&graph);
        /// Returns all mistakes of a graph or a verb, each with its location in "where". Does not define it.
        Observe check_definition(whole drawing: Drawing) -> Vec<Refusal>: costs
            => |system| system.check_definition(&drawing);
        /// Returns all mistakes of a graph or a verb, as `check_definition` does, and everything that an installation would refuse
        /// regardless of the arguments: constants, defaults, members of objects, second writers in a list. Does not define it.
        Observe check_drawing(whole drawing: Drawing) -> Vec<Refusal>: costs
            => |system| system.check_drawing(&drawing);
        /// Returns the reason why two ports of a graph or a verb cannot be wired together, or null if they can; without `to`, returns the
        /// reason for every other port.
        Observe compatible(
            must from: PortName,
            may to: Option<PortName>,
            whole drawing: Drawing,
        ) -> PortVerdicts: costs
            => |system| match to {
                Some(to) => system.compatible(&drawing, &from, &to).map(PortVerdicts::Two),
                None => system.compatible_with(&drawing, &from).map(PortVerdicts::All),
            };
        /// Defines a type of logical devices.
        Configure define_device_type(whole device_type: DeviceType) -> (): commands("name"), defines("name")
            => |system| system.define_device_type(device_type);
        /// Returns the verb that a composition of verbs defines, without defining it in the system.
        Observe compose(whole composition: Composition) -> Verb: costs
            => |system| system.compose(&composition);
        /// Creates an SVV.
        Configure svv(must name: String, may place: Option<SourceLocation>, whole specification: SvvRequest) -> (): commands("name"), goes_with("delete_svv", "name")
            => |system| system.svv(&name, &specification, place);
        /// Deletes an SVV to which no port is bound.
        Configure delete_svv(must name: String) -> (): commands("name")
            => |system| system.delete_svv(&name);
        /// Returns all blocks of the library and of code modules.
        Observe library() -> Vec<Interface>: costs
            => |system| crate::sure(system.blocks());
        /// Fuses C blocks that are always due together, for up to a second; call again as long as there are groups `waiting`. Returns the
        /// fused blocks.
        Configure fuse(
            /// False to undo fusing.
            may on: Option<bool>,
        ) -> FusedBlocks: commands(""), unjournalled, costs
            => |system| system.fuse(on.unwrap_or(true));
        /// Returns the fused blocks, and the other blocks with the reasons.
        Observe fused() -> FusedBlocks: costs
            => |system| crate::sure(system.fused());
    ];
}
