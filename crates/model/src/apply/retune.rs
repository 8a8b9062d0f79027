// SPDX-License-Identifier: Apache-2.0
//! Tunable intervals: plans an instance with changed intervals and rechecks all rates. Everything else stays the same.
use crate::checked::CheckedVerb;
use crate::configuration::Configuration;
use crate::definition::Application;
use crate::lists::CheckedCommand;
use crate::plan::{ActivationIndex, Plan, PlannedCommand};
use crate::refusal::{Class, Refusal, Refusals};
use hints::did_you_mean;
use indexmap::IndexMap;

impl CheckedVerb {
    /// Returns the labels whose interval is declared tunable in any command list, in the order of the lists.
    pub fn tunable_labels(&self) -> Vec<&str> {
        let mut labels: Vec<&str> = Vec::new();
        for (label, tunable) in self.activated() {
            if tunable && !labels.contains(&label) {
                labels.push(label);
            }
        }
        labels
    }

    /// Returns the labels that command lists activate, each with a flag that is true if its interval is tunable.
    fn activated(&self) -> impl Iterator<Item = (&str, bool)> {
        let commands = self.lists.iter().flat_map(|list| &list.stages).flat_map(|stage| &stage.commands);
        commands.filter_map(|command| match command {
            CheckedCommand::Activate { label, tunable, .. } => Some((label.as_str(), *tunable)),
            _ => None,
        })
    }

    /// Returns the plan of `application`, which is installed as `plan`, with the intervals in `every` (label → ns) in place of the
    /// previous ones. The placement and grouping of blocks stay the same.
    ///
    /// # Errors
    /// Fails if a label is not activated or not tunable, or if a rate would no longer hold.
    pub fn retuned(&self, application: &Application, every: &IndexMap<String, u64>, plan: &Plan, configuration: &Configuration) -> Result<Plan, Refusals> {
        let refusals: Refusals = every.keys().filter_map(|label| self.not_tunable(label)).map(|refusal| refusal.at(&self.place)).collect();
        if !refusals.is_empty() {
            return Err(refusals);
        }
        let mut changed = application.clone();
        changed.every.extend(every.iter().map(|(label, every_ns)| (label.clone(), *every_ns)));
        changed.placement = plan.blocks.iter().map(|block| (block.label.clone(), block.source.clone())).collect();
        let retuned = self.apply(&changed, configuration)?;
        if !is_alike(plan, &retuned) {
            let message = format!("these intervals would change which blocks of '{}' run as one", plan.verb);
            return Err(vec![Refusal::new(Class::SchedulingError, message).remedy("give them when the verb is applied: .on(every=…)").at(&self.place)]);
        }
        Ok(retuned)
    }

    fn not_tunable(&self, label: &str) -> Option<Refusal> {
        let mut declared = self.activated().filter(|(known, _)| *known == label).map(|(_, tunable)| tunable).peekable();
        if declared.peek().is_none() {
            let message = format!("every= names '{label}', which verb '{}' does not activate", self.name);
            return Some(Refusal::new(Class::UnknownName, message).remedy(did_you_mean(label, self.tunable_labels())));
        }
        if declared.all(|tunable| tunable) {
            return None;
        }
        let message = format!("the interval of '{label}' in verb '{}' is not tunable", self.name);
        let remedy = format!("declare it in every list: activate('{label}', every=gpac.interval('20 ms', tunable=True)), or give it at the next application");
        Some(Refusal::new(Class::InvalidState, message).remedy(remedy))
    }
}

impl Plan {
    /// Returns the number of firings between two invocations of an activation, in the first stage that activates it; `None` if no stage
    /// does.
    pub fn every(&self, activation: ActivationIndex) -> Option<u32> {
        let active = self.lists.iter().flat_map(|list| &list.stages).flat_map(|stage| &stage.active);
        active.into_iter().find(|(index, _)| *index == activation).map(|(_, every)| *every)
    }
}

/// Returns true if two plans differ only in intervals and rates.
fn is_alike(before: &Plan, after: &Plan) -> bool {
    let commands = |plan: &Plan| -> Vec<PlannedCommand> {
        let of = plan.lists.iter().flat_map(|list| &list.stages).flat_map(|stage| &stage.commands);
        let plain = |command: &PlannedCommand| match command {
            PlannedCommand::On { activation, .. } => PlannedCommand::On { activation: *activation, every: 1 },
            other => other.clone(),
        };
        of.map(plain).collect()
    };
    let activations =
        before.activations.iter().zip(&after.activations).all(|(a, b)| (&a.source, &a.due, &a.blocks, a.tunable) == (&b.source, &b.due, &b.blocks, b.tunable));
    before.activations.len() == after.activations.len()
        && activations
        && before.blocks == after.blocks
        && before.order == after.order
        && commands(before) == commands(after)
}
