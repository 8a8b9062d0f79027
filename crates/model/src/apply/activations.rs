// SPDX-License-Identifier: Apache-2.0
//! Activations: the largest sets of blocks on one source that are always active together at the same rate.
use super::Draft;
use super::activity::{Activity, On};
use super::relate::{Beat, Relations};
use crate::configuration::Rate;
use crate::interface::Mode;
use crate::plan::{ActivationIndex, CellIndex, CellKind, Due, PlannedActivation};
use crate::refusal::Class;
use std::collections::HashMap;

/// Properties that all blocks of an activation have in common.
#[derive(Hash, PartialEq, Eq)]
struct Key<'a> {
    source: &'a str,
    on: &'a [On],
    by: Vec<(ActivationIndex, u32)>,
    /// Cells written by other sources or instances whose values the block waits for.
    queues: Vec<CellIndex>,
    is_driven: bool,
}

/// Drivers of a block, and the queues on which it waits.
#[derive(Default)]
struct Drive {
    by: Vec<(ActivationIndex, u32)>,
    queues: Vec<CellIndex>,
    is_driven: bool,
}

impl<'a> Draft<'a> {
    /// Groups the blocks into activations and determines when each one is due.
    pub fn activations(&mut self, activity: &Activity, relations: &Relations, beats: &[Vec<Beat<'a>>]) -> Vec<PlannedActivation> {
        let mut activations: Vec<PlannedActivation> = Vec::new();
        let mut known: HashMap<Key<'_>, ActivationIndex> = HashMap::new();
        let sources: Vec<String> = self.blocks.iter().map(|block| block.source.clone()).collect();
        for &block in &relations.order {
            let drive = self.drive(block, activity, relations);
            let joined = self.joins(block, &drive, activity, &activations);
            let index = joined.unwrap_or_else(|| {
                let due = match (drive.is_driven, drive.queues.is_empty()) {
                    (false, _) => Due::Interval,
                    (true, true) => Due::Driven { by: drive.by.clone() },
                    (true, false) => Due::Queued { by: drive.by.clone() },
                };
                let key = Key { source: &sources[block], on: &activity.on[block], by: drive.by, queues: drive.queues, is_driven: drive.is_driven };
                *known.entry(key).or_insert_with(|| {
                    activations.push(PlannedActivation {
                        source: sources[block].clone(),
                        due,
                        blocks: Vec::new(),
                        budget_ns: None,
                        tunable: !drive.is_driven && activity.on[block].iter().any(|on| on.tunable != 0),
                        rates: self.rates(block, activity, beats),
                    });
                    activations.len() - 1
                })
            });
            self.blocks[block].activation = index;
            let activation = &mut activations[index];
            activation.blocks.push(block);
            activation.budget_ns = activity.on[block].iter().filter_map(|on| on.budget_ns).chain(activation.budget_ns).max();
            for list in &activity.executed[block] {
                if !activation.rates.contains(&(*list, Rate::Once)) {
                    activation.rates.push((*list, Rate::Once));
                }
            }
        }
        for activation in &mut activations {
            activation.blocks.sort_unstable();
        }
        activations
    }

    /// Finds the drivers of a block and fills in the block's driver lists. Blocks are visited after their drivers, so the drivers'
    /// activations are already known.
    fn drive(&mut self, block: usize, activity: &Activity, relations: &Relations) -> Drive {
        let mut drive = Drive::default();
        for relation in &relations.of[block] {
            let cell = relation.cell;
            if let (CellKind::Svv { name, .. }, true) = (&self.cells[cell].kind, self.cells[cell].writers.is_empty()) {
                self.blocks[block].external_drivers.push((relation.item, name.clone()));
            }
            if relation.mode != Mode::Synchronous {
                continue;
            }
            drive.is_driven = true;
            if self.cells[cell].writers.is_empty() {
                push_new(&mut drive.queues, cell);
                continue;
            }
            for (writer, item) in self.active_writers(block, relation.item, cell, activity) {
                if self.blocks[writer].source == self.blocks[block].source {
                    let n = if let Mode::Ratio(n) = self.flat(writer).mode(item) { n } else { 1 };
                    push_new(&mut drive.by, (self.blocks[writer].activation, n));
                    push_new(&mut self.blocks[block].drivers, writer);
                } else {
                    push_new(&mut drive.queues, cell);
                    push_new(&mut self.blocks[block].remote_drivers, writer);
                }
            }
        }
        drive.by.sort_unstable();
        drive.queues.sort_unstable();
        drive
    }

    /// Returns the writers of a cell that are active at the same time as a reader; if there are none, all writers of the cell.
    fn active_writers(&mut self, reader: usize, item: usize, cell: CellIndex, activity: &Activity) -> Vec<(usize, usize)> {
        let writers = &self.cells[cell].writers;
        if let [writer] = writers[..] {
            return vec![writer];
        }
        let on_together = |writer: &&(usize, usize)| {
            let theirs = &activity.on[writer.0];
            activity.on[reader].iter().any(|on| theirs.binary_search_by_key(&on.stage, |on| on.stage).is_ok())
        };
        let together: Vec<(usize, usize)> = writers.iter().filter(on_together).copied().collect();
        match together[..] {
            [] => writers.clone(),
            [writer] => vec![writer],
            [first, second, ..] => {
                let (described, a, b) = (self.described((reader, item)), self.described(first), self.described(second));
                let message = format!("{described} is driven by {a} in one command list and by {b} in another");
                let remedy = format!("{}, or use one block for each", self.relax_remedy((reader, item)));
                let place = self.flat(reader).place.clone();
                self.refuse(Class::SchedulingError, message, &remedy, &place);
                together
            }
        }
    }

    /// Returns the activation of the block's only driver if both are active in exactly the same stages.
    fn joins(&self, block: usize, drive: &Drive, activity: &Activity, activations: &[PlannedActivation]) -> Option<ActivationIndex> {
        let [(by, 1)] = drive.by[..] else { return None };
        if !drive.queues.is_empty() {
            return None;
        }
        let first = *activations[by].blocks.first()?;
        let stages = |block: usize| activity.on[block].iter().map(|on| on.stage);
        stages(first).eq(stages(block)).then_some(by)
    }

    fn rates(&self, block: usize, activity: &Activity, beats: &[Vec<Beat<'a>>]) -> Vec<(usize, Rate)> {
        let mut rates = Vec::new();
        for (on, beat) in activity.on[block].iter().zip(&beats[block]) {
            if let Some(rate) = beat.rate() {
                push_new(&mut rates, (activity.list_of[on.stage as usize], rate));
            }
        }
        rates
    }
}

fn push_new<T: PartialEq>(list: &mut Vec<T>, element: T) {
    if !list.contains(&element) {
        list.push(element);
    }
}
