// SPDX-License-Identifier: Apache-2.0
//! Names of ports, and the covers ρ and χ, in which every data node has exactly one binding.
use crate::flatten::{Flat, Group, ItemTarget, LabelTarget, Origin, Port};
use crate::interface::{Kind, Mode};
use crate::kind::is_data;
use crate::plan::Remark;
use crate::refusal::{Class, Refusal, SourceLocation};
use hints::did_you_mean;
use indexmap::IndexMap;

/// Maximum number of refusals per definition for which suggestions ("did you mean") are computed.
const SUGGESTED_MAX: usize = 200;

impl<'a> Flat<'a> {
    /// Returns the target that `prefix` + `name` denotes; adds a refusal if the name is unknown.
    pub fn resolve(&mut self, prefix: &str, name: &str, place: &Option<SourceLocation>) -> Option<ItemTarget> {
        let full = format!("{prefix}{name}");
        let (label, item) = match full.rsplit_once('.') {
            Some((label, item)) if label.len() >= prefix.len() => (label, item),
            _ => {
                self.refuse(Class::UnknownName, format!("'{full}' does not name a port"), place, "write label.port");
                return None;
            }
        };
        let Some(labelled) = self.labels.get(label).copied() else {
            let remedy = self.did_you_mean_label(prefix, label);
            self.refuse(Class::UnknownName, format!("'{full}' names the block '{label}', which does not exist"), place, &remedy);
            return None;
        };
        let found = match labelled {
            LabelTarget::Block(block) => self.blocks[block].kind.find(item).map(|item| (block, item)),
            LabelTarget::Scope(scope) if self.scopes[scope].ports.contains_key(item) => {
                return Some(ItemTarget::Ports(self.scopes[scope].ports[item].clone()));
            }
            LabelTarget::Scope(_) => None,
        };
        let before = self.refusals.len();
        if found.is_none() {
            let element = self.element(labelled, item, place);
            if element.is_some() || self.refusals.len() > before {
                return element;
            }
            let (of, remedy) = match labelled {
                LabelTarget::Block(block) => {
                    let interface = &self.blocks[block].kind.interface;
                    (interface.name.clone(), did_you_mean(item, interface.items.iter().map(|i| i.name.as_str())))
                }
                LabelTarget::Scope(scope) => {
                    let scope = &self.scopes[scope];
                    (format!("graph {}", scope.name), did_you_mean(item, scope.ports.keys().map(String::as_str)))
                }
            };
            self.refuse(Class::UnknownName, format!("'{label}' ({of}) has no '{item}'"), place, &remedy);
        }
        found.map(ItemTarget::Item)
    }

    /// Returns the label that was probably intended. Only the first mistakes are given a suggestion, because each search scans all
    /// labels.
    fn did_you_mean_label(&self, prefix: &str, label: &str) -> String {
        if self.refusals.len() >= SUGGESTED_MAX {
            return String::new();
        }
        let mut near: Vec<&str> = self.labels.keys().filter_map(|known| known.strip_prefix(prefix)).collect();
        near.sort_unstable();
        did_you_mean(&label[prefix.len()..], near)
    }

    /// Resolves `names` to data nodes and marks them as covered by `by`.
    pub fn cover(&mut self, prefix: &str, by: &str, names: &[String], place: &Option<SourceLocation>) -> Vec<Port> {
        let mut ports: Vec<Port> = Vec::with_capacity(names.len());
        for name in names {
            let inner = match self.resolve(prefix, name, place) {
                Some(ItemTarget::Ports(inner)) => {
                    let own = format!("{prefix}{name}");
                    for port in &inner {
                        if self.covered.get(port).is_some_and(|by| *by == own) {
                            self.covered.remove(port);
                        }
                    }
                    inner
                }
                Some(ItemTarget::Item(port)) if is_data(self.item_kind(port)) => vec![port],
                Some(ItemTarget::Item(port)) => {
                    let message = format!("'{by}' covers {}, which is not a port or device", self.described(port));
                    self.refuse_ports(Class::CoverError, message, place, "reach parameters and conditions by input parameters", &[port]);
                    continue;
                }
                None => continue,
            };
            for port in inner {
                match self.covered.insert(port, by.to_owned()) {
                    Some(other) => {
                        let message = format!("{} is covered by '{other}' and by '{by}'", self.described(port));
                        let is_array = self.blocks[port.0].kind.elements_max(port.1).is_some();
                        let name = self.port_name(port);
                        let remedy = if is_array { format!("name its elements: '{name}[0]', '{name}[1]'") } else { "leave one of them out".to_owned() };
                        self.refuse_ports(Class::CoverError, message, place, &format!("a port has one binding; {remedy}"), &[port]);
                    }
                    None => ports.push(port),
                }
            }
        }
        ports
    }

    /// Relaxes modes as declared by `modes=` in a graph or verb.
    pub fn relax(&mut self, prefix: &str, modes: &IndexMap<String, Mode>, scope: Option<usize>, place: &Option<SourceLocation>) {
        for (name, mode) in modes {
            let own = scope.and_then(|scope| self.scopes[scope].ports.get(name).cloned());
            let ports = match own {
                Some(ports) => ports,
                None => match self.resolve(prefix, name, place) {
                    Some(ItemTarget::Ports(ports)) => ports,
                    Some(ItemTarget::Item(port)) => vec![port],
                    None => continue,
                },
            };
            for port in ports {
                self.subject = Some(self.part(port));
                self.relax_port(port, *mode, place);
            }
            self.subject = None;
        }
    }

