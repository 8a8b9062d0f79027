// SPDX-License-Identifier: Apache-2.0
//! Meaning of a network's numbers: the declaration that `gpac.policy` writes into the file, compared with the network's shapes and with
//! the trainer's metadata (`metadata.rs`).
use super::network::{Network, names};
use crate::source::is_taken_in_c;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Key of the declaration, as JSON, in the file's metadata.
pub const KEY: &str = "opengpac.policy";

/// A declaration: the ports, and how they form the inputs and outputs of the network.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Meaning {
    pub name: String,
    pub doc: String,
    pub period_ns: Option<i64>,
    pub age_max_ns: Option<i64>,
    pub inputs: BTreeMap<String, Vec<Term>>,
    pub outputs: BTreeMap<String, Vec<Term>>,
    /// For each input that carries state, the output that feeds it in the next invocation.
    pub states: BTreeMap<String, String>,
    pub shapes: BTreeMap<String, Vec<i64>>,
}

/// Elements of an input or output of the network that form one port of the block.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Term {
    pub port: String,
    pub size: usize,
    pub unit: String,
    pub doc: String,
    /// Trainer's name for the term; defaults to the name of the port.
    pub observation: String,
    /// Names of the elements, such as joints, in order.
    pub names: Vec<String>,
    pub scale: Option<Vec<f64>>,
    pub offset: Option<Vec<f64>>,
    /// Minimum and maximum value; for an input, they apply after the offset has been subtracted.
    pub clip: Option<[Vec<f64>; 2]>,
    /// Range of the values with which the network was trained.
    pub within: Option<[Vec<f64>; 2]>,
    pub history: usize,
    /// Output of the network whose value at the previous invocation the term takes, if the term is not a port.
    pub previous: String,
    pub mode: String,
}

impl Term {
    /// Returns the number of elements of the network that the term occupies.
    pub fn width(&self) -> usize {
        self.size * self.history.max(1)
    }

    /// Returns the trainer's name for the term.
    pub fn trained_as(&self) -> &str {
        match (self.observation.as_str(), self.port.as_str()) {
            ("", "") => &self.previous,
            ("", port) => port,
            (observation, _) => observation,
        }
    }
}

impl Meaning {
    /// Reads the declaration; without one, each input and output becomes a port of numbers without units.
    pub fn read(metadata: &BTreeMap<String, String>) -> Result<Meaning, String> {
        metadata.get(KEY).map_or_else(|| Ok(Meaning::default()), |text| serde_json::from_str(text).map_err(|why| format!("its declaration is damaged: {why}")))
    }

    /// Fills in omitted values and checks the shapes.
    pub fn complete(&mut self, network: &Network) -> Result<(), String> {
        for (input, output) in &self.states {
            let (from, to) = (shape(&network.inputs, input, "input")?, shape(&network.outputs, output, "output")?);
            if from != to {
                return Err(format!("state: its input '{input}' has shape {from:?}, but its output '{output}' has {to:?}"));
            }
        }
        let fed: Vec<String> = self.states.keys().cloned().collect();
        let kept: Vec<String> = self.states.values().cloned().collect();
        fill(&mut self.inputs, &network.inputs, &fed, "input")?;
        fill(&mut self.outputs, &network.outputs, &kept, "output")?;
        for term in self.inputs.values_mut().flatten().filter(|term| !term.previous.is_empty()) {
            term.size = shape(&network.outputs, &term.previous, "output")?.iter().product();
        }
        for (sides, all, side) in [(&mut self.inputs, &network.inputs, "input"), (&mut self.outputs, &network.outputs, "output")] {
            for (name, terms) in sides.iter_mut() {
                if let [Term { size: size @ 0, history, .. }] = &mut terms[..] {
                    *size = shape(all, name, side)?.iter().product::<usize>() / (*history).max(1);
                }
            }
        }
        for (sides, all, side) in [(&self.inputs, &network.inputs, "input"), (&self.outputs, &network.outputs, "output")] {
            for (name, terms) in sides {
                check(name, terms, shape(all, name, side)?, side)?;
            }
        }
        Ok(())
    }
}

fn shape<'a>(all: &'a [(String, Vec<usize>)], name: &str, side: &str) -> Result<&'a [usize], String> {
    let found = all.iter().find(|(known, _)| known == name).map(|(_, shape)| &shape[..]);
    found.ok_or_else(|| format!("it has no {side} '{name}'; its {side}s are {}", names(all.iter().map(|(known, _)| known.as_str()))))
}

/// Adds a port for each input or output without a declaration.
fn fill(declared: &mut BTreeMap<String, Vec<Term>>, all: &[(String, Vec<usize>)], spoken_for: &[String], side: &str) -> Result<(), String> {
    let is_bare = declared.is_empty();
    for (name, shape) in all.iter().filter(|(name, _)| !spoken_for.contains(name)) {
        if is_bare {
            let port = port_name(name, side);
            if let Some(other) = declared.iter().find(|(_, terms)| terms.iter().any(|term| term.port == port)).map(|(other, _)| other.clone()) {
                return Err(format!("its {side}s '{other}' and '{name}' would both be port '{port}': name them in {side}s="));
            }
            declared.insert(name.clone(), vec![Term { port, size: shape.iter().product(), ..Term::default() }]);
        } else if !declared.contains_key(name) && side == "input" {
            return Err(format!("its input '{name}' of shape {shape:?} is not declared: add it to inputs= or states="));
        }
    }
    Ok(())
}

fn check(name: &str, terms: &[Term], shape: &[usize], side: &str) -> Result<(), String> {
    let (declared, width): (usize, usize) = (terms.iter().map(Term::width).sum(), shape.iter().product());
    if declared != width {
        let parts: Vec<String> = terms
            .iter()
            .map(|t| format!("{} {}", t.trained_as(), if t.history > 1 { format!("{} x {}", t.size, t.history) } else { t.size.to_string() }))
            .collect();
        return Err(format!("{side} '{name}' has {width} elements (shape {shape:?}), but its declaration has {declared}: {}", parts.join(", ")));
    }
    for term in terms {
        let lists = [
            ("names", Some(term.names.len()).filter(|&len| len > 0)),
            ("scale", term.scale.as_ref().map(Vec::len)),
            ("offset", term.offset.as_ref().map(Vec::len)),
        ];
        let ranges = [("clip", &term.clip), ("within", &term.within)].map(|(what, range)| (what, range.as_ref().map(|[least, _]| least.len())));
        for (what, len) in lists.into_iter().chain(ranges) {
            if let Some(len) = len.filter(|&len| len != term.size) {
                return Err(format!("{side} '{name}': '{}' has {} elements, but its {what} has {len}", term.trained_as(), term.size));
            }
        }
    }
    Ok(())
}

/// Returns the port name for an undeclared input or output: its own name, reduced to letters, digits and _.
pub(super) fn port_name(name: &str, side: &str) -> String {
    let letters: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    match letters.trim_matches('_') {
        "" => format!("{side}_value"),
        bare if bare.starts_with(|c: char| c.is_ascii_digit()) || is_taken_in_c(bare) => format!("{side}_{bare}"),
        bare => bare.to_string(),
    }
}
