// SPDX-License-Identifier: Apache-2.0
//! Elements of array ports: `sum.u[1]` is bound like a port, and the array is gathered from, or scattered to, its elements.
use crate::flatten::{Flat, ItemTarget, LabelTarget, Port};
use crate::refusal::{Class, Refusal, SourceLocation};
use std::sync::Arc;

/// Splits `u[1]` into `u` and 1.
fn split(name: &str) -> Option<(&str, usize)> {
    let (port, index) = name.strip_suffix(']')?.split_once('[')?;
    let is_index = !index.is_empty() && index.bytes().all(|digit| digit.is_ascii_digit());
    Some((port, index.parse().ok().filter(|_| is_index)?))
}

impl Flat<'_> {
    /// Returns the array element that a name denotes in a block or graph; `None` if `item` is not the name of an element or the port does
    /// not exist.
    pub(crate) fn element(&mut self, labelled: LabelTarget, item: &str, place: &Option<SourceLocation>) -> Option<ItemTarget> {
        let (port, index) = split(item)?;
        let ports: Vec<Port> = match labelled {
            LabelTarget::Block(block) => vec![(block, self.blocks[block].kind.find(port)?)],
            LabelTarget::Scope(scope) => self.scopes[scope].ports.get(port)?.clone(),
        };
        let mut elements = Vec::with_capacity(ports.len());
        for (block, port) in ports {
            let kind = &self.blocks[block].kind;
            match kind.elements_max(port) {
                Some(count) if index < count => elements.push((block, Arc::make_mut(&mut self.blocks[block].kind).element(port, index))),
                Some(count) => {
                    let message = format!("{} has no element [{index}]", self.described((block, port)));
                    self.refuse_ports(Class::UnknownName, message, place, &format!("it has at most {count}, counted from 0"), &[(block, port)]);
                }
                None => {
                    let message = format!("{} has no elements", self.described((block, port)));
                    self.refuse_ports(Class::UnknownName, message, place, "write it without brackets", &[(block, port)]);
                }
            }
        }
        match labelled {
            LabelTarget::Block(_) => elements.first().map(|port| ItemTarget::Item(*port)),
            LabelTarget::Scope(_) => Some(ItemTarget::Ports(elements)),
        }
    }

    /// Refuses array ports that have both bound and unbound elements, or whose elements are bound in addition to the whole array.
    pub(crate) fn check_elements(&mut self, place: &Option<SourceLocation>) {
        for block in 0..self.blocks.len() {
            let kind = Arc::clone(&self.blocks[block].kind);
            for port in 0..kind.interface.items.len() {
                let named = kind.elements_of(port);
                let Some((last, item)) = named.last() else { continue };
                if let Some(group) = self.groups.iter().find(|group| group.ports.contains(&(block, port))) {
                    let message = format!("{} is covered as a whole by '{}', and its element [{last}] by another", self.described((block, port)), group.name);
                    self.refuse_ports(Class::CoverError, message, place, "name the whole port, or each of its elements", &[(block, port)]);
                }
                let is_sized = kind.item(port).sized;
                let count = if is_sized { last + 1 } else { kind.elements_max(port).unwrap_or(0) };
                if let Some(missing) = (0..count).find(|index| !named.iter().any(|(element, _)| element == index)) {
                    let described = self.described((block, port));
                    let bound: Vec<String> = named.iter().map(|(element, _)| format!("[{element}]")).collect();
                    let name = self.port_name((block, port));
                    let refusal = Refusal::new(Class::CoverError, format!("element [{missing}] of {described} is not bound, but {} are", bound.join(", ")));
                    let refusal = refusal.remedy(format!("name '{name}[{missing}]' in a cell or a parameter")).about([self.part((block, *item))]);
                    self.push(refusal.end(described, &self.blocks[block].place).at(place));
                }
            }
        }
    }
}
