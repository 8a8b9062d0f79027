// SPDX-License-Identifier: Apache-2.0
//! A verb that was entered in a system: its definition is checked and flat, ready to be applied any number of times.
//!
//! Keep one for each verb, made by [`CheckedVerb::new`] when the verb (or a block or device type that it uses) is defined, and
//! apply it with [`CheckedVerb::apply`]. [`crate::apply`] makes one anew each time.
use crate::conditions::{self, CheckedCondition};
use crate::configuration::Configuration;
use crate::conformity;
use crate::constants::{constants_of_other_types, constants_on_bound_inputs};
use crate::definition::{Bound, Graph, IfCutOff, Object, Part, Requirement, Verb};
use crate::ending::{self, CheckedSuspend};
use crate::flatten::{Flat, FlatBlock, Group, Labelled, Named, Origin, Port};
use crate::interface::{Kind, Mode};
use crate::lists::{self, CheckedList};
use crate::order;
use crate::plan::{PlannedEnding, Remark};
use crate::quantity::check_unit;
use crate::reach::check_reach;
use crate::refusal::{Class, Place, Refusal, Refusals, Where};
use crate::suggest::did_you_mean;
use crate::undriven::{cells_without_writer, undriven};
use crate::value::Value;
use indexmap::IndexMap;
use std::sync::OnceLock;

/// A parameter of a verb, taken apart: whose it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Whose {
    /// `sensed`.
    Own,
    /// `arm.commanded`: a member of an object.
    Object { object: String, member: String },
    /// `drive.position`: a channel of the part that is given as `drive`.
    Part { argument: String, channel: String },
}

/// An input parameter: ψ with its targets resolved.
#[derive(Clone, Debug)]
pub struct CheckedInput {
    pub name: String,
    pub whose: Whose,
    pub ports: Vec<Port>,
    pub default: Option<Value>,
    pub tunable: bool,
    pub preset: bool,
    pub unit: String,
    pub within: Option<(Bound, Bound)>,
    pub counted_from: Option<String>,
    pub place: Option<Place>,
}

/// A checked, flat verb.
#[derive(Clone, Debug)]
pub struct CheckedVerb {
    pub name: String,
    pub place: Option<Place>,
    pub(crate) objects: IndexMap<String, Object>,
    pub(crate) parts: IndexMap<String, Part>,
    pub(crate) blocks: Vec<FlatBlock>,
    pub(crate) groups: Vec<Group>,
    /// Group of each data item of each block.
    pub(crate) group_of: Vec<Vec<Option<u32>>>,
    /// Groups that are instantiation parameters.
    pub(crate) parameters: Vec<(usize, Whose)>,
    pub(crate) inputs: Vec<CheckedInput>,
    pub(crate) requires: IndexMap<String, Requirement>,
    pub(crate) outputs: Vec<(String, Port)>,
    pub(crate) lists: Vec<CheckedList>,
    pub(crate) initial: usize,
    pub(crate) ending: PlannedEnding,
    pub(crate) suspend: CheckedSuspend,
    pub(crate) if_cut_off: Option<IfCutOff>,
    pub(crate) conditions: Vec<CheckedCondition>,
    pub(crate) manual: bool,
    pub(crate) remarks: Vec<Remark>,
    /// Whether a block has synchronous inputs that are no constants.
    pub(crate) driven: Vec<bool>,
}

/// Every refusal of a verb's definition; empty: it may be entered.
pub fn check_verb(verb: &Verb, configuration: &Configuration) -> Refusals {
    CheckedVerb::new(verb, configuration).err().unwrap_or_default()
}

/// Every refusal of a graph's definition.
pub fn check_graph(graph: &Graph, configuration: &Configuration) -> Refusals {
    flat_graph(graph, configuration).refusals
}

