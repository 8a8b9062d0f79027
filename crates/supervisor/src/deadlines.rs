// SPDX-License-Identifier: Apache-2.0
//! What time brings: limits, waits for a time, departures and rests that have had their time.
use crate::core::Core;
use crate::instance::{Instance, State};

impl Core {
    /// When the next limit or wait of a running instance is over, ns on the clock.
    pub fn next_deadline(&self) -> Option<i64> {
        let deadlines = |i: &Instance| {
            let limit = i.limits.time_limit_ns.and_then(|t| i.running.clock_at(t));
            let wait = i.wait_until_ns.filter(|_| !i.is_under_way()).and_then(|t| i.running.clock_at(t));
            let rest = i.resting_until_ns.and_then(|t| i.running.clock_at(t));
            let departure = i.departure.as_ref().and_then(|d| d.until_ns).and_then(|t| i.running.clock_at(t));
            [limit.filter(|_| !i.is_in_ending()), wait, departure, rest, self.age_deadline(i)].into_iter().flatten().min()
        };
        self.instances.values().filter(|i| i.state == State::Running && i.ending.is_none()).filter_map(deadlines).min()
    }

    /// Serves what is over by now.
    pub fn serve_deadlines(&mut self, now_ns: i64) {
        let running: Vec<u64> = self.instances.values().filter(|i| i.state == State::Running && i.ending.is_none()).map(|i| i.id).collect();
        for id in running {
            let Some(instance) = self.instances.get_mut(&id) else { continue };
            let past = |running_ns: Option<i64>| running_ns.is_some_and(|t| instance.running.clock_at(t).is_some_and(|at| at <= now_ns));
            if past(instance.departure.as_ref().and_then(|d| d.until_ns)) {
                self.departure_is_over(id);
            } else if !instance.is_in_ending() && past(instance.limits.time_limit_ns) {
                let limit = instance.limits.time_limit_ns.take().unwrap_or_default();
                self.end_by_name(id, "time_limit", format!("it ran longer than {} s", limit as f64 * 1e-9));
            } else if past(instance.resting_until_ns) {
                self.rest_at_last(id);
            } else if !instance.is_under_way() && past(instance.wait_until_ns) {
                self.time_is_over(id);
            }
        }
        self.serve_overrun_limits();
        self.serve_ages(now_ns);
    }

    /// A wait for a time is over: the next stage, unless a kernel was faster.
    fn time_is_over(&mut self, id: u64) {
        let before = (self.instances[&id].list, self.instances[&id].stage);
        if !self.take_process(id, false) {
            return;
        }
        let now = (self.instances[&id].list, self.instances[&id].stage);
        if now == before { self.go(id, now.0, now.1 + 1) } else { self.go_on(id) }
    }

    /// Instances with a limit on overruns.
    fn serve_overrun_limits(&mut self) {
        let limited: Vec<(u64, u64)> = (self.instances.values())
            .filter(|i| i.state == State::Running && i.ending.is_none())
            .filter_map(|i| i.limits.overruns.map(|limit| (i.id, limit)))
            .collect();
        for (id, limit) in limited {
            let count = self.overruns(id) - self.instances[&id].overruns_before;
            if count >= limit {
                self.end_by_name(id, "overrun", format!("{count} releases of its sources were skipped"));
            }
        }
    }
}
