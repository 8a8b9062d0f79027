// SPDX-License-Identifier: Apache-2.0
//! Interfaces with parsed types, prepared for checking.
use crate::interface::{Interface, Item, Kind};
use crate::quantity::check_unit;
use crate::refusal::{Class, Refusal};
use crate::types::Type;
use std::collections::HashMap;
use std::sync::Arc;

/// A type with its layout.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    pub read: Type,
    /// Normalised text of the type.
    pub text: String,
    pub size: usize,
    pub align: usize,
}

impl Layout {
    pub fn new(read: Type) -> Arc<Layout> {
        Arc::new(Layout { text: read.normalised(), size: read.size(), align: read.align(), read })
    }
}

/// Shape of an item's type before the size of its block is known.
#[derive(Clone, Debug)]
pub enum Shape {
    /// A condition without a value.
    Nothing,
    Fixed(Arc<Layout>),
    /// An array of n elements of this type, where n is the size of the block.
    Sized(Arc<Layout>),
}

/// A block's interface with its types and names resolved.
#[derive(Clone, Debug)]
pub struct BlockKind {
    pub interface: Interface,
    pub shapes: Vec<Shape>,
    by_name: HashMap<String, usize>,
    /// Elements of array ports that a definition uses, such as `u[1]`: (port, element). Their item indices follow those of the
    /// descriptor's items.
    elements: Vec<(usize, usize)>,
    /// Item that sets the number of elements.
    pub size_item: Option<usize>,
}

impl BlockKind {
    /// Parses the types of an interface.
    ///
    /// # Errors
    /// Returns a refusal for every type and every unit that cannot be parsed.
    pub fn new(interface: &Interface) -> Result<BlockKind, Vec<Refusal>> {
        let mut refusals = Vec::new();
        for item in &interface.items {
            let unknown = item.unit_of.iter().find(|name| !interface.items.iter().any(|other| other.name == **name));
            let wrong = match unknown {
                Some(name) => Some(Refusal::new(Class::UnknownName, format!("its unit is that of '{name}', which does not exist"))),
                None => check_unit(&item.unit).err(),
            };
            refusals.extend(wrong.map(|refusal| refusal.for_what(&format!("item '{}' of block '{}'", item.name, interface.name))));
        }
        let shapes = interface.items.iter().map(|item| {
            shape(interface, item).unwrap_or_else(|refusal| {
                refusals.push(refusal.for_what(&format!("item '{}' of block '{}'", item.name, interface.name)));
                Shape::Nothing
            })
        });
        let shapes = shapes.collect();
        if !refusals.is_empty() {
            return Err(refusals);
        }
        Ok(BlockKind {
            shapes,
            by_name: interface.items.iter().enumerate().map(|(at, item)| (item.name.clone(), at)).collect(),
            elements: Vec::new(),
            size_item: interface.items.iter().position(|item| item.kind == Kind::Size),
            interface: interface.clone(),
        })
    }

    pub fn item(&self, at: usize) -> &Item {
        &self.interface.items[at]
    }

    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    /// Returns the item for an element of an array port, creating it on first use.
    pub fn element(&mut self, port: usize, element: usize) -> usize {
        if let Some(known) = self.elements.iter().position(|known| *known == (port, element)) {
            return self.interface.items.len() - self.elements.len() + known;
        }
        let (of, shape) = match &self.shapes[port] {
            Shape::Sized(of) => (of.text.clone(), Shape::Fixed(Arc::clone(of))),
            Shape::Fixed(layout) => match &layout.read {
                Type::Array(of, _) => (of.normalised(), Shape::Fixed(Layout::new((**of).clone()))),
                _ => (layout.text.clone(), self.shapes[port].clone()),
            },
            Shape::Nothing => (String::new(), Shape::Nothing),
        };
        let whole = &self.interface.items[port];
        let item = Item { name: format!("{}[{element}]", whole.name), type_text: of, sized: false, has_default: false, default: Vec::new(), ..whole.clone() };
        self.by_name.insert(item.name.clone(), self.interface.items.len());
        self.interface.items.push(item);
        self.shapes.push(shape);
        self.elements.push((port, element));
        self.interface.items.len() - 1
    }

    /// Returns the corresponding item of the descriptor: this item itself, or the array port of which it is an element.
    pub fn whole(&self, item: usize) -> usize {
        self.element_of(item).map_or(item, |(port, _)| port)
    }

    /// Returns the port and element that an item denotes; `None` if it is an item of the descriptor.
    pub fn element_of(&self, item: usize) -> Option<(usize, usize)> {
        let own = self.interface.items.len() - self.elements.len();
        item.checked_sub(own).map(|at| self.elements[at])
    }

    /// Returns the elements of a port that the definition uses, with their items, in order.
    pub fn elements_of(&self, port: usize) -> Vec<(usize, usize)> {
        let own = self.interface.items.len() - self.elements.len();
        let named = self.elements.iter().enumerate().filter(|(_, (of, _))| *of == port);
        let mut found: Vec<(usize, usize)> = named.map(|(at, (_, element))| (*element, own + at)).collect();
        found.sort_unstable();
        found
    }

    /// Returns the maximum number of elements of an array port; `None` for any other item.
    pub fn elements_max(&self, port: usize) -> Option<usize> {
        let is_port = matches!(self.item(port).kind, Kind::Input | Kind::Output) && self.item(port).history == 0;
        match &self.shapes[port] {
            _ if !is_port => None,
            Shape::Sized(_) => Some(self.size_item.map_or(usize::MAX, |size| self.item(size).most as usize)),
            Shape::Fixed(layout) => match &layout.read {
                Type::Array(_, count) => Some(*count),
                _ => None,
            },
            Shape::Nothing => None,
        }
    }

    /// Returns the type of an item in a block of `size` elements; `None` if it has no value or its size is not known.
    pub fn layout(&self, item: usize, size: Option<u32>) -> Option<Arc<Layout>> {
        match &self.shapes[item] {
            Shape::Nothing => None,
            Shape::Fixed(layout) => Some(Arc::clone(layout)),
            Shape::Sized(element) => Some(Layout::new(Type::Array(Box::new(element.read.clone()), size? as usize))),
        }
    }
}

fn shape(interface: &Interface, item: &Item) -> Result<Shape, Refusal> {
    if item.kind == Kind::Size {
        return Ok(Shape::Fixed(Layout::new(Type::Scalar(crate::types::Scalar::Uint32))));
    }
    if item.type_text.is_empty() {
        return Ok(Shape::Nothing);
    }
    if !item.sized {
        return Ok(Shape::Fixed(Layout::new(Type::parse(&item.type_text, &interface.types)?)));
    }
    match Type::parse_sized(&item.type_text, &interface.types, Some(1))? {
        Type::Array(element, _) => Ok(Shape::Sized(Layout::new(*element))),
        other => Ok(Shape::Sized(Layout::new(other))),
    }
}

/// Returns true if an item is a data node: a port or device that χ or ρ binds.
pub fn is_data(kind: Kind) -> bool {
    matches!(kind, Kind::Input | Kind::Output | Kind::DeviceRead | Kind::DeviceWrite)
}

/// Returns the name of an item kind for messages.
pub fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Input => "input",
        Kind::Output => "output",
        Kind::DeviceRead | Kind::DeviceWrite => "device",
        Kind::Condition => "condition",
        Kind::Parameter => "parameter",
        Kind::State => "state",
        Kind::Size => "size",
    }
}
