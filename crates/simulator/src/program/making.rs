// SPDX-License-Identifier: Apache-2.0
//! One random verb of a program: its blocks, their wiring, and its command lists.
use super::*;

/// Generator of a verb.
pub(super) struct Making<'a> {
    pub sources: &'a [Source],
    pub timers: &'a [usize],
    pub plant: (usize, usize),
    pub draw: Numbers,
}

/// Block used by the verb.
struct Use {
    label: String,
    of: &'static str,
    source: usize,
    /// Producer of this verb that drives the block; the block itself if the producer belongs to another verb.
    driven_by: Option<String>,
}

#[derive(Default)]
struct Parts {
    uses: Vec<Use>,
    parameters: Vec<Parameter>,
    chi: Map<String, Json>,
    cells: Map<String, Json>,
    tags: Vec<String>,
    /// ψ name → targets.
    psi: Map<String, Json>,
    inputs: Vec<(&'static str, u64)>,
    outputs: Map<String, Json>,
    conditions: Map<String, Json>,
    /// Conditions that blocks report, in the format in which command lists wait for them.
    waits: Vec<String>,
}

impl Making<'_> {
    pub fn verb(mut self, name: &str) -> Verb {
        let mut parts = Parts::default();
        (0..1 + self.draw.below(3)).for_each(|index| self.producer(&mut parts, index));
        (0..self.draw.below(3)).for_each(|index| self.reader(&mut parts, index));
        for index in 0..self.draw.weighted(&[4, 4, 1]) {
            self.drive(&mut parts, index);
        }
        let lists: Vec<&str> = ["one", "two", "three"][..1 + self.draw.below(3)].to_vec();
        let mut command_lists = Map::new();
        for list in &lists {
            command_lists.insert((*list).to_owned(), json!({"commands": self.commands(&parts)}));
        }
        let returns: Vec<String> = parts.outputs.keys().cloned().collect();
        let transitions = self.transitions(&lists, &parts);
        for always in ["halted", "completed", "fault", "aborted", "time_limit"] {
            let leads_on = transitions.as_array().is_some_and(|lines| lines.iter().any(|line| line["condition"] == always));
            if !leads_on && self.draw.percent(40) {
                parts.conditions.insert(always.to_owned(), json!({"returns": returns}));
            }
        }
        let mut definition = json!({
            "name": name,
            "blocks": parts.uses.iter().map(|of| (of.label.clone(), json!({"block": {"subroutine": of.of}}))).collect::<Map<_, _>>(),
            "instantiation_parameters": &parts.chi, "cells": &parts.cells, "output_values": &parts.outputs,
            "initial": "one", "transitions": transitions, "conditions": &parts.conditions, "command_lists": command_lists,
        });
        parts.psi.insert("tag".to_owned(), json!({"targets": parts.tags}));
        definition["input_parameters"] = std::mem::take(&mut parts.psi).into();
        if self.draw.percent(25) {
            definition["ending"] = json!("last");
            definition["ending_limit_ns"] = json!(5 * MS);
            let mut commands = self.commands(&parts);
            commands.push(json!({"command": "wait", "time_ns": self.draw.within(1, 4) * MS}));
            definition["command_lists"]["last"] = json!({"commands": commands});
        }
        if self.draw.percent(40) {
            definition["suspend"] = json!("safe");
        }
        let crashes = parts.uses.iter().any(|of| of.of.starts_with("crashing."));
        let placement = parts.uses.into_iter().map(|of| (of.label, of.source)).collect();
        Verb { name: name.to_owned(), definition, parameters: parts.parameters, placement, crashes, inputs: parts.inputs }
    }

