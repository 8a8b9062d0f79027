// SPDX-License-Identifier: Apache-2.0
//! Composition: unites several verbs into one by the union of their components and an augmented τ. The result is an ordinary verb.
//!
//! Blocks, cells and lists carry the label of their part; parameters, outputs, objects and conditions with the same name are merged. The
//! values that a condition returns, and the port from which an output is read, depend on the part that ends: ν and ω of a composed verb
//! have one entry per part.
mod conditions;
mod endings;
mod form;
mod joint;
mod lists;
mod part;
mod reach;
mod references;
mod shared;
mod stores;
mod transitions;
mod unite;

use crate::checked::CheckedVerb;
use crate::configuration::Configuration;
use crate::definition::{Part, Suspend, Verb};
use crate::refusal::{Class, Refusal, Refusals, SourceLocation};
use crate::value::Value;
use indexmap::{IndexMap, IndexSet};
use joint::Joint;
use part::PartOf;
use serde::{Deserialize, Serialize};

/// An entry of the augmented τ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Step {
    /// Parts or lists from which the entry leads: `approach`, `approach.back_off`. A part stands for each of its lists that the condition
    /// ends.
    #[serde(deserialize_with = "crate::definition::written::one_or_several")]
    #[cfg_attr(feature = "schema", schemars(with = "crate::definition::written::Names"))]
    pub from: Vec<String>,
    /// Condition, by its name in the composed verb or in the part; if absent, every normal end except a halt.
    #[serde(default)]
    pub condition: Option<String>,
    /// Target of the entry: a list, or a part, which stands for its initial list.
    pub to: String,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// Ending rule of parts that run together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(feature = "schema", schemars(rename = "TogetherUntil"))]
#[serde(rename_all = "snake_case")]
pub enum Until {
    /// The parts run until the first of them has ended.
    #[default]
    Any,
    /// The parts run until all of them have ended normally.
    All,
}

/// Definition of a composed verb.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Composition {
    pub name: String,
    #[serde(default)]
    pub doc: String,
    /// Label → verb, in the order of the parameters of a call.
    pub parts: IndexMap<String, Verb>,
    #[serde(default)]
    pub transitions: Vec<Step>,
    /// Initial part or list; if absent, the first part.
    #[serde(default)]
    pub initial: Option<String>,
    /// `part.name` → name in the composed verb, for a parameter, object, output or condition.
    #[serde(default)]
    pub rename: IndexMap<String, String>,
    /// `part.input` → fixed value of the input.
    #[serde(default)]
    pub preset: IndexMap<String, Value>,
    /// Labels of shared blocks: all parts use the same instance.
    #[serde(default)]
    pub share: Vec<String>,
    /// True if the initial lists of all parts are merged into one.
    #[serde(default)]
    pub together: bool,
    /// Ending rule of parts that run together.
    #[serde(default)]
    pub until: Until,
    #[serde(default)]
    pub place: Option<SourceLocation>,
}

/// Returns the verb that a composition defines.
///
/// # Errors
/// Returns all incompatibilities of the parts at once; each names the parts and contains a remedy.
pub fn compose(composition: &Composition, configuration: &Configuration) -> Result<Verb, Refusals> {
    let mut composing = Composing::new(composition, configuration)?;
    composing.read_references();
    composing.stop()?;
    composing.read_shared();
    composing.join();
    composing.stop()?;
    composing.unite();
    composing.lists();
    composing.endings();
    composing.conditions();
    composing.transitions();
    composing.check_stores();
    composing.stop()?;
    let checked = CheckedVerb::new(&composing.verb, configuration);
    checked.map(|_| composing.verb)
}

/// A composed verb that is being built.
struct Composing<'a> {
    of: &'a Composition,
    parts: Vec<PartOf<'a>>,
    joints: Vec<Joint>,
    /// Lists of parts that run together and that are reached only after a condition that orders the verb to end.
    only_ending: IndexSet<String>,
    verb: Verb,
    refusals: Refusals,
}

