// SPDX-License-Identifier: Apache-2.0
//! Deadlines: limits, timed waits, and the time limits for departures and for coming to rest.
use crate::core::Core;
use crate::instances::course::Course;
use crate::instances::instance::Instance;
use crate::stopping::ages::{age_deadline, too_old};
use model::SystemCondition;

impl Core {
    /// Returns the time at which the next limit or wait of a running instance, or the next shelving of an alarm, expires, ns on the
    /// clock.
    pub fn next_deadline(&self) -> Option<i64> {
        let deadlines = |i: &Instance| {
            let limit = i.times.limits.time_limit_ns.and_then(|t| i.times.running.clock_at(t));
            let wait = i.position.wait_until_ns.filter(|_| !i.is_under_way()).and_then(|t| i.times.running.clock_at(t));
            let rest = i.resting_until_ns().and_then(|t| i.times.running.clock_at(t));
            let departure = i.leaving.departure.as_ref().and_then(|d| d.until_ns).and_then(|t| i.times.running.clock_at(t));
            [limit.filter(|_| !i.is_in_ending()), wait, departure, rest, age_deadline(self, i), i.work.look_ns].into_iter().flatten().min()
        };
        let running = self.instances.values().filter(|i| i.is_running()).filter_map(deadlines);
        running.chain(self.safety.alarms.next_unshelving()).min()
    }

    /// Handles all deadlines that have expired.
    pub fn serve_deadlines(&mut self, now_ns: i64) {
        let running: Vec<u64> = self.instances.values().filter(|i| i.is_running()).map(|i| i.id).collect();
        for id in running {
            let Some(instance) = self.instances.get_mut(&id) else { continue };
            let past = |running_ns: Option<i64>| running_ns.is_some_and(|t| instance.times.running.clock_at(t).is_some_and(|at| at <= now_ns));
            if past(instance.leaving.departure.as_ref().and_then(|d| d.until_ns)) {
                self.course(id).finish_departure();
            } else if !instance.is_in_ending() && past(instance.times.limits.time_limit_ns) {
                let limit = instance.times.limits.time_limit_ns.take().unwrap_or_default();
                self.course(id).end_by(SystemCondition::TimeLimit, format!("it ran longer than {} s", limit as f64 * 1e-9));
            } else if instance.work.look_ns.is_some_and(|at| at <= now_ns) {
                instance.work.look_ns = None;
                self.course(id).proceed();
            } else if past(instance.resting_until_ns()) {
                self.course(id).rest_at_last();
            } else if !instance.is_under_way() && past(instance.position.wait_until_ns) {
                self.course(id).end_timed_wait();
            }
        }
        self.serve_overrun_limits();
        self.serve_ages(now_ns);
        self.serve_shelvings(now_ns);
    }

    /// Handles instances with a limit on the age of the values that they read.
    fn serve_ages(&mut self, now_ns: i64) {
        for (id, condition, message) in too_old(self, now_ns) {
            let now_ns = self.host.now_ns();
            let Some(instance) = self.instances.get_mut(&id) else { continue };
            instance.times.limits.age_max_ns = None;
            self.observation.log.add(now_ns, condition.name(), &instance.name, message.clone());
            self.course(id).end_by(condition, message);
        }
    }

    /// Handles instances with a limit on overruns.
    fn serve_overrun_limits(&mut self) {
        let limited: Vec<(u64, u64)> =
            (self.instances.values()).filter(|i| i.is_running()).filter_map(|i| i.times.limits.overruns.map(|limit| (i.id, limit))).collect();
        for (id, limit) in limited {
            let count = self.instances.overruns(&self.host, id) - self.instances[&id].times.overruns_before;
            if count >= limit {
                self.course(id).end_by(SystemCondition::Overrun, format!("{count} releases of its sources were skipped"));
            }
        }
    }
}

impl Course<'_> {
    /// Ends a timed wait: enters the next stage, unless a kernel has already done so.
    fn end_timed_wait(&mut self) {
        let id = self.id;
        let before = (self.core.instances[&id].position.list, self.core.instances[&id].position.stage);
        if !self.take_process(false) {
            return;
        }
        let now = (self.core.instances[&id].position.list, self.core.instances[&id].position.stage);
        if now == before { self.go(now.0, now.1 + 1) } else { self.core.carrier().go_on(id) }
    }
}
