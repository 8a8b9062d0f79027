// SPDX-License-Identifier: Apache-2.0
//! Checks of definitions while they are being drawn: all mistakes, and the reason why two ports cannot be wired. The rules are those of
//! the installation, applied without arguments by the same functions.
use crate::apply::{Draft, GroupBinding, StandIns};
use crate::checked::{self, CheckedVerb};
use crate::configuration::Configuration;
use crate::definition::{Application, Graph, Verb};
use crate::flatten::{Flat, Group, LabelTarget, Origin, Port, Scope};
use crate::interface::Kind;
use crate::kind::is_data;
use crate::refusal::{Class, Refusal, Refusals};
use hints::did_you_mean;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Drawing to check: a graph or a verb.
#[derive(Clone, Debug, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Drawing {
    #[serde(default)]
    pub graph: Option<Graph>,
    #[serde(default)]
    pub verb: Option<Verb>,
}

/// A port of a block or, if `block` is empty, of the graph itself, as identified by a drawing editor.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct PortName {
    pub block: String,
    pub port: String,
}

/// A port, and the reason why it cannot be wired, if it cannot.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Verdict {
    pub block: String,
    pub port: String,
    pub reason: Option<String>,
}

/// Returns all mistakes of a definition that can be found before any arguments are passed, in names, covers, types, units, cycles, lists
/// and conditions. A wrong name does not hide type errors elsewhere.
///
/// # Errors
/// `CallError` if the drawing contains neither a graph nor a verb, or both.
pub fn check_definition(drawing: &Drawing, configuration: &Configuration) -> Result<Refusals, Refusals> {
    let sketch = Sketch::new(drawing, configuration)?;
    let mut found = sketch.refusals.clone();
    let nothing = Application::default();
    let mut draft = sketch.draft(&nothing, configuration);
    sketch.checked.groups.iter().for_each(|group| draft.check_object(group));
    found.extend(draft.refusals);
    Ok(found)
}

/// Checks as [`check_definition`] does, and adds everything that an installation would refuse regardless of the arguments: units and
/// types of object members, constants and defaults, second writers in a list, undriven inputs.
///
/// # Errors
/// Fails as [`check_definition`] does.
pub fn check_drawing(drawing: &Drawing, configuration: &Configuration) -> Result<Refusals, Refusals> {
    let sketch = Sketch::new(drawing, configuration)?;
    let mut found = sketch.refusals.clone();
    let nothing = Application::default();
    let stand_ins = StandIns::new(&sketch.checked, configuration);
    let mut draft = Draft::new(&sketch.checked, &nothing, configuration);
    let given = draft.stand_in(&stand_ins);
    draft.rehearse(&given, sketch.refusals.is_empty());
    for refusal in draft.refusals {
        if !found.iter().any(|known| is_same(known, &refusal)) {
            found.push(refusal);
        }
    }
    Ok(found)
}

/// Returns true if two checks have found the same mistake. For example, a constant is checked once where it is named, and again where it
/// is stored.
fn is_same(one: &Refusal, other: &Refusal) -> bool {
    let is_constant = |refusal: &Refusal| refusal.message.starts_with("the constant for ");
    one.message == other.message || is_constant(one) && is_constant(other) && one.about == other.about
}

/// Returns the reason why a wire cannot connect two ports; `None` if it can. The direction does not matter.
///
/// # Errors
/// `UnknownName` if a port does not exist. `CallError` if the drawing contains neither a graph nor a verb, or both.
pub fn compatible(drawing: &Drawing, configuration: &Configuration, from: &PortName, to: &PortName) -> Result<Option<String>, Refusals> {
    let sketch = Sketch::new(drawing, configuration)?;
    let (from, to) = (sketch.end(from)?, sketch.end(to)?);
    let nothing = Application::default();
    Ok(sketch.why_not(&mut sketch.draft(&nothing, configuration), &from, &to))
}

