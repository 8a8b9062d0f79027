// SPDX-License-Identifier: Apache-2.0
//! Activity of blocks: the stages in which the command lists activate each block.
use super::Draft;
use crate::lists::CheckedCommand;
use crate::refusal::Class;
use hints::did_you_mean;

/// State of a block in a stage in which it is active.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct On {
    /// Number of the stage; stages are numbered across all lists.
    pub stage: u32,
    /// Interval of the block itself; absent if the block is driven or triggered.
    pub every_ns: Option<u64>,
    pub budget_ns: Option<u64>,
    /// Number of the tunable interval, starting at 1; 0 if the block has none. Blocks with different numbers are never grouped into one
    /// activation.
    pub tunable: u32,
}

/// Effects of the command lists on the blocks.
#[derive(Debug, Default)]
pub(crate) struct Activity {
    /// Stages in which each block is active, in ascending order.
    pub on: Vec<Vec<On>>,
    /// Lists that execute each block, in ascending order.
    pub executed: Vec<Vec<usize>>,
    /// List to which each stage belongs.
    pub list_of: Vec<usize>,
}

impl Draft<'_> {
    /// Runs the command lists symbolically, ignoring time.
    pub fn activity(&mut self) -> Activity {
        let checked = self.checked;
        let count = checked.blocks.len();
        let mut activity = Activity { on: vec![Vec::new(); count], executed: vec![Vec::new(); count], list_of: Vec::new() };
        self.check_every();
        let tunable = self.checked.tunable_labels();
        let number_of = |label: &str| tunable.iter().zip(1..).find(|(known, _)| **known == label).map_or(0, |(_, number)| number);
        for (index, list) in checked.lists.iter().enumerate() {
            let mut now: Vec<Option<On>> = vec![None; count];
            for stage in &list.stages {
                let number = u32::try_from(activity.list_of.len()).expect("a verb has fewer than 2^32 stages");
                activity.list_of.push(index);
                for command in &stage.commands {
                    match command {
                        CheckedCommand::Activate { label, blocks, every_ns, budget_ns, divide, .. } => {
                            let tunable = number_of(label);
                            for block in blocks.clone() {
                                let every_ns = self.every(label, block, *every_ns, *divide);
                                now[block] = Some(On { stage: number, every_ns, budget_ns: *budget_ns, tunable });
                            }
                        }
                        CheckedCommand::Deactivate(blocks) => now[blocks.clone()].fill(None),
                        CheckedCommand::Execute { blocks, .. } => {
                            for block in blocks.clone() {
                                if activity.executed[block].last() != Some(&index) {
                                    activity.executed[block].push(index);
                                }
                            }
                        }
                        CheckedCommand::Install(_) | CheckedCommand::Ready => {}
                    }
                }
                for (block, on) in now.iter().enumerate() {
                    if let Some(on) = on {
                        activity.on[block].push(On { stage: number, ..*on });
                    }
                }
            }
        }
        activity
    }

    /// Returns the interval of a block: the interval set by the application or, by default, the command's interval multiplied by the
    /// divisors of the block's graphs.
    fn every(&self, label: &str, block: usize, every_ns: Option<u64>, divide: u32) -> Option<u64> {
        if self.checked.driven[block] {
            return None;
        }
        let flat = self.flat(block);
        if let Some(own) = self.application.every.get(&flat.label) {
            return Some(*own);
        }
        let every_ns = self.application.every.get(label).copied().or(every_ns)?;
        Some(every_ns.saturating_mul(u64::from(flat.divide / divide.max(1))))
    }

    fn check_every(&mut self) {
        let checked = self.checked;
        for (label, every_ns) in &self.application.every {
            let block = checked.blocks.iter().position(|b| b.label == *label);
            let commands = checked.lists.iter().flat_map(|list| &list.stages).flat_map(|stage| &stage.commands);
            let mut activated = commands.filter_map(|command| match command {
                CheckedCommand::Activate { label, .. } => Some(label.as_str()),
                _ => None,
            });
            if block.is_none() && !activated.clone().any(|known| known == label) {
                let remedy = did_you_mean(label, activated.by_ref());
                self.refuse(Class::UnknownName, format!("every= names '{label}', which verb '{}' does not activate", checked.name), &remedy, &None);
            } else if *every_ns == 0 {
                self.refuse(Class::SchedulingError, format!("every= gives '{label}' an interval of 0"), "give a positive interval, for example '1 ms'", &None);
            } else if block.is_some_and(|block| checked.driven[block]) {
                self.refuse(
                    Class::SchedulingError,
                    format!("every= gives '{label}' an execution interval, but a synchronous input drives it"),
                    "give the interval to the block that drives it",
                    &None,
                );
            }
        }
    }
}
