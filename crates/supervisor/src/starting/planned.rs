// SPDX-License-Identifier: Apache-2.0
//! Cache of recent plans: if nothing has changed, the same application has the same plan. A program repeatedly calls only a few verbs.
use crate::copied::CopiedState;
use model::CheckedVerb;
use model::configuration::{Configuration, Writer};
use model::definition::Application;
use model::plan::{CellKind, Plan};
use model::refusal::Refusals;
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of plans to keep.
const PLANS_MAX: usize = 32;

/// Latest plans, most recently used last.
#[derive(Default)]
pub(crate) struct Plans(VecDeque<PlannedApplication>);

struct PlannedApplication {
    /// Application without its location, which depends on the call.
    application: Application,
    /// Basis of the plan: change counter of the definitions, and writers of the SVVs to which it is bound.
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

/// Returns true if two applications differ at most in values, name and location, which do not affect the plan.
fn is_same(kept: &Application, asked: &Application) -> bool {
    kept.verb == asked.verb
        && kept.arguments.iter().eq(&asked.arguments)
        // Order matters: the first matching pattern wins.
        && kept.placement.iter().eq(&asked.placement)
        && kept.every.iter().eq(&asked.every)
        && kept.owner == asked.owner
}

fn writers_of<'a>(configuration: &'a Configuration, svv: &str) -> &'a [Writer] {
    configuration.writers.get(svv).map_or(&[], Vec::as_slice)
}

impl Plans {
    /// Returns the plan of an application of a verb in the current configuration.
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
        // A plan made from earlier definitions never becomes valid again.
        self.0.retain(|kept| kept.changes == changes && !is_same(&kept.application, application));
        if self.0.len() == PLANS_MAX {
            self.0.pop_front();
        }
        self.0.push_back(PlannedApplication { application: application.clone(), changes, writers, checked: checked.clone(), plan: plan.clone() });
        Ok(plan)
    }
}
