// SPDX-License-Identifier: Apache-2.0
//! Unions of the blocks, objects, χ, cells, ψ, ω and relaxed modes of all parts.
use super::Composing;
use super::form::{Differ, form};
use super::part::{PartOf, is_within};
use crate::definition::{Bound, InputParameter, Requirement};
use crate::flatten::Port;
use crate::quantity::units_agree;
use crate::refusal::Class;
use std::collections::HashMap;

/// Kind of item that a name denotes in calls to a composed verb.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sort {
    Object,
    Argument,
    Input,
}

impl Sort {
    fn text(self) -> &'static str {
        match self {
            Sort::Object => "an object",
            Sort::Argument => "an instantiation parameter",
            Sort::Input => "an input parameter",
        }
    }
}

/// Names that have been united, with their properties and the part in which each occurred first.
#[derive(Default)]
struct SeenNames {
    sorts: HashMap<String, (Sort, usize)>,
    arguments: HashMap<String, usize>,
    inputs: HashMap<String, usize>,
    outputs: HashMap<String, usize>,
}

impl Composing<'_> {
    /// Unites everything except lists, conditions and τ.
    pub fn unite(&mut self) {
        let mut seen = SeenNames::default();
        for part in 0..self.parts.len() {
            self.unite_blocks(part);
            self.unite_objects(part, &mut seen);
            self.unite_arguments(part, &mut seen);
            self.unite_cells(part);
            self.unite_inputs(part, &mut seen);
            self.unite_outputs(part, &mut seen);
            self.unite_requirements(part);
        }
    }

    /// Unites the requirements: all requirements of a part must be met when the whole verb starts.
    fn unite_requirements(&mut self, part: usize) {
        let of = &self.parts[part];
        for (member, requirement) in &of.verb.requires {
            let when = requirement.when.as_ref().map(|when| of.parameter(when));
            self.verb.requires.entry(of.parameter(member)).or_insert_with(|| Requirement { when, ..requirement.clone() });
        }
    }

    fn unite_blocks(&mut self, part: usize) {
        let of = &self.parts[part];
        for (label, usage) in &of.verb.blocks {
            self.verb.blocks.entry(of.block(label)).or_insert_with(|| usage.clone());
        }
        for (port, mode) in &of.verb.modes {
            self.verb.modes.insert(of.port(port), *mode);
        }
    }

    /// Checks that a name denotes the same kind of item in all parts.
    fn check_sort(&mut self, part: usize, name: &str, sort: Sort, seen: &mut SeenNames) {
        let (known, first) = *seen.sorts.entry(name.to_owned()).or_insert((sort, part));
        if known != sort {
            let message =
                format!("'{name}' is {} in part '{}' but {} in part '{}'", known.text(), self.parts[first].label, sort.text(), self.parts[part].label);
            let remedy = self.rename_remedy(part, name);
            self.conflict(Class::CompositionConflict, message, &remedy, (first, part));
        }
    }

    /// Returns the remedy for a name that occurs in two parts and cannot be merged: `rename one: rename={'grasp.speed': 'grasp_speed'}`.
    pub fn rename_remedy(&self, part: usize, name: &str) -> String {
        let name = name.split('.').next().unwrap_or(name);
        let of = &self.parts[part];
        let own = of.renamed.iter().find(|(_, to)| **to == name).map_or(name, |(own, _)| *own);
        format!("rename one: rename={{'{}.{own}': '{}_{name}'}}", of.label, of.label)
    }

    fn unite_objects(&mut self, part: usize, seen: &mut SeenNames) {
        let verb = self.parts[part].verb;
        for (own, object) in &verb.objects {
            let name = self.parts[part].own(own).to_owned();
            self.check_sort(part, &name, Sort::Object, seen);
            let known = self.verb.objects.entry(name.clone()).or_insert_with(|| object.clone()).clone();
            if known != *object {
                let first = seen.sorts[&name].1;
                let text = |object: &crate::definition::Object| format!("{} '{}'", if object.each { "several of" } else { "one" }, object.device_type);
                let message = format!(
                    "the object '{name}' is {} in part '{}' but {} in part '{}'",
                    text(&known),
                    self.parts[first].label,
                    text(object),
                    self.parts[part].label
                );
                let remedy = self.rename_remedy(part, &name);
                self.conflict(Class::TypeMismatch, message, &remedy, (first, part));
            }
        }
    }

    fn unite_arguments(&mut self, part: usize, seen: &mut SeenNames) {
        let verb = self.parts[part].verb;
        for (own, nodes) in &verb.instantiation_parameters {
            let (root, of) = (own.split('.').next().unwrap_or(own), &self.parts[part]);
            let (name, root_name, ports) = (of.parameter(own), of.own(root).to_owned(), of.ports(nodes));
            if !verb.objects.contains_key(root) {
                self.check_sort(part, &root_name, Sort::Argument, seen);
            }
            let first = *seen.arguments.entry(name.clone()).or_insert(part);
            if first != part {
                let own_first = self.parts[first].verb.instantiation_parameters.keys().find(|known| self.parts[first].parameter(known) == name);
                let ports_of = |part: usize, name: &str| self.parts[part].group(name).map(|group| group.ports.clone()).unwrap_or_default();
                let sides = (ports_of(first, own_first.map_or("", String::as_str)), ports_of(part, own));
                self.check_forms(&name, (first, &sides.0, ""), (part, &sides.1, ""));
            }
            let all = self.verb.instantiation_parameters.entry(name).or_default();
            all.extend(ports.into_iter().filter(|port| !all.contains(port)).collect::<Vec<_>>());
        }
    }

    /// Checks that a united parameter has the same kind, type and unit in both parts.
    fn check_forms(&mut self, name: &str, (first, ports, unit): (usize, &[Port], &str), (second, others, other_unit): (usize, &[Port], &str)) {
        let (a, b) = (form(&self.parts[first], ports, unit), form(&self.parts[second], others, other_unit));
        let (Some(a), Some(b)) = (a, b) else { return };
        let Some(differ) = a.differs(&b) else { return };
        let (class, why) = match differ {
            Differ::Kinds => (Class::TypeMismatch, format!("one takes {}, the other {}", a.what, b.what)),
            Differ::Types => (Class::TypeMismatch, "types differ".to_owned()),
            Differ::Units => (Class::UnitMismatch, "units differ".to_owned()),
        };
        let message = format!("'{name}' of {} cannot be merged: it is {} and {}: {why}", self.both(first, second), a.described, b.described);
        let remedy = self.rename_remedy(second, name);
        self.conflict(class, message, &remedy, (first, second));
    }

    fn unite_cells(&mut self, part: usize) {
        let of = &self.parts[part];
        for (own, nodes) in &of.verb.cells {
            let (name, ports) = (of.cell(own), of.ports(nodes));
            let cell = self.verb.cells.entry(name.clone()).or_default();
            // Cells of the same name are merged only if a shared block is bound to them in both parts.
            let is_common =
                |port: &String| cell.contains(port) || of.shared.iter().any(|label| is_within(port, label) && cell.iter().any(|known| is_within(known, label)));
            if !cell.is_empty() && !ports.iter().any(is_common) {
                let message = format!(
                    "the cell '{name}' of part '{}' is bound to a shared block, but the cell of that name in other parts is bound to another",
                    of.label
                );
                self.refuse(Class::CompositionConflict, message, "give the two cells different names in their verbs", &None);
                return;
            }
            cell.extend(ports.into_iter().filter(|port| !cell.contains(port)).collect::<Vec<_>>());
        }
    }

    fn unite_inputs(&mut self, part: usize, seen: &mut SeenNames) {
        let verb = self.parts[part].verb;
        for (own, input) in &verb.input_parameters {
            let of = &self.parts[part];
            let within = input.within.as_ref().map(|(least, most)| (bound(of, least), bound(of, most)));
            let counted_from = input.counted_from.as_ref().map(|member| of.parameter(member));
            let mut input = InputParameter { targets: of.ports(&input.targets), within, counted_from, ..input.clone() };
            let value = of.preset.get(own.as_str());
            if input.preset || value.is_some() {
                input.default = value.map(|value| (*value).clone()).or(input.default);
                (input.preset, input.tunable) = (true, false);
                self.verb.input_parameters.insert(format!("{}.{own}", of.label), input);
                continue;
            }
            let (name, root) = (of.parameter(own), own.split('.').next().unwrap_or(own));
            if !verb.objects.contains_key(root) {
                self.check_sort(part, &name, Sort::Input, seen);
            }
            let first = *seen.inputs.entry(name.clone()).or_insert(part);
            match self.verb.input_parameters.get(&name).cloned() {
                Some(known) if first != part => self.unite_input((first, part), &name, known, input),
                _ => drop(self.verb.input_parameters.insert(name, input)),
            }
        }
    }

    /// Unites two inputs with the same name. They must have the same type and unit; the default is kept if it is the same in both.
    fn unite_input(&mut self, (first, second): (usize, usize), name: &str, known: InputParameter, input: InputParameter) {
        let ports_of = |part: usize| {
            let of = &self.parts[part];
            of.checked.inputs.iter().find(|i| !i.preset && of.parameter(&i.name) == name).map(|i| i.ports.clone()).unwrap_or_default()
        };
        let (ports, others) = (ports_of(first), ports_of(second));
        if !units_agree(&known.unit, &input.unit) {
            let message = format!(
                "the input '{name}' is in {} in part '{}' but in {} in part '{}'",
                known.unit, self.parts[first].label, input.unit, self.parts[second].label
            );
            let remedy = self.rename_remedy(second, name);
            self.conflict(Class::UnitMismatch, message, &remedy, (first, second));
        } else {
            self.check_forms(name, (first, &ports, &known.unit), (second, &others, &input.unit));
        }
        if let (Some(a), Some(b)) = (&known.default, &input.default)
            && a != b
        {
            // A table of thousands of numbers does not belong in a message.
            let text = |value| crate::wording::shown(&serde_json::to_string(value).unwrap_or_default());
            let (first_label, label) = (self.parts[first].label, self.parts[second].label);
            let message = format!("the input '{name}' defaults to {} in part '{first_label}' but to {} in part '{label}'", text(a), text(b));
            let remedy = format!("{}, or fix one: preset={{'{label}.{name}': {}}}", self.rename_remedy(second, name), text(b));
            self.conflict(Class::CompositionConflict, message, &remedy, (first, second));
        }
        if known.within.is_some() && input.within.is_some() && (&known.within, &known.counted_from) != (&input.within, &input.counted_from) {
            let message = format!("the input '{name}' has one range in part '{}' and another in part '{}'", self.parts[first].label, self.parts[second].label);
            let remedy = self.rename_remedy(second, name);
            self.conflict(Class::CompositionConflict, message, &remedy, (first, second));
        }
        let mut united = known;
        if united.within.is_none() {
            (united.within, united.counted_from) = (input.within, input.counted_from);
        }
        united.targets.extend(input.targets.into_iter().filter(|target| !united.targets.contains(target)).collect::<Vec<_>>());
        united.tunable &= input.tunable;
        united.default = united.default.filter(|_| input.default.is_some());
        if united.unit.is_empty() {
            united.unit = input.unit;
        }
        self.verb.input_parameters.insert(name.to_owned(), united);
    }

    fn unite_outputs(&mut self, part: usize, seen: &mut SeenNames) {
        let verb = self.parts[part].verb;
        for (at, (key, source)) in verb.output_values.iter().enumerate() {
            let of = &self.parts[part];
            self.verb.output_values.insert(of.line(key), of.port(source));
            let name = of.own(verb.reported(key)).to_owned();
            let first = *seen.outputs.entry(name.clone()).or_insert(part);
            if first == part {
                continue;
            }
            let port_of = |part: usize| self.parts[part].checked.outputs.iter().find(|(known, _)| self.parts[part].own(known) == name).map(|(_, port)| *port);
            if let (Some(port), Some((_, other))) = (port_of(first), self.parts[part].checked.outputs.get(at)) {
                self.check_forms(&name, (first, &[port], ""), (part, &[*other], ""));
            }
        }
    }
}

/// Returns a bound of a range, with its object renamed for the composed verb.
fn bound(of: &PartOf<'_>, bound: &Bound) -> Bound {
    match bound {
        Bound::Number(number) => Bound::Number(*number),
        Bound::Member(name) => match name.strip_prefix('-') {
            Some(name) => Bound::Member(format!("-{}", of.parameter(name))),
            None => Bound::Member(of.parameter(name)),
        },
    }
}
