// SPDX-License-Identifier: Apache-2.0
//! Ranges of input parameters and requirements of a verb, for the devices to which it is applied.
use super::Draft;
use crate::definition::Bound;
use crate::parameters::CheckedInput;
use crate::plan::{PlannedBound, PlannedMember, PlannedRange, PlannedRequirement};
use crate::quantity::units_agree;
use crate::range::Range;

impl Draft<'_> {
    /// Returns the range of an input parameter.
    pub fn range(&self, input: &CheckedInput) -> Option<PlannedRange> {
        let (least, most) = input.within.as_ref()?;
        let counted_from = input.counted_from.as_ref().map(|name| self.svvs_of(name)).unwrap_or_default();
        Some(PlannedRange { least: self.bound(least), most: self.bound(most), counted_from })
    }

    /// Returns the distinct ranges of the items in which an input parameter is stored.
    pub fn item_ranges(&self, input: &CheckedInput) -> Vec<Range> {
        let mut ranges = Vec::new();
        for &(block, item) in &input.ports {
            if let Some(range) = self.checked.blocks[block].kind.item(item).range.filter(|range| !ranges.contains(range)) {
                ranges.push(range);
            }
        }
        ranges
    }

    /// Resolves a unit with alternatives, `rad/s|m/s`, for the devices of the verb: `rad/s` if all of them are revolute joints.
    pub fn chosen_unit(&self, unit: String) -> String {
        if !unit.contains('|') {
            return unit;
        }
        let mut of_members: Vec<String> = Vec::new();
        for device in self.objects.iter().flatten().filter_map(|name| self.configuration.logical_devices.get(*name)) {
            let Some(of) = self.configuration.device_types.get(&device.device_type) else { continue };
            let declared = of.svvs.values().map(|svv| &svv.unit).chain(of.parameters.values().map(|parameter| &parameter.unit));
            of_members.extend(declared.filter(|unit| !unit.is_empty()).map(|unit| device.unit(unit)));
        }
        let is_used = |choice: &&str| of_members.iter().any(|unit| units_agree(choice, unit));
        let used: Vec<&str> = unit.split('|').filter(is_used).collect();
        if used.is_empty() { unit } else { used.join("|") }
    }

    fn bound(&self, bound: &Bound) -> PlannedBound {
        match bound {
            Bound::Number(number) => PlannedBound::Number(*number),
            Bound::Member(text) => {
                let (sign, name) = text.strip_prefix('-').map_or((1.0, text.as_str()), |name| (-1.0, name));
                let (object, parameter) = name.split_once('.').unwrap_or(("", name));
                PlannedBound::Parameter { sign, devices: self.devices_of(object), parameter: parameter.to_owned() }
            }
        }
    }

    /// Returns the requirements of each device.
    pub fn requirements(&self) -> Vec<PlannedRequirement> {
        let mut planned = Vec::new();
        for (name, requirement) in &self.checked.requires {
            let Some((object, member)) = name.split_once('.') else { continue };
            for device in self.devices_of(object) {
                let when = requirement.when.as_ref().and_then(|when| when.split_once('.')).and_then(|(_, member)| self.member(&device, member));
                if let Some(member) = self.member(&device, member) {
                    let (raises, remedy) = (requirement.raises, requirement.remedy.clone());
                    planned.push(PlannedRequirement { device, member, when, raises, remedy });
                }
            }
        }
        planned
    }

    fn member(&self, device: &str, member: &str) -> Option<PlannedMember> {
        let found = self.configuration.logical_devices.get(device)?;
        Some(match found.svvs.get(member) {
            Some(svv) => PlannedMember::Svv(svv.clone()),
            None => PlannedMember::Parameter { device: device.to_owned(), parameter: member.to_owned() },
        })
    }

    fn devices_of(&self, object: &str) -> Vec<String> {
        let at = self.checked.objects.get_index_of(object);
        at.map(|at| self.objects[at].iter().map(|device| (*device).to_owned()).collect()).unwrap_or_default()
    }

    fn svvs_of(&self, name: &str) -> Vec<String> {
        let Some((object, member)) = name.split_once('.') else { return Vec::new() };
        let svv = |device: String| self.configuration.logical_devices.get(&device)?.svvs.get(member).cloned();
        self.devices_of(object).into_iter().filter_map(svv).collect()
    }
}