impl<'a> Composing<'a> {
    fn new(of: &'a Composition, configuration: &Configuration) -> Result<Composing<'a>, Refusals> {
        let mut refusals = Vec::new();
        let mut parts = Vec::with_capacity(of.parts.len());
        for (label, verb) in &of.parts {
            if label.is_empty() || label.contains('.') {
                let refusal = Refusal::new(Class::DefinitionError, format!("the label '{label}' of a part of '{}' is empty or contains a dot", of.name));
                refusals.push(refusal.remedy("give the part a plain name").at(&of.place));
            }
            let dotted = verb.conditions.keys().chain(verb.output_values.keys()).find(|name| verb.parts.is_empty() && name.contains('.'));
            if let Some(name) = dotted {
                let message = format!("part '{label}' of '{}' has a condition or output '{name}', but a dot separates a name from its part", of.name);
                refusals.push(Refusal::new(Class::DefinitionError, message).remedy("give it a plain name in its verb").at(&verb.place).at(&of.place));
            }
            match CheckedVerb::new(verb, configuration) {
                Ok(checked) => parts.push(PartOf::new(label, verb, checked, of)),
                Err(wrong) => refusals.extend(wrong.into_iter().map(|refusal| refusal.for_what(&format!("part '{label}' of '{}'", of.name)).at(&of.place))),
            }
        }
        if of.parts.is_empty() {
            let refusal = Refusal::new(Class::DefinitionError, format!("the composition '{}' has no parts", of.name));
            refusals.push(refusal.remedy("give it verbs by label: {'approach': approach, 'grasp': grasp}").at(&of.place));
        }
        if refusals.is_empty() {
            Ok(Composing { of, verb: empty(of, &parts), parts, joints: Vec::new(), only_ending: IndexSet::new(), refusals })
        } else {
            Err(refusals)
        }
    }

    fn stop(&mut self) -> Result<(), Refusals> {
        if self.refusals.is_empty() { Ok(()) } else { Err(std::mem::take(&mut self.refusals)) }
    }

    fn refuse(&mut self, class: Class, message: String, remedy: &str, place: &Option<SourceLocation>) {
        self.refusals.push(Refusal::new(class, message).remedy(remedy).at(place).at(&self.of.place));
    }

    /// Refuses conflicting declarations of two parts.
    fn conflict(&mut self, class: Class, message: String, remedy: &str, (first, second): (usize, usize)) {
        let mut refusal = Refusal::new(class, message).remedy(remedy);
        for part in [first, second] {
            let part = &self.parts[part];
            refusal = refusal.end(part.described(), &part.verb.place);
        }
        self.refusals.push(refusal.at(&self.of.place));
    }

    /// Describes two parts for messages: `part 'approach' and part 'grasp'`.
    fn both(&self, first: usize, second: usize) -> String {
        format!("part '{}' and part '{}'", self.parts[first].label, self.parts[second].label)
    }
}

/// Returns the verb before anything is merged into it: its name and attributes, and its parts with their nested parts.
fn empty(of: &Composition, parts: &[PartOf<'_>]) -> Verb {
    let mut known = IndexMap::new();
    for part in parts {
        known.insert(part.label.to_owned(), Part { verb: part.verb.name.clone(), initial: part.list(part.checked.initial) });
        for (inner, of) in &part.verb.parts {
            let initial = part.verb.command_lists.get_index_of(&of.initial).unwrap_or(part.checked.initial);
            known.insert(format!("{}.{inner}", part.label), Part { verb: of.verb.clone(), initial: part.list(initial) });
        }
    }
    Verb {
        name: of.name.clone(),
        doc: of.doc.clone(),
        manual: parts.iter().all(|part| part.verb.manual),
        blocks: IndexMap::new(),
        objects: IndexMap::new(),
        instantiation_parameters: IndexMap::new(),
        cells: IndexMap::new(),
        input_parameters: IndexMap::new(),
        output_values: IndexMap::new(),
        command_lists: IndexMap::new(),
        initial: None,
        conditions: IndexMap::new(),
        transitions: Vec::new(),
        modes: IndexMap::new(),
        ending: None,
        ending_limit_ns: parts.iter().filter_map(|part| part.verb.ending_limit_ns).max(),
        suspend: Suspend::Idle,
        if_cut_off: None,
        requires: IndexMap::new(),
        parts: known,
        place: of.place.clone(),
    }
}
