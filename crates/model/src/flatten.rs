// SPDX-License-Identifier: Apache-2.0
//! Flattening: converts nested graphs to one flat list of blocks, each labelled by its path from the outermost graph inwards:
//! `servo.pid`.
use crate::configuration::Configuration;
use crate::definition::{BlockSource, BlockUse, Graph};
use crate::interface::{Kind, Mode};
use crate::kind::{self, BlockKind};
use crate::refusal::{Class, Refusal, Refusals, SourceLocation, Where};
use crate::value::Value;
use hints::did_you_mean;
use indexmap::IndexMap;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Item of a flat block: (block, item).
pub type Port = (usize, usize);

/// Subroutine instance in the flat list.
#[derive(Clone, Debug)]
pub struct FlatBlock {
    pub label: String,
    pub kind: Arc<BlockKind>,
    pub constants: Vec<(usize, Value)>,
    /// Effective modes of relaxed items.
    pub modes: Vec<(usize, Mode)>,
    /// Product of the `divide` values of the enclosing graphs.
    pub divide: u32,
    pub place: Option<SourceLocation>,
}

impl FlatBlock {
    /// Returns the effective mode of an item.
    pub fn mode(&self, item: usize) -> Mode {
        let item = self.kind.whole(item);
        self.modes.iter().find(|(at, _)| *at == item).map_or(self.kind.item(item).mode, |(_, mode)| *mode)
    }
}

/// A nested graph, or the verb itself.
#[derive(Clone, Debug)]
pub struct Scope {
    pub label: String,
    pub name: String,
    pub blocks: Range<usize>,
    pub ports: IndexMap<String, Vec<Port>>,
    pub divide: u32,
}

/// One data object: the ports that are bound to the same SVV, cell or channel.
#[derive(Clone, Debug)]
pub struct Group {
    pub name: String,
    pub origin: Origin,
    pub ports: Vec<Port>,
    pub place: Option<SourceLocation>,
}

/// Origin of a data object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// An instantiation parameter, passed at creation.
    Parameter,
    /// A cell of the verb or a graph.
    Cell,
    /// An output, or a port of a graph, that is not named in any binding.
    Filled,
    /// Inputs written only by input parameters.
    InputOnly,
    /// An input with a default or a constant.
    Constant,
}

impl Origin {
    /// Returns true if the data object may change while the verb is running.
    pub fn varies(self) -> bool {
        !matches!(self, Origin::Constant | Origin::InputOnly)
    }
}

/// Target of a label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabelTarget {
    Block(usize),
    Scope(usize),
}

/// Target of a name `label.item`.
pub enum ItemTarget {
    Item(Port),
    /// A port of a graph.
    Ports(Vec<Port>),
}

/// A flat list that is being built.
pub struct Flat<'a> {
    pub configuration: &'a Configuration,
    pub blocks: Vec<FlatBlock>,
    pub scopes: Vec<Scope>,
    pub labels: HashMap<String, LabelTarget>,
    pub groups: Vec<Group>,
    /// Ports covered by a ρ or χ, with the name that covers them.
    pub covered: HashMap<Port, String>,
    pub refusals: Refusals,
    /// Part of the definition that is being checked, to which refusals refer.
    pub subject: Option<Where>,
    /// True if block labels begin with the label of their part in a composed verb.
    pub is_composed: bool,
    kinds: HashMap<&'a str, Option<Arc<BlockKind>>>,
}