/// Checks every port of the definition as [`compatible`] does.
///
/// # Errors
/// Fails as [`compatible`] does.
pub fn compatible_with(drawing: &Drawing, configuration: &Configuration, from: &PortName) -> Result<Vec<Verdict>, Refusals> {
    let sketch = Sketch::new(drawing, configuration)?;
    let from = sketch.end(from)?;
    let nothing = Application::default();
    // Infer sizes and units once rather than for each port.
    let mut draft = sketch.draft(&nothing, configuration);
    let judged = sketch.names.iter().filter(|name| **name != from.name).map(|name| {
        let to = sketch.end(name)?;
        Ok(Verdict { block: name.block.clone(), port: name.port.clone(), reason: sketch.why_not(&mut draft, &from, &to) })
    });
    judged.collect()
}

/// A definition, resolved to the extent possible.
struct Sketch {
    checked: CheckedVerb,
    refusals: Refusals,
    labels: HashMap<String, LabelTarget>,
    scopes: Vec<Scope>,
    is_graph: bool,
    /// Drawn ports: those of the definition's blocks, and those of the graph itself.
    names: Vec<PortName>,
}

/// A port, with the inner ports to which it is bound.
struct End {
    name: PortName,
    ports: Vec<Port>,
    /// Description of the port for messages: `output 'servo.effort' (double, N.m)`.
    described: String,
    writes: bool,
}

impl Sketch {
    fn new(drawing: &Drawing, configuration: &Configuration) -> Result<Sketch, Refusals> {
        match (&drawing.graph, &drawing.verb) {
            (Some(graph), None) => Ok(Sketch::of_graph(graph, configuration)),
            (None, Some(verb)) => Ok(Sketch::of_verb(verb, configuration)),
            _ => Err(vec![Refusal::new(Class::CallError, "a definition is either a graph or a verb").remedy("give either \"graph\" or \"verb\"")]),
        }
    }

    fn of_verb(verb: &Verb, configuration: &Configuration) -> Sketch {
        let mut flat = Flat::new(configuration);
        let checked = CheckedVerb::sketch(&mut flat, verb);
        Sketch::named(flat, checked, verb.blocks.keys(), false)
    }

    fn of_graph(graph: &Graph, configuration: &Configuration) -> Sketch {
        let mut flat = checked::flat_graph(graph, configuration);
        let place = graph.place.clone();
        let ports = flat.scopes.last().map(|own| own.ports.clone()).unwrap_or_default();
        // Seen from outside, each port of the graph will be bound to one data object.
        let sides = ports.into_iter().map(|(name, ports)| Group { name, origin: Origin::Parameter, ports, place: place.clone() });
        flat.groups.retain(|group| group.origin == Origin::Cell);
        flat.groups.extend(sides);
        let empty = Verb::default();
        let checked = CheckedVerb { place, ..CheckedVerb::sketch(&mut Flat::new(configuration), &empty) };
        let groups = std::mem::take(&mut flat.groups);
        let blocks = std::mem::take(&mut flat.blocks);
        let group_of = checked::group_of(&blocks, &groups);
        Sketch::named(flat, CheckedVerb { blocks, groups, group_of, ..checked }, graph.blocks.keys(), true)
    }