/// A graph, flat and checked by itself.
pub(crate) fn flat_graph<'a>(graph: &'a Graph, configuration: &'a Configuration) -> Flat<'a> {
    let mut flat = Flat::new(configuration);
    flat.add("", &graph.blocks, &graph.divide, 1);
    flat.close_graph("", graph, 0, 1, &graph.place);
    let given: Vec<Port> = flat.scopes.last().expect("close_graph has made one").ports.values().flatten().copied().collect();
    if flat.refusals.is_empty() {
        flat.fill(&given, true, &graph.place);
        constants_of_other_types(&mut flat);
        let group_of = group_of(&flat.blocks, &flat.groups);
        flat.refusals.extend(synchronous_cycle(&flat.blocks, &flat.groups, &group_of, &graph.place));
    }
    flat
}

impl CheckedVerb {
    /// Checks a definition and makes it flat.
    ///
    /// # Errors
    /// Everything that is wrong with it, in the order of the definition.
    pub fn new(verb: &Verb, configuration: &Configuration) -> Result<CheckedVerb, Refusals> {
        let mut flat = Flat::new(configuration);
        let checked = CheckedVerb::sketch(&mut flat, verb);
        if flat.refusals.is_empty() { Ok(checked) } else { Err(flat.refusals) }
    }

    /// What can be told of a verb, right or wrong: the refusals are in `flat`, with the labels.
    pub(crate) fn sketch<'a>(flat: &mut Flat<'a>, verb: &'a Verb) -> CheckedVerb {
        flat.is_composed = !verb.parts.is_empty();
        flat.add("", &verb.blocks, no_divides(), 1);
        let parameters = instantiation_parameters(flat, verb);
        for (name, nodes) in &verb.cells {
            flat.subject = Some(Where::Cell { cell: name.clone() });
            let ports = flat.cover("", name, nodes, &verb.place);
            if verb.instantiation_parameters.contains_key(name) {
                flat.refuse(Class::CoverError, format!("'{name}' is an instantiation parameter and a cell"), &verb.place, "give them two names");
            }
            flat.groups.push(Group { name: name.clone(), origin: Origin::Cell, ports, place: verb.place.clone() });
        }
        flat.subject = None;
        flat.relax("", &verb.modes, None, &verb.place);
        let inputs = input_parameters(flat, verb);
        conformity::check(flat, verb);
        let outputs = output_values(flat, verb);
        let lists = lists::check_lists(flat, verb);
        let conditions = conditions::check_conditions(flat, verb);
        let initial = lists::initial(flat, verb);
        let ending = ending::check_ending(flat, verb, initial);
        let suspend = ending::check_suspend(flat, verb, &conditions);
        let given: Vec<Port> = inputs.iter().flat_map(|input| input.ports.iter().copied()).chain(suspend.given()).collect();
        let known = flat.refusals.is_empty();
        let mut remarks = flat.fill(&given, false, &verb.place);
        constants_on_bound_inputs(flat);
        remarks.extend(cells_without_writer(flat, &given));
        let group_of = group_of(&flat.blocks, &flat.groups);
        let drivers = drivers(&flat.blocks, &flat.groups, &group_of);
        if known {
            constants_of_other_types(flat);
            undriven(flat, &inputs);
            flat.refusals.extend(synchronous_cycle(&flat.blocks, &flat.groups, &group_of, &verb.place));
            lists::check_scheduled(flat, &lists, &drivers);
            remarks.extend(check_reach(flat, verb, &lists, (initial, ending.list), &conditions, &outputs));
        }
        CheckedVerb {
            name: verb.name.clone(),
            place: verb.place.clone(),
            objects: verb.objects.clone(),
            parts: verb.parts.clone(),
            blocks: std::mem::take(&mut flat.blocks),
            groups: std::mem::take(&mut flat.groups),
            group_of,
            parameters,
            inputs,
            requires: verb.requires.clone(),
            outputs,
            lists,
            initial,
            ending,
            suspend,
            if_cut_off: verb.if_cut_off,
            conditions,
            manual: verb.manual,
            remarks,
            driven: drivers.iter().map(Option::is_some).collect(),
        }
    }

    /// The group that a data item is bound to.
    pub(crate) fn group(&self, (block, item): Port) -> Option<usize> {
        self.group_of[block][item].map(|group| group as usize)
    }
}