    fn relax_port(&mut self, port: Port, mode: Mode, place: &Option<SourceLocation>) {
        let described = self.described(port);
        if !matches!(self.item_kind(port), Kind::Input | Kind::Output) {
            self.refuse(Class::SchedulingError, format!("modes= gives a mode to {described}, which is not a port"), place, "");
            return;
        }
        let port = (port.0, self.blocks[port.0].kind.whole(port.1));
        let declared = self.blocks[port.0].mode(port.1);
        let relaxes = declared == mode || matches!((declared, mode), (Mode::Synchronous, _) | (Mode::Ratio(_), Mode::Asynchronous));
        if mode == Mode::Ratio(0) {
            self.refuse(Class::SchedulingError, format!("the ratio of {described} is 0"), place, "give 1 or more");
        } else if relaxes {
            self.blocks[port.0].modes.retain(|(item, _)| *item != port.1);
            self.blocks[port.0].modes.push((port.1, mode));
        } else {
            let message = format!("{described} is {}, but modes= would make it {}", declared.name(), mode.name());
            self.refuse(Class::SchedulingError, message, place, "use modes= only to relax a declared mode, never to tighten it");
        }
    }

    /// Completes the cover: an unnamed output is assigned a cell; an input is assigned a constant, or a cell written by input parameters.
    pub fn fill(&mut self, inputs: &[Port], in_graph: bool, place: &Option<SourceLocation>) -> Vec<Remark> {
        let mut remarks = Vec::new();
        let mut bound: Vec<Vec<bool>> = self.blocks.iter().map(|b| vec![false; b.kind.interface.items.len()]).collect();
        for group in &self.groups {
            group.ports.iter().for_each(|port| bound[port.0][port.1] = true);
        }
        for (block, bound) in self.blocks.iter().zip(&mut bound) {
            let elements = (0..block.kind.interface.items.len()).filter_map(|item| block.kind.element_of(item));
            elements.for_each(|(port, _)| bound[port] = true);
        }
        let mut given: Vec<Port> = inputs.to_vec();
        given.sort_unstable();
        // Outer graphs are closed after inner ones, because their ports combine more nodes.
        for scope in (0..self.scopes.len()).rev() {
            for (name, ports) in self.scopes[scope].ports.clone() {
                let free: Vec<Port> = ports.into_iter().filter(|port| !bound[port.0][port.1]).collect();
                if free.len() > 1 || free.iter().any(|port| self.item_kind(*port) == Kind::Output) {
                    free.iter().for_each(|port| bound[port.0][port.1] = true);
                    let full = format!("{}.{name}", self.scopes[scope].label).trim_start_matches('.').to_owned();
                    self.fill_one(full, free, &given, in_graph, place, &mut remarks);
                }
            }
        }
        for (block, bound) in bound.iter().enumerate() {
            for (item, _) in bound.iter().enumerate().filter(|(_, bound)| !**bound) {
                if is_data(self.item_kind((block, item))) {
                    self.fill_one(self.port_name((block, item)), vec![(block, item)], &given, in_graph, place, &mut remarks);
                }
            }
        }
        remarks
    }

    fn fill_one(&mut self, name: String, ports: Vec<Port>, given: &[Port], in_graph: bool, place: &Option<SourceLocation>, remarks: &mut Vec<Remark>) {
        let is_given = ports.iter().any(|port| given.binary_search(port).is_ok());
        let first = ports[0];
        let output = ports.iter().copied().find(|port| self.item_kind(*port) == Kind::Output);
        let (origin, text) = match (output, self.item_kind(first)) {
            (Some(_), _) => (Origin::Filled, format!("output '{name}' gets its own cell")),
            (_, Kind::DeviceRead | Kind::DeviceWrite) if in_graph => return,
            (_, Kind::DeviceRead | Kind::DeviceWrite) => {
                let message = format!("{} has no channel", self.described(first));
                let remedy = "name it in an instantiation parameter";
                let refusal = Refusal::new(Class::CoverError, message).remedy(remedy).about([self.part(first)]);
                self.push(refusal.end(self.described(first), &self.blocks[first.0].place).at(place));
                return;
            }
            _ if is_given => (Origin::InputOnly, format!("input '{name}' gets a cell that only input parameters write")),
            _ if ports.iter().all(|port| self.has_value(*port)) => (Origin::Constant, format!("input '{name}' gets its default")),
            _ => {
                let bare = *ports.iter().find(|port| !self.has_value(**port)).unwrap_or(&first);
                let described = self.described(bare);
                let whose = if in_graph { "a cell or an input of the graph" } else { "an instantiation parameter, a cell or an input parameter" };
                let refusal = Refusal::new(Class::CoverError, format!("{described} has no binding, default or input parameter"));
                let refusal = refusal.remedy(format!("name it in {whose}, or give it a constant"));
                let refusal = refusal.about([self.part(bare)]);
                self.push(refusal.end(described, &self.blocks[first.0].place).at(place));
                return;
            }
        };
        let place = self.blocks[first.0].place.clone();
        remarks.push(Remark { text, place: place.clone() });
        self.groups.push(Group { name, origin, ports, place });
    }
}