    fn named<'l>(flat: Flat<'_>, checked: CheckedVerb, labels: impl Iterator<Item = &'l String>, is_graph: bool) -> Sketch {
        let mut sketch = Sketch { checked, refusals: flat.refusals, labels: flat.labels, scopes: flat.scopes, is_graph, names: Vec::new() };
        for label in labels {
            let ports: Vec<String> = match sketch.labels.get(label) {
                Some(LabelTarget::Block(block)) => {
                    let items = &sketch.checked.blocks[*block].kind.interface.items;
                    items.iter().filter(|item| is_data(item.kind)).map(|item| item.name.clone()).collect()
                }
                Some(LabelTarget::Scope(scope)) => sketch.scopes[*scope].ports.keys().cloned().collect(),
                None => Vec::new(),
            };
            sketch.names.extend(ports.into_iter().map(|port| PortName { block: label.clone(), port }));
        }
        if let Some(own) = sketch.own() {
            let names: Vec<PortName> = own.ports.keys().map(|port| PortName { block: String::new(), port: port.clone() }).collect();
            sketch.names.extend(names);
        }
        sketch
    }

    /// Returns the scope of the graph itself.
    fn own(&self) -> Option<&Scope> {
        self.scopes.last().filter(|_| self.is_graph)
    }

    fn draft<'a>(&'a self, nothing: &'a Application, configuration: &'a Configuration) -> Draft<'a> {
        let mut draft = Draft::new(&self.checked, nothing, configuration);
        let given: Vec<GroupBinding<'_>> = self.checked.groups.iter().map(|_| GroupBinding::Private).collect();
        draft.known_sizes(&given);
        draft.infer_units(&given);
        draft
    }

    fn kind(&self, port: Port) -> Kind {
        self.checked.blocks[port.0].kind.item(port.1).kind
    }

    fn end(&self, name: &PortName) -> Result<End, Refusals> {
        if name.block.is_empty() {
            return self.own_end(name);
        }
        let Some(labelled) = self.labels.get(&name.block) else {
            let mut known: Vec<&str> = self.labels.keys().map(String::as_str).collect();
            known.sort_unstable();
            return Err(missing(format!("there is no block '{}'", name.block), did_you_mean(&name.block, known)));
        };
        let known = || self.names.iter().filter(|known| known.block == name.block).map(|known| known.port.as_str());
        let ports = match labelled {
            LabelTarget::Block(block) => self.checked.blocks[*block].kind.find(&name.port).map(|item| vec![(*block, item)]),
            LabelTarget::Scope(scope) => self.scopes[*scope].ports.get(&name.port).cloned(),
        };
        let Some(ports) = ports else {
            return Err(missing(format!("block '{}' has no port '{}'", name.block, name.port), did_you_mean(&name.port, known())));
        };
        let writes = ports.iter().any(|port| self.kind(*port) == Kind::Output);
        let described = match (labelled, ports.iter().find(|port| (self.kind(**port) == Kind::Output) == writes)) {
            (LabelTarget::Block(_), Some(port)) => crate::flatten::describe(&self.checked.blocks[port.0], port.1),
            _ => format!("{} '{}.{}' of a graph", if writes { "output" } else { "input" }, name.block, name.port),
        };
        Ok(End { name: name.clone(), ports, described, writes })
    }

    /// Returns a port of the graph itself as seen from inside, where an input of the graph is a writer.
    fn own_end(&self, name: &PortName) -> Result<End, Refusals> {
        let ports = self.own().map(|own| &own.ports);
        let Some(ports) = ports.and_then(|ports| ports.get(&name.port)) else {
            let known = self.own().into_iter().flat_map(|own| own.ports.keys().map(String::as_str));
            return Err(missing(format!("the definition has no port '{}'", name.port), did_you_mean(&name.port, known)));
        };
        let is_output = ports.iter().any(|port| self.kind(*port) == Kind::Output);
        let described = format!("the graph's own {} '{}'", if is_output { "output" } else { "input" }, name.port);
        Ok(End { name: name.clone(), ports: ports.clone(), described, writes: !is_output })
    }

    fn why_not(&self, draft: &mut Draft<'_>, one: &End, other: &End) -> Option<String> {
        let (from, to) = if one.writes { (one, other) } else { (other, one) };
        let refused = |why: &str| Some(format!("cannot bind {} to {}: {why}", from.described, to.described));
        if one.writes == other.writes {
            return refused(if one.writes { "both write" } else { "neither of them writes" });
        }
        if let Some(device) = [from, to].into_iter().find(|end| end.ports.iter().any(|port| !matches!(self.kind(*port), Kind::Input | Kind::Output))) {
            return refused(&format!("a wire cannot lead to {}; a device item takes a channel", device.described));
        }
        let (source, sink) = (self.object(from), self.object(to));
        if source.is_some() && source == sink {
            return None;
        }
        if let (Some(source), Some(sink)) = (source, sink) {
            let (source, sink) = (&self.checked.groups[source].name, &self.checked.groups[sink].name);
            return Some(format!("{} is covered by '{sink}', but {} by '{source}'; a port has only one binding", to.described, from.described));
        }
        self.refused_wire(draft, from, to, source, sink)
    }

    /// Returns the named data object that contains a port: a cell, a parameter, or a port of the graph.
    fn object(&self, end: &End) -> Option<usize> {
        if end.name.block.is_empty() {
            return self.checked.groups.iter().position(|group| group.origin == Origin::Parameter && group.name == end.name.port);
        }
        let groups = end.ports.iter().filter_map(|port| self.checked.group(*port));
        let mut named = groups.filter(|group| {
            let group = &self.checked.groups[*group];
            matches!(group.origin, Origin::Parameter | Origin::Cell) || group.origin == Origin::InputOnly && group.ports.len() > 1
        });
        named.next()
    }

    /// Returns the reason why the installation would refuse the wire, assuming that it refuses nothing without the wire.
    fn refused_wire(&self, draft: &mut Draft<'_>, from: &End, to: &End, source: Option<usize>, sink: Option<usize>) -> Option<String> {
        let object = |at: Option<usize>, end: &End| match at {
            Some(at) => self.checked.groups[at].clone(),
            None => Group { name: end.name.port.clone(), origin: Origin::Cell, ports: end.ports.clone(), place: None },
        };
        let (before, joining) = (object(source, from), object(sink, to));
        let mut together = if source.is_none() && sink.is_some() { joining.clone() } else { before.clone() };
        for port in before.ports.iter().chain(&joining.ports) {
            if !together.ports.contains(port) {
                together.ports.push(*port);
            }
        }
        if let Some(second) = self.second_writer(&together).filter(|_| self.is_graph) {
            return Some(second);
        }
        draft.refusals.clear();
        draft.check_object(&before);
        draft.check_object(&joining);
        let known = std::mem::take(&mut draft.refusals);
        draft.check_object(&together);
        let new = std::mem::take(&mut draft.refusals).into_iter().find(|refusal| !known.iter().any(|known| known.message == refusal.message));
        new.or_else(|| self.cycle(&together, source, sink)).map(|refusal| with_remedy(&refusal))
    }

    fn second_writer(&self, together: &Group) -> Option<String> {
        let mut writers = together.ports.iter().filter(|port| self.kind(**port) == Kind::Output);
        let (first, second) = (writers.next()?, writers.next()?);
        let described = |port: &Port| crate::flatten::describe(&self.checked.blocks[port.0], port.1);
        Some(format!("'{}' has two writers: {} and {}; give each its own cell", together.name, described(first), described(second)))
    }

    /// Returns the cycle of synchronous ports that the wire would close.
    fn cycle(&self, together: &Group, source: Option<usize>, sink: Option<usize>) -> Option<Refusal> {
        let cycle = |groups: &[Group]| {
            let group_of = checked::group_of(&self.checked.blocks, groups);
            crate::cycles::synchronous_cycle(&self.checked.blocks, groups, &group_of, &None)
        };
        if cycle(&self.checked.groups).is_some() {
            return None;
        }
        let kept = self.checked.groups.iter().enumerate().filter(|(at, _)| Some(*at) != source && Some(*at) != sink).map(|(_, group)| group.clone());
        let groups: Vec<Group> = kept.chain([together.clone()]).collect();
        cycle(&groups)
    }
}

fn missing(message: String, remedy: String) -> Refusals {
    vec![Refusal::new(Class::UnknownName, message).remedy(remedy)]
}

fn with_remedy(refusal: &Refusal) -> String {
    if refusal.remedy.is_empty() { refusal.message.clone() } else { format!("{}; {}", refusal.message, refusal.remedy) }
}
