// SPDX-License-Identifier: Apache-2.0
//! Infers the number of elements of variable-size blocks from their bindings.
use super::{Draft, GroupBinding};
use crate::flatten::Port;
use crate::kind::Shape;
use crate::refusal::Class;
use crate::types::Type;
use crate::value::Value;
use std::sync::Arc;

impl Draft<'_> {
    /// Infers the size of every variable-size block.
    pub fn infer_sizes(&mut self, given: &[GroupBinding<'_>]) {
        for block in self.known_sizes(given) {
            self.check_size(block);
        }
    }

    /// Infers the sizes that can be determined, and returns the blocks whose size is known.
    pub fn known_sizes(&mut self, given: &[GroupBinding<'_>]) -> Vec<usize> {
        self.sizes = vec![None; self.checked.blocks.len()];
        let checked = self.checked;
        let sized: Vec<usize> = (0..checked.blocks.len()).filter(|b| checked.blocks[*b].kind.size_item.is_some()).collect();
        for &block in &sized {
            self.size_of_constant(block);
        }
        // Each round either fixes a block or is the last; a block that is fixed affects only its neighbours.
        let mut work = sized.clone();
        while let Some(block) = work.pop() {
            if self.sizes[block].is_none() {
                self.sizes[block] = self.size_from_bindings(block, given);
            }
            if self.sizes[block].is_some() {
                work.extend(self.unsized_neighbours(block));
            }
        }
        sized
    }

    fn size_of_constant(&mut self, block: usize) {
        let flat = self.flat(block);
        let constant = flat.constants.iter().find(|(item, _)| Some(*item) == flat.kind.size_item);
        match constant {
            Some((_, Value::Integer(size))) if u32::try_from(*size).is_ok() => self.sizes[block] = u32::try_from(*size).ok(),
            Some(_) => self.refuse(Class::ValueRefused, format!("the size of '{}' is not a whole number", flat.label), "give, for example, n=6", &flat.place),
            // A list for an array parameter determines the number of elements.
            None => {
                let list = flat.constants.iter().find_map(|(item, value)| match (&flat.kind.shapes[*item], value) {
                    (Shape::Sized(_), Value::List(values)) => u32::try_from(values.len()).ok(),
                    _ => None,
                });
                self.sizes[block] = list;
            }
        }
    }

    fn size_from_bindings(&self, block: usize, given: &[GroupBinding<'_>]) -> Option<u32> {
        let kind = Arc::clone(&self.flat(block).kind);
        kind.shapes.iter().enumerate().find_map(|(item, shape)| {
            let Shape::Sized(element) = shape else { return None };
            if let Some((last, _)) = kind.elements_of(item).last() {
                return u32::try_from(last + 1).ok();
            }
            let group = self.checked.group((block, item))?;
            let count = match &given[group] {
                GroupBinding::Svvs(svvs) if svvs.len() > 1 => Some(svvs.len()),
                GroupBinding::Svvs(svvs) => {
                    let svv = svvs.first()?.1;
                    let read = Type::parse(&svv.type_text, &svv.types).ok()?;
                    if read == element.read { Some(1) } else { elements(&read, &element.read) }
                }
                GroupBinding::Channel { channel, physical, .. } => {
                    let read = Type::parse(&physical.channels[*channel].type_text, &Default::default()).ok()?;
                    elements(&read, &element.read)
                }
                GroupBinding::Private => self.checked.groups[group].ports.iter().find_map(|port| self.known_count(*port, &element.read)),
            };
            u32::try_from(count?).ok()
        })
    }

    fn known_count(&self, port: Port, element: &Type) -> Option<usize> {
        match &self.flat(port.0).kind.shapes[port.1] {
            Shape::Sized(_) => self.sizes[port.0].map(|size| size as usize),
            Shape::Fixed(layout) => elements(&layout.read, element),
            Shape::Nothing => None,
        }
    }

    fn unsized_neighbours(&self, block: usize) -> Vec<usize> {
        let kind = &self.flat(block).kind;
        let items = (0..kind.shapes.len()).filter(|item| matches!(kind.shapes[*item], Shape::Sized(_)));
        let groups = items.filter_map(|item| self.checked.group((block, item)));
        let ports = groups.flat_map(|group| self.checked.groups[group].ports.iter());
        let unsized_block = |b: &usize| self.sizes[*b].is_none() && self.flat(*b).kind.size_item.is_some();
        ports.map(|port| port.0).filter(unsized_block).collect()
    }

    fn check_size(&mut self, block: usize) {
        let flat = self.flat(block);
        let Some(size_item) = flat.kind.size_item else { return };
        let item = flat.kind.item(size_item);
        match self.sizes[block] {
            None => {
                let message = format!("the size '{}' of '{}' ({}) is not known", item.name, flat.label, flat.kind.interface.name);
                let remedy = format!("bind an array or a list to it, or give {}= as a constant", item.name);
                self.refuse(Class::TypeMismatch, message, &remedy, &flat.place);
                self.sizes[block] = Some(item.least.max(1));
            }
            Some(size) if size < item.least || size > item.most => {
                let message =
                    format!("the size '{}' of '{}' is {size}, but {} takes {} to {}", item.name, flat.label, flat.kind.interface.name, item.least, item.most);
                self.refuse(Class::ValueRefused, message, "choose a number of elements within that range", &flat.place);
            }
            Some(_) => {}
        }
    }
}

fn elements(array: &Type, element: &Type) -> Option<usize> {
    match array {
        Type::Array(inner, count) if **inner == *element => Some(*count),
        _ => None,
    }
}