fn whose(flat: &mut Flat<'_>, verb: &Verb, name: &str, is_svv: bool, place: &Option<Place>) -> Whose {
    let Some((first, member)) = name.split_once('.') else { return Whose::Own };
    let Some(object) = verb.objects.get(first) else {
        return Whose::Part { argument: first.to_owned(), channel: member.to_owned() };
    };
    if let Some(device_type) = flat.configuration.device_types.get(&object.device_type) {
        let (there, what) = if is_svv { (device_type.svvs.contains_key(member), "SVV") } else { (device_type.parameters.contains_key(member), "parameter") };
        if !there {
            let names: Vec<&str> =
                if is_svv { device_type.svvs.keys().map(String::as_str).collect() } else { device_type.parameters.keys().map(String::as_str).collect() };
            let remedy = did_you_mean(member, names);
            flat.refuse(Class::UnknownName, format!("'{name}': the device type '{}' has no {what} '{member}'", device_type.name), place, &remedy);
        }
    }
    Whose::Object { object: first.to_owned(), member: member.to_owned() }
}

fn instantiation_parameters(flat: &mut Flat<'_>, verb: &Verb) -> Vec<(usize, Whose)> {
    for (name, object) in &verb.objects {
        flat.subject = Some(Where::Object { object: name.clone() });
        if !flat.configuration.device_types.contains_key(&object.device_type) {
            let remedy = did_you_mean(&object.device_type, flat.configuration.device_types.keys().map(String::as_str));
            flat.refuse(
                Class::UnknownName,
                format!("the object '{name}' is of the device type '{}', which is not there", object.device_type),
                &verb.place,
                &remedy,
            );
        }
    }
    for name in verb.objects.keys().chain(verb.instantiation_parameters.keys()).filter(|name| OPTIONS.contains(&name.as_str())) {
        let message = format!("an argument of verb '{}' cannot be named '{name}': that is a word of a call", verb.name);
        flat.refuse(Class::DefinitionError, message, &verb.place, &format!("choose another name, for example '{name}_value'"));
    }
    let mut parameters = Vec::with_capacity(verb.instantiation_parameters.len());
    for (name, nodes) in &verb.instantiation_parameters {
        flat.subject = Some(Where::Cell { cell: name.clone() });
        let whose = whose(flat, verb, name, true, &verb.place);
        let ports = flat.cover("", name, nodes, &verb.place);
        parameters.push((flat.groups.len(), whose));
        flat.groups.push(Group { name: name.clone(), origin: Origin::Parameter, ports, place: verb.place.clone() });
    }
    parameters
}

/// What every call takes beside the arguments of its verb, and `set` beside its values.
const OPTIONS: [&str; 5] = ["time_limit", "overruns", "age_max", "every", "self"];

/// Words that a call has a meaning for already: its options, and those of Python.
fn is_reserved(name: &str) -> bool {
    const PYTHON: [&str; 35] = [
        "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class", "continue", "def", "del", "elif", "else", "except", "finally",
        "for", "from", "global", "if", "import", "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise", "return", "try", "while", "with", "yield",
    ];
    OPTIONS.contains(&name) || PYTHON.contains(&name)
}

