// SPDX-License-Identifier: Apache-2.0
//! Plans that were made lately: where nothing has changed, the same application has the same plan. A program calls few verbs, again and
//! again.
use crate::copied::CopiedState;
use model::CheckedVerb;
use model::configuration::{Configuration, Writer};
use model::definition::Application;
use model::plan::{CellKind, Plan};
use model::refusal::Refusals;
use std::collections::VecDeque;
use std::sync::Arc;

/// Plans that are kept.
const PLANS_MAX: usize = 32;

/// The latest plans, the last used one last.
#[derive(Default)]
pub(crate) struct Plans(VecDeque<PlannedApplication>);

struct PlannedApplication {
    /// Without its place, which is of the call.
    application: Application,
    /// Origin of the plan: the definitions by the number of their changes, and the writers of what it is bound to.
    changes: u64,
    writers: Vec<(String, Vec<Writer>)>,
    checked: Arc<CheckedVerb>,
    plan: Arc<Plan>,
}

impl PlannedApplication {
    fn holds(&self, application: &Application, checked: &Arc<CheckedVerb>, changes: u64, configuration: &Configuration) -> bool {
        self.changes == changes
            && Arc::ptr_eq(&self.checked, checked)
            && is_same(&self.application, application)
            && self.writers.iter().all(|(svv, writers)| writers_of(configuration, svv) == writers)
    }
}

/// Returns true if all is the same but the values, the name and the place: no plan has anything of those.
fn is_same(kept: &Application, asked: &Application) -> bool {
    kept.verb == asked.verb
        && kept.arguments.iter().eq(&asked.arguments)
        // The first pattern that fits counts.
        && kept.placement.iter().eq(&asked.placement)
        && kept.every.iter().eq(&asked.every)
        && kept.owner == asked.owner
}

fn writers_of<'a>(configuration: &'a Configuration, svv: &str) -> &'a [Writer] {
    configuration.writers.get(svv).map_or(&[], Vec::as_slice)
}

impl Plans {
    /// Returns the plan of an application of a verb as everything is now.
    pub fn of(&mut self, application: &Application, checked: &Arc<CheckedVerb>, configuration: &CopiedState<Configuration>) -> Result<Arc<Plan>, Refusals> {
        let changes = configuration.changes();
        if let Some(at) = self.0.iter().position(|kept| kept.holds(application, checked, changes, configuration)) {
            let kept = self.0.remove(at).expect("it was just found");
            let plan = kept.plan.clone();
            self.0.push_back(kept);
            return Ok(plan);
        }
        let plan = Arc::new(checked.apply(application, configuration)?);
        let bound = plan.cells.iter().filter_map(|cell| if let CellKind::Svv { name, .. } = &cell.kind { Some(name) } else { None });
        let writers = bound.map(|svv| (svv.clone(), writers_of(configuration, svv).to_vec())).collect();
        // What was made from other definitions holds never again.
        self.0.retain(|kept| kept.changes == changes && !is_same(&kept.application, application));
        if self.0.len() == PLANS_MAX {
            self.0.pop_front();
        }
        self.0.push_back(PlannedApplication { application: application.clone(), changes, writers, checked: checked.clone(), plan: plan.clone() });
        Ok(plan)
    }
}
