// SPDX-License-Identifier: Apache-2.0
//! Checked verbs: the definition of a verb that is added to a system is checked and flattened once, after which it can be applied any
//! number of times.
//!
//! Keep one for each verb, created by [`CheckedVerb::new`] when the verb (or a block or device type that it uses) is defined, and apply
//! it with [`CheckedVerb::apply`]. [`crate::apply`] creates a new one each time.
use crate::conditions::{self, CheckedCondition};
use crate::configuration::Configuration;
use crate::conformity;
use crate::constants::{constants_of_other_types, constants_on_bound_inputs};
use crate::cycles::{is_synchronous_input, synchronous_cycle};
use crate::definition::{Graph, IfCutOff, Object, Part, Requirement, Verb};
use crate::ending::{self, CheckedSuspend};
use crate::flatten::{Flat, FlatBlock, Group, ItemTarget, Origin, Port};
use crate::interface::Kind;
use crate::lists::{self, CheckedList};
use crate::parameters::{CheckedInput, Whose, input_parameters, instantiation_parameters};
use crate::plan::{PlannedEnding, Remark};
use crate::reach::check_reach;
use crate::refusal::{Class, Refusals, SourceLocation, Where};
use crate::undriven::{cells_without_writer, undriven};
use indexmap::IndexMap;
use std::sync::OnceLock;

/// A checked and flattened verb.
#[derive(Clone, Debug)]
pub struct CheckedVerb {
    pub name: String,
    pub place: Option<SourceLocation>,
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
    /// True for each block that has synchronous inputs that are not constant.
    pub(crate) driven: Vec<bool>,
}

/// Returns all refusals of a verb's definition. The verb may be added if there are none.
pub fn check_verb(verb: &Verb, configuration: &Configuration) -> Refusals {
    CheckedVerb::new(verb, configuration).err().unwrap_or_default()
}

/// Returns all refusals of a graph's definition.
pub fn check_graph(graph: &Graph, configuration: &Configuration) -> Refusals {
    flat_graph(graph, configuration).refusals
}

/// Returns a graph, flattened and checked on its own.
pub(crate) fn flat_graph<'a>(graph: &'a Graph, configuration: &'a Configuration) -> Flat<'a> {
    let mut flat = Flat::new(configuration);
    flat.add("", &graph.blocks, &graph.divide, 1);
    flat.close_graph("", graph, 0, 1, &graph.place);
    let given: Vec<Port> = flat.scopes.last().expect("close_graph has made one").ports.values().flatten().copied().collect();
    if flat.refusals.is_empty() {
        flat.check_elements(&graph.place);
        flat.fill(&given, true, &graph.place);
        constants_of_other_types(&mut flat);
        let group_of = group_of(&flat.blocks, &flat.groups);
        flat.refusals.extend(synchronous_cycle(&flat.blocks, &flat.groups, &group_of, &graph.place));
    }
    flat
}

impl CheckedVerb {
    /// Checks and flattens a definition.
    ///
    /// # Errors
    /// Returns all mistakes in the order of the definition.
    pub fn new(verb: &Verb, configuration: &Configuration) -> Result<CheckedVerb, Refusals> {
        let mut flat = Flat::new(configuration);
        let checked = CheckedVerb::sketch(&mut flat, verb);
        if flat.refusals.is_empty() { Ok(checked) } else { Err(flat.refusals) }
    }

    /// Resolves as much of a verb as possible, even if it contains mistakes. The refusals and labels are in `flat`.
    pub(crate) fn sketch<'a>(flat: &mut Flat<'a>, verb: &'a Verb) -> CheckedVerb {
        flat.is_composed = !verb.parts.is_empty();
        flat.add("", &verb.blocks, no_divides(), 1);
        let parameters = instantiation_parameters(flat, verb);
        for (name, nodes) in &verb.cells {
            flat.subject = Some(Where::Cell { cell: name.clone() });
            let ports = flat.cover("", name, nodes, &verb.place);
            if verb.instantiation_parameters.contains_key(name) {
                flat.refuse(Class::CoverError, format!("'{name}' is both an instantiation parameter and a cell"), &verb.place, "give them different names");
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
        if known {
            flat.check_elements(&verb.place);
        }
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

    /// Returns the group to which a data item is bound.
    pub(crate) fn group(&self, (block, item): Port) -> Option<usize> {
        self.group_of[block][item].map(|group| group as usize)
    }
}

fn output_values(flat: &mut Flat<'_>, verb: &Verb) -> Vec<(String, Port)> {
    let mut outputs = Vec::with_capacity(verb.output_values.len());
    for (name, source) in &verb.output_values {
        flat.subject = Some(Where::Output { output: name.clone() });
        let port = match flat.resolve("", source, &verb.place) {
            Some(ItemTarget::Item(port)) => port,
            Some(ItemTarget::Ports(ports)) => match ports.first() {
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

/// Returns the first non-constant synchronous input of each block: the block runs only when this input has a new value.
fn drivers(blocks: &[FlatBlock], groups: &[Group], group_of: &[Vec<Option<u32>>]) -> Vec<Option<usize>> {
    let driver = |(at, block): (usize, &FlatBlock)| {
        (0..block.kind.interface.items.len()).find(|item| {
            is_synchronous_input(blocks, (at, *item)) && group_of[at][*item].is_some_and(|group| groups[group as usize].origin != Origin::Constant)
        })
    };
    blocks.iter().enumerate().map(driver).collect()
}