fn input_parameters(flat: &mut Flat<'_>, verb: &Verb) -> Vec<CheckedInput> {
    let mut inputs = Vec::with_capacity(verb.input_parameters.len());
    for (name, input) in &verb.input_parameters {
        flat.subject = Some(Where::Parameter { parameter: name.clone() });
        let place = if input.place.is_some() { &input.place } else { &verb.place };
        if verb.instantiation_parameters.contains_key(name) || verb.objects.contains_key(name) {
            flat.refuse(
                Class::DefinitionError,
                format!("'{name}' is an input parameter and an instantiation parameter or object"),
                place,
                "give them two names",
            );
        }
        if is_reserved(name) {
            let message = format!("an input parameter of verb '{}' cannot be named '{name}': that is a word of a call", verb.name);
            flat.refuse(Class::DefinitionError, message, place, &format!("choose another name, for example '{name}_value'"));
        }
        if let Err(refusal) = check_unit(&input.unit) {
            flat.push(refusal.for_what(&format!("the input parameter '{name}'")).at(place));
        }
        let whose = match if input.preset { Whose::Own } else { whose(flat, verb, name, false, place) } {
            Whose::Part { argument, .. } => {
                let remedy = did_you_mean(&argument, verb.objects.keys().map(String::as_str));
                flat.refuse(Class::UnknownName, format!("the input parameter '{name}' names the object '{argument}', which is not there"), place, &remedy);
                continue;
            }
            whose => whose,
        };
        let mut ports = Vec::new();
        for target in &input.targets {
            match flat.resolve("", target, place) {
                Some(Named::Ports(inner)) => ports.extend(inner),
                Some(Named::Item(port)) => ports.push(port),
                None => {}
            }
        }
        for port in &ports {
            let item = flat.blocks[port.0].kind.item(port.1);
            let takes = match item.kind {
                Kind::Input | Kind::Output | Kind::Parameter => true,
                Kind::Condition => !item.type_text.is_empty(),
                _ => false,
            };
            if !takes {
                let described = flat.described(*port);
                flat.refuse(
                    Class::DefinitionError,
                    format!("the input parameter '{name}' cannot store into {described}"),
                    place,
                    "input parameters go to ports, presets of conditions and parameters",
                );
            }
        }
        inputs.push(CheckedInput {
            name: name.clone(),
            whose,
            ports,
            default: input.default.clone(),
            tunable: input.tunable,
            preset: input.preset,
            unit: input.unit.clone(),
            within: input.within.clone(),
            counted_from: input.counted_from.clone(),
            place: place.clone(),
        });
    }
    flat.subject = None;
    inputs
}

fn output_values(flat: &mut Flat<'_>, verb: &Verb) -> Vec<(String, Port)> {
    let mut outputs = Vec::with_capacity(verb.output_values.len());
    for (name, source) in &verb.output_values {
        flat.subject = Some(Where::Output { output: name.clone() });
        let port = match flat.resolve("", source, &verb.place) {
            Some(Named::Item(port)) => port,
            Some(Named::Ports(ports)) => match ports.first() {
                Some(port) => *port,
                None => continue,
            },
            None => continue,
        };
        let item = flat.blocks[port.0].kind.item(port.1);
        let has_value = match item.kind {
            Kind::Input | Kind::Output | Kind::Parameter => true,
            Kind::Condition => !item.type_text.is_empty(),
            _ => false,
        };
        if has_value {
            outputs.push((verb.reported(name).to_owned(), port));
        } else {
            let described = flat.described(port);
            flat.refuse(
                Class::DefinitionError,
                format!("the output value '{name}' cannot be read from {described}"),
                &verb.place,
                "name a port, a condition with a value or a parameter",
            );
        }
    }
    flat.subject = None;
    outputs
}

fn no_divides() -> &'static IndexMap<String, u32> {
    static NONE: OnceLock<IndexMap<String, u32>> = OnceLock::new();
    NONE.get_or_init(IndexMap::new)
}

pub(crate) fn group_of(blocks: &[FlatBlock], groups: &[Group]) -> Vec<Vec<Option<u32>>> {
    let mut group_of: Vec<Vec<Option<u32>>> = blocks.iter().map(|b| vec![None; b.kind.interface.items.len()]).collect();
    for (at, group) in groups.iter().enumerate() {
        for (block, item) in &group.ports {
            group_of[*block][*item] = Some(u32::try_from(at).expect("a verb has fewer than 2^32 data objects"));
        }
    }
    group_of
}

/// The first synchronous input of each block that is no constant: it runs when that has a new value, and only then.
fn drivers(blocks: &[FlatBlock], groups: &[Group], group_of: &[Vec<Option<u32>>]) -> Vec<Option<usize>> {
    let driver = |(at, block): (usize, &FlatBlock)| {
        (0..block.kind.interface.items.len()).find(|item| {
            is_synchronous_input(blocks, (at, *item)) && group_of[at][*item].is_some_and(|group| groups[group as usize].origin != Origin::Constant)
        })
    };
    blocks.iter().enumerate().map(driver).collect()
}

