// SPDX-License-Identifier: Apache-2.0
//! Form of a parameter: the kind of value to which it is bound or set. Two parts that share a parameter name must agree on its form.
use super::part::PartOf;
use crate::flatten::Port;
use crate::interface::Kind;
use crate::kind::Shape;
use crate::quantity::units_agree;
use crate::types::Type;

/// Kind, type and unit of a parameter, taken from its first port.
pub(super) struct Form {
    /// Kind of value that is passed for the parameter.
    pub what: &'static str,
    element: String,
    /// Number of elements; `None` if it depends on the size of the block.
    count: Option<usize>,
    unit: String,
    /// Description of the parameter for messages: `input 'approach.plan.speed' (double, rad/s)`.
    pub described: String,
}

/// Reason why two forms differ.
pub(super) enum Differ {
    Kinds,
    Types,
    Units,
}

/// Returns the common form of a set of ports.
pub(super) fn form(part: &PartOf<'_>, ports: &[Port], unit: &str) -> Option<Form> {
    let &(block, item) = ports.first()?;
    let kind = &part.checked.blocks[block].kind;
    let (element, count) = match &kind.shapes[item] {
        Shape::Nothing => return None,
        Shape::Sized(element) => (element.text.clone(), None),
        Shape::Fixed(layout) => match &layout.read {
            Type::Array(element, count) => (element.normalised(), Some(*count)),
            _ => (layout.text.clone(), Some(1)),
        },
    };
    let what = match kind.item(item).kind {
        Kind::DeviceRead => "a channel that is read",
        Kind::DeviceWrite => "a channel that is written",
        _ => "a value",
    };
    let unit_of = |port: &Port| part.checked.blocks[port.0].kind.item(port.1).unit.as_str();
    let unit = std::iter::once(unit).chain(ports.iter().map(unit_of)).find(|unit| !unit.is_empty()).unwrap_or("").to_owned();
    Some(Form { what, element, count, unit, described: part.item((block, item)) })
}

impl Form {
    /// Returns the reason why `other` cannot be the same parameter; `None` if it can.
    pub fn differs(&self, other: &Form) -> Option<Differ> {
        let counts_differ = matches!((self.count, other.count), (Some(a), Some(b)) if a != b);
        if self.what != other.what {
            Some(Differ::Kinds)
        } else if self.element != other.element || counts_differ {
            Some(Differ::Types)
        } else if !units_agree(&self.unit, &other.unit) {
            Some(Differ::Units)
        } else {
            None
        }
    }
}
