// SPDX-License-Identifier: Apache-2.0
//! Units that pass through a block: an item whose unit is declared in terms of other items (`=u`, `=k.u`) is assigned its unit as soon as
//! theirs are known.
use super::{Draft, GroupBinding};
use crate::configuration::Channel;
use crate::flatten::Port;
use crate::interface::Kind;
use crate::quantity::{product, unit_of};
use crate::value::Value;

/// Unit of a dimensionless number.
const PURE: &str = "1";

impl<'a> Draft<'a> {
    /// Returns the declared or inferred unit of an item; empty if it is not known.
    pub fn unit(&self, (block, item): Port) -> &str {
        let inferred = self.units[block].iter().find(|(at, _)| *at == item);
        inferred.map_or(self.checked.blocks[block].kind.item(item).unit.as_str(), |(_, unit)| unit)
    }

    /// Infers the units of items that are declared in terms of other items' units.
    pub fn infer_units(&mut self, given: &[GroupBinding<'_>]) {
        let checked = self.checked;
        let items = |block: usize| checked.blocks[block].kind.interface.items.iter().enumerate();
        let mut work: Vec<Port> =
            (0..checked.blocks.len()).flat_map(|block| items(block).filter(|(_, item)| !item.unit_of.is_empty()).map(move |(at, _)| (block, at))).collect();
        // Start from the last: chains are mostly declared in the order in which values flow.
        work.reverse();
        while let Some(port) = work.pop() {
            if !self.unit(port).is_empty() {
                continue;
            }
            let Some(unit) = self.inferred(port, given) else { continue };
            self.units[port.0].push((port.1, unit));
            let Some(group) = checked.group(port) else { continue };
            for (block, _) in &checked.groups[group].ports {
                work.extend(items(*block).filter(|(_, item)| !item.unit_of.is_empty()).map(|(at, _)| (*block, at)));
            }
        }
    }

    fn inferred(&self, (block, item): Port, given: &[GroupBinding<'_>]) -> Option<String> {
        let kind = &self.checked.blocks[block].kind;
        let factors = kind.item(item).unit_of.iter().map(|name| self.factor((block, kind.find(name)?), given));
        let factors: Vec<String> = factors.collect::<Option<_>>()?;
        let mut known = factors.iter().filter(|unit| *unit != PURE);
        match (known.next(), known.next()) {
            (None, _) => Some(PURE.to_owned()),
            (Some(one), None) => Some(one.clone()),
            // A product cannot decide between the alternatives of `rad|m`.
            _ if factors.iter().any(|unit| unit.contains('|')) => None,
            _ => Some(product(factors.iter().map(String::as_str))),
        }
    }

    /// Returns the unit of an item to which another item refers; `None` if it is not known.
    fn factor(&self, port: Port, given: &[GroupBinding<'_>]) -> Option<String> {
        let own = Some(self.unit(port).to_owned()).filter(|unit| !unit.is_empty());
        own.or_else(|| match self.kind(port) {
            Kind::Parameter => self.parameter_unit(port).map(str::to_owned),
            _ => self.group_unit(port, given),
        })
    }

    /// Returns a channel's unit for the device that owns the verb: a prismatic joint may have a rotary drive. Empty if the direction of
    /// the channel does not match the port, which is refused separately.
    fn channel_unit(&self, port: Port, channel: &Channel) -> String {
        if channel.write != (self.kind(port) == Kind::DeviceWrite) {
            return String::new();
        }
        let owner = self.application.owner.as_ref().and_then(|owner| self.configuration.logical_devices.get(owner));
        owner.map_or_else(|| channel.unit.clone(), |device| device.unit(&channel.unit))
    }

    /// Returns the unit of the data object to which a port is bound.
    fn group_unit(&self, port: Port, given: &[GroupBinding<'_>]) -> Option<String> {
        let Some(group) = self.checked.group(port) else { return self.elements_unit(port, given) };
        let mut found: Vec<String> = match &given[group] {
            GroupBinding::Svvs(svvs) => svvs.iter().map(|(_, svv)| svv.unit.clone()).collect(),
            GroupBinding::Channel { channel, physical, .. } => vec![self.channel_unit(port, &physical.channels[*channel])],
            GroupBinding::Private => Vec::new(),
        };
        if found.iter().all(|unit| unit.is_empty()) {
            let ports = &self.checked.groups[group].ports;
            let known = ports.iter().filter(|other| **other != port).map(|other| self.unit(*other)).find(|unit| !unit.is_empty());
            found = known.map(str::to_owned).into_iter().collect();
        }
        let first = found.first().filter(|unit| !unit.is_empty())?;
        found.iter().all(|unit| unit == first).then(|| first.clone())
    }

    /// Returns the unit that all elements have in common, for an array port that is bound element by element.
    fn elements_unit(&self, (block, item): Port, given: &[GroupBinding<'_>]) -> Option<String> {
        let elements = self.checked.blocks[block].kind.elements_of(item);
        let mut units = elements.iter().map(|(_, element)| self.factor((block, *element), given));
        let first = units.next()??;
        units.all(|unit| unit.as_ref() == Some(&first)).then_some(first)
    }

    /// Returns the unit of a parameter's value: `k="2 N.m/rad"`. A number without a unit is dimensionless; the unit of an input
    /// parameter's value is not known yet.
    fn parameter_unit(&self, (block, item): Port) -> Option<&str> {
        if let Some(input) = self.checked.inputs.iter().find(|input| input.ports.contains(&(block, item))) {
            return Some(input.unit.as_str()).filter(|unit| !unit.is_empty());
        }
        let constant = self.checked.blocks[block].constants.iter().find(|(at, _)| *at == item);
        constant.map_or(Some(PURE), |(_, value)| value_unit(value))
    }
}

fn value_unit(value: &Value) -> Option<&str> {
    match value {
        Value::Text(text) => Some(unit_of(text).filter(|unit| *unit != "%").unwrap_or(PURE)),
        Value::List(values) => {
            let first = values.first().map_or(Some(PURE), value_unit)?;
            values.iter().all(|value| value_unit(value) == Some(first)).then_some(first)
        }
        _ => Some(PURE),
    }
}