/// A cycle of synchronous ports within the definition.
pub(crate) fn synchronous_cycle(blocks: &[FlatBlock], groups: &[Group], group_of: &[Vec<Option<u32>>], place: &Option<Place>) -> Option<Refusal> {
    let mut edges = Vec::new();
    for group in groups {
        for writer in group.ports.iter().filter(|p| blocks[p.0].kind.item(p.1).kind == Kind::Output) {
            for reader in group.ports.iter().filter(|p| is_synchronous_input(blocks, **p)) {
                edges.push((writer.0, reader.0));
            }
        }
    }
    debug_assert_eq!(group_of.len(), blocks.len());
    let cycle = order::find_cycle(blocks.len(), &edges)?;
    let (first, last) = (*cycle.first()?, *cycle.last()?);
    let closing = groups.iter().filter(|group| group.ports.iter().any(|p| p.0 == last && blocks[last].kind.item(p.1).kind == Kind::Output));
    let relaxed: Vec<usize> = closing.flat_map(|group| &group.ports).filter(|p| p.0 == first && is_synchronous_input(blocks, **p)).map(|p| p.1).collect();
    let labels: Vec<&str> = cycle.iter().map(|&block| blocks[block].label.as_str()).collect();
    Some(cycle_refusal(&labels, &modes_of(&blocks[first], &relaxed), place))
}

/// How these inputs of a block are relaxed; of a block within a graph it is for that graph to say.
pub(crate) fn modes_of(block: &FlatBlock, items: &[usize]) -> String {
    let relaxed: Vec<String> = items.iter().map(|item| format!("'{}.{}': 'asynchronous'", block.label, block.kind.interface.items[*item].name)).collect();
    if relaxed.is_empty() || block.label.contains('.') { "modes=".to_owned() } else { format!("modes={{{}}}", relaxed.join(", ")) }
}

/// How the synchronous inputs of a block are relaxed, all of them.
pub(crate) fn modes_of_all(block: &FlatBlock) -> String {
    let is_synchronous = |item: &usize| block.kind.item(*item).kind == Kind::Input && block.mode(*item) == Mode::Synchronous;
    modes_of(block, &(0..block.kind.interface.items.len()).filter(is_synchronous).collect::<Vec<_>>())
}

/// How the first block of a cycle is relaxed that only its labels tell.
pub(crate) fn modes_of_first(blocks: &[FlatBlock], labels: &[&str]) -> String {
    let first = blocks.iter().find(|block| labels.first() == Some(&block.label.as_str()));
    first.map_or_else(|| "modes=".to_owned(), modes_of_all)
}

fn is_synchronous_input(blocks: &[FlatBlock], (block, item): Port) -> bool {
    blocks[block].kind.item(item).kind == Kind::Input && blocks[block].mode(item) == Mode::Synchronous
}

/// Names a cycle. `modes`: what relaxes one of its inputs.
pub(crate) fn cycle_refusal(labels: &[&str], modes: &str, place: &Option<Place>) -> Refusal {
    let path: Vec<String> = labels.iter().chain(labels.first()).map(|label| format!("'{label}'")).collect();
    let about = labels.iter().map(|label| Where::Block { block: (*label).to_owned() });
    Refusal::new(Class::SynchronousCycle, format!("synchronous ports make a cycle: {}", path.join(" → ")))
        .remedy(format!("relax one of the inputs, for example with {modes}"))
        .at(place)
        .about(about)
}

/// The block row that a label names.
pub(crate) fn labelled(flat: &mut Flat<'_>, label: &str, what: &str, place: &Option<Place>) -> Option<(std::ops::Range<usize>, u32)> {
    match flat.labels.get(label) {
        Some(Labelled::Block(block)) => Some((*block..*block + 1, flat.blocks[*block].divide)),
        Some(Labelled::Scope(scope)) => Some((flat.scopes[*scope].blocks.clone(), flat.scopes[*scope].divide)),
        None => {
            let mut known: Vec<&str> = flat.labels.keys().map(String::as_str).collect();
            known.sort_unstable();
            let remedy = did_you_mean(label, known);
            flat.refuse(Class::UnknownName, format!("{what} names the block '{label}', which is not there"), place, &remedy);
            None
        }
    }
}
