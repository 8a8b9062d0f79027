// SPDX-License-Identifier: Apache-2.0
//! Sequences: the order of each source's firing, and the command lists with activations in place of blocks.
use super::Draft;
use super::activity::Activity;
use super::bind::cells_of;
use super::endings::keep_endings;
use super::relate::Relations;
use crate::configuration::SourceKind;
use crate::interface::{Kind, Mode};
use crate::lists::{CheckedCommand, CheckedStage};
use crate::order;
use crate::plan::{ActivationIndex, BlockIndex, PlannedActivation, PlannedCommand, PlannedList, PlannedStage, Remark};
use crate::refusal::Refusals;

/// Blocks of each source, in firing order.
pub(crate) type Order = Vec<(String, Vec<BlockIndex>)>;

impl Draft<'_> {
    /// Returns the firing order of each source.
    pub fn order(&mut self, relations: &Relations) -> Result<Order, Refusals> {
        let mut order: Order = Vec::new();
        for source in self.configuration.sources.keys() {
            let blocks: Vec<BlockIndex> = (0..self.blocks.len()).filter(|b| self.blocks[*b].source == *source).collect();
            if !blocks.is_empty() {
                order.push((source.clone(), blocks));
            }
        }
        let mut local = vec![(0, 0); self.blocks.len()];
        for (source, (_, blocks)) in order.iter().enumerate() {
            for (at, block) in blocks.iter().enumerate() {
                local[*block] = (source, at);
            }
        }
        let (mut hard, mut soft) = (vec![Vec::new(); order.len()], vec![Vec::new(); order.len()]);
        for (reader, block) in self.blocks.iter().enumerate() {
            for bound in block.bindings.iter().filter(|bound| self.kind((reader, bound.item)) == Kind::Input) {
                let edges = match bound.mode {
                    Mode::Synchronous => &mut hard,
                    Mode::Asynchronous => &mut soft,
                    Mode::Ratio(_) => continue,
                };
                let writers = cells_of(&bound.binding).iter().flat_map(|cell| &self.cells[*cell].writers);
                for (writer, _) in writers.filter(|writer| local[writer.0].0 == local[reader].0) {
                    edges[local[reader].0].push((local[*writer].1, local[reader].1));
                }
            }
        }
        for (at, (source, blocks)) in order.iter_mut().enumerate() {
            let sorted = match order::sort(blocks.len(), &hard[at], &soft[at]) {
                Ok(sorted) => sorted,
                Err(cycle) => {
                    let labels: Vec<&str> = cycle.iter().map(|b| self.blocks[blocks[*b]].label.as_str()).collect();
                    return Err(vec![crate::cycles::cycle_refusal(
                        &labels,
                        &crate::cycles::modes_of_first(&self.checked.blocks, &labels),
                        &self.checked.place,
                    )]);
                }
            };
            for (from, to) in sorted.against {
                let (from, to) = (&self.blocks[blocks[from]], &self.blocks[blocks[to]]);
                let text = format!("'{}' reads '{}' as the previous firing left it: a delay of one firing of '{source}'", to.label, from.label);
                self.remarks.push(Remark { text, place: to.place.clone() });
            }
            *blocks = sorted.order.into_iter().map(|b| blocks[b]).collect();
        }
        debug_assert_eq!(relations.of.len(), self.blocks.len());
        Ok(order)
    }

    /// Returns the command lists.
    pub fn lists(&mut self, activity: &Activity, relations: &Relations, activations: &[PlannedActivation], order: &Order) -> Vec<PlannedList> {
        let active = self.active(activity, activations);
        let mut position = vec![(0, 0); self.blocks.len()];
        for (source, (_, blocks)) in order.iter().enumerate() {
            for (at, block) in blocks.iter().enumerate() {
                position[*block] = (source, at);
            }
        }
        let mut number = 0;
        let mut lists: Vec<PlannedList> = Vec::with_capacity(self.checked.lists.len());
        for list in &self.checked.lists {
            let mut before: &[(ActivationIndex, u32)] = &[];
            let mut stages = Vec::with_capacity(list.stages.len());
            for stage in &list.stages {
                let commands = self.commands(stage, before, &active[number], relations, &position);
                stages.push(PlannedStage { commands, wait: stage.wait.clone(), active: active[number].clone() });
                before = &active[number];
                number += 1;
            }
            lists.push(PlannedList { name: list.name.clone(), stages, transitions: Vec::new(), cut: Vec::new(), copy_of: None });
        }
        for (at, condition) in self.checked.conditions.iter().enumerate() {
            for (from, to) in &condition.transitions {
                lists[*from].transitions.push((at, *to));
            }
        }
        keep_endings(&mut lists, self.checked.initial, &self.checked.conditions);
        lists
    }

    /// Returns the activations that are active after each stage, each with its number of releases.
    fn active(&self, activity: &Activity, activations: &[PlannedActivation]) -> Vec<Vec<(ActivationIndex, u32)>> {
        let mut active = vec![Vec::new(); activity.list_of.len()];
        for (index, activation) in activations.iter().enumerate() {
            let Some(first) = activation.blocks.first() else { continue };
            // Use the block that has the interval, if driven blocks joined it.
            let timed = activation.blocks.iter().find(|b| activity.on[**b].iter().any(|on| on.every_ns.is_some())).unwrap_or(first);
            let period_ns = match self.configuration.sources.get(&activation.source).map(|source| &source.kind) {
                Some(SourceKind::Timer { period_ns }) => (*period_ns).max(1),
                _ => 1,
            };
            for on in &activity.on[*timed] {
                let every = on.every_ns.map_or(1, |every| u32::try_from(every / period_ns).unwrap_or(u32::MAX));
                active[on.stage as usize].push((index, every));
            }
        }
        active
    }

    fn commands(
        &self,
        stage: &CheckedStage,
        before: &[(ActivationIndex, u32)],
        after: &[(ActivationIndex, u32)],
        relations: &Relations,
        position: &[(usize, usize)],
    ) -> Vec<PlannedCommand> {
        // An activation is switched once in a stage, by the last command that names one of its blocks.
        let mut last: std::collections::HashMap<ActivationIndex, usize> = std::collections::HashMap::new();
        for (at, command) in stage.commands.iter().enumerate() {
            if let CheckedCommand::Activate { blocks, .. } | CheckedCommand::Deactivate(blocks) = command {
                for block in blocks.clone() {
                    last.insert(self.blocks[block].activation, at);
                }
            }
        }
        let every_in = |stage: &[(ActivationIndex, u32)], activation: ActivationIndex| {
            stage.binary_search_by_key(&activation, |(index, _)| *index).ok().map(|found| stage[found].1)
        };
        let mut commands = Vec::new();
        for (at, command) in stage.commands.iter().enumerate() {
            match command {
                CheckedCommand::Install(ranges) => commands.push(PlannedCommand::Install(ranges.iter().flat_map(Clone::clone).collect())),
                CheckedCommand::Execute { blocks, .. } => commands.push(PlannedCommand::Execute(self.executed(blocks.clone(), relations, position))),
                CheckedCommand::Ready => commands.push(PlannedCommand::Ready),
                CheckedCommand::Activate { blocks, .. } | CheckedCommand::Deactivate(blocks) => {
                    let mut switched: Vec<ActivationIndex> = Vec::new();
                    for activation in blocks.clone().map(|block| self.blocks[block].activation) {
                        if last.get(&activation) == Some(&at) && last.remove(&activation).is_some() {
                            switched.push(activation);
                        }
                    }
                    for activation in switched {
                        match (every_in(before, activation), every_in(after, activation)) {
                            (was, Some(every)) if was != Some(every) => commands.push(PlannedCommand::On { activation, every }),
                            (Some(_), None) => commands.push(PlannedCommand::Off(activation)),
                            _ => {}
                        }
                    }
                }
            }
        }
        commands
    }

    /// Returns one invocation of each block without synchronous inputs, followed by the blocks that they drive. The definition guarantees
    /// that there is at least one.
    fn executed(&self, blocks: std::ops::Range<usize>, relations: &Relations, position: &[(usize, usize)]) -> Vec<BlockIndex> {
        let is_driven = |block: usize| relations.of[block].iter().any(|r| r.mode == Mode::Synchronous);
        let mut runs = vec![false; blocks.len()];
        let mut executed = Vec::new();
        for &block in relations.order.iter().filter(|block| blocks.contains(block)) {
            let from = |driver: &usize| blocks.contains(driver) && runs[*driver - blocks.start];
            let planned = &self.blocks[block];
            let here = planned.external_drivers.is_empty() && planned.drivers.iter().chain(&planned.remote_drivers).all(from);
            if !is_driven(block) || here {
                runs[block - blocks.start] = true;
                executed.push(block);
            }
        }
        executed.sort_by_key(|block| position[*block]);
        executed
    }
}
