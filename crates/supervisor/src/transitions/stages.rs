// SPDX-License-Identifier: Apache-2.0
//! Stages and reactions: conditions that each kernel watches while a stage of a command list is running, and the scripts that respond
//! immediately.
//!
//! The kernel responds to a condition on its own, in the same firing, if everything that the response changes is in the source that
//! reported the condition; otherwise the process is frozen there and the supervisor continues.
use crate::instances::installed_verb::InstalledVerb;
use crate::movements::sequence::{Builder, Movement};
use kernel::{Op, Response, Script, SourceId, Stage, Watch};
use model::plan::{Claim, Due, Plan, PlannedCommand, Wait};
use std::sync::Arc;

/// Consequence of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Answer {
    /// Moves to (list, stage): the next stage of the same list, or another list by τ.
    Go(usize, usize),
    End,
}

/// Maximum size of the output values that a reaction may capture, bytes. Ends with larger outputs are handled by the supervisor.
const CAPTURED_MAX: usize = 64 * 1024;

/// Maximum size of the output values captured at a transition to another list, which may be frequent, bytes.
const PASSED_MAX: usize = 4 * 1024;

/// Maximum number of conditions, both of a verb and of its waits, for which a kernel has capacity.
pub(crate) const REMEMBERED_MAX: usize = 64;

/// Returns the kernel's stage while the commands of (list, stage) are being executed. Each stage corresponds to two kernel stages: during
/// its commands, awaited conditions are stored; after them, the wait is reached.
pub(crate) fn under_way(plan: &Plan, list: usize, stage: usize) -> u16 {
    let before: usize = plan.lists[..list].iter().map(|l| l.stages.len()).sum();
    u16::try_from(2 * (before + stage)).expect("a verb has fewer than 32,768 stages")
}

/// Returns the kernel's stage after the commands of (list, stage).
pub(crate) fn reached(plan: &Plan, list: usize, stage: usize) -> u16 {
    under_way(plan, list, stage) + u16::from(matches!(plan.lists[list].stages[stage].wait, Some(Wait::Conditions(_))))
}