impl<'a> Flat<'a> {
    pub fn new(configuration: &'a Configuration) -> Flat<'a> {
        Flat {
            configuration,
            blocks: Vec::new(),
            scopes: Vec::new(),
            labels: HashMap::new(),
            groups: Vec::new(),
            covered: HashMap::new(),
            refusals: Vec::new(),
            subject: None,
            is_composed: false,
            kinds: HashMap::new(),
        }
    }

    /// Adds the blocks of a verb or graph. Their labels begin with `prefix` (empty or ending in a dot).
    pub fn add(&mut self, prefix: &str, blocks: &'a IndexMap<String, BlockUse>, divides: &'a IndexMap<String, u32>, divide: u32) {
        for (label, usage) in blocks {
            let full = format!("{prefix}{label}");
            self.subject = Some(Where::Block { block: full.clone() });
            let may_have_dot = self.is_composed && prefix.is_empty();
            if label.is_empty() || label.contains('.') && !may_have_dot {
                self.refuse(Class::DefinitionError, format!("the label '{full}' of a block is empty or contains a dot"), &usage.place, "");
                continue;
            }
            let divide = divide.saturating_mul(divides.get(label).copied().unwrap_or(1));
            match &usage.block {
                BlockSource::Subroutine(name) => self.add_subroutine(full, name, usage, divide),
                BlockSource::Graph(graph) => self.add_graph(full, graph, usage, divide),
            }
        }
        self.subject = None;
    }

    fn add_subroutine(&mut self, label: String, name: &'a str, usage: &'a BlockUse, divide: u32) {
        let Some(kind) = self.kind(name, usage) else { return };
        let mut constants = Vec::new();
        for (constant, value) in &usage.constants {
            self.subject = Some(Where::Block { block: label.clone() });
            let found = kind.find(constant);
            match found {
                Some(item) if takes_constant(&kind, item) => constants.push((item, value.clone())),
                Some(item) => {
                    self.subject = Some(Where::Port { block: label.clone(), port: constant.clone() });
                    let what = kind::kind_name(kind.item(item).kind);
                    let message = format!("'{constant}' of '{label}' is a {what}, which cannot be given a constant");
                    self.refuse(Class::DefinitionError, message, &usage.place, "give constants only to parameters, presets, sizes and inputs");
                }
                None => {
                    let names = (0..kind.interface.items.len()).filter(|item| takes_constant(&kind, *item));
                    let remedy = did_you_mean(constant, names.map(|item| kind.item(item).name.as_str()));
                    self.refuse(Class::UnknownName, format!("'{label}' ({name}) has no parameter '{constant}'"), &usage.place, &remedy);
                }
            }
        }
        self.labels.insert(label.clone(), LabelTarget::Block(self.blocks.len()));
        self.blocks.push(FlatBlock { label, kind, constants, modes: Vec::new(), divide, place: usage.place.clone() });
    }

    fn kind(&mut self, name: &'a str, usage: &BlockUse) -> Option<Arc<BlockKind>> {
        if let Some(kind) = self.kinds.get(name) {
            return kind.clone();
        }
        let kind = match self.configuration.interfaces.get(name).map(BlockKind::new) {
            Some(Ok(kind)) => Some(Arc::new(kind)),
            Some(Err(refusals)) => {
                let subject = self.subject.clone();
                self.refusals.extend(refusals.into_iter().map(|refusal| refusal.at(&usage.place).about(subject.clone())));
                None
            }
            None => {
                let remedy = did_you_mean(name, self.configuration.interfaces.keys().map(String::as_str));
                self.refuse(Class::UnknownName, format!("there is no block '{name}'"), &usage.place, &remedy);
                None
            }
        };
        self.kinds.insert(name, kind.clone());
        kind
    }

    fn add_graph(&mut self, label: String, graph: &'a Graph, usage: &'a BlockUse, divide: u32) {
        let place = if usage.place.is_some() { &usage.place } else { &graph.place };
        let prefix = format!("{label}.");
        let first = self.blocks.len();
        self.add(&prefix, &graph.blocks, &graph.divide, divide);
        self.close_graph(&prefix, graph, first, divide, place);
        self.subject = Some(Where::Block { block: label.clone() });
        for (name, value) in &usage.constants {
            self.constant_of_graph(&prefix, name, value, place);
        }
        self.labels.insert(label, LabelTarget::Scope(self.scopes.len() - 1));
    }

    /// Adds a constant of a graph, which sets an inner parameter (`inner.item`) or the inputs bound to a port.
    fn constant_of_graph(&mut self, prefix: &str, name: &str, value: &Value, place: &Option<SourceLocation>) {
        let scope = self.scopes.len() - 1;
        let ports = match self.scopes[scope].ports.get(name) {
            Some(ports) => ports.clone(),
            None => match self.resolve(prefix, name, place) {
                Some(ItemTarget::Item(port)) => vec![port],
                Some(ItemTarget::Ports(ports)) => ports,
                None => return,
            },
        };
        for (block, item) in ports {
            if takes_constant(&self.blocks[block].kind, item) {
                self.blocks[block].constants.retain(|(at, _)| *at != item);
                self.blocks[block].constants.push((item, value.clone()));
            }
        }
    }

    /// Closes the scope of a graph whose blocks have been added: processes its cover, cells, modes and divisors.
    pub fn close_graph(&mut self, prefix: &str, graph: &'a Graph, first: usize, divide: u32, place: &Option<SourceLocation>) {
        for (label, divide) in &graph.divide {
            self.subject = Some(Where::Block { block: format!("{prefix}{label}") });
            if !graph.blocks.contains_key(label) {
                let remedy = did_you_mean(label, graph.blocks.keys().map(String::as_str));
                self.refuse(Class::UnknownName, format!("divide= of graph '{}' names '{label}', which is not one of its blocks", graph.name), place, &remedy);
            } else if *divide == 0 {
                self.refuse(Class::SchedulingError, format!("divide= of '{prefix}{label}' is 0"), place, "give 1 or more");
            }
        }
        let mut ports = IndexMap::new();
        let sides = graph.inputs.iter().map(|(name, inner)| (name, inner, true));
        for (name, inner, is_input) in sides.chain(graph.outputs.iter().map(|(name, inner)| (name, inner, false))) {
            let full = format!("{prefix}{name}");
            self.subject = Some(Where::Port { block: prefix.trim_end_matches('.').to_owned(), port: name.clone() });
            let resolved = self.cover(prefix, &full, inner, place);
            self.check_side(&full, &resolved, is_input, place);
            if ports.insert(name.clone(), resolved).is_some() {
                self.refuse(
                    Class::CoverError,
                    format!("'{full}' is both an input and an output of graph '{}'", graph.name),
                    place,
                    "give them different names",
                );
            }
        }
        for (name, inner) in &graph.cells {
            let full = format!("{prefix}{name}");
            self.subject = Some(Where::Cell { cell: full.clone() });
            let resolved = self.cover(prefix, &full, inner, place);
            self.one_output(&full, &resolved, place);
            self.groups.push(Group { name: full, origin: Origin::Cell, ports: resolved, place: place.clone() });
        }
        self.scopes.push(Scope { label: prefix.trim_end_matches('.').to_owned(), name: graph.name.clone(), blocks: first..self.blocks.len(), ports, divide });
        let scope = self.scopes.len() - 1;
        self.subject = None;
        self.relax(prefix, &graph.modes, Some(scope), place);
        for name in graph.inputs.keys() {
            self.one_mode(scope, prefix, name, place);
        }
    }

    /// Checks that a port of a graph has a single mode, like a port of a subroutine: all inputs bound to it must have the same mode.
    fn one_mode(&mut self, scope: usize, prefix: &str, name: &str, place: &Option<SourceLocation>) {
        let inputs = self.scopes[scope].ports[name].iter().copied().filter(|port| self.item_kind(*port) == Kind::Input);
        let inputs: Vec<(Port, Mode)> = inputs.map(|port| (port, self.blocks[port.0].mode(port.1))).collect();
        let Some(&(first, mode)) = inputs.first() else { return };
        let Some(&(other, differs)) = inputs.iter().find(|(_, other)| *other != mode) else { return };
        let mode_of = |port: Port| self.blocks[port.0].mode(port.1);
        let (a, b) = (self.described(first), self.described(other));
        let message =
            format!("the graph input '{prefix}{name}' covers {a}, which is {}, and {b}, which is {}: a port has one mode", mode.name(), differs.name());
        let tight = if mode == Mode::Synchronous || differs == Mode::Asynchronous { (first, differs) } else { (other, mode) };
        let (port, mode) = (self.port_name(tight.0), tight.1.name());
        let mode = mode.strip_prefix("ratio ").map_or_else(|| format!("'{mode}'"), |n| format!("gpac.ratio({n})"));
        let remedy = match (mode_of(first), mode_of(other)) {
            (Mode::Ratio(_), Mode::Ratio(_)) => "make it two inputs".to_owned(),
            _ => format!("relax one with modes={{'{}': {mode}}}, or make it two inputs", port.strip_prefix(prefix).unwrap_or(&port)),
        };
        self.subject = Some(Where::Port { block: prefix.trim_end_matches('.').to_owned(), port: name.to_owned() });
        self.refuse_ports(Class::SchedulingError, message, place, &remedy, &[other, first]);
        self.subject = None;
    }

    fn check_side(&mut self, name: &str, ports: &[Port], is_input: bool, place: &Option<SourceLocation>) {
        let output = ports.iter().copied().find(|port| self.item_kind(*port) == Kind::Output);
        match output {
            Some(port) if is_input => {
                let message = format!("the graph input '{name}' covers the output '{}'", self.port_name(port));
                self.refuse_ports(Class::CoverError, message, place, "make it an output or a cell: a graph input leads only to inputs", &[port]);
            }
            None if !is_input && !ports.is_empty() => {
                self.refuse(Class::CoverError, format!("the graph output '{name}' covers no output of a block"), place, "make it an input");
            }
            _ => self.one_output(name, ports, place),
        }
    }

    /// Checks that a cell of a graph has at most one writer.
    fn one_output(&mut self, name: &str, ports: &[Port], place: &Option<SourceLocation>) {
        let mut outputs = ports.iter().copied().filter(|port| self.item_kind(*port) == Kind::Output);
        if let (Some(first), Some(second)) = (outputs.next(), outputs.next()) {
            let message = format!("'{name}' has two writers: {} and {}", self.described(first), self.described(second));
            self.refuse_ports(Class::SecondWriter, message, place, "give each its own cell", &[second, first]);
        }
    }

    /// Returns true if the mode of an input makes it wait for its writer.
    pub fn waits(&self, (block, item): Port) -> bool {
        self.item_kind((block, item)) == Kind::Input && self.blocks[block].mode(item) != Mode::Asynchronous
    }

    /// Returns true if an input needs no writer because it has a constant or a default.
    pub fn has_value(&self, (block, item): Port) -> bool {
        let block = &self.blocks[block];
        block.kind.item(item).has_default || block.constants.iter().any(|(at, _)| *at == item)
    }

    pub fn item_kind(&self, (block, item): Port) -> Kind {
        self.blocks[block].kind.item(item).kind
    }

    /// Returns the name of a port for messages: `servo.effort`.
    pub fn port_name(&self, (block, item): Port) -> String {
        format!("{}.{}", self.blocks[block].label, self.blocks[block].kind.item(item).name)
    }

    /// Describes a port for messages: `output 'servo.effort' (double, N.m)`.
    pub fn described(&self, port: Port) -> String {
        describe(&self.blocks[port.0], port.1)
    }

    /// Returns the location of a port in the drawing.
    pub fn part(&self, (block, item): Port) -> Where {
        Where::Port { block: self.blocks[block].label.clone(), port: self.blocks[block].kind.item(item).name.clone() }
    }

    pub fn refuse(&mut self, class: Class, message: String, place: &Option<SourceLocation>, remedy: &str) {
        self.push(Refusal::new(class, message).remedy(remedy).at(place));
    }

    /// Refuses as `refuse` does, naming these ports before the part that is being checked.
    pub fn refuse_ports(&mut self, class: Class, message: String, place: &Option<SourceLocation>, remedy: &str, ports: &[Port]) {
        let parts: Vec<Where> = ports.iter().map(|port| self.part(*port)).collect();
        self.push(Refusal::new(class, message).remedy(remedy).at(place).about(parts));
    }

    /// Adds a refusal, which then also names the part that is being checked.
    pub fn push(&mut self, refusal: Refusal) {
        self.refusals.push(refusal.about(self.subject.clone()));
    }
}

/// Describes an item of a block for messages: `output 'servo.effort' (double, N.m)`.
pub fn describe(block: &FlatBlock, item: usize) -> String {
    let item = block.kind.item(item);
    let unit = if item.unit.is_empty() { String::new() } else { format!(", {}", item.unit) };
    format!("{} '{}.{}' ({}{unit})", kind::kind_name(item.kind), block.label, item.name, item.type_text)
}

fn takes_constant(kind: &BlockKind, item: usize) -> bool {
    let item = kind.item(item);
    match item.kind {
        Kind::Input | Kind::Parameter | Kind::Size => true,
        Kind::Condition => !item.type_text.is_empty(),
        _ => false,
    }
}

/// Returns the range of blocks that a label denotes.
pub(crate) fn labelled(flat: &mut Flat<'_>, label: &str, what: &str, place: &Option<SourceLocation>) -> Option<(Range<usize>, u32)> {
    match flat.labels.get(label) {
        Some(LabelTarget::Block(block)) => Some((*block..*block + 1, flat.blocks[*block].divide)),
        Some(LabelTarget::Scope(scope)) => Some((flat.scopes[*scope].blocks.clone(), flat.scopes[*scope].divide)),
        None => {
            let mut known: Vec<&str> = flat.labels.keys().map(String::as_str).collect();
            known.sort_unstable();
            let remedy = did_you_mean(label, known);
            flat.refuse(Class::UnknownName, format!("{what} names the block '{label}', which does not exist"), place, &remedy);
            None
        }
    }
}
