// SPDX-License-Identifier: Apache-2.0
//! Application of a verb: converts a verb and its arguments to a plan by binding, placing, relating and ordering its blocks.
mod activations;
mod activity;
mod arguments;
mod bind;
mod endings;
mod finish;
mod placement;
mod ranges;
mod rehearse;
mod relate;
mod retune;
mod sequence;
mod sizes;
mod units;

use crate::checked::CheckedVerb;
use crate::configuration::{Configuration, PhysicalDevice, Svv, SvvId};
use crate::definition::Application;
use crate::flatten::{FlatBlock, Port};
use crate::kind::Layout;
use crate::plan::{CellIndex, Plan, PlannedBlock, PlannedCell, Remark};
use crate::refusal::{Class, Refusal, Refusals, SourceLocation, Where};
use hints::did_you_mean;
pub(crate) use rehearse::StandIns;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Applies the verb named by `application`: checks it, and returns the plan of an instance.
///
/// # Errors
/// Returns all mistakes in the order in which they are found.
pub fn apply(application: &Application, configuration: &Configuration) -> Result<Plan, Refusals> {
    let Some(verb) = configuration.verbs.get(&application.verb) else {
        let remedy = did_you_mean(&application.verb, configuration.verbs.keys().map(String::as_str));
        let refusal = Refusal::new(Class::UnknownName, format!("there is no verb '{}'", application.verb));
        return Err(vec![refusal.remedy(remedy).at(&application.place)]);
    };
    CheckedVerb::new(verb, configuration)?.apply(application, configuration)
}

impl CheckedVerb {
    /// Returns the plan of an instance of this verb.
    ///
    /// # Errors
    /// Returns all mistakes in the arguments, bindings, placement and rates, in the order in which they are found.
    pub fn apply(&self, application: &Application, configuration: &Configuration) -> Result<Plan, Refusals> {
        let mut draft = Draft::new(self, application, configuration);
        let given = draft.arguments();
        draft.stop()?;
        draft.infer_sizes(&given);
        draft.infer_units(&given);
        draft.bind(&given);
        draft.stop()?;
        let activity = draft.activity();
        let relations = draft.relations()?;
        draft.place(&activity, &relations, &given);
        draft.stop()?;
        let rates = draft.relate(&activity, &relations);
        draft.one_writer(&activity);
        draft.stop()?;
        let activations = draft.activations(&activity, &relations, &rates);
        let order = draft.order(&relations)?;
        let lists = draft.lists(&activity, &relations, &activations, &order);
        draft.stop()?;
        draft.finish(given, activations, order, lists)
    }
}

/// Binding of a group's ports.
pub(crate) enum GroupBinding<'a> {
    /// A cell of the instance.
    Private,
    /// An SVV, or an SVV per element (`each`).
    Svvs(Vec<(&'a str, &'a Svv)>),
    Channel {
        device: &'a str,
        channel: usize,
        physical: &'a PhysicalDevice,
    },
}

/// A plan under construction.
pub(crate) struct Draft<'a> {
    pub checked: &'a CheckedVerb,
    pub application: &'a Application,
    pub configuration: &'a Configuration,
    /// Devices of each object, in the order of the verb's objects.
    pub objects: Vec<Vec<&'a str>>,
    pub sizes: Vec<Option<u32>>,
    /// Inferred units of items that are declared in terms of other items' units, if known: for each block, (item, unit).
    pub units: Vec<Vec<(usize, String)>>,
    pub cells: Vec<PlannedCell>,
    /// True for each cell that is not constant.
    pub varies: Vec<bool>,
    pub svv_cells: HashMap<SvvId, CellIndex>,
    pub channel_cells: HashMap<(&'a str, usize), CellIndex>,
    pub blocks: Vec<PlannedBlock>,
    /// Cells of the elements of array ports that are bound element by element; filled during binding and used afterwards.
    pub gathered: BTreeMap<Port, BTreeMap<usize, CellIndex>>,
    pub elements: BTreeMap<Port, BTreeMap<usize, CellIndex>>,
    pub remarks: Vec<Remark>,
    pub refusals: Refusals,
}

impl<'a> Draft<'a> {
    pub(crate) fn new(checked: &'a CheckedVerb, application: &'a Application, configuration: &'a Configuration) -> Draft<'a> {
        Draft {
            checked,
            application,
            configuration,
            objects: Vec::new(),
            sizes: Vec::new(),
            units: vec![Vec::new(); checked.blocks.len()],
            cells: Vec::with_capacity(checked.groups.len()),
            varies: Vec::with_capacity(checked.groups.len()),
            svv_cells: HashMap::new(),
            channel_cells: HashMap::new(),
            blocks: Vec::with_capacity(checked.blocks.len()),
            gathered: BTreeMap::new(),
            elements: BTreeMap::new(),
            remarks: Vec::new(),
            refusals: Vec::new(),
        }
    }

    /// Fails if there are any refusals so far, because later steps depend on the earlier ones.
    fn stop(&mut self) -> Result<(), Refusals> {
        if self.refusals.is_empty() { Ok(()) } else { Err(std::mem::take(&mut self.refusals)) }
    }

    pub fn refuse(&mut self, class: Class, message: String, remedy: &str, place: &Option<SourceLocation>) {
        let place = if place.is_some() { place } else { &self.application.place };
        self.refusals.push(Refusal::new(class, message).remedy(remedy).at(place).at(&self.checked.place));
    }

    /// Refuses as [`Draft::refuse`] does, and names the parts of the definition involved, the main one first.
    pub fn refuse_at(&mut self, class: Class, message: String, remedy: &str, place: &Option<SourceLocation>, about: impl IntoIterator<Item = Where>) {
        self.refuse(class, message, remedy, place);
        self.mark(about);
    }

    /// Adds parts of the definition to the latest refusal.
    pub fn mark(&mut self, about: impl IntoIterator<Item = Where>) {
        if let Some(refusal) = self.refusals.last_mut() {
            refusal.about.extend(about);
        }
    }

    pub fn flat(&self, block: usize) -> &'a FlatBlock {
        &self.checked.blocks[block]
    }

    pub fn layout(&self, (block, item): Port) -> Option<Arc<Layout>> {
        self.flat(block).kind.layout(item, self.sizes[block])
    }

    /// Describes a port for messages: `output 'servo.effort' (double[6], N.m)`.
    pub fn described(&self, port: Port) -> String {
        let item = self.flat(port.0).kind.item(port.1);
        let type_text = self.layout(port).map_or_else(|| item.type_text.clone(), |layout| layout.text.clone());
        let unit = match self.unit(port) {
            "" => String::new(),
            unit => format!(", {unit}"),
        };
        let what = crate::kind::kind_name(item.kind);
        let last = if item.history > 0 { format!(", the last {}", item.history) } else { String::new() };
        format!("{what} '{}.{}' ({type_text}{unit}{last})", self.flat(port.0).label, item.name)
    }
}