impl InstalledVerb<'_> {
    /// Returns the consequence of (block, item) in (list, stage): a wait takes precedence, then τ, then the end. `None` if it is not a
    /// termination condition in that stage.
    pub fn answer(&self, list: usize, stage: usize, condition: Option<usize>, reported: Option<(usize, usize)>) -> Option<Answer> {
        let planned = &self.plan.lists[list];
        if let (Some(Wait::Conditions(waits)), Some(reported)) = (&planned.stages[stage].wait, reported)
            && waits.contains(&reported)
        {
            return Some(Answer::Go(list, stage + 1));
        }
        let condition = condition.filter(|c| self.plan.conditions[*c].holds_in(list))?;
        let to = planned.transitions.iter().find(|(c, _)| *c == condition);
        Some(to.map_or(Answer::End, |(_, to)| Answer::Go(*to, 0)))
    }

    /// Returns the watch tables of all stages.
    pub fn stages(&self) -> Vec<Stage> {
        let mut stages = Vec::new();
        for (list, planned) in self.plan.lists.iter().enumerate() {
            for (stage, of) in planned.stages.iter().enumerate() {
                let waits = matches!(of.wait, Some(Wait::Conditions(_)));
                stages.push(Stage { watches: self.watches(list, stage, waits) });
                stages.push(Stage { watches: if waits { self.watches(list, stage, false) } else { Vec::new() } });
            }
        }
        stages
    }

    /// Returns the watch table of a stage, during its commands or after its wait has been reached.
    fn watches(&self, list: usize, stage: usize, under_way: bool) -> Vec<Watch> {
        let awaited = match &self.plan.lists[list].stages[stage].wait {
            Some(Wait::Conditions(waits)) if under_way => waits.as_slice(),
            _ => &[],
        };
        let remembered = |watch: Watch, reported| if awaited.contains(&reported) { Watch { response: Response::Remember, ..watch } } else { watch };
        let mut watches = Vec::new();
        let mut seen = Vec::new();
        for (index, condition) in self.plan.conditions.iter().enumerate() {
            for &(block, item) in &condition.on {
                if let Some(answer) = self.answer(list, stage, Some(index), Some((block, item))) {
                    seen.push((block, item));
                    watches.push(remembered(self.watch(list, stage, index, condition.priority, (block, item), answer), (block, item)));
                }
            }
            if condition.name == "fault"
                && condition.on.is_empty()
                && let Some(answer) = self.answer(list, stage, Some(index), None)
            {
                let response = self.response(list, stage, answer, index, self.only_source());
                watches.push(Watch { block: None, item: Watch::FAULT, condition: index_u16(index), priority: condition.priority, response });
            }
        }
        for (number, (block, item)) in self.waited_for().into_iter().enumerate() {
            if seen.contains(&(block, item)) {
                continue;
            }
            let index = self.plan.conditions.len() + number;
            let watch = match self.answer(list, stage, None, Some((block, item))) {
                Some(answer) => remembered(self.watch(list, stage, index, i32::MAX, (block, item), answer), (block, item)),
                None => Watch {
                    block: Some(self.installed.blocks[block].id()),
                    item: index_u8(item),
                    condition: index_u16(index),
                    priority: 0,
                    response: Response::Remember,
                },
            };
            watches.push(watch);
        }
        watches
    }

    /// Returns the conditions for which the verb waits, in order of appearance, and the condition that reports that it may be suspended.
    pub fn waited_for(&self) -> Vec<(usize, usize)> {
        let mut found = Vec::new();
        for stage in self.plan.lists.iter().flat_map(|l| &l.stages) {
            if let Some(Wait::Conditions(waits)) = &stage.wait {
                found.extend(waits.iter().filter(|w| !found.contains(*w)).copied().collect::<Vec<_>>());
            }
        }
        for holding in self.plan.suspend.holdings() {
            if !found.contains(&holding.until) {
                found.push(holding.until);
            }
        }
        found
    }

    fn watch(&self, list: usize, stage: usize, index: usize, priority: i32, reported: (usize, usize), answer: Answer) -> Watch {
        let source = Some(self.installed.block_source[reported.0]);
        Watch {
            block: Some(self.installed.blocks[reported.0].id()),
            item: index_u8(reported.1),
            condition: index_u16(index),
            priority,
            response: self.response(list, stage, answer, index, source),
        }
    }

    /// Returns the source if the verb has only one.
    fn only_source(&self) -> Option<SourceId> {
        (self.installed.sources.len() == 1).then(|| self.installed.sources[0])
    }

    /// Returns a reaction if everything that it changes is in `source`, otherwise the response that notifies the supervisor.
    fn response(&self, list: usize, stage: usize, answer: Answer, condition: usize, source: Option<SourceId>) -> Response {
        // A process spread over several sources is handled by the supervisor.
        let Some(source) = source.filter(|_| !self.installed.process.is_spread()) else { return Response::Tell };
        let active: Vec<usize> = self.plan.lists[list].stages[stage].active.iter().map(|(a, _)| *a).collect();
        if matches!(answer, Answer::End) && self.plan.conditions.get(condition).is_some_and(|c| c.returns.iter().any(|output| self.moves(*output))) {
            return Response::Tell;
        }
        let mut builder = Builder::at_home(self.homes_in(list, stage));
        let next = match answer {
            Answer::Go(to, to_stage) => {
                if self.ends_at_once(to, to_stage) {
                    return Response::Tell;
                }
                if to_stage == 0 {
                    let outputs = self.outputs_in(source, condition);
                    let captured: usize = outputs.iter().map(|piece| self.piece_len(*piece)).sum();
                    if outputs.iter().any(|(output, _)| self.moves(*output)) || captured > PASSED_MAX {
                        return Response::Tell;
                    }
                    self.capture_in(&mut builder, source, &outputs);
                    builder.add(source, Op::Forget);
                }
                self.enter(&mut builder, &active, to, to_stage, None);
                Some(reached(self.plan, to, to_stage))
            }
            Answer::End if self.plan.ending.list.is_some_and(|ending| ending != list) => return self.conclusion((list, stage), &active, condition, source),
            Answer::End => {
                // The ending list reads no outputs.
                let is_ending = self.plan.ending.list == Some(list);
                let outputs = if is_ending { Vec::new() } else { self.outputs_in(source, condition) };
                let captured: usize = outputs.iter().map(|o| self.piece_len(*o)).sum();
                if active.iter().any(|a| self.installed.activation_source[*a] != source) || captured > CAPTURED_MAX {
                    return Response::Tell;
                }
                self.stop_in(&mut builder, source);
                builder.add(source, Op::Capture(self.cells_of(&outputs)));
                None
            }
        };
        match local(builder, source) {
            Some(ops) => Response::React { script: Arc::new(Script { id: 0, ops }), next },
            None => Response::Tell,
        }
    }

    /// Returns a reaction that reads ω and enters the ending list, if everything that it changes is in `source`; otherwise the response
    /// that notifies the supervisor.
    fn conclusion(&self, from: (usize, usize), active: &[usize], condition: usize, source: SourceId) -> Response {
        let Some(list) = self.plan.ending.list else { return Response::Tell };
        let outputs = self.concluding_outputs(source, condition);
        if (0..self.plan.outputs.len()).any(|output| self.moves(output)) {
            return Response::Tell;
        }
        let all = self.pieces(condition).len();
        let captured: usize = outputs.iter().map(|o| self.piece_len(*o)).sum();
        if self.ends_at_once(list, 0) || self.outputs_in(source, condition).len() < all || captured > CAPTURED_MAX {
            return Response::Tell;
        }
        let mut builder = Builder::at_home(self.homes_in(from.0, from.1));
        builder.add(source, Op::Capture(self.cells_of(&outputs)));
        builder.add(source, Op::Forget);
        self.enter(&mut builder, active, list, 0, None);
        match local(builder, source) {
            Some(ops) => Response::React { script: Arc::new(Script { id: 0, ops }), next: Some(reached(self.plan, list, 0)) },
            None => Response::Tell,
        }
    }

    /// Returns true if a stage is complete on entry or marks a device as ready, because the supervisor must then continue.
    pub fn ends_at_once(&self, list: usize, stage: usize) -> bool {
        let stage = &self.plan.lists[list].stages[stage];
        let idle = stage.active.is_empty() && matches!(stage.wait, None | Some(Wait::Idle));
        idle || stage.commands.iter().any(|c| matches!(c, PlannedCommand::Ready))
    }

    /// Adds the operations that leave the active blocks and enter a stage: the abort, and the commands, in order. A block that is active
    /// in both stages keeps its instance, state and phase. `from` lists activations that may be active. `generation` is the supervisor's
    /// generation, if the supervisor makes the move.
    pub fn enter(&self, builder: &mut Builder, from: &[usize], list: usize, stage: usize, generation: Option<u32>) {
        let planned = &self.plan.lists[list].stages[stage];
        let commanded = |a: usize| planned.commands.iter().any(|c| matches!(c, PlannedCommand::Off(off) if *off == a));
        for activation in from {
            if !planned.active.iter().any(|(a, _)| a == activation) && !commanded(*activation) {
                builder.add(self.installed.activation_source[*activation], Op::Off(self.installed.activations[*activation].clone()));
            }
        }
        self.open(builder, list, stage, generation);
        self.commands(builder, &planned.commands, generation);
        self.reach(builder, list, stage, generation);
    }

    /// Adds commands in order. Among blocks that are activated together, those that read values from other sources are activated first,
    /// because otherwise a reader would not count a value that arrived before it was active.
    pub fn commands(&self, builder: &mut Builder, commands: &[PlannedCommand], generation: Option<u32>) {
        let is_on = |command: &PlannedCommand| matches!(command, PlannedCommand::On { .. });
        let takes = |command: &&PlannedCommand| match command {
            PlannedCommand::On { activation, .. } => matches!(self.plan.activations[*activation].due, Due::Queued { .. }),
            _ => false,
        };
        for side_by_side in commands.chunk_by(|a, b| is_on(a) && is_on(b)) {
            let (readers, others): (Vec<_>, Vec<_>) = side_by_side.iter().partition(takes);
            for command in &readers {
                self.command(builder, command, generation);
            }
            if !readers.is_empty() && !others.is_empty() {
                builder.barrier();
            }
            for command in others {
                self.command(builder, command, generation);
            }
        }
    }

    /// Adds the operation that enters the stage, before its commands.
    pub fn open(&self, builder: &mut Builder, list: usize, stage: usize, generation: Option<u32>) {
        if let Some(generation) = generation {
            builder.barrier();
            let process = self.installed.process.clone();
            builder.add(self.stage_source(list, stage), Op::Stage { process, stage: under_way(self.plan, list, stage), generation: Some(generation) });
        }
        builder.barrier();
    }

    /// Adds the operation that follows the stage's commands and reaches its wait.
    pub fn reach(&self, builder: &mut Builder, list: usize, stage: usize, generation: Option<u32>) {
        let (from, to) = (under_way(self.plan, list, stage), reached(self.plan, list, stage));
        if let (Some(generation), true) = (generation, from != to) {
            builder.barrier();
            builder.add(self.stage_source(list, stage), Op::Advance { process: self.installed.process.clone(), generation, from, to });
        }
        builder.then(Movement::Entered { list, stage });
    }

    /// Returns the source whose kernel enters the stage: the source of its first command.
    fn stage_source(&self, list: usize, stage: usize) -> SourceId {
        let first = self.plan.lists[list].stages[stage].commands.iter().find_map(|c| match c {
            PlannedCommand::Execute(blocks) | PlannedCommand::Install(blocks) => blocks.first().map(|b| self.installed.block_source[*b]),
            PlannedCommand::On { activation, .. } | PlannedCommand::Off(activation) => Some(self.installed.activation_source[*activation]),
            PlannedCommand::Ready => None,
        });
        first.unwrap_or(self.installed.sources[0])
    }

    /// Returns the sources required by a command list: those of the blocks that it activates or executes, and those that enter its
    /// stages.
    pub fn needed_by(&self, list: usize) -> Vec<SourceId> {
        let mut needed = Vec::new();
        for (index, stage) in self.plan.lists[list].stages.iter().enumerate() {
            needed.push(self.stage_source(list, index));
            needed.extend(stage.active.iter().map(|(activation, _)| self.installed.activation_source[*activation]));
            for command in &stage.commands {
                if let PlannedCommand::Execute(blocks) | PlannedCommand::Install(blocks) = command {
                    needed.extend(blocks.iter().map(|block| self.installed.block_source[*block]));
                }
            }
        }
        needed
    }

    /// Adds one command. Operations after an `execute` take effect only if the `execute` did not end the process.
    fn command(&self, builder: &mut Builder, command: &PlannedCommand, generation: Option<u32>) {
        self.bring(builder, command);
        match command {
            PlannedCommand::Install(blocks) => {
                for block in blocks {
                    builder.add(self.installed.block_source[*block], Op::Reset(self.installed.blocks[*block].clone()));
                }
            }
            PlannedCommand::Execute(blocks) => {
                for run in blocks.chunk_by(|a, b| self.installed.block_source[*a] == self.installed.block_source[*b]) {
                    builder.barrier();
                    let blocks = run.iter().map(|b| self.installed.blocks[*b].clone()).collect();
                    let source = self.installed.block_source[run[0]];
                    builder.add(source, Op::Execute(blocks));
                    if let Some(generation) = generation {
                        builder.add(source, Op::While { process: self.installed.process.clone(), generation });
                    }
                    builder.barrier();
                    // The block's reports must have arrived and been handled before the rest is sent.
                    if self.installed.process.is_spread() {
                        builder.divide();
                    }
                }
            }
            PlannedCommand::On { activation, every } => {
                builder.add(self.installed.activation_source[*activation], Op::On(self.installed.activations[*activation].clone(), *every));
            }
            PlannedCommand::Off(activation) => {
                builder.add(self.installed.activation_source[*activation], Op::Off(self.installed.activations[*activation].clone()));
            }
            PlannedCommand::Ready => builder.then(Movement::Ready),
        }
    }

    /// Adds the operations that stop the instance in one source: its activations are switched off, and its channels are made safe. The
    /// operations hold no reference to the process, so a process may own them.
    pub fn stop_in(&self, builder: &mut Builder, source: SourceId) {
        for (activation, of) in self.installed.activations.iter().zip(&self.installed.activation_source) {
            if *of == source {
                builder.add(source, Op::Off(activation.clone()));
            }
        }
        for (device, channels) in self.channels_in(source) {
            builder.add(source, Op::Safe { device, channels });
        }
    }

    /// Adds the operations that claim the verb's channels at their devices. Starting with the firing in which they take effect, the
    /// values stored by its blocks are output.
    pub fn engage(&self, builder: &mut Builder) {
        for &source in &self.installed.sources {
            for (device, channels) in self.channels_in(source) {
                builder.add(source, Op::Engage { device, channels });
            }
        }
    }

    /// Returns the channels that the verb writes in a source.
    pub fn channels_in(&self, source: SourceId) -> Vec<(Arc<kernel::Device>, Vec<u16>)> {
        let mut found: Vec<(&str, Vec<u16>)> = Vec::new();
        for claim in &self.plan.claims {
            if let Claim::Channel { device, channel } = claim {
                match found.iter_mut().find(|(name, _)| *name == device) {
                    Some((_, channels)) => channels.push(index_u16(*channel)),
                    None => found.push((device, vec![index_u16(*channel)])),
                }
            }
        }
        found
            .into_iter()
            .filter(|(name, _)| self.devices[*name].source == source)
            .map(|(name, channels)| (self.devices[name].device.clone(), channels))
            .collect()
    }
}

/// Returns the operations if all of them are for `source` and form a single script.
fn local(builder: Builder, source: SourceId) -> Option<Vec<Op>> {
    let mut ops = Vec::new();
    for movement in builder.finish() {
        match movement {
            Movement::Scripts(scripts) => {
                let [(of, script)] = <[_; 1]>::try_from(scripts).ok()?;
                if of != source || !ops.is_empty() {
                    return None;
                }
                ops = script;
            }
            Movement::Entered { .. } => {}
            _ => return None,
        }
    }
    Some(ops)
}

fn index_u16(index: usize) -> u16 {
    u16::try_from(index).expect("a verb has fewer than 65,536 conditions and channels")
}

fn index_u8(item: usize) -> u8 {
    u8::try_from(item).expect("a block has at most 32 items")
}