    fn producer(&mut self, parts: &mut Parts, index: usize) {
        let label = format!("p{index}");
        let source = *self.draw.pick(self.timers);
        let of = ["sim.pair", "sim.reporter", "sim.faulty", "sim.many", "crashing.crash", "crashing.torn"][self.draw.weighted(&[8, 6, 3, 3, 1, 1])];
        parts.uses.push(Use { label: label.clone(), of, source, driven_by: None });
        parts.tags.push(format!("{label}.tag"));
        let is_private = self.draw.percent(35);
        if is_array(of) {
            if of == "crashing.torn" {
                let targets = parts.psi.entry("at").or_insert_with(|| json!({"targets": [], "default": 1_000_000, "tunable": true}));
                if let Some(targets) = targets["targets"].as_array_mut() {
                    targets.push(json!(format!("{label}.at")));
                }
                if !parts.inputs.iter().any(|(other, _)| *other == "at") {
                    parts.inputs.push(("at", 40));
                }
            }
            let nodes = json!([format!("{label}.y")]);
            if is_private {
                parts.cells.insert(label, nodes);
            } else {
                parts.chi.insert(label.clone(), nodes);
                parts.parameters.push(Parameter { name: label, kind: Kind::Array });
            }
            return;
        }
        for half in ["a", "b"] {
            let (name, nodes) = (format!("{label}{half}"), json!([format!("{label}.{half}")]));
            if is_private {
                parts.cells.insert(name.clone(), nodes)
            } else {
                parts.chi.insert(name.clone(), nodes)
            };
            parts.outputs.insert(name, json!(format!("{label}.{half}")));
        }
        if !is_private {
            parts.parameters.push(Parameter { name: label.clone(), kind: Kind::Pair });
        }
        let mut give = |name: &'static str, most: u64, default: u64| {
            let targets = parts.psi.entry(name).or_insert_with(|| json!({"targets": [], "default": default, "tunable": true}));
            if let Some(targets) = targets["targets"].as_array_mut() {
                targets.push(json!(format!("{label}.{name}")));
            }
            if !parts.inputs.iter().any(|(other, _)| *other == name) {
                parts.inputs.push((name, most));
            }
        };
        match of {
            "sim.reporter" => {
                give("each", 20, 0);
                let returns = [format!("{label}a"), format!("{label}b")];
                parts.conditions.insert(format!("reached_{label}"), json!({"on": [format!("{label}.reached")], "returns": returns}));
                parts.waits.push(format!("{label}.reached"));
            }
            "sim.faulty" => {
                give("at", 40, 1_000_000);
                give("how", 3, 1);
            }
            "crashing.crash" => give("at", 40, 1_000_000),
            _ => {}
        }
    }

    /// Adds a block that reads values from a producer of this verb or of another verb.
    fn reader(&mut self, parts: &mut Parts, index: usize) {
        let label = format!("r{index}");
        let producers: Vec<(String, usize, bool)> =
            (parts.uses.iter().filter(|of| of.label.starts_with('p'))).map(|of| (of.label.clone(), of.source, is_array(of.of))).collect();
        let (from, source, is_many) = self.draw.pick(&producers).clone();
        let is_foreign = self.draw.percent(30) && !is_many;
        let of = if is_many { "sim.all" } else { ["sim.newest", "sim.each", "sim.third"][self.draw.weighted(&[4, 3, 2])] };
        let is_newest = matches!(of, "sim.newest" | "sim.all");
        let softs: Vec<usize> = (0..self.sources.len()).filter(|i| self.sources[*i].period_ns.is_none()).collect();
        let source = match (is_newest, self.draw.percent(60) && !softs.is_empty()) {
            (true, _) => *self.draw.pick(self.timers),
            (false, true) => *self.draw.pick(&softs),
            (false, false) => source,
        };
        let from = if is_foreign { label.clone() } else { from };
        parts.uses.push(Use { label: label.clone(), of, source, driven_by: (!is_newest).then(|| from.clone()) });
        parts.cells.insert(format!("{label}y"), json!([format!("{label}.y")]));
        let mut bind = |name: String, node: String| {
            let held = if parts.chi.contains_key(&name) { &mut parts.chi } else { &mut parts.cells };
            match held.get_mut(&name).and_then(Json::as_array_mut) {
                Some(nodes) => nodes.push(json!(node)),
                None => drop(parts.chi.insert(name, json!([node]))),
            }
        };
        if is_many {
            return bind(from, format!("{label}.u"));
        }
        bind(format!("{from}a"), format!("{label}.u"));
        bind(format!("{from}b"), format!("{label}.v"));
        if is_foreign {
            parts.parameters.push(Parameter { name: label, kind: Kind::Reads });
        }
    }

    fn drive(&mut self, parts: &mut Parts, index: usize) {
        let label = format!("d{index}");
        parts.uses.push(Use { label: label.clone(), of: "sim.drive", source: self.plant.0, driven_by: None });
        parts.chi.insert(label.clone(), json!([format!("{label}.channel")]));
        parts.tags.push(format!("{label}.tag"));
        parts.parameters.push(Parameter { name: label, kind: Kind::Channel });
    }

    /// Returns a plausible command list: executed blocks, activated blocks, waits, and deactivated blocks.
    fn commands(&mut self, parts: &Parts) -> Vec<Json> {
        let mut commands = Vec::new();
        for of in &parts.uses {
            if of.driven_by.is_none() && self.draw.percent(20) {
                commands.push(json!({"command": "execute", "block": of.label}));
            }
        }
        let mut active: Vec<String> = Vec::new();
        for of in &parts.uses {
            // The block that drives it is active.
            let is_driven = of.driven_by.as_ref().is_none_or(|by| *by == of.label || active.contains(by));
            let is_on = is_driven && self.draw.percent(85);
            if is_on {
                let every_ns = (self.sources[of.source].period_ns).filter(|_| of.driven_by.is_none()).map(|period| period * self.draw.within(1, 2));
                commands.push(json!({"command": "activate", "block": of.label, "every_ns": every_ns}));
                active.push(of.label.clone());
            }
        }
        match self.draw.below(4) {
            0 => commands.push(json!({"command": "wait", "time_ns": self.draw.within(1, 8) * MS})),
            1 if !parts.waits.is_empty() => commands.push(json!({"command": "wait", "conditions": [self.draw.pick(&parts.waits)]})),
            _ => return commands,
        }
        for label in active {
            if self.draw.percent(40) {
                commands.push(json!({"command": "deactivate", "block": label}));
            }
        }
        commands
    }

    fn transitions(&mut self, lists: &[&str], parts: &Parts) -> Json {
        let own: Vec<&String> = parts.conditions.keys().filter(|name| name.starts_with("reached")).collect();
        let mut taken: Vec<(String, String)> = Vec::new();
        let mut lines = Vec::new();
        for index in 1..lists.len() + self.draw.below(3) {
            // Each list is reached from an earlier one.
            let (from, to) = if index < lists.len() { (lists[self.draw.below(index)], lists[index]) } else { (*self.draw.pick(lists), *self.draw.pick(lists)) };
            let from = from.to_owned();
            let condition = match self.draw.below(3) {
                0 if !own.is_empty() => (*self.draw.pick(&own)).clone(),
                _ => (*self.draw.pick(&["halted", "completed", "fault", "time_limit", "aborted"])).to_owned(),
            };
            if !taken.contains(&(from.clone(), condition.clone())) {
                lines.push(json!({"from": from, "condition": condition, "to": to}));
                taken.push((from, condition));
            }
        }
        lines.into()
    }
}
