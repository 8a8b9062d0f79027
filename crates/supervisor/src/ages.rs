// SPDX-License-Identifier: Apache-2.0
//! Limits on the age of values that come from other sources: `late` where a ratio value is absent for longer, `link_lost` where nothing came
//! from a timer, which publishes in each of its firings.
use crate::connect::{Pair, mode_of};
use crate::core::Core;
use crate::instance::{Instance, State};
use crate::refuse::refuse;
use kernel::SourceId;
use model::interface::Mode;
use model::plan::CellKind;
use model::refusal::{Class, Refusals};

/// A value that is about to be too old.
struct Aging {
    condition: &'static str,
    /// When it is, ns on the clock: just behind the limit, after the firings of that instant.
    over_ns: i64,
    pair: Pair,
}

impl Core {
    /// When a value that an instance reads will be older than it may be, if nothing comes.
    pub fn age_deadline(&self, instance: &Instance) -> Option<i64> {
        instance.limits.age_max_ns?;
        self.aging(instance).map(|aging| aging.over_ns).min()
    }

    /// Ends instances whose values are too old.
    pub fn serve_ages(&mut self, now_ns: i64) {
        let limited = self.instances.values().filter(|i| i.state == State::Running && i.ending.is_none() && i.limits.age_max_ns.is_some());
        let over: Vec<(u64, Aging)> = limited.filter_map(|i| Some((i.id, self.aging(i).find(|aging| aging.over_ns <= now_ns)?))).collect();
        for (id, Aging { condition, pair: (writer, reader), .. }) in over {
            let limit_ns = self.instances.get_mut(&id).and_then(|instance| instance.limits.age_max_ns.take());
            let limit_s = limit_ns.unwrap_or_default() as f64 * 1e-9;
            let (writer, reader) = (self.source_name(writer), self.source_name(reader));
            let message = match condition {
                "late" => format!("a ratio value from '{writer}' to '{reader}' is absent for more than {limit_s} s"),
                _ => format!("nothing has come from '{writer}' to '{reader}' for more than {limit_s} s"),
            };
            let now_ns = self.host.now_ns();
            self.log.add(now_ns, condition, &self.instances[&id].name.clone(), message.clone());
            self.end_by_name(id, condition, message);
        }
    }

    /// An age must leave the writers time to publish.
    pub fn check_age(&self, instance: &Instance, age_max_ns: Option<i64>) -> Result<(), Refusals> {
        let Some(age_max_ns) = age_max_ns else { return Ok(()) };
        let slowest = self.heard(instance).into_iter().filter_map(|(writer, _)| Some((self.host.period_ns(writer)?, writer))).max();
        match slowest.filter(|(period_ns, _)| age_max_ns <= *period_ns) {
            None => Ok(()),
            Some((period_ns, writer)) => Err(refuse(
                Class::ValueRefused,
                format!(
                    "cannot start '{}' with age_max {} s: source '{}', which it reads, publishes every {} s",
                    instance.name,
                    age_max_ns as f64 * 1e-9,
                    self.source_name(writer),
                    period_ns as f64 * 1e-9
                ),
                "give a longer age",
            )),
        }
    }

    fn aging<'a>(&'a self, instance: &'a Instance) -> impl Iterator<Item = Aging> + 'a {
        let age_max_ns = instance.limits.age_max_ns;
        let silent = self.heard(instance).into_iter().filter_map(move |(writer, reader)| {
            let inlets = &self.tables[&reader].inlets;
            let inbound = &inlets.iter().find(|inlet| inlet.instance.is_none() && inlet.writer == writer)?.inbound;
            let brought_ns = inbound.brought_ns().unwrap_or(i64::MIN).max(instance.started_ns);
            Some(Aging { condition: "link_lost", over_ns: brought_ns + age_max_ns? + 1, pair: (writer, reader) })
        });
        let late = instance.installed.sources.iter().flat_map(move |&reader| {
            let own = self.tables[&reader].inlets.iter().filter(move |inlet| age_max_ns.is_some() && inlet.instance == Some(instance.id));
            own.filter_map(move |inlet| {
                let since_ns = inlet.inbound.late_since_ns()?.max(instance.started_ns);
                Some(Aging { condition: "late", over_ns: since_ns + age_max_ns? + 1, pair: (inlet.writer, reader) })
            })
        });
        silent.chain(late)
    }

    /// Pairs of timers over which an instance reads values asynchronously.
    fn heard(&self, instance: &Instance) -> Vec<Pair> {
        let mut pairs: Vec<Pair> = instance.crossings.iter().map(|(pair, _, _)| *pair).collect();
        for cell in &instance.plan.cells {
            let CellKind::Svv { name, .. } = &cell.kind else { continue };
            let Some(home) = self.svvs.get(name).and_then(|svv| svv.home) else { continue };
            let readers = cell.readers.iter().filter(|(block, item)| mode_of(&instance.plan, *block, *item) == Mode::Asynchronous);
            pairs.extend(readers.map(|(block, _)| (home, instance.installed.block_source[*block])).filter(|(writer, reader)| writer != reader));
        }
        pairs.sort();
        pairs.dedup();
        let is_timer = |source: &SourceId| self.host.period_ns(*source).is_some();
        pairs.retain(|(writer, reader)| is_timer(writer) && is_timer(reader));
        pairs
    }
}
